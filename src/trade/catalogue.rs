//! Which ways there are for a scene: a base, and each knob's choices.

use super::knob::Knob;
use super::way::{Claim, Engine, Way};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};

/// A choice of a knob.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// Its name.
    pub name: String,
    /// Number of its way.
    pub way: usize,
}

/// A knob of which there is something to choose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Turned {
    /// The knob.
    pub knob: Knob,
    /// What turning it answers.
    pub question: String,
    /// Its choices.
    pub choices: Vec<Choice>,
}

/// What is not measured, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Of which knob.
    pub knob: Knob,
    /// Which choice; all of them if there is no name.
    pub choice: Option<String>,
    /// Why.
    pub why: String,
}

/// All ways that are measured, each once; way 0 is the base.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Catalogue {
    /// The ways.
    pub ways: Vec<Way>,
    /// The knobs, with choices among the ways.
    pub knobs: Vec<Turned>,
    /// What is left out.
    pub left_out: Vec<LeftOut>,
}

/// The base of all ways: it loses no light, and its mean is the reference.
///
/// What belongs to the scene's look stays as the scene has it: the horizon's policy, whether diffuse surfaces see
/// others, and highlights.
pub fn base(scene: &Scene, engine: Engine, spp: u32) -> Way {
    let way = Way { name: "base".into(), settings: vec![], engine, spp, noise: None, claim: Claim::Unbiased };
    // A clamp cannot be unsaid; one that is never reached is none.
    let way = match scene.settings.clamp_indirect {
        Some(_) => way.with("settings.clamp_indirect", "1e30"),
        None => way,
    };
    way.with("settings.max_depth", scene.settings.max_depth.max(8))
        .with("settings.at_max_depth", "\"roulette\"")
        .with("settings.glossy_samples", 1)
        .with("settings.self_hit", "\"primitive\"")
        .with("settings.direct_light", "\"mis\"")
        .with("settings.sampler", "\"sobol\"")
        .with("settings.occlusion", "\"exact\"")
        .with("settings.light_candidates", scene.settings.light_candidates.without_pilot())
        .with("settings.guiding", scene.settings.guiding)
        .with("settings.portals", scene.settings.portals)
        .with("settings.emitter_edges", scene.settings.emitter_edges)
        .with("settings.split_glass", scene.settings.split_glass)
        .with("settings.adaptive", scene.settings.adaptive)
}

impl Catalogue {
    /// The ways of these knobs for a scene, as changes of [`base`].
    pub fn new(scene: &Scene, base: &Way, knobs: &[Knob]) -> Self {
        let mut catalogue = Self { ways: vec![base.clone()], knobs: vec![], left_out: vec![] };
        for &knob in knobs {
            match knob.idle(scene, base) {
                Some(why) => {
                    catalogue.left_out.push(LeftOut { knob, choice: None, why: why.to_owned() });
                }
                None => catalogue.turn(knob, scene, base),
            }
        }
        catalogue
    }

    fn turn(&mut self, knob: Knob, scene: &Scene, base: &Way) {
        let mut choices = vec![];
        for (name, way) in knob.choices(scene, base) {
            match way {
                Ok(way) => {
                    let way = self.add(Way { name: format!("{} {name}", knob.name()), ..way });
                    choices.push(Choice { name, way });
                }
                Err(why) => self.left_out.push(LeftOut { knob, choice: Some(name), why }),
            }
        }
        self.knobs.push(Turned { knob, question: knob.question(), choices });
    }

    /// The number of a way, which is added unless there is one like it.
    fn add(&mut self, way: Way) -> usize {
        if let Some(known) = self.ways.iter().position(|known| known.is_same(&way)) {
            return known;
        }
        self.ways.push(way);
        self.ways.len() - 1
    }

    /// Takes a way out; the others move up.
    pub fn leave_out(&mut self, way: usize, why: &str) {
        for turned in &mut self.knobs {
            for choice in turned.choices.iter().filter(|choice| choice.way == way) {
                self.left_out.push(LeftOut {
                    knob: turned.knob,
                    choice: Some(choice.name.clone()),
                    why: why.to_owned(),
                });
            }
            turned.choices.retain(|choice| choice.way != way);
            for choice in turned.choices.iter_mut().filter(|choice| choice.way > way) {
                choice.way -= 1;
            }
        }
        self.ways.remove(way);
    }
}
