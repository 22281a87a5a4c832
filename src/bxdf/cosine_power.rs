//! The glossy lobe: a cosine power about the mirror direction.
//!
//! The lobe is `p(wi) = (e + 1) / (2 pi) cos^e(alpha)` on the hemisphere about the mirror direction `r`, alpha the
//! angle between `wi` and `r`. A part of it lies below the surface; [`Horizon`] says what becomes of that part.
//! Turning by pi about `r` keeps solid angle and `p`, so a folded sample has exactly the density `m p`, where `m` is
//! the number of directions (1 or 2) that end at `wi`: that is the density which multiple importance sampling sees.
//!
//! Numbers are kept at f32 rounding for e up to [`CosinePower::MAX_EXPONENT`]: samples come from `ln u / (e + 1)`
//! through `expm1`, and `cos^e` from the chord `|wi - r|`; a power of a dot product has no correct digit at e = 1e9.

use super::{Bxdf, Drawn, Incidence, LobeSample, Mirror, above_horizon, renormalized};
use crate::core::{Frame, Rgb, exponential, sampler::hash, special, warp};
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// What becomes of a direction that falls below the surface.
///
/// `P` is the lobe's mass above the surface, `mass_above`; `k` is the reflectance. The furnace value is the
/// directional albedo, what a surface returns under the radiance 1 from everywhere.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
    clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Horizon {
    /// Turned by pi about the mirror direction: the lecture's. Furnace: `k`; not reciprocal.
    #[default]
    Fold,
    /// Turned likewise and weighted by one over the number of directions that end there: the clipped lobe without
    /// wasted rays. Furnace: `k P`.
    FoldWeighted,
    /// Black: the dark rim. Furnace: `k P`.
    Clip,
    /// Drawn again until it is above: the clipped lobe divided by its mass. Furnace: `k`.
    Reject,
    /// Lafortune and Willems' reciprocal lobe `f = k (e + 2) / (2 pi) cos^e(alpha)`, black below the surface.
    /// Furnace: `k E`, see `modified_phong_albedo`; it falls with the cosine of incidence.
    ///
    /// Source: Lafortune and Willems 1994, *Using the Modified Phong Reflectance Model for Physically Based
    /// Rendering*.
    ModifiedPhong,
}

/// A cosine power about the mirror direction `r`. Make it with [`Bxdf::cosine_power`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CosinePower {
    /// `kr cr`.
    pub reflectance: Rgb,
    /// The exponent e, real, at least 0; one above [`MAX_EXPONENT`](Self::MAX_EXPONENT) counts as that.
    pub exponent: f32,
    /// What becomes of directions below the surface.
    pub horizon: Horizon,
}

impl Bxdf {
    /// The glossy lobe with exponent `exponent >= 0`; a [`Mirror`] for an exponent that no f32 direction can tell
    /// from infinity, under every policy.
    #[inline]
    pub fn cosine_power(reflectance: Rgb, exponent: f32, horizon: Horizon) -> Self {
        if exponent > CosinePower::MAX_EXPONENT {
            Self::Mirror(Mirror { reflectance })
        } else {
            Self::CosinePower(CosinePower { reflectance, exponent, horizon })
        }
    }
}

/// The lobe's mass above a plane to whose normal its axis has the cosine `cos`: `1 - I(sin^2; (e+1)/2, 1/2) / 2`.
pub fn mass_above(exponent: f32, cos: f32) -> f32 {
    let (e, cos) = (f64::from(exponent), f64::from(cos).clamp(0.0, 1.0));
    // The mass below is less than sin^(e + 1) / 2, of which f32 sees nothing here.
    if (e + 1.0) * (-cos * cos).ln_1p() < -36.0 {
        return 1.0;
    }
    (1.0 - 0.5 * special::cosine_power_tail(e, cos) / special::wallis(e)) as f32
}

/// The directional albedo `E` of [`Horizon::ModifiedPhong`] of reflectance 1 at the cosine of incidence `cos`:
/// `cos P(e + 1) + W(e) sin^(e + 2) / pi`, `P` the mass above and `W` Wallis' integral.
pub fn modified_phong_albedo(exponent: f32, cos: f32) -> f32 {
    let (e, cos) = (f64::from(exponent), f64::from(cos).clamp(0.0, 1.0));
    let above = 1.0 - 0.5 * special::cosine_power_tail(e + 1.0, cos) / special::wallis(e + 1.0);
    let sin_pow = ((0.5 * e + 1.0) * (-cos * cos).ln_1p()).exp();
    (cos * above + special::wallis(e) * sin_pow / std::f64::consts::PI) as f32
}

/// A [`CosinePower`] at one incidence: what all directions drawn and evaluated there share.
#[derive(Clone, Copy, Debug)]
pub struct PreparedCosinePower {
    lobe: CosinePower,
    policy: Policy,
    about: About,
}

/// A cosine power about the mirror direction of one incidence.
#[derive(Clone, Copy, Debug)]
struct About {
    frame: Frame,
    n: Vec3,
    ng: Vec3,
    exponent: f32,
    /// `(e + 1) / (2 pi)`, divided by the mass above where the policy divides.
    norm: f32,
}

/// What a [`Horizon`] does with a direction that was drawn, as answers of 0 and 1: so that lobes of several policies are
/// drawn side by side.
#[derive(Clone, Copy, Debug, Default)]
pub struct Policy {
    /// Whether directions below the surface are turned above it; else they carry no light.
    pub turns: f32,
    /// Whether the weight is divided by the number of directions that end in one.
    pub divides: f32,
    /// Whether the lobe is Lafortune and Willems' reciprocal one.
    pub reciprocal: f32,
}

/// A direction of the lobe in its two parts; turned by pi about the axis it is `along - across`.
struct Draw {
    along: Vec3,
    across: Vec3,
    /// The lobe there, in 1/sr.
    p: f32,
}

impl CosinePower {
    /// The largest exponent with a lobe: beyond it the lobe is narrower than the resolution of f32 directions.
    pub const MAX_EXPONENT: f32 = 1e13;

    /// The lobe at `at`, for many directions.
    #[inline]
    pub fn prepare(&self, at: &Incidence) -> PreparedCosinePower {
        let mut about = About::new(self.exponent, at);
        if self.horizon == Horizon::Reject {
            about.norm /= mass_above(about.exponent, about.frame.n.dot(at.ng));
        }
        PreparedCosinePower { lobe: *self, policy: self.policy(), about }
    }

    /// What becomes of a direction that was drawn once: [`draw`](Self::draw) needs it.
    #[inline(always)]
    pub fn policy(&self) -> Policy {
        let is = |horizon| f32::from(self.horizon == horizon);
        Policy {
            turns: 1.0 - is(Horizon::Clip),
            divides: is(Horizon::FoldWeighted) + is(Horizon::ModifiedPhong),
            reciprocal: is(Horizon::ModifiedPhong),
        }
    }

    /// A direction of a lobe with this exponent, the same for any reflectance; not for [`Horizon::Reject`], which may draw
    /// more than one.
    #[inline(always)]
    pub fn draw(exponent: f32, policy: Policy, at: &Incidence, u: [f32; 2]) -> Drawn {
        About::new(exponent, at).drawn(u, policy)
    }

    /// The value of a lobe with this exponent, the same for any colour, and its density, both in 1/sr; zeros below the surface.
    /// Not for [`Horizon::Reject`], which divides by the mass above the surface.
    #[inline(always)]
    pub fn value(exponent: f32, policy: Policy, at: &Incidence, wi: Vec3) -> [f32; 2] {
        About::new(exponent, at).value(policy, wi)
    }

    #[inline(never)]
    pub(super) fn f_cos_and_pdf(&self, at: &Incidence, wi: Vec3) -> (Rgb, f32) {
        self.prepare(at).f_cos_and_pdf(wi)
    }

    #[inline(never)]
    pub(super) fn sample(&self, at: &Incidence, u: [f32; 2]) -> Option<LobeSample> {
        self.prepare(at).sample(u)
    }

    #[inline]
    pub(super) fn albedo(&self, at: &Incidence) -> Rgb {
        self.reflectance * Self::whole_albedo(self.exponent, self.policy(), at)
    }

    /// The albedo of a lobe with this exponent and the reflectance 1.
    #[inline(always)]
    pub fn whole_albedo(exponent: f32, policy: Policy, at: &Incidence) -> f32 {
        if policy.turns > 0.0 && policy.divides == 0.0 { 1.0 } else { partial_albedo(exponent, policy, at) }
    }
}

/// The same where a part of the lobe is lost.
#[inline(never)]
fn partial_albedo(exponent: f32, policy: Policy, at: &Incidence) -> f32 {
    let exponent = exponent.min(CosinePower::MAX_EXPONENT);
    if policy.reciprocal > 0.0 {
        modified_phong_albedo(exponent, at.n.dot(at.wo))
    } else {
        mass_above(exponent, at.mirror_direction().dot(at.ng))
    }
}

impl PreparedCosinePower {
    /// See [`Bxdf::f_cos`].
    #[inline]
    pub fn f_cos(&self, wi: Vec3) -> Rgb {
        self.f_cos_and_pdf(wi).0
    }

    /// See [`Bxdf::pdf`].
    #[inline]
    pub fn pdf(&self, wi: Vec3) -> f32 {
        self.f_cos_and_pdf(wi).1
    }

    /// Both, with what they share done once.
    #[inline]
    pub(super) fn f_cos_and_pdf(&self, wi: Vec3) -> (Rgb, f32) {
        let [f_cos, pdf] = match self.lobe.horizon {
            Horizon::Reject => [self.about.evaluate(wi).0; 2],
            _ => self.about.value(self.policy, wi),
        };
        (self.lobe.reflectance * f_cos, pdf)
    }

    /// See [`Bxdf::sample`].
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Option<LobeSample> {
        match self.lobe.horizon {
            Horizon::Reject => self.redrawn(u),
            _ => self.about.drawn(u, self.policy).coloured(|_| self.lobe.reflectance),
        }
    }

    /// The first direction above the surface among those of `u` and of pairs hashed from `u`.
    ///
    /// At least half of the lobe is above, so that the last resort, folding, is taken once in `2^32` samples.
    #[inline]
    fn redrawn(&self, u: [f32; 2]) -> Option<LobeSample> {
        const TRIES: u32 = 32;
        let key = hash(u[0].to_bits() ^ hash(u[1].to_bits()));
        let unit = |x: u32| (x >> 8) as f32 * (1.0 / (1 << 24) as f32);
        let retries = (1..TRIES).map(|i| {
            let x = hash(key.wrapping_add(i.wrapping_mul(0x9e37_79b9)));
            [unit(x), unit(hash(x ^ 0x1b56_c4e9))]
        });
        let clip = Policy::default();
        std::iter::once(u)
            .chain(retries)
            .map(|u| self.about.drawn(u, clip))
            .find(|drawn| drawn.weight > 0.0)
            .unwrap_or_else(|| self.about.drawn(u, self.policy))
            .coloured(|_| self.lobe.reflectance)
    }
}

impl About {
    /// About the mirror direction of `at`, with the `norm` of a lobe that is not divided.
    #[inline(always)]
    fn new(exponent: f32, at: &Incidence) -> Self {
        let exponent = exponent.min(CosinePower::MAX_EXPONENT);
        let frame = Frame::new(at.mirror_direction());
        Self { frame, n: at.n, ng: at.ng, exponent, norm: (exponent + 1.0) / TAU }
    }

    /// The lobe in 1/sr, 0 below the surface, and the number of directions that fold to `wi`.
    #[inline(always)]
    fn evaluate(&self, wi: Vec3) -> (f32, f32) {
        let r = self.frame.n;
        let height = self.ng.dot(wi);
        // 1 - cos alpha from the chord: exact where the cosine is all rounding error.
        let fall = 0.5 * (wi - r).length_squared();
        let p = self.norm * exponential::exp(self.exponent * exponential::ln_1p(-fall));
        let turned_height = 2.0 * (1.0 - fall) * r.dot(self.ng) - height;
        let is_there = (fall < 1.0) & (height > 0.0);
        (if is_there { p } else { 0.0 }, if turned_height <= 0.0 { 2.0 } else { 1.0 })
    }

    /// The value without its colour and the density, by a policy that draws once.
    #[inline(always)]
    fn value(&self, policy: Policy, wi: Vec3) -> [f32; 2] {
        let (p, m) = self.evaluate(wi);
        let folded = if policy.turns > 0.0 { m * p } else { p };
        let value = if policy.divides > 0.0 { p } else { folded };
        [if policy.reciprocal > 0.0 { self.reciprocal_weight(wi) * p } else { value }, folded]
    }

    /// `f |n . wi| / p` of the reciprocal lobe of reflectance 1.
    #[inline(always)]
    fn reciprocal_weight(&self, wi: Vec3) -> f32 {
        (self.exponent + 2.0) / (self.exponent + 1.0) * self.n.dot(wi).max(0.0)
    }

    /// A direction of the whole lobe: `cos^(e + 1)` is uniform.
    #[inline(always)]
    fn draw(&self, u: [f32; 2]) -> Draw {
        // 1 - u is in (0, 1], and exact.
        let ln_cos = exponential::ln(1.0 - u[0]) / (self.exponent + 1.0);
        let fall = exponential::exp_m1(ln_cos);
        let sin = (-fall * (2.0 + fall)).sqrt();
        let Vec2 { x: cos_phi, y: sin_phi } = warp::unit_vector(u[1]);
        Draw {
            along: self.frame.n + fall * self.frame.n,
            across: (sin * cos_phi) * self.frame.s + (sin * sin_phi) * self.frame.t,
            p: self.norm * exponential::exp(self.exponent * ln_cos),
        }
    }

    /// The direction that `u` draws, by the policy turned by pi about the axis if it is below the surface.
    #[inline(always)]
    fn drawn(&self, u: [f32; 2], policy: Policy) -> Drawn {
        let d = self.draw(u);
        let turns = policy.turns > 0.0;
        let (along, across) = (self.ng.dot(d.along), self.ng.dot(d.across));
        let side = if turns & (along + across <= 0.0) { -1.0 } else { 1.0 };
        let drawn = renormalized(d.along + side * d.across);
        let wi = above_horizon(drawn, self.ng);

        let m = if turns & (along <= across.abs()) { 2.0 } else { 1.0 };
        let carries = if turns | (self.ng.dot(drawn) > 0.0) { 1.0 } else { 0.0 };
        let divided = if policy.divides > 0.0 { carries / m } else { carries };
        let weight = if policy.reciprocal > 0.0 { self.reciprocal_weight(wi) * divided } else { divided };
        Drawn { wi, weight, cos_half: 1.0, pdf: d.p * m }
    }
}
