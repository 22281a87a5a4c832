//! What shortcuts cost: a made-up renderer whose costs and errors are known, and the real one.

use gloss::core::{Rgb, sampler::hash};
use gloss::scene::load::{Format, load_str};
use gloss::trade::findings::{About, Verdict};
use gloss::trade::run::{Listener, REFERENCE_SHOTS};
use gloss::trade::state::Cost;
use gloss::trade::way::Claim;
use gloss::trade::{
    Catalogue, Engine, Findings, Knob, Options, Shot, State, Stopped, Target, Task, Way, Workbench,
};
use gloss::trade::{catalogue, csv, page, run, text};
use std::path::Path;
use std::time::Duration;

const SCENE: &str = r#"
[camera]
eye = [0, 0, 5]
look_at = [0, 0, 0]
resolution = [48, 32]

[environment]
type = "constant"
radiance = 1

[materials.shiny]
type = "cosine-power"
exponent = 100

[[shapes]]
type = "sphere"
radius = 1
material = "shiny"
"#;

/// How a made-up way is: what its pictures cost and how they err, per sample.
#[derive(Clone, Copy)]
struct Law {
    seconds: f64,
    deviation: f32,
    bias: f32,
}

/// Pictures of known noise, bias and cost, by a clock of its own.
struct MadeUp {
    now: f64,
    laws: Vec<(&'static str, Law)>,
    /// Tells it to stop after so many pictures.
    left: usize,
    /// Costs vary by this fraction, as on a noisy machine.
    jitter: f64,
}

const SIZE: [u32; 2] = [40, 25];

fn unit(x: u32) -> f32 {
    (hash(x) >> 8) as f32 / (1 << 24) as f32
}

impl MadeUp {
    fn new() -> Self {
        let law = |seconds, deviation, bias| Law { seconds, deviation, bias };
        let laws = vec![
            ("base", law(1e-3, 2.0, 0.0)),
            ("fast", law(2e-4, 2.0, 0.05)),
            ("clever", law(2e-3, 1.0, 0.0)),
            ("bad", law(4e-3, 3.0, 0.0)),
        ];
        Self { now: 100.0, laws, left: usize::MAX, jitter: 0.1 }
    }

    fn catalogue(&self) -> Catalogue {
        let way = |(name, law): &(&str, Law)| Way {
            name: (*name).to_owned(),
            settings: vec![],
            engine: Engine::default(),
            spp: 16,
            noise: None,
            claim: if law.bias > 0.0 { Claim::Biased } else { Claim::Unbiased },
        };
        Catalogue { ways: self.laws.iter().map(way).collect(), knobs: vec![], left_out: vec![] }
    }
}

impl Workbench for MadeUp {
    fn shoot(&mut self, task: &Task<'_>) -> Result<Option<Shot>, String> {
        if self.left == 0 {
            return Ok(None);
        }
        self.left -= 1;
        let law = self.laws.iter().find(|(name, _)| *name == task.way.name).expect("it is in the list").1;
        let spread = law.deviation / (task.spp as f32).sqrt() * 12f32.sqrt();
        let channel = |i: u32| {
            let noise = spread
                * (unit(
                    hash(task.seed ^ hash(task.way.name.len() as u32))
                        .wrapping_add(i.wrapping_mul(0x9e37_79b9)),
                ) - 0.5);
            1.0 + law.bias + 0.1 * noise
        };
        let pixels =
            (0..SIZE[0] * SIZE[1]).map(|i| Rgb::new(channel(3 * i), channel(3 * i + 1), channel(3 * i + 2)));
        let jitter = 1.0 + self.jitter * (2.0 * f64::from(unit(task.seed ^ 77)) - 1.0);
        let seconds = law.seconds * f64::from(task.spp) * jitter;
        self.now += seconds;
        let cost =
            Cost { cpu_seconds: seconds, wall_seconds: seconds, spp: f64::from(task.spp), ..Cost::default() };
        Ok(Some(Shot { pixels: pixels.collect(), cost }))
    }

    fn seconds(&self) -> f64 {
        self.now
    }
}

/// Counts what is kept, and keeps the last.
#[derive(Default)]
struct Ear {
    told: Vec<String>,
    kept: Vec<State>,
}

impl Listener for Ear {
    fn tell(&mut self, line: &str) {
        self.told.push(line.to_owned());
    }

    fn keep(&mut self, state: &State) -> Result<(), String> {
        self.kept.push(state.clone());
        Ok(())
    }
}

const OPTIONS: Options = Options { rounds: 8, time: None, reference_spp: 1024, seed: 0 };

fn about() -> About {
    About { scene: "made <up>".into(), full_resolution: [400, 250], ..About::default() }
}

fn measured(seed: u32) -> (State, Findings) {
    let mut bench = MadeUp::new();
    let mut state = State::new("made up".into(), SIZE, bench.catalogue());
    let stopped = run(&mut state, &Options { seed, ..OPTIONS }, &mut bench, &mut Ear::default());
    assert_eq!(stopped, Ok(Stopped::Rounds));
    let targets = [Target::Error(1e-4), Target::Error(0.5), Target::Time(300.0)];
    let findings = Findings::of(&state, &about(), &targets).expect("there are rounds");
    (state, findings)
}

#[test]
fn costs_noise_and_bias_are_found_as_they_were_made_up() {
    let (_, found) = measured(0);
    let weight = 1.01f64.powi(-2);
    for (f, (name, law)) in found.ways.iter().zip(MadeUp::new().laws) {
        let noise = weight * (0.1 * f64::from(law.deviation)).powi(2) / 16.0;
        assert!((f.errors.noise.value / noise - 1.0).abs() < 0.05, "{name}: {:?}", f.errors);
        let bias = weight * f64::from(law.bias).powi(2);
        assert!(f.errors.bias.low <= bias && bias <= f.errors.bias.high, "{name}: {:?}", f.errors);
        let verdict = if law.bias > 0.0 { Verdict::Floor } else { Verdict::Unbiased };
        assert_eq!(f.verdict, verdict, "{name}");
        let seconds = 16.0 * law.seconds;
        // A 95 % interval of 8 measurements reaches 2.36 standard errors.
        let mean = f.cpu_seconds.mean;
        let standard_error = 0.5 * (mean.high - mean.low) / 2.36;
        assert!((mean.value - seconds).abs() < 5.0 * standard_error, "{name}: {mean:?}");
        assert!((f.errors.brightness.value - f64::from(law.bias)).abs() < 2e-3, "{name}");
    }
    assert!((found.ways[2].relative_efficiency - 2.0).abs() < 0.3, "{}", found.ways[2].relative_efficiency);
    // At 16 samples even the bias of the fast way is less than the bad one's noise; nobody beats the fast way in time.
    assert_eq!(found.ways.iter().map(|f| f.dominated_by).collect::<Vec<_>>(), [None, None, None, Some(1)]);
    assert_eq!(found.ways.iter().map(|f| f.on_front).collect::<Vec<_>>(), [true, true, true, false]);
}

#[test]
fn two_runs_agree_within_their_intervals() {
    let [(_, a), (_, b)] = [1, 2].map(measured);
    for (a, b) in a.ways.iter().zip(&b.ways) {
        let pairs = [
            (a.cpu_seconds.mean, b.cpu_seconds.mean),
            (a.errors.relmse, b.errors.relmse),
            (a.errors.noise, b.errors.noise),
            (a.errors.bias, b.errors.bias),
        ];
        for (number, (x, y)) in pairs.iter().enumerate() {
            assert!(x.agrees(y), "{} {number}: {x:?} {y:?}", a.way.name);
        }
    }
}

#[test]
fn advice_is_the_best_of_the_made_up_ways() {
    let (_, found) = measured(3);
    // 1e-4 lies below the bias of the fast way: of the others the clever one is twice as good as the base.
    let exact = &found.advice[0];
    assert_eq!(exact.name, "clever");
    // The noise may be larger than its mean was: some samples are added for that.
    let spp = 0.01 / 1.01f64.powi(2) / 1e-4;
    let more = f64::from(exact.spp) / spp;
    assert!(more > 0.99 && more < 1.25, "{exact:?}");
    assert!((exact.seconds / (f64::from(exact.spp) * 2e-3 * 100.0) - 1.0).abs() < 0.1, "{exact:?}");
    assert!((exact.times_the_base.unwrap() - 2.0).abs() < 0.3, "{exact:?}");
    // A large error allows the bias; a long time does not.
    assert_eq!((&*found.advice[1].name, found.advice[1].spp), ("fast", 1));
    assert_eq!(found.advice[2].name, "clever");
    let taken = found.advice[2].seconds;
    assert!(taken <= 300.0 && taken > 290.0, "{taken}");
    assert!(found.advise(Target::Time(1e-9), 1e6).is_none());
}

#[test]
fn a_run_that_was_broken_off_goes_on_as_if_it_had_not_been() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run.state");
    let (whole, _) = measured(0);
    for left in [1, 5, REFERENCE_SHOTS as usize + 6] {
        let mut bench = MadeUp { left, ..MadeUp::new() };
        let mut state = State::new("made up".into(), SIZE, bench.catalogue());
        assert_eq!(run(&mut state, &OPTIONS, &mut bench, &mut Ear::default()), Ok(Stopped::Interrupted));
        state.write(&path).unwrap();
        let mut again = State::read(&path).unwrap();
        assert_eq!(again, state, "what is read is what was written");
        assert_eq!(run(&mut again, &OPTIONS, &mut MadeUp::new(), &mut Ear::default()), Ok(Stopped::Rounds));
        again.seconds = whole.seconds;
        assert_eq!(again, whole, "after {left} pictures");
    }
    std::fs::write(&path, "{}\n").unwrap();
    assert!(State::read(&path).unwrap_err().contains("not the state"));
}

#[test]
fn the_time_bounds_the_run_and_each_step_is_told_and_kept() {
    let mut bench = MadeUp::new();
    let mut state = State::new("made up".into(), SIZE, bench.catalogue());
    let mut ear = Ear::default();
    // The reference takes 1 s, a round 0.12 s.
    let options = Options { rounds: 1000, time: Some(Duration::from_secs(3)), ..OPTIONS };
    assert_eq!(run(&mut state, &options, &mut bench, &mut ear), Ok(Stopped::Time));
    assert!(state.seconds <= 3.0 && state.seconds > 2.6, "{}", state.seconds);
    assert!(state.rounds > 10 && state.rounds < 20, "{}", state.rounds);
    assert_eq!(ear.kept.len(), (REFERENCE_SHOTS + state.rounds + 1) as usize);
    assert_eq!(ear.told[0], "reference: 1 of 8, 128 spp");
    assert!(ear.told.iter().any(|line| line == "round 1 of 1000, 1 of 4: base"), "{:?}", ear.told);
    // However short the time, noise and bias can be told apart.
    let mut state = State::new("made up".into(), SIZE, bench.catalogue());
    let options = Options { time: Some(Duration::ZERO), ..options };
    assert_eq!(run(&mut state, &options, &mut bench, &mut ear), Ok(Stopped::Time));
    assert_eq!((state.rounds, state.reference_spp), (2, 256));
}

#[test]
fn reports_say_what_was_found_and_hold_no_markup_of_others() {
    let (state, found) = measured(0);
    let table = csv::to_csv(&found);
    let columns: Vec<usize> = table.lines().map(|line| line.split(',').count()).collect();
    assert_eq!(columns, [columns[0]; 5], "{table}");
    let told = text::to_text(&found);
    assert!(told.contains("for a relMSE of 0.0001: clever with"), "{told}");
    assert_eq!(told.lines().filter(|line| line.contains(" |")).count(), 16, "{told}");
    let html = page::to_html(&found, &state, "gloss trade '<x>'", 0.0);
    assert!(html.contains("made &lt;up&gt;") && !html.contains("made <up>"));
    assert!(!html.contains("NaN") && !html.contains("inf,"));
    let json = html.split("id=\"findings\">").nth(1).unwrap().split("</script>").next().unwrap();
    let again: Findings = serde_json::from_str(&json.replace("\\u003c", "<")).unwrap();
    assert_eq!(again, found, "the page holds all findings");
}

#[test]
fn knobs_that_turn_nothing_are_left_out_and_ways_are_measured_once() {
    let catalogue_of = |text: &str| {
        let scene = load_str(text, Format::Toml, Path::new("."), &[]).unwrap();
        let base = catalogue::base(&scene, Engine::default(), 16);
        Catalogue::new(&scene, &base, &Knob::ALL)
    };
    let glossy = catalogue_of(SCENE);
    assert!(glossy.ways.len() > 25, "{}", glossy.ways.len());
    for (i, a) in glossy.ways.iter().enumerate() {
        assert!(glossy.ways[..i].iter().all(|b| !a.is_same(b)), "{}", a.name);
    }
    for turned in &glossy.knobs {
        assert!(turned.choices.len() > 1 && turned.choices.iter().all(|c| c.way < glossy.ways.len()));
        // The ends are those of other depths, samples of lights are those of hits that split, and the base leaves the horizon to
        // the scene.
        let is_apart = [Knob::End, Knob::LightSamples, Knob::Horizon].contains(&turned.knob);
        assert!(is_apart || turned.choices.iter().any(|c| c.way == 0), "{:?}", turned.knob);
    }
    let split = &glossy.knobs.iter().find(|t| t.knob == Knob::Split).unwrap().choices;
    let names: Vec<&str> = split.iter().map(|c| &*c.name).collect();
    assert_eq!(names, ["1x16", "2x8", "4x4", "8x2", "16x1", "auto"]);

    let dull = catalogue_of(&SCENE.replace("cosine-power", "diffuse").replace("exponent = 100", ""));
    for knob in [Knob::Split, Knob::Horizon, Knob::Occlusion] {
        assert!(dull.left_out.iter().any(|left| left.knob == knob && left.choice.is_none()), "{knob:?}");
    }
    let dark = catalogue_of(&SCENE.replace("[environment]\ntype = \"constant\"\nradiance = 1", ""));
    let why = dark.left_out.iter().find(|left| left.knob == Knob::Occlusion).unwrap();
    assert_eq!(why.why, "there is no environment");
    let off = catalogue_of(&format!("settings = {{ guiding = false, portals = false }}\n{SCENE}"));
    for knob in [Knob::Guiding, Knob::Portals] {
        let why = |from: &Catalogue| from.left_out.iter().find(|left| left.knob == knob).unwrap().why.clone();
        assert_eq!(why(&off), "the scene turns it off");
        assert_ne!(why(&glossy), "the scene turns it off");
    }
}
