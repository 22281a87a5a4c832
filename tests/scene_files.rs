//! Scene files: what loads, what is refused and how, and that the size and place of a scene change nothing.

mod scene_files {
    mod errors;
    mod loading;
    mod overrides;
    mod shipped;
    mod world;

    use gloss::scene::{Format, Override, Scene, SceneError, load_str};
    use std::path::Path;

    /// A scene from TOML.
    fn read(text: &str) -> Result<Scene, SceneError> {
        load_str(text, Format::Toml, Path::new(""), &[])
    }

    /// A scene that must load.
    fn scene(text: &str) -> Scene {
        read(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
    }

    /// A scene with overrides, each `path=value`.
    fn with(text: &str, overrides: &[&str]) -> Result<Scene, SceneError> {
        let overrides: Vec<Override> = overrides.iter().map(|o| o.parse().unwrap()).collect();
        load_str(text, Format::Toml, Path::new(""), &overrides)
    }

    /// The message of a scene that must not load.
    fn complaint(text: &str) -> String {
        match read(text) {
            Ok(_) => panic!("this should not load:\n{text}"),
            Err(e) => e.to_string(),
        }
    }
}
