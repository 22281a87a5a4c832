//! What a point of a surface reflects with: one lobe a file, each with its value, its density and its sampling.
//!
//! Never sees a ray or a scene: a lobe is asked at an [`Incidence`], in world space, so that its tests need neither.
//! Read [`Bxdf`] first, then [`cosine_power`], the lobe that this project is about. To add a lobe: write its file,
//! add its variant to [`Bxdf`], and let `tests/bxdf.rs` sweep over it.

pub mod conductor;
pub mod cosine_power;
pub mod dielectric;
pub mod diffuse;
pub mod energy;
pub mod fresnel;
pub mod microfacet;
pub mod mirror;
pub mod plastic;
mod width;

pub use conductor::{ComplexIor, Conductor};
pub use cosine_power::{CosinePower, Horizon, Policy, PreparedCosinePower};
pub use dielectric::{Dielectric, DielectricWay};
pub use diffuse::Diffuse;
pub use energy::CoatEnergy;
pub use mirror::Mirror;
pub use plastic::{Coat, Layers, Plastic};
pub use width::Width;

use crate::core::{Frame, Rgb};
use glam::Vec3;

/// A point of a surface as its lobes see it: unit vectors in world space, pointing away from the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incidence {
    /// Towards the viewer.
    pub wo: Vec3,
    /// Shading normal on `wo`'s side: `n . wo > 0`.
    pub n: Vec3,
    /// Geometric normal on `wo`'s side: the horizon that no reflected direction may fall below.
    pub ng: Vec3,
    /// Whether `wo` is on the outer side of the surface.
    pub front: bool,
}

impl Incidence {
    /// `wo` in the shading frame, above the surface whatever the rounding.
    #[inline]
    fn local_wo(&self, frame: &Frame) -> Vec3 {
        let wo = frame.to_local(self.wo);
        wo.with_z(wo.z.max(microfacet::MIN_COS))
    }

    /// Whether `wi` is above the planes of both normals.
    #[inline(always)]
    fn is_above(&self, wi: Vec3) -> bool {
        (self.n.dot(wi) > 0.0) & (self.ng.dot(wi) > 0.0)
    }
}

/// One step of Newton's towards unit length: exact to f32 rounding for a `v` that is off by less than 1e-4.
#[inline(always)]
fn renormalized(v: Vec3) -> Vec3 {
    v * (1.5 - 0.5 * v.length_squared())
}

/// The unit vector `wi`, lifted to just above the plane of `ng` if rounding left it on or below.
#[inline(always)]
fn above_horizon(wi: Vec3, ng: Vec3) -> Vec3 {
    /// More than the rounding of the vectors, of their product and of the new length: 5e-7 together.
    const LIFT: f32 = 1e-6;
    let height = ng.dot(wi);
    if height > 0.0 { wi } else { (wi + ng * (LIFT - height)).normalize() }
}

/// How a lobe is spread, which decides how it is sampled, split and combined with lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LobeKind {
    /// One direction only: no light can be sampled into it.
    Delta,
    /// About the mirror direction.
    Glossy,
    /// Over the hemisphere.
    Diffuse,
}

/// A direction drawn from a lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeSample {
    /// Where the light would come from; unit length.
    pub wi: Vec3,
    /// `f(wo, wi) |n . wi| / pdf(wi)` in its analytic form: what the incident radiance is to be multiplied with.
    pub weight: Rgb,
    /// The density over solid angle, in 1/sr; infinite for a delta lobe.
    pub pdf: f32,
}

/// A direction drawn from a lobe before its colour is known, without a branch: so that several are drawn side by side.
#[derive(Clone, Copy, Debug, Default)]
pub struct Drawn {
    /// The direction.
    pub wi: Vec3,
    /// `f cos / pdf` without the colour; zero where the sample carries no light.
    pub weight: f32,
    /// The cosine of incidence that the colour depends on, if it depends on any.
    pub cos_half: f32,
    /// The density over solid angle, in 1/sr.
    pub pdf: f32,
}

impl Drawn {
    /// The sample, with the colour at the cosine of incidence.
    #[inline(always)]
    fn coloured(&self, colour: impl FnOnce(f32) -> Rgb) -> Option<LobeSample> {
        let Self { wi, weight, cos_half, pdf } = *self;
        (weight > 0.0).then(|| LobeSample { wi, weight: colour(cos_half) * weight, pdf })
    }
}

/// One lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bxdf {
    /// Lambert's.
    Diffuse(Diffuse),
    /// A perfect mirror.
    Mirror(Mirror),
    /// A cosine power about the mirror direction.
    CosinePower(CosinePower),
    /// A metal.
    Conductor(Conductor),
    /// One way of glass.
    Dielectric(Dielectric),
    /// A rough coat over a diffuse base.
    Plastic(Plastic),
}

/// Calls the same method of whichever lobe it is.
macro_rules! dispatch {
    ($bxdf:expr, $lobe:ident => $call:expr) => {
        match $bxdf {
            Bxdf::Diffuse($lobe) => $call,
            Bxdf::Mirror($lobe) => $call,
            Bxdf::CosinePower($lobe) => $call,
            Bxdf::Conductor($lobe) => $call,
            Bxdf::Dielectric($lobe) => $call,
            Bxdf::Plastic($lobe) => $call,
        }
    };
}

impl Bxdf {
    /// How the lobe is spread.
    #[inline(always)]
    pub fn kind(&self) -> LobeKind {
        match self {
            Self::Diffuse(_) => LobeKind::Diffuse,
            Self::Mirror(_) | Self::Dielectric(_) => LobeKind::Delta,
            Self::CosinePower(_) | Self::Plastic(_) => LobeKind::Glossy,
            Self::Conductor(lobe) => lobe.kind(),
        }
    }

    /// The BRDF times the cosine, `f(wo, wi) |n . wi|`, in 1/sr; black for a delta lobe.
    #[inline]
    pub fn f_cos(&self, at: &Incidence, wi: Vec3) -> Rgb {
        self.evaluate(at, wi).0
    }

    /// The density of [`sample`](Self::sample) at `wi`, over solid angle, in 1/sr; 0 where it never goes and for a
    /// delta lobe.
    #[inline]
    pub fn pdf(&self, at: &Incidence, wi: Vec3) -> f32 {
        self.evaluate(at, wi).1
    }

    /// [`f_cos`](Self::f_cos) and [`pdf`](Self::pdf) together, with what they share done once.
    #[inline(always)]
    pub fn evaluate(&self, at: &Incidence, wi: Vec3) -> (Rgb, f32) {
        match self {
            Self::Diffuse(lobe) => lobe.f_cos_and_pdf(at, wi),
            Self::Mirror(_) | Self::Dielectric(_) => (Rgb::BLACK, 0.0),
            Self::CosinePower(lobe) => lobe.f_cos_and_pdf(at, wi),
            Self::Conductor(lobe) => lobe.f_cos_and_pdf(at, wi),
            Self::Plastic(lobe) => lobe.f_cos_and_pdf(at, wi),
        }
    }

    /// Draws a direction; `None` where the sample carries no light. `u` is in `[0, 1)`.
    #[inline(always)]
    pub fn sample(&self, at: &Incidence, u: [f32; 2]) -> Option<LobeSample> {
        dispatch!(self, lobe => lobe.sample(at, u))
    }

    /// The [`sample`](Self::sample) in a direction that [`Diffuse::draw`], [`Conductor::draw`] or [`CosinePower::draw`] has
    /// drawn for this lobe.
    ///
    /// # Panics
    /// If it is another kind of lobe.
    #[inline(always)]
    pub fn sample_along(&self, drawn: &Drawn) -> Option<LobeSample> {
        match self {
            Self::Diffuse(lobe) => drawn.coloured(|_| lobe.reflectance),
            Self::Conductor(lobe) => drawn.coloured(|cos| lobe.colour(cos)),
            Self::CosinePower(lobe) => drawn.coloured(|_| lobe.reflectance),
            _ => unreachable!("no other lobe is drawn with others"),
        }
    }

    /// Draws one direction for each of `us`: [`sample`](Self::sample), with the work that directions at one point
    /// share done once.
    ///
    /// # Panics
    /// If `us` and `out` differ in length.
    pub fn sample_many(&self, at: &Incidence, us: &[[f32; 2]], out: &mut [Option<LobeSample>]) {
        assert_eq!(us.len(), out.len(), "one place for each sample");
        let pairs = us.iter().zip(out);
        if let Self::CosinePower(lobe) = self {
            let lobe = lobe.prepare(at);
            pairs.for_each(|(&u, out)| *out = lobe.sample(u));
        } else {
            pairs.for_each(|(&u, out)| *out = self.sample(at, u));
        }
    }

    /// Whether the lobe is a delta lobe or at most as wide as GGX of roughness `alpha`, which a cosine power is from the
    /// exponent `2 / alpha^2 - 2` up (Walter et al. 2007). A plastic, most of which may be its base, never is.
    pub fn is_sharp(&self, alpha: f32) -> bool {
        match self {
            Self::Mirror(_) | Self::Dielectric(_) => true,
            Self::Conductor(lobe) => lobe.alpha <= alpha,
            Self::CosinePower(lobe) => lobe.exponent >= 2.0 / (alpha * alpha) - 2.0,
            Self::Diffuse(_) | Self::Plastic(_) => false,
        }
    }

    /// The fraction of light from everywhere that goes to `wo`, or a good estimate: how often the lobe is chosen.
    #[inline]
    pub fn albedo(&self, at: &Incidence) -> Rgb {
        dispatch!(self, lobe => lobe.albedo(at))
    }

    /// The BRDF itself, in 1/sr, without the cosine.
    pub fn f(&self, at: &Incidence, wi: Vec3) -> Rgb {
        let cos = at.n.dot(wi).abs();
        // A direction within 1e-38 of the tangent plane must not make an infinity.
        if cos == 0.0 { Rgb::BLACK } else { (self.f_cos(at, wi) / cos).map(|f| f.min(f32::MAX)) }
    }
}

/// The lobes of one point, together what it reflects with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bsdf {
    /// Those beyond `count` are black.
    lobes: [Bxdf; Self::MAX_LOBES],
    count: usize,
}

impl Bsdf {
    /// As many lobes as a point can have.
    pub const MAX_LOBES: usize = 3;

    /// A surface that reflects nothing.
    pub const BLACK: Self =
        Self { lobes: [Bxdf::Diffuse(Diffuse { reflectance: Rgb::BLACK }); Self::MAX_LOBES], count: 0 };

    /// Adds a lobe.
    ///
    /// # Panics
    /// If there are [`MAX_LOBES`](Self::MAX_LOBES) already.
    pub fn add(&mut self, lobe: Bxdf) {
        self.lobes[self.count] = lobe;
        self.count += 1;
    }

    /// The lobe of this number, which must be one that was added.
    #[inline(always)]
    pub fn lobe(&self, number: usize) -> &Bxdf {
        &self.lobes()[number]
    }

    /// The lobes in the order in which they were added.
    #[inline(always)]
    pub fn lobes(&self) -> &[Bxdf] {
        &self.lobes[..self.count]
    }
}
