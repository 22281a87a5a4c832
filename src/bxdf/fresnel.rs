//! Fresnel's equations for unpolarised light, exact.
//!
//! Sources: Born and Wolf 1999, *Principles of Optics*, 1.5.2 and 14.2; Lagarde 2013, *Memo on Fresnel equations*.

/// Reflectance of a boundary between dielectrics, and the cosine on its far side.
///
/// `cos` in `[0, 1]` is the cosine of incidence, `eta` the index of the far side over that of the near side.
/// Under total internal reflection this is `(1, 0)`.
#[inline(always)]
pub fn dielectric(cos: f32, eta: f32) -> (f32, f32) {
    // sin^2 on the far side as 1 - sin^2 / eta^2, without cancelling where eta is near 1.
    let cos2_far = (cos * cos + (eta - 1.0) * (eta + 1.0)) / (eta * eta);
    let cos_far = cos2_far.max(0.0).sqrt();
    let s = (cos - eta * cos_far) / (cos + eta * cos_far);
    let p = (eta * cos - cos_far) / (eta * cos + cos_far);
    let partial = if eta == 1.0 { 0.0 } else { (0.5 * (s * s + p * p)).min(1.0) };
    (if cos2_far <= 0.0 { 1.0 } else { partial }, cos_far)
}

/// Reflectance of a conductor of index `eta + i k` in air at the cosine of incidence `cos` in `[0, 1]`.
///
/// In f64, so that no `k` that f32 holds overflows its fourth power.
#[inline(always)]
pub fn conductor(cos: f32, eta: f32, k: f32) -> f32 {
    let (cos, eta, k) = (f64::from(cos).min(1.0), f64::from(eta), f64::from(k));
    let (cos2, sin2) = (cos * cos, 1.0 - cos * cos);
    // a + i b is the complex cosine inside times the index: (a + i b)^2 = (eta + i k)^2 - sin^2.
    let real = (eta - k) * (eta + k) - sin2;
    let norm = (real * real + 4.0 * eta * eta * k * k).sqrt();
    // The sum cancels for a good metal; the product of both roots does not.
    let [sum, product] = [0.5 * (norm + real), 2.0 * eta * eta * k * k / (norm - real)];
    let a2 = if real >= 0.0 { sum } else { product };
    let cross = 2.0 * cos * a2.sqrt();
    let s = ratio(norm + cos2, cross);
    let p = s * ratio(cos2 * norm + sin2 * sin2, cross * sin2);
    (0.5 * (s + p)).clamp(0.0, 1.0) as f32
}

/// `(a - b) / (a + b)`, and 1 where both are 0.
#[inline(always)]
fn ratio(a: f64, b: f64) -> f64 {
    let ratio = (a - b) / (a + b);
    if a + b == 0.0 { 1.0 } else { ratio }
}

/// Reflectance of a dielectric under diffuse light from outside: the mean of [`dielectric`] over `2 cos d(cos)`,
/// for `eta >= 1`. From inside it is `1 - (1 - F) / eta^2`.
///
/// Source: Walsh 1926, in Duntley 1942, *The Optical Properties of Diffusing Materials*, eq. 23.
pub fn diffuse_average(eta: f32) -> f32 {
    // The closed form cancels near 1, where the reflectance is proportional to eta - 1 to 1e-5 of it.
    const NEAR: f64 = 1.001;
    let n = f64::from(eta).max(1.0);
    if n < NEAR {
        return ((n - 1.0) / (NEAR - 1.0) * walsh(NEAR)) as f32;
    }
    walsh(n) as f32
}

/// The closed form of [`diffuse_average`].
fn walsh(n: f64) -> f64 {
    let (n2, n4) = (n * n, n * n * n * n);
    0.5 + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0).powi(2))
        + n2 * (n2 - 1.0).powi(2) / (n2 + 1.0).powi(3) * ((n - 1.0) / (n + 1.0)).ln()
        - 2.0 * n * n2 * (n2 + 2.0 * n - 1.0) / ((n2 + 1.0) * (n4 - 1.0))
        + 8.0 * n4 * (n4 + 1.0) / ((n2 + 1.0) * (n4 - 1.0).powi(2)) * n.ln()
}
