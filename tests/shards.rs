//! Pictures that are shared among many and put together again, to the bit.

mod common;

use common::place::{Place, Ran};
use exr::prelude::{AnyChannels, FlatSamples, read_first_flat_layer_from_file};
use gloss::farm::Checkpoint;
use std::path::Path;

#[test]
fn shards_merge_to_the_bits_of_the_whole() {
    let place = Place::new();
    let whole = place.whole("--adaptive=false");
    for (count, by) in [(1, "samples"), (2, "samples"), (7, "tiles"), (7, "samples"), (64, "samples")] {
        let mut files = String::new();
        for index in (0..count).rev() {
            let name = format!("{by}-{index}-{count}.exr");
            let ran = place
                .gloss(&format!("render scene.toml -o {name} --shard {index}/{count} --shard-by {by} -q"));
            assert_eq!(ran.code, 0, "{}", ran.err);
            files.push_str(&name);
            files.push(' ');
        }
        let _ = std::fs::remove_file(place.path("merged.exr"));
        let ran = place.gloss(&format!("merge -o merged.png --checkpoint merged.exr {files}"));
        assert_eq!(ran.code, 0, "{}", ran.err);
        let merged = Checkpoint::read(&place.path("merged.exr")).unwrap();
        assert_eq!(merged.film.pixels, whole.film.pixels, "{count} shards by {by}");
        assert_eq!(merged.header.tally.all_rays().rays, whole.header.tally.all_rays().rays);
        let pictures = ["merged.png", "whole.png"].map(|name| std::fs::read(place.path(name)).unwrap());
        assert!(pictures[0] == pictures[1], "{count} shards by {by}: the pictures differ");
    }
    assert!(!place.names().iter().any(|name| name.contains(".part") || name.contains(".tmp")));
}

/// All channels of a picture.
fn layers(path: &Path) -> AnyChannels<FlatSamples> {
    read_first_flat_layer_from_file(path).unwrap().layer_data.channel_data
}

#[test]
fn layers_for_denoisers_merge_to_the_bits_of_the_whole() {
    let place = Place::new();
    // Sharp gloss, which is looked through, and split hits, of which one ray is followed.
    let aovs = "--aov albedo,normal,depth,variance";
    let flags = &format!("{aovs} -D materials.shiny.exponent=100000 --glossy-samples 3 -q");
    let ran = place.gloss(&format!(
        "render scene.toml -o whole.exr --checkpoint whole.state.exr --adaptive=false {flags}"
    ));
    assert_eq!(ran.code, 0, "{}", ran.err);
    let whole = Checkpoint::read(&place.path("whole.state.exr")).unwrap();
    assert_eq!(layers(&place.path("whole.exr")).list.len(), 3 + 3 + 3 + 1 + 3);
    for by in ["samples", "tiles"] {
        let mut files = String::new();
        for index in 0..3 {
            let name = format!("{by}-{index}.exr");
            let ran = place
                .gloss(&format!("render scene.toml -o {name} --shard {index}/3 --shard-by {by} {flags}"));
            assert_eq!(ran.code, 0, "{}", ran.err);
            files.push_str(&name);
            files.push(' ');
        }
        let _ = std::fs::remove_file(place.path("merged.state.exr"));
        let ran = place.gloss(&format!("merge -o merged.exr --checkpoint merged.state.exr {files}"));
        assert_eq!(ran.code, 0, "{}", ran.err);
        assert_eq!(Checkpoint::read(&place.path("merged.state.exr")).unwrap().film, whole.film, "by {by}");
        assert!(layers(&place.path("merged.exr")) == layers(&place.path("whole.exr")), "by {by}");
    }
    let ran = place.gloss(&format!("render scene.toml -o plain.exr --shard 1/3 {}", flags.replace(aovs, "")));
    assert_eq!(ran.code, 0, "{}", ran.err);
    let ran = place.gloss("merge -o mixed.exr samples-0.exr plain.exr samples-2.exr");
    assert!(ran.code == 2 && ran.err.contains("aovs: "), "{}", ran.err);
}

#[test]
fn a_merge_says_what_is_missing_and_refuses_what_does_not_fit() {
    let place = Place::new();
    for index in [0, 2] {
        let ran = place.gloss(&format!("render scene.toml -o {index}.exr --shard {index}/3 -q"));
        assert_eq!(ran.code, 0, "{}", ran.err);
    }
    let ran = place.gloss("merge -o merged.png 0.exr 2.exr");
    assert_eq!(ran.code, 1);
    assert!(ran.err.contains("shard 1/3, samples 21 to 42 is in none of the files"), "{}", ran.err);
    assert!(!place.path("merged.png").exists());
    assert_eq!(place.gloss("merge -o merged.png 0.exr 2.exr --partial").code, 0);

    place.gloss("render scene.toml -o other.exr --shard 1/3 -q --max-depth 1");
    let ran = place.gloss("merge -o merged.png 0.exr other.exr 2.exr");
    assert_eq!(ran.code, 2);
    assert!(ran.err.contains("max_depth: 3 in the file, 1 now"), "{}", ran.err);
}

#[test]
fn a_finished_shard_is_left_alone_and_two_attempts_do_no_harm() {
    let place = Place::new();
    let shard = "render scene.toml -o 1.exr --shard 1/2";
    let attempts = [0; 3].map(|_| place.start(shard));
    for attempt in attempts {
        let ran = Ran::from(attempt.wait_with_output().unwrap());
        assert_eq!(ran.code, 0, "{}", ran.err);
    }
    let first = std::fs::read(place.path("1.exr")).unwrap();
    let ran = place.gloss(shard);
    assert!(ran.code == 0 && ran.err.contains("this shard is finished"), "{}", ran.err);
    assert!(std::fs::read(place.path("1.exr")).unwrap() == first, "a finished file was written again");

    let ran = place.gloss("render scene.toml -o 1.exr --shard 0/2");
    assert!(ran.code == 2 && ran.err.contains("part: shard 1/2"), "{}", ran.err);
    let task = [("SLURM_ARRAY_TASK_ID", "0"), ("SLURM_ARRAY_TASK_MIN", "0"), ("SLURM_ARRAY_TASK_MAX", "1")];
    let ran = place.command("render scene.toml -o 0.exr --shard auto -q").envs(task).status().unwrap();
    assert!(ran.success());
    let ran = place.gloss("merge -o merged.png 0.exr 1.exr");
    assert_eq!(ran.code, 0, "{}", ran.err);
}

#[test]
fn a_share_says_that_its_samples_are_even_where_they_would_not_be() {
    let place = Place::new();
    let told = |flags: &str, file: &str| {
        let ran = place.gloss(&format!("render scene.toml -o {file} --shard 0/2 {flags}"));
        assert_eq!(ran.code, 0, "{}", ran.err);
        ran.err.contains("as many samples as the others")
    };
    assert!(told("", "a.exr"));
    assert!(!told("-D settings.adaptive=false", "b.exr") && !told("--adaptive=false", "c.exr"));
    assert!(!told("--spp 3", "d.exr") && !told("--seed 1 -q", "e.exr"));
}

#[test]
fn a_share_that_hangs_on_the_others_is_refused() {
    let place = Place::new();
    for (flag, why) in [("--noise 0.1", "cannot be used with"), ("--adaptive=true", "leave --adaptive out")] {
        let ran = place.gloss(&format!("render scene.toml -o c.exr --shard 0/2 {flag}"));
        assert!(ran.code == 2 && ran.err.contains(why), "{}", ran.err);
    }
}

#[test]
fn every_share_splits_as_the_whole_does() {
    let place = Place::new();
    // A lobe so wide that splitting is worth it.
    let flags = "-D materials.shiny.exponent=5 --adaptive=false --progress json";
    let split = |ran: &Ran| {
        assert_eq!(ran.code, 0, "{}", ran.err);
        let last = ran.err.lines().last().unwrap_or_default();
        serde_json::from_str::<serde_json::Value>(last).unwrap()["split"].as_u64().unwrap()
    };
    let whole =
        place.gloss(&format!("render scene.toml -o whole.exr --checkpoint whole.state.exr --spp 8 {flags}"));
    assert!(split(&whole) > 1, "{}", whole.err);
    for (file, share) in [("a.exr", "0/2"), ("b.exr", "1/2"), ("c.exr", "1/3 --shard-by tiles")] {
        let ran = place.gloss(&format!("render scene.toml -o {file} --shard {share} --spp 8 {flags}"));
        assert_eq!(split(&ran), split(&whole), "{share}");
    }
}
