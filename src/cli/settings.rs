//! Settings as they are told: in `info`, in EXR attributes.

use crate::scene::Settings;
use serde_json::{Value, json};

/// Every setting by its name in scene files.
pub(super) fn to_json(settings: &Settings) -> Value {
    // Taken apart, so that a new setting cannot be forgotten here.
    let Settings {
        spp,
        max_depth,
        at_max_depth,
        glossy_samples,
        horizon,
        self_hit,
        direct_light,
        diffuse_bounces,
        highlights,
        clamp_indirect,
        aovs,
        occlusion,
        sampler,
        seed,
    } = settings;
    let mut all = json!({
        "spp": spp,
        "max_depth": max_depth,
        "at_max_depth": at_max_depth,
        "glossy_samples": glossy_samples,
        "horizon": horizon,
        "self_hit": self_hit,
        "direct_light": direct_light,
        "diffuse_bounces": diffuse_bounces,
        "highlights": highlights,
        "occlusion": occlusion,
        "sampler": sampler,
        "seed": seed,
    });
    // Named where they say something: a picture with a bound on it is labelled, others are as they were.
    if let Some(most) = clamp_indirect {
        all["clamp_indirect"] = json!(most);
    }
    if !aovs.is_empty() {
        all["aovs"] = json!(aovs);
    }
    all
}

/// On one line: `spp 64, max_depth 8, ...`.
pub(super) fn to_text(settings: &Settings) -> String {
    let Value::Object(all) = to_json(settings) else { unreachable!("settings are an object") };
    let told = all.iter().map(|(name, value)| match value {
        Value::String(text) => format!("{name} {text}"),
        other => format!("{name} {other}"),
    });
    told.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_told_in_the_words_of_scene_files() {
        let text = to_text(&Settings::default());
        assert!(text.contains("spp 64") && text.contains("self_hit primitive"), "{text}");
        assert_eq!(to_json(&Settings::default())["glossy_samples"], 1);
    }
}
