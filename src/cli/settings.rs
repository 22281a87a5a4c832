//! Settings as they are told: in `info`, in EXR attributes.

use crate::scene::Settings;
use serde_json::Value;

/// Every setting by its name in scene files; approximations and extras only where they are on.
pub(super) fn to_json(settings: &Settings) -> Value {
    serde_json::to_value(settings).expect("settings have names and plain values")
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
        assert_eq!(to_json(&Settings::default())["glossy_samples"], "auto");
    }
}
