//! What a scene requires of a render, and what is therefore left out.

use super::{
    AtMaxDepth, DirectLight, Environment, GlossySamples, IndirectGuiding, Light, LightCandidates, Material,
    Scene, SelfHit, Settings, Specular,
};
use crate::bxdf::microfacet::Ggx;
use crate::bxdf::{LobeKind, Width};
use crate::geometry::Shape;
use crate::scene::settings::{EVEN_SAMPLES, MAX_AUTO_SPLIT};
use glam::Vec3;

/// What a scene requires; a stage that it does not ask for does not run.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Plan {
    /// Triangles of all shapes.
    pub triangles: usize,
    /// Analytic spheres of all shapes.
    pub spheres: usize,
    /// Bytes of the shapes' buffers.
    pub shape_bytes: usize,
    /// Whether a surface reflects diffusely.
    pub has_diffuse: bool,
    /// Whether a surface reflects about the mirror direction.
    pub has_glossy: bool,
    /// Whether a surface is a mirror or smooth glass.
    pub has_delta: bool,
    /// Whether a surface is smooth glass.
    pub has_glass: bool,
    /// Whether a shape emits.
    pub has_emitters: bool,
    /// Whether rays go on from surfaces.
    pub bounces: bool,
    /// Rays into which the first hit of a path splits, unless a pilot finds out.
    pub split: u32,
    /// Whether a diffuse hit splits as a glossy one does.
    pub splits_any: bool,
    /// Whether a pilot finds out into how many rays.
    pub splits_by_pilot: bool,
    /// Whether it finds out too whether samples of lights at glossy hits are worth choosing among candidates.
    pub tries_candidates: bool,
    /// The most glossy rays that one camera ray can lead to, if there is a bound.
    pub glossy_rays_bound: Option<f64>,
    /// Whether directions towards lights are sampled.
    pub samples_lights: bool,
    /// Whether shadow rays are asked.
    pub shadow_rays: bool,
    /// Whether the environment is sampled by a table of its radiance.
    pub environment_table: bool,
    /// Whether there are surfaces on which others may focus light, and rays that would miss it.
    pub guides: bool,
    /// Whether there are diffuse surfaces that others may light, and rays that find it.
    pub guides_indirect: bool,
    /// Whether a pilot finds out if it is worth it to guide rays there.
    pub tries_guides: bool,
    /// Whether diffuse surfaces may see the environment through portals.
    pub portals: bool,
    /// Whether edges of emitters that the camera sees get rays of their own.
    pub emitter_edges: bool,
    /// Whether paths go both ways at glass.
    pub splits_glass: bool,
    /// Whether samples are shared out by noise.
    pub shares_out: bool,
    /// Whether rays say what they must not hit: else an accelerator need not be ready for it.
    pub needs_skip: bool,
}

impl Plan {
    /// The plan for a scene with its settings.
    pub fn of(scene: &Scene) -> Self {
        let settings = &scene.settings;
        let used = || scene.geometries.iter().map(|g| &scene.materials[g.material as usize]);
        let has_diffuse = used().any(|m| m.diffuse.is_some());
        let (has_glossy, has_delta) = (used().any(is_glossy), used().any(is_delta));
        let has_glass = used().any(|m| matches!(m.specular, Specular::Dielectric { .. }));
        let has_emitters = used().any(|m| m.emission.is_some());
        let has_lobes = has_diffuse || has_glossy || has_delta;
        let goes_on = settings.most_reflections() > 0;
        let lights = LightUse::of(scene, has_diffuse, has_glossy);
        let bounces = has_lobes && goes_on;
        let splits_any = settings.glossy_samples.splits_any();
        let can_split = goes_on && (has_glossy || splits_any && has_diffuse && settings.diffuse_bounces);
        let splits_by_pilot = can_split && matches!(settings.glossy_samples, GlossySamples::Auto(_));
        let lit_by_others = settings.diffuse_bounces && goes_on && has_diffuse && lights.samples;
        let guides_indirect = settings.indirect_guiding != IndirectGuiding::Never && lit_by_others;
        Self {
            triangles: count(scene, |s| matches!(s, Shape::Mesh(_))),
            spheres: count(scene, |s| matches!(s, Shape::Spheres(_))),
            shape_bytes: scene.shapes.iter().map(Shape::memory_bytes).sum(),
            has_diffuse,
            has_glossy,
            has_delta,
            has_glass,
            has_emitters,
            bounces,
            split: if can_split { settings.glossy_samples.at(0) } else { 1 },
            splits_any,
            splits_by_pilot,
            tries_candidates: splits_by_pilot
                && has_glossy
                && settings.highlights
                && lights.samples
                && matches!(settings.light_candidates, LightCandidates::Auto(_)),
            glossy_rays_bound: if has_glossy { glossy_rays_bound(settings) } else { Some(0.0) },
            samples_lights: lights.samples,
            shadow_rays: lights.shadows,
            environment_table: lights.table,
            guides: settings.guiding && goes_on && lights.samples && may_miss_caustics(scene),
            guides_indirect,
            tries_guides: guides_indirect && settings.indirect_guiding == IndirectGuiding::Auto,
            portals: settings.portals
                && settings.direct_light == DirectLight::Mis
                && settings.occlusion.is_exact()
                && has_diffuse
                && scene.lights.environment.is_some(),
            emitter_edges: settings.emitter_edges && has_emitters,
            splits_glass: settings.split_glass && bounces && has_glass,
            shares_out: settings.shares_out(settings.spp),
            needs_skip: settings.self_hit != SelfHit::Offset && (bounces || lights.shadows),
        }
    }

    /// What will run and what is left out, a sentence a line.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = vec![];
        let mut say = |runs: bool, yes: &str, no: &str| {
            lines.push(if runs { yes.to_owned() } else { format!("left out: {no}") });
        };
        say(
            self.bounces,
            "reflected rays are traced",
            "reflected rays (nothing reflects, or the depth is 0)",
        );
        let into = if self.splits_by_pilot {
            "as many rays as a pilot finds to be worth it".to_owned()
        } else {
            format!("{} rays", self.split)
        };
        let what = if self.splits_any { "hit" } else { "glossy hit" };
        say(
            self.splits_by_pilot || self.split > 1,
            &format!("the first {what} splits into {into}"),
            "splitting (nothing to split, or one ray per hit)",
        );
        say(
            self.samples_lights,
            "directions to lights are sampled",
            "sampling of lights (none that lights a rough surface)",
        );
        say(self.shadow_rays, "shadow rays are asked", "shadow rays (no sampled light casts a shadow)");
        say(
            self.environment_table,
            "the environment is sampled by its radiance",
            "the environment's table (no environment of varying radiance is sampled)",
        );
        say(
            self.tries_candidates,
            "a pilot finds out whether samples of lights at glossy hits are chosen among candidates",
            "a trial of candidates for samples of lights (no light is sampled at anything glossy, or their number is given)",
        );
        say(
            self.guides,
            "photons say where caustics come from",
            "photons (no caustic can fall where rays would miss it, or none is wanted)",
        );
        say(
            self.guides_indirect,
            if self.tries_guides {
                "camera paths say where diffuse surfaces see reflected light, and a pilot whether to look there"
            } else {
                "camera paths say where diffuse surfaces see reflected light"
            },
            "looking for reflected light (no diffuse surface sees others, or it is not wanted)",
        );
        say(
            self.portals,
            "rays look for portals through which little of the environment is seen",
            "looking for portals (no diffuse surface, no environment, or none is wanted)",
        );
        say(
            self.emitter_edges,
            "edges of emitters that the camera sees get rays of their own",
            "rays for edges of emitters (no shape emits, or none are wanted)",
        );
        say(
            self.splits_glass,
            "paths go both ways at glass",
            "going both ways at glass (there is none to go through, or it is not wanted)",
        );
        say(
            self.needs_skip,
            "rays skip the surface that they leave",
            "the skip rule (no ray leaves a surface, or the offset alone is asked for)",
        );
        say(
            self.shares_out,
            &format!("samples beyond {EVEN_SAMPLES} per pixel go where the noise is"),
            &format!(
                "sharing samples out by noise (not wanted, less than {EVEN_SAMPLES} per pixel, or a sampler of a fixed number)"
            ),
        );
        match self.glossy_rays_bound {
            Some(most) if most > 1e4 => {
                lines.push(format!("up to {most:.4e} glossy rays follow one camera ray"));
            }
            _ => {}
        }
        lines
    }
}

fn count(scene: &Scene, of_kind: impl Fn(&Shape) -> bool) -> usize {
    scene.shapes.iter().filter(|s| of_kind(s)).map(Shape::primitive_count).sum()
}

fn is_glossy(material: &Material) -> bool {
    match material.specular {
        Specular::CosinePower { .. } | Specular::Plastic { .. } => true,
        Specular::Conductor { alpha, .. } => !Ggx { alpha }.is_smooth(),
        Specular::None | Specular::Mirror(_) | Specular::Dielectric { .. } => false,
    }
}

/// Whether rays of some surface may hardly find what another has reflected of a small light.
fn may_miss_caustics(scene: &Scene) -> bool {
    let Settings { diffuse_bounces, .. } = scene.settings;
    let used = scene.geometries.iter().map(|g| scene.materials[g.material as usize].bsdf(Vec3::ZERO));
    let (mut widest, mut narrowest) = (Width::NONE, Width::EVERYWHERE);
    for bsdf in used {
        for lobe in bsdf.lobes() {
            let (width, looks) = (lobe.width(), diffuse_bounces || lobe.kind() != LobeKind::Diffuse);
            widest = if looks && width > widest { width } else { widest };
            narrowest = if width < narrowest { width } else { narrowest };
        }
    }
    widest.misses(narrowest)
}

fn is_delta(material: &Material) -> bool {
    match material.specular {
        Specular::Mirror(_) | Specular::Dielectric { .. } => true,
        Specular::Conductor { alpha, .. } => Ggx { alpha }.is_smooth(),
        Specular::None | Specular::CosinePower { .. } | Specular::Plastic { .. } => false,
    }
}

/// The most glossy rays per camera ray: all hits glossy, to the greatest depth. `None` if there is none.
fn glossy_rays_bound(settings: &Settings) -> Option<f64> {
    if settings.at_max_depth == AtMaxDepth::Roulette {
        return None;
    }
    let depth = f64::from(settings.max_depth);
    Some(match &settings.glossy_samples {
        GlossySamples::First(m) | GlossySamples::Any { any: m } => f64::from(*m) * depth,
        GlossySamples::Branch { branch: 1 } => depth,
        GlossySamples::Auto(_) => f64::from(MAX_AUTO_SPLIT) * depth,
        // The sum of m + m^2 + ... + m^D.
        GlossySamples::Branch { branch } => {
            let m = f64::from(*branch);
            m * (m.powf(depth) - 1.0) / (m - 1.0)
        }
        GlossySamples::PerDepth(list) => {
            let listed = &list[..list.len().min(settings.max_depth as usize)];
            let (rays, sum) = listed.iter().fold((1.0, 0.0), |(rays, sum), &m| {
                let rays = rays * f64::from(m);
                (rays, sum + rays)
            });
            sum + rays * (depth - listed.len() as f64)
        }
    })
}

/// How the scene's lights are used.
struct LightUse {
    samples: bool,
    shadows: bool,
    table: bool,
}

impl LightUse {
    fn of(scene: &Scene, has_diffuse: bool, has_glossy: bool) -> Self {
        let settings = &scene.settings;
        // Lights that no ray can hit are sampled in any case, the others where the settings say so.
        let takes_points = has_diffuse || (has_glossy && settings.highlights);
        let takes_others = takes_points && settings.direct_light != DirectLight::Lobe;
        let (mut samples, mut shadows) = (false, false);
        for light in &scene.lights.lights {
            let (sampled, shadow) = match light {
                Light::Point(light) => (takes_points, light.shadow),
                Light::Directional(light) => (takes_points, light.shadow),
                Light::Rectangle(_) | Light::Sphere(_) | Light::Mesh(_) => (takes_others, true),
            };
            samples |= sampled;
            shadows |= sampled && shadow;
        }
        let environment = scene.lights.environment.as_ref().filter(|_| takes_others);
        let table = environment.is_some_and(|e| matches!(e, Environment::Studio(_) | Environment::Image(_)));
        Self { samples: samples || environment.is_some(), shadows: shadows || environment.is_some(), table }
    }
}
