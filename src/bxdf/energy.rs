//! What rough mirrors return of light from everywhere.
//!
//! Single scattering off microfacets has no closed form for it, so it is tabulated over the root of the cosine of
//! incidence, as it is steep at grazing incidence: once for a surface that reflects everything, and once for each
//! dielectric coat that a scene uses.

use super::fresnel;
use super::microfacet::{Ggx, MIN_COS};
use crate::core::lanes::{Floats, LANES};
use glam::Vec3;
use std::sync::{Mutex, OnceLock, PoisonError};

/// Nodes of a row, over the root of the cosine.
const COSINES: usize = 64;
/// Rows of the mirror's table, over the root of the roughness.
const ALPHAS: usize = 17;

type Row = [f32; COSINES];

/// The directional albedo of one rough dielectric boundary from outside; transmitted light is not counted.
#[derive(Clone, Debug, PartialEq)]
pub struct CoatEnergy {
    eta: f32,
    alpha: f32,
    row: Row,
    average: f32,
}

impl CoatEnergy {
    /// The table of a boundary of index `eta >= 1`: computed in some milliseconds by the first call and kept for the
    /// life of the program, as few different coats as scenes have.
    pub fn of(ggx: Ggx, eta: f32) -> &'static Self {
        static COATS: Mutex<Vec<&'static CoatEnergy>> = Mutex::new(Vec::new());
        let mut coats = COATS.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(coat) = coats.iter().find(|c| c.eta == eta && c.alpha == ggx.alpha) {
            return coat;
        }
        let row = row(ggx, |cos| fresnel::dielectric(cos, eta).0);
        let coat: &'static Self =
            Box::leak(Box::new(Self { eta, alpha: ggx.alpha, row, average: average(&row) }));
        coats.push(coat);
        coat
    }

    /// At the cosine of incidence `cos`; to 0.003.
    #[inline(always)]
    pub fn albedo(&self, cos: f32) -> f32 {
        interpolated(&self.row, cos)
    }

    /// Of eight boundaries, each at its own cosine: [`albedo`](Self::albedo) side by side, but for the look at each table.
    #[inline(always)]
    pub fn albedos(energies: &[&Self; LANES], cos: &Floats) -> Floats {
        let (mut nodes, mut t) = ([0; LANES], Floats::default());
        for lane in 0..LANES {
            (nodes[lane], t[lane]) = node(cos[lane].max(0.0).sqrt(), COSINES);
        }
        let [mut below, mut above] = [Floats::default(); 2];
        for (lane, energy) in energies.iter().enumerate() {
            (below[lane], above[lane]) = (energy.row[nodes[lane]], energy.row[nodes[lane] + 1]);
        }
        let mut albedos = Floats::default();
        for lane in 0..LANES {
            albedos[lane] = lerp(t[lane], below[lane], above[lane]);
        }
        albedos
    }

    /// The mean over diffuse light, `2 cos d(cos)`.
    #[inline(always)]
    pub fn average(&self) -> f32 {
        self.average
    }
}

/// The directional albedo of a rough mirror that reflects everything: what single scattering keeps. To 0.01.
pub fn mirror_albedo(ggx: Ggx, cos: f32) -> f32 {
    static TABLE: OnceLock<Vec<Row>> = OnceLock::new();
    let alpha_at = |i: usize| (i as f32 / (ALPHAS - 1) as f32).powi(2).max(Ggx::SMOOTH);
    let table = TABLE.get_or_init(|| (0..ALPHAS).map(|i| row(Ggx { alpha: alpha_at(i) }, |_| 1.0)).collect());
    let (i, t) = node(ggx.alpha.sqrt(), ALPHAS);
    lerp(t, interpolated(&table[i], cos), interpolated(&table[i + 1], cos))
}

/// The albedos of a surface whose facets have the reflectance `fresnel`.
fn row(ggx: Ggx, fresnel: impl Fn(f32) -> f32) -> Row {
    std::array::from_fn(|i| lattice_albedo(ggx, (i as f32 / (COSINES - 1) as f32).powi(2), &fresnel))
}

/// The mean sampling weight over a lattice of random numbers.
fn lattice_albedo(ggx: Ggx, cos: f32, fresnel: &impl Fn(f32) -> f32) -> f32 {
    // Fibonacci's lattice, whose rows and columns are stratified.
    const POINTS: u32 = 610;
    const STEP: u32 = 377;
    let wo = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos.max(MIN_COS));
    let coordinate = |k: u32| (k as f32 + 0.5) / POINTS as f32;
    let weight = |k: u32| {
        let sample = ggx.sample(wo, [coordinate(k), coordinate(k * STEP % POINTS)]);
        sample.weight * fresnel(sample.cos_half)
    };
    (0..POINTS).map(weight).sum::<f32>() / POINTS as f32
}

/// The mean of a row over `2 cos d(cos)`.
fn average(row: &Row) -> f32 {
    const STEPS: usize = 16 * (COSINES - 1);
    let value = |i: usize| {
        let x = (i as f32 + 0.5) / STEPS as f32;
        4.0 * x.powi(3) * interpolated(row, x * x)
    };
    (0..STEPS).map(value).sum::<f32>() / STEPS as f32
}

#[inline(always)]
fn interpolated(row: &Row, cos: f32) -> f32 {
    let (i, t) = node(cos.max(0.0).sqrt(), COSINES);
    lerp(t, row[i], row[i + 1])
}

/// The node below `x` in `[0, 1]`, and how far `x` is towards the next.
#[inline(always)]
fn node(x: f32, count: usize) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * (count - 1) as f32;
    let i = (x as usize).min(count - 2);
    (i, x - i as f32)
}

#[inline(always)]
fn lerp(t: f32, a: f32, b: f32) -> f32 {
    a + t * (b - a)
}
