//! Which figures there are.

/// One picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Figure {
    /// Its file's name without the ending.
    pub name: &'static str,
    /// What is written below it.
    pub caption: &'static str,
    /// What it changes of the family's scene: keys and values as the command line's `-D` takes them.
    pub overrides: &'static [(&'static str, &'static str)],
}

/// Pictures of one scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Family {
    /// The scene, in TOML.
    pub scene: &'static str,
    /// Its pictures.
    pub figures: &'static [Figure],
    /// Name and caption of a picture of how far the first two are apart.
    pub difference: Option<(&'static str, &'static str)>,
}

const fn figure(
    name: &'static str,
    caption: &'static str,
    overrides: &'static [(&'static str, &'static str)],
) -> Figure {
    Figure { name, caption, overrides }
}

const fn family(scene: &'static str, figures: &'static [Figure]) -> Family {
    Family { scene, figures, difference: None }
}

const EXPONENT: &str = "materials.lemon.exponent";

/// The figures of Suffern 2007, *Ray Tracing from the Ground Up*, chapter 25, with the book's numbers, and the pair
/// that shows what the lecture's rule against self-hits loses.
pub const FAMILIES: [Family; 6] = [
    family(
        include_str!("../../scenes/rim.toml"),
        &[
            figure("25-07-fold", "25.7 e = 1, folded above the surface", &[]),
            figure("25-07-clip", "25.7 e = 1, below the surface black", &[("settings.horizon", "clip")]),
        ],
    ),
    family(
        include_str!("../../scenes/lemon.toml"),
        &[
            figure("25-08-a", "25.8 (a) e = 1", &[(EXPONENT, "1")]),
            figure("25-08-b", "25.8 (b) e = 10", &[(EXPONENT, "10")]),
            figure("25-08-c", "25.8 (c) e = 100", &[(EXPONENT, "100")]),
            figure("25-08-d", "25.8 (d) e = 1000", &[(EXPONENT, "1000")]),
            figure("25-08-e", "25.8 (e) e = 10 000", &[(EXPONENT, "10000")]),
            figure("25-08-f", "25.8 (f) e = 100 000", &[(EXPONENT, "100000")]),
            figure(
                "25-13-a",
                "25.13 (a) e = 1, 1 sample, random",
                &[
                    (EXPONENT, "1"),
                    ("settings.spp", "1"),
                    ("settings.sampler", "independent"),
                    ("settings.direct_light", "lobe"),
                ],
            ),
            figure(
                "25-13-b",
                "25.13 (b) e = 1, 1 sample, regular",
                &[
                    (EXPONENT, "1"),
                    ("settings.spp", "1"),
                    ("settings.sampler", "regular"),
                    ("settings.direct_light", "lobe"),
                ],
            ),
            figure(
                "25-13-c",
                "25.13 (c) e = 1, 1 sample, Hammersley",
                &[
                    (EXPONENT, "1"),
                    ("settings.spp", "1"),
                    ("settings.sampler", "hammersley"),
                    ("settings.direct_light", "lobe"),
                ],
            ),
        ],
    ),
    family(
        include_str!("../../scenes/boxes.toml"),
        &[figure("25-09", "25.9 e = 100 000, 10 000, 1000, 100", &[])],
    ),
    family(
        include_str!("../../scenes/mirror-room.toml"),
        &[
            figure(
                "25-10-a",
                "25.10 (a) sharp mirrors",
                &[("materials.glossy-mirror.exponent", "inf"), ("settings.spp", "16")],
            ),
            figure("25-10-b", "25.10 (b) glossy mirrors, e = 25 000", &[]),
        ],
    ),
    family(
        include_str!("../../scenes/checker-sphere.toml"),
        &[figure("25-12", "25.12 e = 100 over a checkered floor", &[])],
    ),
    Family {
        scene: include_str!("../../scenes/self-hit.toml"),
        figures: &[
            figure("self-hit-geometry", "no ray hits the knot that it leaves", SKIP_GEOMETRY),
            figure("self-hit-primitive", "no ray hits the triangle that it leaves", &[]),
        ],
        difference: Some(("self-hit-difference", "what the first rule loses")),
    },
];

const SKIP_GEOMETRY: &[(&str, &str)] = &[("settings.self_hit", "geometry")];
