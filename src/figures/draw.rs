//! From scenes to labelled pictures.

use crate::accel::Accelerator;
use crate::compare::magma::magma;
use crate::image_io::Image;
use crate::image_io::label::{Canvas, LETTER, contact_sheet};
use crate::render::{Outcome, RenderOptions, Silent, StopReason, render};
use crate::scene::Scene;
use std::sync::atomic::AtomicBool;

/// A rendered figure.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Linear light.
    pub image: Image,
    /// How the render went.
    pub outcome: Outcome,
}

/// Renders a scene with an accelerator that was built from its shapes; `None` if `stop` became true.
pub fn draw(scene: &Scene, accel: &dyn Accelerator, threads: usize, stop: &AtomicBool) -> Option<Drawn> {
    let options = RenderOptions { threads, ..RenderOptions::default() };
    let outcome = render(scene, accel, &options, &Silent, stop);
    if outcome.stopped_by == StopReason::Interrupted {
        return None;
    }
    let [width, height] = scene.camera.resolution;
    Some(Drawn { image: Image::new(width, height, outcome.film.image()), outcome })
}

/// How far two pictures of one size are apart, pixel by pixel: black where they agree, pale yellow where a channel
/// differs by 1 or more.
pub fn apart(a: &Image, b: &Image) -> Canvas {
    let mut canvas = Canvas::new(a.width, a.height, [0; 3]);
    let pixels = (0..a.height).flat_map(|y| (0..a.width).map(move |x| (x, y)));
    for ((x, y), (a, b)) in pixels.zip(a.pixels.iter().zip(&b.pixels)) {
        let difference = (*a - *b).map(f32::abs).max_channel();
        canvas.draw(&Canvas::new(1, 1, magma(difference)), x, y);
    }
    canvas
}

/// Space around words.
const GAP: u32 = 4;
const PAPER: [u8; 3] = [24; 3];
const INK: [u8; 3] = [230; 3];

/// The picture with its caption below, in as many lines as it takes.
pub fn labelled(picture: &Canvas, caption: &str) -> Canvas {
    let [width, height] = picture.size();
    let lines = wrapped(caption, (width.saturating_sub(2 * GAP) / LETTER).max(1) as usize);
    let mut page = Canvas::new(width, height + GAP + lines.len() as u32 * (LETTER + GAP), PAPER);
    page.draw(picture, 0, 0);
    for (y, line) in (0..).map(|i| height + GAP + i * (LETTER + GAP)).zip(&lines) {
        page.text(line, GAP, y, 1, INK);
    }
    page
}

/// Lines of at most so many letters, broken between words; a longer word has a line of its own.
fn wrapped(text: &str, letters: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.len() + 1 + word.len() <= letters => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// All pictures on one sheet, each at most `edge` pixels wide and high.
pub fn sheet(pictures: &[(Canvas, String)], edge: u32) -> Canvas {
    let small = pictures.iter().map(|(picture, words)| (picture.shrunk(edge, edge), words.clone()));
    contact_sheet(&small.collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Rgb;

    #[test]
    fn captions_are_broken_between_words() {
        assert_eq!(wrapped("one two three", 7), ["one two", "three"]);
        assert_eq!(wrapped("extraordinary", 3), ["extraordinary"]);
        let page = labelled(&Canvas::new(64, 10, [9; 3]), "two lines");
        assert_eq!(page.size(), [64, 10 + GAP + 2 * (LETTER + GAP)]);
        assert_eq!(page.pixel(63, 9), Some([9; 3]));
    }

    #[test]
    fn what_is_equal_is_black_and_what_differs_is_brighter() {
        let a = Image::from_fn(3, 1, |x, _| Rgb::grey(x as f32));
        let b = Image::from_fn(3, 1, |_, _| Rgb::grey(0.5));
        let brightness = |x: u32| apart(&a, &b).pixel(x, 0).map(|c| c.map(u32::from).iter().sum::<u32>());
        assert_eq!(apart(&a, &a).pixel(1, 0), Some(magma(0.0)));
        assert_eq!(brightness(0), brightness(1));
        assert!(brightness(1) < brightness(2));
    }
}
