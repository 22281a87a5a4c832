//! The settings, checked.

use super::SceneError;
use super::source::Source;
use crate::scene::desc::SettingsDesc;
use crate::scene::{GlossySamples, LightCandidates, Settings};

/// Rays that one hit may split into: more would not fit into one wave.
const MOST_GLOSSY_SAMPLES: u32 = 65_536;

/// The settings with the preset filled in.
pub(super) fn checked(desc: &SettingsDesc, source: &Source) -> Result<Settings, SceneError> {
    let at = source.at("settings");
    let settings = desc.resolve();
    if settings.spp == 0 {
        return Err(at.key("spp").fail("0 samples per pixel make no picture: it must be at least 1"));
    }
    if settings.clamp_indirect.is_some_and(|most| !(most.is_finite() && most > 0.0)) {
        let message = "the most radiance of indirect light must be above 0; leave it out for no bound";
        return Err(at.key("clamp_indirect").fail(message));
    }
    let counts = match &settings.glossy_samples {
        GlossySamples::First(m) | GlossySamples::Any { any: m } => &[*m][..],
        GlossySamples::PerDepth(list) => list,
        GlossySamples::Auto(_) => &[],
        GlossySamples::Branch { branch } => &[*branch],
    };
    if let Some(m) = counts.iter().find(|m| !(1..=MOST_GLOSSY_SAMPLES).contains(*m)) {
        let message = format!("{m} rays per hit: each number must be from 1 to {MOST_GLOSSY_SAMPLES}");
        return Err(at.key("glossy_samples").fail(message));
    }
    let candidates = settings.light_candidates.without_pilot();
    if !(1..=LightCandidates::MOST).contains(&candidates) {
        let most = LightCandidates::MOST;
        let message = format!("{candidates} candidates: their number must be from 1 to {most}");
        return Err(at.key("light_candidates").fail(message));
    }
    Ok(settings)
}
