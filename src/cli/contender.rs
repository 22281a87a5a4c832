//! What `compare` compares: a backend and how it is built, in a few words.

use super::accel_args::build;
use super::exit::Failure;
use crate::accel::{Accelerator, Backend, BuildOptions, EmbreeMode, Quality};
use crate::scene::Scene;
use clap::ValueEnum;

/// `embree`, `bvh`, `embree:packet8`, `bvh:quality=high`, ...
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Contender {
    backend: Backend,
    embree_mode: Option<EmbreeMode>,
    quality: Option<Quality>,
    robust: Option<bool>,
    /// The words that its backend's own name does not tell.
    extra: Vec<String>,
}

impl Contender {
    /// From what is typed: the backend, then its words, all parted by colons.
    pub(super) fn parse(typed: &str) -> Result<Self, String> {
        let mut words = typed.split(':');
        let name = words.next().unwrap_or_default();
        let backend = Backend::from_str(name, false)
            .map_err(|_| format!("`{name}` is no backend: it is embree, bvh or brute"))?;
        let mut contender = Self::of(backend);
        words.try_for_each(|word| contender.take(word))?;
        Ok(contender)
    }

    fn of(backend: Backend) -> Self {
        Self { backend, embree_mode: None, quality: None, robust: None, extra: vec![] }
    }

    fn take(&mut self, word: &str) -> Result<(), String> {
        if let (Backend::Embree, Ok(mode)) = (self.backend, EmbreeMode::from_str(word, false)) {
            self.embree_mode = Some(mode);
            return Ok(());
        }
        match (word, word.strip_prefix("quality=").map(|quality| Quality::from_str(quality, false))) {
            ("robust", _) => self.robust = Some(true),
            ("not-robust", _) => self.robust = Some(false),
            (_, Some(Ok(quality))) => self.quality = Some(quality),
            _ => {
                return Err(format!(
                    "`{word}` says nothing of a backend: it is robust, not-robust, quality=fast|medium|high, or for \
                     Embree a mode such as single or packet8"
                ));
            }
        }
        self.extra.push(word.to_owned());
        Ok(())
    }

    /// Every way there is in this program: all of Embree's modes and the BVH, or the BVH's qualities.
    pub(super) fn all() -> Vec<Self> {
        let bvh = Self::of(Backend::Bvh);
        if cfg!(feature = "embree") {
            let mode = |mode: &EmbreeMode| Self { embree_mode: Some(*mode), ..Self::of(Backend::Embree) };
            return EmbreeMode::value_variants().iter().map(mode).chain([bvh]).collect();
        }
        ["bvh:quality=medium", "bvh:quality=fast", "bvh:quality=high"]
            .into_iter()
            .filter_map(|typed| Self::parse(typed).ok())
            .collect()
    }

    /// The two that are compared where nobody says otherwise, and what there is to tell about it.
    pub(super) fn usual(primitives: usize) -> (Vec<Self>, Option<&'static str>) {
        if cfg!(feature = "embree") {
            return ([Backend::Embree, Backend::Bvh].map(Self::of).into(), None);
        }
        if primitives <= FEW {
            let note = "this gloss was built without Embree: the BVH is held against brute force";
            return ([Backend::Brute, Backend::Bvh].map(Self::of).into(), Some(note));
        }
        let high = Self {
            quality: Some(Quality::High),
            extra: vec!["quality=high".into()],
            ..Self::of(Backend::Bvh)
        };
        let note =
            "this gloss was built without Embree: the BVH of high quality is held against the usual one";
        (vec![Self::of(Backend::Bvh), high], Some(note))
    }

    /// Builds it over the scene's shapes, as `options` say where it does not; with a name for people.
    pub(super) fn build(
        &self,
        scene: &Scene,
        options: BuildOptions,
    ) -> Result<(String, Box<dyn Accelerator>), Failure> {
        let options = BuildOptions {
            embree_mode: self.embree_mode.unwrap_or(options.embree_mode),
            quality: self.quality.unwrap_or(options.quality),
            robust: self.robust.unwrap_or(options.robust),
            ..options
        };
        let accel = build(self.backend, scene, &options)?;
        let mut name = accel.info().name;
        for word in &self.extra {
            name = format!("{name} {word}");
        }
        Ok((name, accel))
    }
}

/// Primitives that brute force answers in good time.
const FEW: usize = 256;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_what_they_say() {
        let embree = Contender::parse("embree:packet8:quality=high:not-robust").unwrap();
        assert_eq!(embree.embree_mode, Some(EmbreeMode::Packet8));
        assert_eq!((embree.quality, embree.robust), (Some(Quality::High), Some(false)));
        assert_eq!(embree.extra, ["quality=high", "not-robust"]);
        assert_eq!(Contender::parse("bvh"), Ok(Contender::of(Backend::Bvh)));
        for bad in ["", "bvh:packet8", "bvh:", "gpu", "embree:fast", "bvh:quality=best"] {
            assert!(Contender::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn there_are_always_two_to_compare() {
        assert!(Contender::all().len() > 1);
        for primitives in [0, FEW, FEW + 1] {
            assert_eq!(Contender::usual(primitives).0.len(), 2);
        }
    }
}
