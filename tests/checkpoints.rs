//! Pictures that are broken off, killed and gone on with, to the bit.

mod common;

use common::place::{Place, Ran, SCENE};
use gloss::accel::{self, Backend, BuildOptions};
use gloss::farm::Checkpoint;
use gloss::film::PixelRect;
use gloss::image_io::read_image;
use gloss::render::{Outcome, Progress, RenderOptions, Silent, State, StopReason, render};
use gloss::scene::{Format, Scene, load_str};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

/// Waits until the program listens to SIGUSR1, which would end it before.
#[cfg(target_os = "linux")]
fn wait_until_it_listens(child: &Child) {
    const USR1: u64 = 1 << 9;
    let started = Instant::now();
    loop {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
        if u64::from_str_radix(caught.trim(), 16).unwrap() & USR1 != 0 {
            return;
        }
        assert!(started.elapsed() < Duration::from_secs(60), "the program does not listen");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Whether the programs that this one starts go on when their terminal is gone, as under `nohup`.
#[cfg(target_os = "linux")]
fn ignores_hangups() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap();
    u64::from_str_radix(ignored.trim(), 16).unwrap() & 1 == 1
}

/// Waits for a file that can be read.
fn wait_for(path: &Path) -> Checkpoint {
    let started = Instant::now();
    loop {
        if let Ok(checkpoint) = Checkpoint::read(path) {
            return checkpoint;
        }
        assert!(started.elapsed() < Duration::from_secs(60), "{} does not come", path.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn samples(checkpoint: &Checkpoint) -> u64 {
    checkpoint.film.pixels.iter().map(|pixel| u64::from(pixel.count)).sum()
}

#[cfg(target_os = "linux")]
#[test]
fn a_terminated_render_goes_on_to_the_same_bits() {
    let place = Place::new();
    let flags = "--spp 1000 --threads 1 --tile-size 8";
    let render =
        format!("render scene.toml -o a.png --checkpoint a.exr --resume --checkpoint-every 10ms {flags}");
    let mut done = 0;
    for name in ["TERM", "HUP"] {
        if name == "HUP" && ignores_hangups() {
            continue;
        }
        let child = place.start(&render);
        while samples(&wait_for(&place.path("a.exr"))) <= done {
            std::thread::sleep(Duration::from_millis(5));
        }
        signal(&child, name);
        let ran = Ran::from(child.wait_with_output().unwrap());
        assert_eq!(ran.code, 75, "{name}: {}", ran.err);
        assert!(ran.err.contains("a.exr has all of it"), "{name}: {}", ran.err);
        done = samples(&wait_for(&place.path("a.exr")));
    }
    let broken_off = Checkpoint::read(&place.path("a.exr")).unwrap();
    assert!(!broken_off.header.is_finished() && !place.path("a.png").exists());

    // Another checkpoint on demand, although the interval is long.
    let rare = render.replace("10ms", "1h");
    let child = place.start(&rare);
    wait_until_it_listens(&child);
    let started = Instant::now();
    let after_signal = loop {
        signal(&child, "USR1");
        std::thread::sleep(Duration::from_millis(20));
        let now = Checkpoint::read(&place.path("a.exr")).unwrap();
        if samples(&now) > samples(&broken_off) {
            break now;
        }
        assert!(started.elapsed() < Duration::from_secs(60), "no checkpoint on demand");
    };
    assert!(!after_signal.header.is_finished());
    assert_eq!(Ran::from(child.wait_with_output().unwrap()).code, 0);
    let finished = Checkpoint::read(&place.path("a.exr")).unwrap();
    assert_eq!(finished.film.pixels, place.whole(flags).film.pixels);
}

#[test]
fn a_finished_render_takes_more_samples() {
    let place = Place::new();
    let render = |spp: u32| {
        place.gloss(&format!("render scene.toml -o a.png --checkpoint a.exr --resume --spp {spp}"))
    };
    assert_eq!((render(5).code, render(23).code), (0, 0));
    let grown = Checkpoint::read(&place.path("a.exr")).unwrap();
    assert_eq!(grown.film.pixels, place.whole("--spp 23").film.pixels);
    assert_eq!(grown.header.tally.samples, 23 * 48 * 32);
    let ran = render(6);
    assert!(ran.code == 2 && ran.err.contains("samples per pixel: 23 in the file, 6 now"), "{}", ran.err);
}

#[test]
fn layers_for_denoisers_are_kept_and_grow() {
    let place = Place::new();
    let render = |flags: &str| {
        place.gloss(&format!("render scene.toml -o a.exr --checkpoint a.state.exr --resume -q {flags}"))
    };
    let aovs = "--aov albedo,normal,depth,variance";
    let first = render(&format!("{aovs} --spp 5"));
    assert_eq!(first.code, 0, "{}", first.err);
    let ran = render("--aov albedo --spp 40");
    assert!(ran.code == 2 && ran.err.contains("aovs: "), "{}", ran.err);
    assert_eq!(render(&format!("{aovs} --spp 40")).code, 0);
    let grown = Checkpoint::read(&place.path("a.state.exr")).unwrap();
    assert!(grown.film.guides.iter().any(|guide| guide.met > 40), "samples are shared out");
    let whole = place
        .gloss(&format!("render scene.toml -o whole.exr --checkpoint whole.state.exr -q {aovs} --spp 40"));
    assert_eq!(whole.code, 0, "{}", whole.err);
    assert_eq!(grown.film, Checkpoint::read(&place.path("whole.state.exr")).unwrap().film);
}

#[test]
fn another_pictures_checkpoint_and_a_damaged_one_are_refused() {
    let place = Place::new();
    place.whole("");
    let again = "render scene.toml -o again.png --checkpoint whole.exr";
    let ran = place.gloss(again);
    assert!(ran.code == 2 && ran.err.contains("add --resume"), "{}", ran.err);
    for (flags, difference) in [
        ("--seed 5", "seed: 0 in the file, 5 now"),
        ("-D materials.shiny.exponent=21", "scene.toml or a file that it names has changed"),
        ("--resolution 48x31", "resolution: 48 x 32 in the file, 48 x 31 now"),
        ("--backend brute", "backend: "),
    ] {
        let ran = place.gloss(&format!("{again} --resume {flags}"));
        assert!(ran.code == 2 && ran.err.contains(difference), "{flags}: {}", ran.err);
    }
    let bytes = std::fs::read(place.path("whole.exr")).unwrap();
    for length in [0, 4, 1000, bytes.len() - 100] {
        std::fs::write(place.path("whole.exr"), &bytes[..length]).unwrap();
        let ran = place.gloss(&format!("{again} --resume"));
        assert!(
            ran.code == 2 && ran.err.starts_with("error: ") && ran.err.contains("whole.exr"),
            "{}",
            ran.err
        );
    }
    assert!(!place.path("again.png").exists());
}

/// Numbers that look random: xorshift.
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % end
    }
}

#[test]
fn a_hundred_kills_lose_nothing_that_was_written() {
    let place = Place::new();
    let flags = "--spp 3000 --threads 1 --resolution 24x16";
    let render =
        format!("render scene.toml -o a.png --checkpoint a.exr --resume --checkpoint-every 5ms -q {flags}");
    let (mut dice, mut kills, mut most) = (Dice(0x9e37_79b9_7f4a_7c15), 0, 0);
    while kills < 100 {
        let mut child = place.start(&render);
        std::thread::sleep(Duration::from_millis(10 + dice.below(60)));
        if child.try_wait().unwrap().is_some() {
            // Finished: what a finished file is must stay so, and the next picture begins.
            let done = Checkpoint::read(&place.path("a.exr")).unwrap();
            assert!(done.header.is_finished());
            assert!(read_image(&place.path("a.png")).is_ok());
            std::fs::remove_file(place.path("a.exr")).unwrap();
            most = 0;
            continue;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        kills += 1;
        // Whole or not there; and never less than was there before.
        if place.path("a.exr").exists() {
            let kept = samples(&Checkpoint::read(&place.path("a.exr")).unwrap());
            assert!(kept >= most, "kill {kills}: {kept} samples after {most}");
            most = kept;
        }
    }
    let ran = place.gloss(&render);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let survivor = Checkpoint::read(&place.path("a.exr")).unwrap();
    assert_eq!(survivor.film.pixels, place.whole(flags).film.pixels);
}

#[test]
fn a_full_disk_leaves_the_old_files_as_they_were() {
    let place = Place::new();
    let disk = place.path("disk");
    std::fs::create_dir(&disk).unwrap();
    let mounted = |arguments: &[&str]| {
        let status = Command::new("mount").args(arguments).arg(&disk).stderr(Stdio::null()).status();
        status.is_ok_and(|status| status.success())
    };
    if !mounted(&["-t", "tmpfs", "-o", "size=24k", "tmpfs"]) {
        eprintln!("skipped: it takes root to mount a small disk");
        return;
    }
    let result = std::panic::catch_unwind(|| {
        std::fs::write(disk.join("a.png"), "old").unwrap();
        std::fs::write(disk.join("a.exr"), "old").unwrap();
        for output in ["disk/a.png", "disk/a.exr"] {
            let ran = place.gloss(&format!("render scene.toml -o {output} --resolution 300x200 --spp 1"));
            assert!(ran.code == 1 && ran.err.contains("No space left"), "{output}: {}", ran.err);
        }
        let sheet = "render scene.toml -o b.png --resolution 300x200 --spp 1 --checkpoint disk/b.exr";
        let ran = place.gloss(sheet);
        assert!(ran.code == 1 && ran.err.contains("No space left"), "{}", ran.err);
        let mut names: Vec<_> = std::fs::read_dir(&disk).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["a.exr", "a.png"]);
        assert!(std::fs::read(disk.join("a.png")).unwrap() == b"old");

        assert!(mounted(&["-o", "remount,ro"]));
        let ran = place.gloss("render scene.toml -o disk/a.png");
        assert!(ran.code == 1 && ran.err.contains("disk is not writable"), "{}", ran.err);
    });
    assert!(Command::new("umount").arg(&disk).status().unwrap().success());
    result.unwrap();
}

#[test]
fn a_render_stops_by_time_or_noise_and_says_so() {
    let place = Place::new();
    let ran = place.gloss("render scene.toml -o a.png --checkpoint a.exr --spp 1000000000 --time 100ms");
    assert!(ran.code == 0 && ran.err.contains("spp by the end of the time"), "{}", ran.err);
    assert!(!Checkpoint::read(&place.path("a.exr")).unwrap().header.is_finished());
    let noise = "render scene.toml -o b.png --checkpoint b.exr --spp 5000";
    let ran = place.gloss(&format!("{noise} --noise 0.1"));
    assert!(ran.code == 0 && ran.err.contains("spp to the noise asked for"), "{}", ran.err);
    let kept = Checkpoint::read(&place.path("b.exr")).unwrap();
    assert!(kept.header.is_finished() && kept.film.pixels.iter().all(|pixel| pixel.count < 5000));
    let ran = place.gloss(&format!("{noise} --noise 0.2 --resume"));
    assert!(ran.code == 2 && ran.err.contains("noise threshold: 0.1 in the file, 0.2 now"), "{}", ran.err);
}

/// A scene with the settings of a text.
fn scene(settings: &str) -> Scene {
    let text = SCENE.replace("spp = 64, max_depth = 3", settings);
    load_str(&text, Format::Toml, Path::new(""), &[]).unwrap()
}

/// Stops a render after so many tiles, and keeps the state of that moment.
struct Breaker<'a> {
    left: Mutex<u32>,
    kept: Mutex<Option<State>>,
    stop: &'a AtomicBool,
}

impl Progress for Breaker<'_> {
    fn advance(&self, _: u64, _: u64) {}

    fn state(&self, state: &State) {
        let mut left = self.left.lock().unwrap();
        if *left == 0 {
            return;
        }
        *left -= 1;
        if *left == 0 {
            *self.kept.lock().unwrap() = Some(state.clone());
            self.stop.store(true, Ordering::Relaxed);
        }
    }
}

/// Renders with a break after each so many tiles, as if it were killed: all that goes on is what was kept, through
/// JSON as a file does it.
fn render_in_pieces(scene: &Scene, options: &RenderOptions<'_>, tiles: u32) -> (Outcome, u32) {
    let accel = accel::build(Backend::Brute, &scene.shapes, &BuildOptions::default()).unwrap();
    let mut resume = None;
    for pieces in 1.. {
        let stop = AtomicBool::new(false);
        let breaker = Breaker { left: Mutex::new(tiles), kept: Mutex::new(None), stop: &stop };
        let options = RenderOptions { resume: resume.clone(), ..options.clone() };
        let outcome = render(scene, &*accel, &options, &breaker, &stop);
        if outcome.stopped_by != StopReason::Interrupted {
            return (outcome, pieces);
        }
        let kept: State = breaker.kept.into_inner().unwrap().unwrap();
        let decisions = serde_json::from_str(&serde_json::to_string(&kept.decisions).unwrap()).unwrap();
        resume = Some(State { decisions, ..kept });
    }
    unreachable!("the loop ends by the render's end")
}

fn unbroken(scene: &Scene, options: &RenderOptions<'_>) -> Outcome {
    let accel = accel::build(Backend::Brute, &scene.shapes, &BuildOptions::default()).unwrap();
    render(scene, &*accel, options, &Silent, &AtomicBool::new(false))
}

#[test]
fn a_tile_of_many_samples_is_kept_in_parts() {
    let scene = scene("spp = 1000, max_depth = 1, adaptive = false");
    let crop = Some(PixelRect { x0: 0, y0: 0, x1: 4, y1: 4 });
    let options = RenderOptions { threads: 1, crop, ..Default::default() };
    let (outcome, pieces) = render_in_pieces(&scene, &options, 1);
    assert!(pieces > 3, "{pieces}");
    assert_eq!(outcome.film.pixels, unbroken(&scene, &options).film.pixels);
}

#[test]
fn splitting_by_a_pilot_goes_on_to_the_same_bits() {
    // A lobe so wide that splitting is worth it.
    let text = SCENE.replace("spp = 64", "spp = 12").replace("exponent = 20", "exponent = 5");
    let scene = load_str(&text, Format::Toml, Path::new(""), &[]).unwrap();
    let options = RenderOptions { threads: 2, tile_size: 8, ..Default::default() };
    let whole = unbroken(&scene, &options);
    assert!(whole.split > 1, "the pilot finds that splitting is worth it");
    for tiles in [1, 4, 5] {
        let (outcome, pieces) = render_in_pieces(&scene, &options, tiles);
        assert!(pieces > 2);
        assert_eq!(outcome.film.pixels, whole.film.pixels, "a break after each {tiles} tiles");
    }
}

#[test]
fn a_threshold_goes_on_to_the_same_bits() {
    for glossy_samples in ["1", "\"auto\""] {
        let settings = format!("spp = 1000, max_depth = 3, glossy_samples = {glossy_samples}");
        let scene = scene(&settings);
        let options = RenderOptions { noise: Some(0.025), threads: 2, ..Default::default() };
        let whole = unbroken(&scene, &options);
        assert_eq!(whole.stopped_by, StopReason::Noise);
        let counts: std::collections::BTreeSet<_> = whole.film.pixels.iter().map(|p| p.count).collect();
        assert!(counts.len() > 1, "blocks are done at different times: {counts:?}");
        for tiles in [1, 5] {
            let (outcome, pieces) = render_in_pieces(&scene, &options, tiles);
            assert!(pieces > 4);
            assert_eq!(outcome.film.pixels, whole.film.pixels, "a break after each {tiles} tiles");
        }
    }
}

#[test]
fn samples_that_are_shared_out_go_on_to_the_same_bits() {
    for glossy_samples in ["1", "\"auto\""] {
        let settings = format!(
            "spp = 32, max_depth = 3, adaptive = true, aovs = [\"depth\"], glossy_samples = {glossy_samples}"
        );
        let scene = scene(&settings);
        let options = RenderOptions { threads: 2, ..Default::default() };
        let whole = unbroken(&scene, &options);
        let counts: std::collections::BTreeSet<_> = whole.film.pixels.iter().map(|p| p.count).collect();
        assert!(counts.len() > 2, "{counts:?}");
        for tiles in [1, 5] {
            let (outcome, pieces) = render_in_pieces(&scene, &options, tiles);
            assert!(pieces > 2);
            assert_eq!(outcome.film, whole.film, "a break after each {tiles} tiles");
        }
    }
}
