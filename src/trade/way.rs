//! One way to render a scene.

use crate::accel::{Backend, BuildOptions, EmbreeMode, Quality};
use crate::scene::Override;
use serde::{Deserialize, Serialize};

/// Who answers rays, and how it is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct Engine {
    /// The backend.
    pub backend: Backend,
    /// Which of Embree's calls are asked.
    pub embree_mode: EmbreeMode,
    /// Time spent on the structure.
    pub quality: Quality,
    /// Watertight tests.
    pub robust: bool,
}

impl Default for Engine {
    fn default() -> Self {
        let BuildOptions { embree_mode, quality, robust, .. } = BuildOptions::default();
        Self { backend: Backend::default(), embree_mode, quality, robust }
    }
}

/// Whether the mean of ever more samples is the reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Claim {
    /// It should be: a bias that shows is a fault.
    Unbiased,
    /// It need not be.
    Biased,
}

/// One way to render: settings that are put into the scene, and who answers rays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Way {
    /// What it is called: knob and choice.
    pub name: String,
    /// Settings by their path in the scene, as TOML values; later ones win.
    pub settings: Vec<(String, String)>,
    /// Who answers rays.
    pub engine: Engine,
    /// Samples per pixel: the most of them where a threshold of noise is given.
    pub spp: u32,
    /// Threshold of noise below which parts of the picture get no more samples.
    pub noise: Option<f64>,
    /// What is said of its bias.
    pub claim: Claim,
}

impl Way {
    /// This way with one more setting.
    pub fn with(mut self, path: &str, value: impl std::fmt::Display) -> Self {
        self.settings.retain(|(old, _)| old != path);
        self.settings.push((path.to_owned(), value.to_string()));
        self
    }

    /// The settings as overrides of a scene.
    pub fn overrides(&self) -> Vec<Override> {
        self.settings.iter().map(|(path, value)| Override::new(path, value)).collect()
    }

    /// Whether its numbers are a pattern of so many points as there are samples, whose error falls by a law of its own.
    pub fn has_a_pattern(&self) -> bool {
        let sampler = self.settings.iter().find(|(path, _)| path == "settings.sampler");
        sampler.is_some_and(|(_, kind)| kind.contains("regular") || kind.contains("hammersley"))
    }

    /// Whether both give the same pictures by the same work.
    pub fn is_same(&self, other: &Self) -> bool {
        let sorted = |way: &Self| {
            let mut settings = way.settings.clone();
            settings.sort();
            settings
        };
        (self.engine, self.spp, self.noise) == (other.engine, other.spp, other.noise)
            && sorted(self) == sorted(other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_are_the_same_by_what_they_do_and_not_by_name_or_order() {
        let way = Way {
            name: "a".into(),
            settings: vec![],
            engine: Engine::default(),
            spp: 4,
            noise: None,
            claim: Claim::Unbiased,
        };
        let a = way.clone().with("settings.max_depth", 2).with("settings.horizon", "\"clip\"");
        let mut b = way.with("settings.horizon", "\"fold\"").with("settings.horizon", "\"clip\"");
        assert!(!a.is_same(&b));
        b = b.with("settings.max_depth", 2);
        b.name = "b".into();
        assert!(a.is_same(&b));
        assert!(!b.has_a_pattern() && b.clone().with("settings.sampler", "\"regular\"").has_a_pattern());
        b.spp = 5;
        assert!(!a.is_same(&b));
        assert_eq!(a.overrides()[0].to_string(), "settings.max_depth=2");
    }
}
