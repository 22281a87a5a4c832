//! What a checkpoint says of itself.

use super::shard::{Shard, ShardBy};
use crate::film::{Dropped, PixelRect};
use crate::integrator::Tally;
use crate::render::Decisions;
use crate::scene::Aov;
use serde::{Deserialize, Serialize};

/// Which picture: what must agree before films may be added or a render goes on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Version of this program: another may draw other numbers.
    pub version: String,
    /// Name of the scene file, for people: it may differ.
    pub scene: String,
    /// Hash of the scene, its files and its settings, without the number of samples.
    pub scene_hash: String,
    /// The settings as lines `name = value`, to say what differs.
    pub settings: String,
    /// Seed of the random numbers; also part of the hash.
    pub seed: u32,
    /// Who answers rays and how it was built: the last bits of a hit depend on it.
    pub backend: String,
    /// Size of the full image.
    pub resolution: [u32; 2],
    /// The part of the image that all parts together fill.
    pub picture: PixelRect,
    /// Samples per pixel that all parts together hold.
    pub spp: u32,
    /// Pictures beside the picture, of which the film then knows all.
    #[serde(default)]
    pub aovs: Vec<Aov>,
    /// The error at which pixels are left alone, if there is one.
    pub noise: Option<f64>,
    /// Whether samples depend on what the render has found before (a threshold, samples where noise is).
    pub adaptive: bool,
    /// Whether a picture of more samples holds all of these: where there is no threshold, no pattern of so many
    /// samples, and, if samples are shared out, either none of them or all that this hangs on.
    pub grows: bool,
}

impl Identity {
    /// What differs between `self`, as a file has it, and `wanted`: a line each, empty if films may be added.
    ///
    /// With `more_samples`, another number of samples is no difference, unless the samples depend on it.
    pub fn differences(&self, wanted: &Self, more_samples: bool) -> Vec<String> {
        let mut found = vec![];
        let mut compare = |name: &str, here: String, there: String| {
            if here != there {
                found.push(format!("{name}: {here} in the file, {there} now"));
            }
        };
        compare("version of gloss", self.version.clone(), wanted.version.clone());
        compare("backend", self.backend.clone(), wanted.backend.clone());
        compare("resolution", size(self.resolution), size(wanted.resolution));
        compare("part of the image", corners(self.picture), corners(wanted.picture));
        compare("noise threshold", threshold(self.noise), threshold(wanted.noise));
        let grows = self.grows && wanted.grows;
        if !more_samples || !grows || self.spp > wanted.spp {
            let name = if more_samples && !grows {
                "samples per pixel (fixed by a noise threshold, a sampler that is a pattern, or --adaptive with 3)"
            } else {
                "samples per pixel"
            };
            compare(name, self.spp.to_string(), wanted.spp.to_string());
        }
        if self.scene_hash != wanted.scene_hash {
            found.extend(self.different_scenes(wanted));
        }
        found
    }

    /// Which settings differ; if none, it is the scene or a file that it names.
    fn different_scenes(&self, wanted: &Self) -> Vec<String> {
        let value = |settings: &str, name: &str| {
            let line = settings.lines().find_map(|l| l.split_once(" = ").filter(|(key, _)| *key == name));
            line.map_or_else(|| "nothing".to_owned(), |(_, value)| value.to_owned())
        };
        let mut names: Vec<&str> = [&self.settings, &wanted.settings]
            .into_iter()
            .flat_map(|settings| settings.lines())
            .filter_map(|line| Some(line.split_once(" = ")?.0))
            .filter(|name| *name != "spp")
            .collect();
        names.sort_unstable();
        names.dedup();
        let differing = names.into_iter().filter_map(|name| {
            let (here, there) = (value(&self.settings, name), value(&wanted.settings, name));
            (here != there).then(|| format!("{name}: {here} in the file, {there} now"))
        });
        let mut found: Vec<String> = differing.collect();
        if found.is_empty() {
            let name = if self.scene == wanted.scene {
                format!("{} or a file that it names has changed", self.scene)
            } else {
                format!("{} in the file, {} now", self.scene, wanted.scene)
            };
            found.push(format!("scene: {name}"));
        }
        found
    }
}

fn size([width, height]: [u32; 2]) -> String {
    format!("{width} x {height}")
}

fn corners(rect: PixelRect) -> String {
    format!("{},{},{},{}", rect.x0, rect.y0, rect.x1, rect.y1)
}

fn threshold(noise: Option<f64>) -> String {
    noise.map_or_else(|| "none".to_owned(), |noise| noise.to_string())
}

/// A share of the picture's samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// Its pixels.
    pub rect: PixelRect,
    /// The first of its pixels' samples.
    pub first: u32,
    /// One past the last.
    pub end: u32,
    /// Which shard it was cut as.
    pub shard: Option<Shard>,
    /// Whether all of its samples are there, or all that were wanted once a rule had ended the render.
    pub finished: bool,
}

impl Part {
    /// Number of samples in all pixels.
    pub fn samples(&self) -> u64 {
        self.rect.area() as u64 * u64::from(self.end - self.first)
    }

    /// Whether both are the same samples of the same pixels.
    pub fn same_samples(&self, other: &Self) -> bool {
        (self.rect, self.first, self.end) == (other.rect, other.first, other.end)
    }

    /// Whether all samples of the other belong to it.
    pub fn contains(&self, other: &Self) -> bool {
        let (a, b) = (self.rect, other.rect);
        let pixels = a.x0 <= b.x0 && b.x1 <= a.x1 && a.y0 <= b.y0 && b.y1 <= a.y1;
        pixels && self.first <= other.first && other.end <= self.end
    }

    /// Whether a sample belongs to both.
    pub fn overlaps(&self, other: &Self) -> bool {
        let (a, b) = (self.rect, other.rect);
        let pixels = a.x0.max(b.x0) < a.x1.min(b.x1) && a.y0.max(b.y0) < a.y1.min(b.y1);
        pixels && self.first.max(other.first) < self.end.min(other.end)
    }
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(shard) = self.shard {
            write!(f, "shard {shard}, ")?;
        }
        match self.shard.map(|shard| shard.by) {
            Some(ShardBy::Tiles) => write!(f, "pixels {}", corners(self.rect)),
            Some(ShardBy::Samples) | None => write!(f, "samples {} to {}", self.first, self.end),
        }
    }
}

/// Everything in a checkpoint but its pixels; each field is an attribute `gloss.NAME` of the file, as JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Number of the format.
    pub format: u32,
    /// Which picture.
    #[serde(flatten)]
    pub identity: Identity,
    /// Which of its samples: one part, or several that were merged.
    pub parts: Vec<Part>,
    /// Samples that could not be added.
    pub dropped: Dropped,
    /// What was counted on the way.
    pub tally: Tally,
    /// What was decided on the way.
    pub decisions: Decisions,
    /// Wall time of the renders so far, in seconds.
    pub seconds: f64,
}

impl Header {
    /// The header of a part of which nothing is done yet.
    pub fn new(identity: Identity, part: Part) -> Self {
        Self {
            format: FORMAT,
            identity,
            parts: vec![part],
            dropped: Dropped::default(),
            tally: Tally::default(),
            decisions: Decisions::default(),
            seconds: 0.0,
        }
    }

    /// Whether all parts are finished; others may be missing altogether.
    pub fn is_finished(&self) -> bool {
        self.parts.iter().all(|part| part.finished)
    }

    /// The pixels that the file holds: those of its part, or of the whole picture where it has several.
    pub fn rect(&self) -> PixelRect {
        match self.parts[..] {
            [part] => part.rect,
            _ => self.identity.picture,
        }
    }
}

/// The number of the format that is written.
pub(super) const FORMAT: u32 = 1;

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in crate::farm) fn identity() -> Identity {
        let picture = PixelRect { x0: 0, y0: 0, x1: 5, y1: 3 };
        Identity {
            version: "1.2.3".into(),
            scene: "lemon.toml".into(),
            scene_hash: "abc".into(),
            settings: "spp = 16\nmax_depth = 8\nseed = 0".into(),
            seed: 0,
            backend: "brute".into(),
            resolution: [5, 3],
            picture,
            spp: 16,
            aovs: vec![],
            noise: None,
            adaptive: false,
            grows: true,
        }
    }

    #[test]
    fn what_differs_is_named() {
        let ours = identity();
        assert!(ours.differences(&ours, false).is_empty());

        let deeper = Identity {
            scene_hash: "def".into(),
            settings: "spp = 16\nmax_depth = 2\nseed = 0".into(),
            ..ours.clone()
        };
        assert_eq!(ours.differences(&deeper, false), ["max_depth: 8 in the file, 2 now"]);
        let changed = Identity { scene_hash: "def".into(), ..ours.clone() };
        assert_eq!(
            ours.differences(&changed, false),
            ["scene: lemon.toml or a file that it names has changed"]
        );
        let elsewhere = Identity { resolution: [6, 3], backend: "bvh".into(), ..ours.clone() };
        let found = ours.differences(&elsewhere, false);
        assert_eq!(
            found,
            ["backend: brute in the file, bvh now", "resolution: 5 x 3 in the file, 6 x 3 now"]
        );
    }

    #[test]
    fn more_samples_are_no_difference_unless_decisions_hang_on_them() {
        let ours = identity();
        let more = Identity { spp: 64, ..ours.clone() };
        assert!(ours.differences(&more, true).is_empty());
        assert_eq!(ours.differences(&more, false), ["samples per pixel: 16 in the file, 64 now"]);
        assert_eq!(more.differences(&ours, true), ["samples per pixel: 64 in the file, 16 now"]);
        let [ours, more] = [ours, more].map(|of| Identity { adaptive: true, grows: false, ..of });
        let refused = "samples per pixel (fixed by a noise threshold, a sampler that is a pattern, or --adaptive with 3): 16 in the file, 64 now";
        assert_eq!(ours.differences(&more, true), [refused]);
    }

    #[test]
    fn parts_overlap_where_they_share_a_sample() {
        let part = |x0, x1, first, end| Part {
            rect: PixelRect { x0, y0: 0, x1, y1: 1 },
            first,
            end,
            shard: None,
            finished: true,
        };
        assert!(part(0, 4, 0, 8).overlaps(&part(3, 5, 7, 9)));
        assert!(!part(0, 4, 0, 8).overlaps(&part(4, 5, 0, 8)));
        assert!(!part(0, 4, 0, 8).overlaps(&part(0, 4, 8, 9)));
        assert!(!part(0, 4, 3, 3).overlaps(&part(0, 4, 0, 8)));
    }
}
