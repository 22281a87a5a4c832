//! What a point of a surface reflects with: one lobe a file, each with its value, its density and its sampling.
//!
//! Never sees a ray or a scene: a lobe is asked at an [`Incidence`], in world space, so that its tests need neither.
//! Read [`Bxdf`] first, then [`cosine_power`], the lobe that this project is about. To add a lobe: write its file,
//! add its variant to [`Bxdf`], and let `tests/bxdf.rs` sweep over it.

pub mod cosine_power;
pub mod diffuse;
pub mod mirror;

pub use cosine_power::{CosinePower, Horizon};
pub use diffuse::Diffuse;
pub use mirror::Mirror;

use crate::core::Rgb;
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
    /// Natural logarithm of the density over solid angle; infinite for a delta lobe.
    pub ln_pdf: f32,
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
}

/// Calls the same method of whichever lobe it is.
macro_rules! dispatch {
    ($bxdf:expr, $lobe:ident => $call:expr) => {
        match $bxdf {
            Bxdf::Diffuse($lobe) => $call,
            Bxdf::Mirror($lobe) => $call,
            Bxdf::CosinePower($lobe) => $call,
        }
    };
}

impl Bxdf {
    /// How the lobe is spread.
    #[inline]
    pub fn kind(&self) -> LobeKind {
        match self {
            Self::Diffuse(_) => LobeKind::Diffuse,
            Self::Mirror(_) => LobeKind::Delta,
            Self::CosinePower(_) => LobeKind::Glossy,
        }
    }

    /// The BRDF times the cosine, `f(wo, wi) |n . wi|`, in 1/sr; black for a delta lobe.
    #[inline]
    pub fn f_cos(&self, at: &Incidence, wi: Vec3) -> Rgb {
        dispatch!(self, lobe => lobe.f_cos(at, wi))
    }

    /// Natural logarithm of the density of [`sample`](Self::sample) at `wi`, over solid angle; `-inf` where it
    /// never goes and for a delta lobe.
    #[inline]
    pub fn ln_pdf(&self, at: &Incidence, wi: Vec3) -> f32 {
        dispatch!(self, lobe => lobe.ln_pdf(at, wi))
    }

    /// Draws a direction; `None` where the sample carries no light. `u` is in `[0, 1)`.
    #[inline]
    pub fn sample(&self, at: &Incidence, u: [f32; 2]) -> Option<LobeSample> {
        dispatch!(self, lobe => lobe.sample(at, u))
    }

    /// The fraction of light from everywhere that goes to `wo`, or a good estimate: how often the lobe is chosen.
    #[inline]
    pub fn albedo(&self, at: &Incidence) -> Rgb {
        dispatch!(self, lobe => lobe.albedo(at))
    }

    /// The BRDF itself, in 1/sr, without the cosine.
    pub fn f(&self, at: &Incidence, wi: Vec3) -> Rgb {
        let cos = at.n.dot(wi).abs();
        if cos == 0.0 { Rgb::BLACK } else { self.f_cos(at, wi) / cos }
    }

    /// The density over solid angle, in 1/sr.
    pub fn pdf(&self, at: &Incidence, wi: Vec3) -> f32 {
        self.ln_pdf(at, wi).exp()
    }
}

/// The lobes of one point, together what it reflects with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bsdf {
    lobes: [Option<Bxdf>; Self::MAX_LOBES],
}

impl Bsdf {
    /// As many lobes as a point can have.
    pub const MAX_LOBES: usize = 3;

    /// A surface that reflects nothing.
    pub const BLACK: Self = Self { lobes: [None; Self::MAX_LOBES] };

    /// Adds a lobe.
    ///
    /// # Panics
    /// If there are [`MAX_LOBES`](Self::MAX_LOBES) already.
    pub fn add(&mut self, lobe: Bxdf) {
        let free = self.lobes.iter_mut().find(|l| l.is_none());
        *free.expect("a material has at most MAX_LOBES lobes") = Some(lobe);
    }

    /// The lobe of this number, which must be one that was added.
    #[inline]
    pub fn lobe(&self, number: usize) -> &Bxdf {
        self.lobes[number].as_ref().expect("only lobes that were added are asked for")
    }

    /// The lobes in the order in which they were added.
    pub fn lobes(&self) -> impl Iterator<Item = &Bxdf> + '_ {
        self.lobes.iter().flatten()
    }
}
