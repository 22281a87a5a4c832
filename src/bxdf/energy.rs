//! What rough mirrors return of light from everywhere: tables of GGX's directional albedo.
//!
//! Single scattering off microfacets has no closed form for it. One table over the index of refraction, the roughness
//! and the cosine of incidence is computed by the first call that needs it, in some tens of milliseconds.

use super::fresnel;
use super::microfacet::Ggx;
use glam::Vec3;
use std::sync::OnceLock;

/// Nodes over `(eta - 1) / (eta + 1)`, the amplitude reflectance at normal incidence; the last reflects everything.
const ETAS: usize = 9;
/// Nodes over the root of the roughness.
const ALPHAS: usize = 17;
/// Nodes over the root of the cosine: the albedo is steep at grazing incidence.
const COSINES: usize = 25;

struct Table {
    albedo: Vec<[[f32; COSINES]; ALPHAS]>,
    /// Means of `albedo` over `2 cos d(cos)`.
    average: Vec<[f32; ALPHAS]>,
}

/// The directional albedo of a rough dielectric boundary of index `eta >= 1`, from outside; transmitted light is not
/// counted. To 0.01, and to 0.002 for a roughness above 0.1.
pub fn dielectric_albedo(ggx: Ggx, eta: f32, cos: f32) -> f32 {
    albedo(ggx, (eta - 1.0) / (eta + 1.0), cos)
}

/// The mean of [`dielectric_albedo`] over diffuse light.
pub fn dielectric_average(ggx: Ggx, eta: f32) -> f32 {
    let average = &table().average;
    let (i, s) = node((eta - 1.0) / (eta + 1.0), ETAS);
    let (j, t) = node(ggx.alpha.sqrt(), ALPHAS);
    lerp(s, lerp(t, average[i][j], average[i][j + 1]), lerp(t, average[i + 1][j], average[i + 1][j + 1]))
}

/// The directional albedo of a rough mirror that reflects everything: what single scattering keeps.
pub fn mirror_albedo(ggx: Ggx, cos: f32) -> f32 {
    albedo(ggx, 1.0, cos)
}

fn albedo(ggx: Ggx, amplitude: f32, cos: f32) -> f32 {
    let albedo = &table().albedo;
    let (i, s) = node(amplitude, ETAS);
    let (j, t) = node(ggx.alpha.sqrt(), ALPHAS);
    let (k, u) = node(cos.max(0.0).sqrt(), COSINES);
    let row = |i: usize, j: usize| lerp(u, albedo[i][j][k], albedo[i][j][k + 1]);
    lerp(s, lerp(t, row(i, j), row(i, j + 1)), lerp(t, row(i + 1, j), row(i + 1, j + 1)))
}

/// The node below `x` in `[0, 1]`, and how far `x` is towards the next.
#[inline]
fn node(x: f32, count: usize) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * (count - 1) as f32;
    let i = (x as usize).min(count - 2);
    (i, x - i as f32)
}

#[inline]
fn lerp(t: f32, a: f32, b: f32) -> f32 {
    a + t * (b - a)
}

fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| {
        let albedo: Vec<_> = (0..ETAS).map(slice).collect();
        let average = albedo.iter().map(|slice| slice.map(|row| average(&row))).collect();
        Table { albedo, average }
    })
}

/// The table at one index of refraction.
fn slice(i: usize) -> [[f32; COSINES]; ALPHAS] {
    let unit = |i: usize, count: usize| i as f32 / (count - 1) as f32;
    let amplitude = unit(i, ETAS);
    let reflectance = |cos: f32| {
        if i + 1 == ETAS { 1.0 } else { fresnel::dielectric(cos, (1.0 + amplitude) / (1.0 - amplitude)).0 }
    };
    std::array::from_fn(|j| {
        let ggx = Ggx { alpha: unit(j, ALPHAS).powi(2).max(Ggx::SMOOTH) };
        std::array::from_fn(|k| lattice_albedo(ggx, unit(k, COSINES).powi(2).max(1e-6), &reflectance))
    })
}

/// The mean sampling weight over a lattice of random numbers.
fn lattice_albedo(ggx: Ggx, cos: f32, reflectance: &impl Fn(f32) -> f32) -> f32 {
    // Fibonacci's lattice of 233 points, whose rows and columns are stratified.
    const POINTS: u32 = 233;
    const STEP: u32 = 144;
    let wo = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let unit = |k: u32| (k as f32 + 0.5) / POINTS as f32;
    let weight = |k: u32| {
        let sample = ggx.sample(wo, [unit(k), unit(k * STEP % POINTS)]);
        sample.weight * reflectance(sample.cos_half)
    };
    (0..POINTS).map(weight).sum::<f32>() / POINTS as f32
}

/// The mean over `2 cos d(cos)` of a row, linear in the root of the cosine between its nodes.
fn average(row: &[f32; COSINES]) -> f32 {
    const FINE: usize = 16;
    let steps = (COSINES - 1) * FINE;
    let value = |i: usize| {
        let x = (i as f32 + 0.5) / steps as f32;
        let (k, t) = node(x, COSINES);
        4.0 * x.powi(3) * lerp(t, row[k], row[k + 1])
    };
    (0..steps).map(value).sum::<f32>() / steps as f32
}
