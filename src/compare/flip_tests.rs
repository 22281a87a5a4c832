//! Held against the authors' own implementation (`flip-evaluator` 1.7 from PyPI, linear input) on pictures made by
//! formulas that are exact in `f32`.

use super::*;

const SIZE: [u32; 2] = [64, 48];

fn picture(colour: impl Fn(u32, u32) -> [f32; 3]) -> Image {
    Image::from_fn(SIZE[0], SIZE[1], |x, y| Rgb::from(colour(x, y)))
}

/// A gradient in red and green, a checker in blue.
fn smooth(x: u32, y: u32) -> [f32; 3] {
    [x as f32 / 64.0, y as f32 / 64.0, 0.125 + 0.75 * ((x / 8 + y / 8) % 2) as f32]
}

/// The same with a highlight three orders of magnitude brighter than the rest.
fn bright(x: u32, y: u32) -> [f32; 3] {
    let (dx, dy) = (x as i32 - 20, y as i32 - 20);
    let light = if dx * dx + dy * dy < 36 { 512.0 } else { 0.25 + (x * y) as f32 / 256.0 };
    smooth(x, y).map(|c| c * light + 0.0078125)
}

/// In `[0, 1)`, in steps of 1/256.
fn noise(x: u32, y: u32, channel: u32) -> f32 {
    (crate::core::sampler::hash(x + 1000 * y + 1_000_000 * channel) >> 24) as f32 / 256.0
}

fn with_noise(colour: [f32; 3], x: u32, y: u32, mix: impl Fn(f32, f32) -> f32) -> [f32; 3] {
    [0, 1, 2].map(|c| mix(colour[c as usize], noise(x, y, c)))
}

/// What the authors' implementation says: mean, maximum, and the pixels (10, 10), (63, 0) and (33, 40).
struct Expected {
    ppd: f32,
    mean: f64,
    max: f32,
    pixels: [f32; 3],
}

#[track_caller]
fn agrees(flip: &Flip, expected: &Expected) {
    let close = |ours: f64, theirs: f64| assert!((ours - theirs).abs() < 2e-5, "{ours} is not {theirs}");
    close(mean(&flip.map), expected.mean);
    close(flip.map.iter().copied().fold(0.0, f32::max).into(), expected.max.into());
    for ([x, y], theirs) in [[10, 10], [63, 0], [33, 40]].into_iter().zip(expected.pixels) {
        close(flip.map[y * SIZE[0] as usize + x].into(), theirs.into());
    }
}

#[test]
fn ldr_flip_of_noise_is_the_authors() {
    let test = picture(|x, y| with_noise(smooth(x, y), x, y, |c, n| 0.75 * c + 0.25 * n));
    for expected in [
        Expected {
            ppd: DEFAULT_PPD,
            mean: 0.3137755,
            max: 0.8038184,
            pixels: [0.364202, 0.423127, 0.228404],
        },
        Expected { ppd: 30.0, mean: 0.3715269, max: 0.8969844, pixels: [0.455184, 0.441589, 0.154321] },
    ] {
        agrees(&ldr(&picture(smooth), &test, expected.ppd), &expected);
    }
}

#[test]
fn ldr_flip_of_a_shift_is_the_authors() {
    let test = picture(|x, y| smooth((x + 1).min(63), y));
    for expected in [
        Expected {
            ppd: DEFAULT_PPD,
            mean: 0.1443835,
            max: 0.3782223,
            pixels: [0.104826, 0.023828, 0.092355],
        },
        Expected { ppd: 30.0, mean: 0.1931229, max: 0.6365658, pixels: [0.116101, 0.011952, 0.089195] },
    ] {
        agrees(&ldr(&picture(smooth), &test, expected.ppd), &expected);
    }
}

#[test]
fn ldr_flip_of_a_tint_is_the_authors() {
    let test = picture(|x, y| {
        let [r, g, b] = smooth(x, y);
        [r, 0.5 * g, b]
    });
    for expected in [
        Expected {
            ppd: DEFAULT_PPD,
            mean: 0.5766859,
            max: 0.9080819,
            pixels: [0.470047, 0.050765, 0.794798],
        },
        Expected { ppd: 30.0, mean: 0.5620626, max: 0.9206704, pixels: [0.466946, 0.021509, 0.773467] },
    ] {
        agrees(&ldr(&picture(smooth), &test, expected.ppd), &expected);
    }
}

#[test]
fn hdr_flip_of_noise_is_the_authors() {
    let test = picture(|x, y| with_noise(bright(x, y), x, y, |c, n| c * (0.5 + n)));
    for expected in [
        Expected {
            ppd: DEFAULT_PPD,
            mean: 0.1618196,
            max: 0.4198369,
            pixels: [0.154318, 0.180392, 0.183768],
        },
        Expected { ppd: 30.0, mean: 0.2983373, max: 0.6829453, pixels: [0.237567, 0.203566, 0.171812] },
    ] {
        let flip = hdr(&picture(bright), &test, expected.ppd);
        agrees(&flip, &expected);
        let exposures = flip.exposures.unwrap();
        assert!((exposures.start + 6.661616).abs() < 1e-5, "{exposures:?}");
        assert!((exposures.stop - 0.971075).abs() < 1e-5, "{exposures:?}");
        assert_eq!(exposures.count, 8);
    }
}

#[test]
fn hdr_flip_of_a_shift_is_the_authors() {
    let test = picture(|x, y| bright(x, y + 1));
    for expected in [
        Expected {
            ppd: DEFAULT_PPD,
            mean: 0.2300535,
            max: 0.7323077,
            pixels: [0.254371, 0.535730, 0.171724],
        },
        Expected { ppd: 30.0, mean: 0.2687562, max: 0.9703047, pixels: [0.247660, 0.593926, 0.255977] },
    ] {
        agrees(&hdr(&picture(bright), &test, expected.ppd), &expected);
    }
}

#[test]
fn hdr_flip_of_partly_black_pictures_is_the_authors() {
    let reference = picture(|x, y| if x >= 24 { bright(x, y) } else { [0.0; 3] });
    let test = picture(|x, y| if x >= 22 { bright(x + 1, y) } else { [0.0; 3] });
    for expected in [
        Expected { ppd: DEFAULT_PPD, mean: 0.1829436, max: 0.9784952, pixels: [0.0, 0.453727, 0.094681] },
        Expected { ppd: 30.0, mean: 0.1889571, max: 0.9897938, pixels: [0.0, 0.534212, 0.090460] },
    ] {
        agrees(&hdr(&reference, &test, expected.ppd), &expected);
    }
}

#[test]
fn flip_of_pure_colours_is_the_authors() {
    let constant = |rgb: [f32; 3]| picture(move |_, _| rgb);
    let flip = |a, b| mean(&ldr(&constant(a), &constant(b), DEFAULT_PPD).map);
    assert!((flip([0.0; 3], [1.0; 3]) - 0.9673883).abs() < 1e-5);
    assert!((flip([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]) - 1.0).abs() < 2e-6);
    assert_eq!(flip([0.25, 0.5, 0.75], [0.25, 0.5, 0.75]), 0.0);
    // Clipped to the same.
    assert_eq!(flip([1.0; 3], [7.0; 3]), 0.0);
}

#[test]
fn mostly_black_and_wholly_black_references_have_exposures() {
    let corner = |x, y| if x < 4 && y < 4 { [0.5; 3] } else { [0.0; 3] };
    let exposures = Exposures::of(&picture(corner));
    assert!(exposures.start.is_finite() && exposures.stop == exposures.start && exposures.count == 2);
    let black = picture(|_, _| [0.0; 3]);
    assert!(mean(&hdr(&black, &picture(corner), DEFAULT_PPD).map) > 0.0);
    assert_eq!(mean(&hdr(&black, &black, DEFAULT_PPD).map), 0.0);
    assert!(mean(&hdr(&picture(corner), &black, DEFAULT_PPD).map) > 0.0);
}

#[test]
fn the_tone_curve_is_inverted() {
    for y in [0.1, 0.5, 0.85] {
        assert!((aces(aces_inverse(y)) - y).abs() < 1e-6);
    }
}

#[test]
fn light_of_any_range_gives_a_number_and_differences_of_bright_pictures_show() {
    let half = |scale: f32, brighter: f32| {
        picture(move |x, _| [scale * if x < 32 { 0.25 } else { brighter }, scale * 0.25, scale * 0.25])
    };
    let at = |scale| hdr(&half(scale, 0.25), &half(scale, 1.0), DEFAULT_PPD).map;
    let expected = mean(&at(1.0));
    assert!(expected > 0.1, "{expected}");
    for scale in [1e-30, 1e19, 1e30, 1e38] {
        let map = at(scale);
        assert!(map.iter().all(|e| (0.0..=1.0).contains(e)), "{scale:e}");
        assert!((mean(&map) - expected).abs() < 1e-3, "{scale:e}: {} is not {expected}", mean(&map));
    }
    let darkest = hdr(&half(1e-44, 0.0), &half(1e38, 0.0), DEFAULT_PPD).map;
    assert!(darkest.iter().all(|e| (0.0..=1.0).contains(e)));
}
