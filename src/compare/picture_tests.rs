use super::*;
use crate::core::{Sampler, SamplerKind};
use crate::film::{PixelRect, RadianceGathered};

const SIZE: u32 = 96;

/// Grey noise about 1 + `more(x, y)`: samples uniform in [0.5, 1.5] of it, `spp` of each pixel.
fn film(seed: u32, spp: u32, more: impl Fn(u32, u32) -> f32) -> Film {
    let rect = PixelRect { x0: 0, y0: 0, x1: SIZE, y1: SIZE };
    let mut film = Film::new([SIZE, SIZE], rect);
    for (i, pixel) in film.pixels.iter_mut().enumerate() {
        let (x, y) = (i as u32 % SIZE, i as u32 / SIZE);
        let sampler = Sampler::new(SamplerKind::Independent, seed, x, y);
        for index in 0..spp {
            let value = (0.5 + sampler.single(index, 0)) * (1.0 + more(x, y));
            pixel.add([RadianceGathered::from(value); 3]);
        }
    }
    film
}

fn clean(_: u32, _: u32) -> f32 {
    0.0
}

#[test]
fn students_tail_is_that_of_the_tables() {
    // Closed forms for 2 and 4 degrees of freedom, and the normal distribution's 0.0026998 far out.
    assert!((student_tail(3.0, 1) - (1.0 - 3.0 / 11f64.sqrt())).abs() < 1e-12);
    assert!((student_tail(3.0, 2) - 0.039_941_968).abs() < 1e-8);
    assert!((student_tail(3.0, 100_000) - 0.002_699_8).abs() < 1e-6);
    assert_eq!(student_tail(3.0, 0), 1.0);
}

#[test]
fn the_same_bits_are_identical() {
    let found = compare_pictures(&film(1, 4, clean), &film(1, 4, clean), None);
    assert_eq!(found.verdict, Verdict::Identical);
    assert_eq!((found.equal_pixels, found.outliers, found.bias), (found.pixels, 0, 0.0));
}

#[test]
fn other_seeds_are_statistically_equal_at_any_number_of_samples() {
    for spp in [1, 2, 4, 64] {
        let control = film(2, spp, clean);
        let found = compare_pictures(&film(1, spp, clean), &film(3, spp, clean), Some(&control));
        assert_eq!(found.verdict, Verdict::StatisticallyEqual, "{spp} spp: {:?}", found.broken_rules());
        assert!(spp < 4 || found.outliers > 0, "{spp} spp: some are beyond 3 by chance");
    }
}

#[test]
fn roundings_of_one_sign_are_statistically_equal() {
    let found = compare_pictures(&film(1, 4, clean), &film(1, 4, |_, _| 2e-6), None);
    assert_eq!(found.verdict, Verdict::StatisticallyEqual, "{:?}", found.broken_rules());
    assert!(found.equal_pixels < found.pixels);
}

#[test]
fn a_small_bias_shows_between_renders_of_one_seed() {
    let found = compare_pictures(&film(1, 4, clean), &film(1, 4, |_, _| 1e-4), None);
    assert_eq!(found.verdict, Verdict::Differs);
    assert!(found.bias > 50.0 && found.z_max < 3.0, "no pixel shows it alone: {found:?}");
}

#[test]
fn a_block_that_is_wrong_shows() {
    let wrong = |x: u32, y: u32| if x / 16 == 2 && y / 16 == 4 { 1e-3 } else { 0.0 };
    let found = compare_pictures(&film(1, 4, clean), &film(1, 4, wrong), None);
    assert_eq!((found.verdict, found.block_at), (Verdict::Differs, [32, 64]));
}

#[test]
fn scattered_wrong_pixels_show_even_without_a_bias() {
    // One pixel in thirty is wrong, by turns too bright and too dark.
    let wrong = |x: u32, y: u32| match (x + 7 * y) % 60 {
        0 => 0.9,
        30 => -0.9,
        _ => 0.0,
    };
    let independent = film(3, 64, wrong);
    for (second, control) in [(&film(1, 64, wrong), None), (&independent, Some(film(2, 64, clean)))] {
        let found = compare_pictures(&film(1, 64, clean), second, control.as_ref());
        assert_eq!(found.verdict, Verdict::Differs);
        assert!(
            found.outliers as f64 > found.outliers_allowed,
            "{} {}",
            found.outliers,
            found.outliers_allowed
        );
    }
}
