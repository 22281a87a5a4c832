//! Pictures beside the picture, by the names that other programs know.

use crate::core::Rgb;
use crate::film::Film;
use crate::scene::Aov;

/// The channels of these AOVs, row by row, by pbrt-v4's names (`Albedo.R`, `N.X`, ...); of a film that was rendered for
/// them.
pub fn aov_channels(aovs: &[Aov], film: &Film) -> Vec<(String, Vec<f32>)> {
    let three = |layer: &str, names: [&str; 3], values: Vec<Rgb>| {
        let channel = |c: usize| values.iter().map(|value| value.to_array()[c]).collect();
        [0, 1, 2].map(|c| (format!("{layer}.{}", names[c]), channel(c))).to_vec()
    };
    let channels = |aov: &Aov| match aov {
        Aov::Albedo => three("Albedo", ["R", "G", "B"], film.albedo()),
        Aov::Normal => three("N", ["X", "Y", "Z"], film.normal()),
        Aov::Depth => vec![("Depth.Z".to_owned(), film.depth())],
        Aov::Variance => three("Variance", ["R", "G", "B"], film.variance()),
    };
    let mut all: Vec<_> = aovs.iter().flat_map(channels).collect();
    all.sort_by(|a, b| a.0.cmp(&b.0));
    all.dedup_by(|a, b| a.0 == b.0);
    all
}
