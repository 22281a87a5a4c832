//! What the samplers and the lobe draw: the plots of the textbook's chapters 5 and 7.

use crate::bxdf::{Bxdf, Horizon, Incidence};
use crate::core::{Rgb, Sampler, SamplerKind, Vec3};
use crate::image_io::Image;
use crate::image_io::label::{Canvas, LETTER};

/// A plot of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plot {
    /// Its file's name without the ending.
    pub name: &'static str,
    /// What is written below it.
    pub caption: &'static str,
    /// Where the points come from.
    pub sampler: SamplerKind,
}

const fn plot(name: &'static str, caption: &'static str, sampler: SamplerKind) -> Plot {
    Plot { name, caption, sampler }
}

/// One plot per sampler.
pub const PLOTS: [Plot; 4] = [
    plot("7-random", "chapter 7: 256 directions, random", SamplerKind::Independent),
    plot("7-regular", "chapter 7: 256 directions, regular", SamplerKind::Regular),
    plot("7-hammersley", "chapter 7: 256 directions, Hammersley", SamplerKind::Hammersley),
    plot("7-sobol", "chapter 7: 256 directions, scrambled Sobol", SamplerKind::Sobol),
];

/// Exponents of the columns: 0 is the uniform hemisphere, 1 the cosine of diffuse reflection.
const EXPONENTS: [f32; 4] = [0.0, 1.0, 10.0, 100.0];
const COUNT: u32 = 256;

/// Directions about +z with the density `(e + 1) / (2 pi) cos^e`: the glossy lobe at normal incidence.
pub fn directions(sampler: SamplerKind, exponent: f32) -> Vec<Vec3> {
    let lobe = Bxdf::cosine_power(Rgb::WHITE, exponent, Horizon::Fold);
    let at = Incidence { wo: Vec3::Z, n: Vec3::Z, ng: Vec3::Z, front: true };
    let sampler = Sampler::new(sampler, 0, 0, 0).for_samples(COUNT);
    let drawn = (0..COUNT).filter_map(|i| lobe.sample(&at, sampler.pair(i, 1)));
    drawn.map(|sample| sample.wi).collect()
}

/// Draws a plot: a column per exponent, the hemisphere from above and below it from the side, `edge` pixels each.
pub fn draw(plot: &Plot, edge: u32) -> Canvas {
    let words = LETTER + 4;
    let columns = EXPONENTS.len() as u32;
    let mut page = Canvas::new(columns * edge, words + edge + edge * 5 / 8, [255; 3]);
    for (x, exponent) in (0..).map(|i| i * edge).zip(EXPONENTS) {
        let directions = directions(plot.sampler, exponent);
        let above = directions.iter().map(|d| [d.x, d.y]).collect::<Vec<_>>();
        let beside = directions.iter().map(|d| [d.x, 0.5 - d.z]).collect::<Vec<_>>();
        page.text(&format!("e = {exponent}"), x + 4, 3, 1, [0; 3]);
        page.draw(&points(&above, [edge, edge], |p| p[0].hypot(p[1])), x, words);
        page.draw(&points(&beside, [edge, edge * 5 / 8], half_disk), x, words + edge);
    }
    page
}

/// 1 on the outline of the upper half disk whose middle is at (0, 0.5), less inside.
fn half_disk([x, y]: [f32; 2]) -> f32 {
    let up = 0.5 - y;
    if up < 0.0 { 1.0 - up } else { x.hypot(up).max(1.0 - up) }
}

/// Pixels that a length of 1 takes, of so many from edge to edge.
const UNIT: f32 = 0.46;
/// Radius of a dot in pixels.
const DOT: f32 = 1.6;

/// Dots at points about the middle of a picture, and the line where `outline` is 1.
fn points(points: &[[f32; 2]], [width, height]: [u32; 2], outline: impl Fn([f32; 2]) -> f32) -> Canvas {
    let unit = UNIT * width as f32;
    let middle = [0.5 * width as f32, 0.5 * height as f32];
    let colour = |x: u32, y: u32| {
        let at = [x as f32 + 0.5 - middle[0], y as f32 + 0.5 - middle[1]];
        let off = |p: &[f32; 2]| (p[0] * unit - at[0]).hypot(p[1] * unit - at[1]);
        let nearest = points.iter().map(off).fold(f32::INFINITY, f32::min);
        let line = (outline(at.map(|c| c / unit)) - 1.0).abs() * unit;
        let [dot, line] = [DOT - nearest, 1.0 - line].map(|inside| (inside + 0.5).clamp(0.0, 1.0));
        let paper = Rgb::WHITE * (1.0 - 0.5 * line);
        paper * (1.0 - dot) + Rgb::new(0.6, 0.05, 0.0) * dot
    };
    Canvas::of_image(&Image::from_fn(width, height, colour), 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_directions_have_the_mean_cosine_of_their_exponent() {
        for plot in PLOTS {
            for exponent in EXPONENTS {
                let directions = directions(plot.sampler, exponent);
                assert_eq!(directions.len(), COUNT as usize);
                let mean = directions.iter().map(|d| d.z).sum::<f32>() / COUNT as f32;
                let expected = (exponent + 1.0) / (exponent + 2.0);
                // Five standard errors of independent directions: the patterns are far better.
                let variance = (exponent + 1.0) / ((exponent + 3.0) * (exponent + 2.0).powi(2));
                let error = 5.0 * (variance / COUNT as f32).sqrt();
                assert!((mean - expected).abs() < error, "{} e = {exponent}: {mean}", plot.name);
            }
        }
    }

    #[test]
    fn a_plot_has_a_dot_where_a_point_is_and_paper_elsewhere() {
        let canvas = points(&[[0.5, 0.0]], [100, 100], |_| 0.0);
        let [r, g, _] = canvas.pixel(72, 50).expect("inside");
        assert!(r > 3 * g, "a dot");
        assert_eq!(canvas.pixel(28, 50), Some([255; 3]));
    }
}
