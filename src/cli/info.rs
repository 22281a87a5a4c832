//! `gloss info`: what a scene is, checked, without rendering it.

use super::exit::{Exit, Failure};
use super::scene_args::SceneArgs;
use super::settings;
use super::terminal::{bytes, print, print_json};
use crate::film::Film;
use crate::geometry::Aabb;
use crate::scene::{Environment, Light, Material, Plan, Scene, Specular};
use serde_json::{Value, json};
use std::fmt::Write;

/// Check a scene and say what is in it
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Loads the scene as `gloss render` would, with the same checks, and stops there.

Exit codes: 0 the scene is good, 2 it is not.

Examples:
  gloss info scenes/lemon.toml
  gloss info scenes/lemon.toml --preset lecture --json")]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,

    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Loads, checks and tells.
pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let scene = args.scene.load()?;
    let inventory = Inventory::of(&scene);
    if args.json {
        return print_json(&inventory.to_json());
    }
    print(&inventory.to_text(&args.scene.scene.display().to_string()))?;
    Ok(Exit::Done)
}

/// What there is to tell.
struct Inventory<'a> {
    scene: &'a Scene,
    plan: Plan,
    /// Least and greatest corner in the scene's own coordinates, if anything can be hit.
    bounds: Option<[[f64; 3]; 2]>,
}

impl<'a> Inventory<'a> {
    fn of(scene: &'a Scene) -> Self {
        let bounds = scene.shapes.iter().fold(Aabb::EMPTY, |all, shape| all.union(shape.bounds()));
        let corner = |p| scene.world.to_scene(p).to_array();
        let bounds = (!bounds.is_empty()).then(|| [corner(bounds.min), corner(bounds.max)]);
        Self { scene, plan: Plan::of(scene), bounds }
    }

    fn to_text(&self, path: &str) -> String {
        let Self { scene, plan, bounds } = self;
        let [width, height] = scene.camera.resolution;
        let mut text = String::new();
        let mut line = |name: &str, what: String| {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{name:<12}{what}");
        };
        line("scene", format!("{path} ({})", scene.hash.get(..16).unwrap_or(&scene.hash)));
        line("picture", format!("{width} x {height} pixels"));
        line(
            "shapes",
            format!("{}: {} triangles, {} spheres", scene.shapes.len(), plan.triangles, plan.spheres),
        );
        line(
            "bounds",
            bounds.map_or_else(
                || "nothing can be hit".to_owned(),
                |[min, max]| format!("{} to {}", point(min), point(max)),
            ),
        );
        let (shapes, film) = (bytes(plan.shape_bytes as u64), bytes(self.film_bytes()));
        line("memory", format!("{shapes} of shapes, without the structure; {film} of the picture"));
        for (number, material) in scene.materials.iter().enumerate() {
            let users = scene.geometries.iter().filter(|g| g.material as usize == number).count();
            let shapes = if users == 1 { "shape" } else { "shapes" };
            line("material", format!("{}: {} ({users} {shapes})", material.name, lobes(material).join(", ")));
        }
        line("lights", lights(scene));
        line("settings", settings::to_text(&scene.settings));
        for sentence in plan.lines() {
            line("plan", sentence);
        }
        for warning in &scene.warnings {
            line("warning", warning.clone());
        }
        text
    }

    /// What the picture takes while it is rendered.
    fn film_bytes(&self) -> u64 {
        let [width, height] = self.scene.camera.resolution.map(|n| n as usize);
        Film::bytes(width * height, !self.scene.settings.aovs.is_empty())
    }

    fn to_json(&self) -> Value {
        let Self { scene, plan, bounds } = self;
        let materials = scene.materials.iter().map(|m| json!({ "name": m.name, "lobes": lobes(m) }));
        json!({
            "hash": scene.hash,
            "resolution": scene.camera.resolution,
            "shapes": scene.shapes.len(),
            "bounds": bounds,
            "plan": plan,
            "film_bytes": self.film_bytes(),
            "materials": materials.collect::<Vec<_>>(),
            "lights": scene.lights.lights.iter().map(kind_of_light).collect::<Vec<_>>(),
            "environment": scene.lights.environment.as_ref().map(kind_of_environment),
            "settings": settings::to_json(&scene.settings),
            "warnings": scene.warnings,
        })
    }
}

fn point(p: [f64; 3]) -> String {
    let [x, y, z] = p.map(|c| format!("{c:.6}").trim_end_matches('0').trim_end_matches('.').to_owned());
    format!("({x}, {y}, {z})")
}

/// What a material does, in words.
fn lobes(material: &Material) -> Vec<String> {
    let mut all = Vec::new();
    if material.ambient.is_some() {
        all.push("ambient".to_owned());
    }
    if material.diffuse.is_some() {
        all.push("diffuse".to_owned());
    }
    match &material.specular {
        Specular::None => {}
        Specular::Mirror(_) => all.push("mirror".to_owned()),
        Specular::Conductor { alpha, .. } => all.push(format!("metal, roughness {alpha}")),
        Specular::Plastic { coat, .. } => {
            all.push(format!("plastic, index {}, roughness {}", coat.eta(), coat.alpha()));
        }
        Specular::Dielectric { eta, .. } => all.push(format!("glass, index {eta}")),
        Specular::CosinePower { exponent, .. } => all.push(format!("glossy, exponent {exponent}")),
    }
    if material.emission.is_some() {
        all.push(if material.emits_both_sides { "emissive on both sides" } else { "emissive" }.to_owned());
    }
    if all.is_empty() {
        all.push("black".to_owned());
    }
    all
}

fn kind_of_light(light: &Light) -> &'static str {
    match light {
        Light::Point(_) => "point",
        Light::Directional(_) => "directional",
        Light::Rectangle(_) => "rectangle",
        Light::Sphere(_) => "sphere",
        Light::Mesh(_) => "mesh",
    }
}

fn kind_of_environment(environment: &Environment) -> &'static str {
    match environment {
        Environment::Constant(_) => "constant",
        Environment::Gradient(_) => "gradient",
        Environment::Studio(_) => "studio",
        Environment::Image(_) => "image",
    }
}

/// Lights by kind: `2 point, 1 sphere, constant environment`.
fn lights(scene: &Scene) -> String {
    let mut kinds: Vec<(&str, usize)> = Vec::new();
    for kind in scene.lights.lights.iter().map(kind_of_light) {
        match kinds.iter_mut().find(|(name, _)| *name == kind) {
            Some((_, count)) => *count += 1,
            None => kinds.push((kind, 1)),
        }
    }
    let mut told: Vec<_> = kinds.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
    if let Some(environment) = &scene.lights.environment {
        told.push(format!("{} environment", kind_of_environment(environment)));
    }
    if told.is_empty() { "none".to_owned() } else { told.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_have_no_needless_digits() {
        assert_eq!(point([1.0, -0.5, 1e-9]), "(1, -0.5, 0)");
        assert_eq!(point([100.0, 20.0, 0.0]), "(100, 20, 0)");
    }
}
