//! Smooth noise with its gradient.

use glam::DVec3;

/// Odd numbers that set the steps along the axes apart (fractional parts of square roots).
const STEPS: [u64; 3] = [0x9e37_79b9_7f4a_7c15, 0xbb67_ae85_84ca_a73b, 0x3c6e_f372_fe94_f82b];

/// A whole number, each of whose bits depends on all of the given one's (the finaliser of SplitMix64: Steele, Lea,
/// Flood 2014).
#[inline]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Twelve directions to the edges of a cube (Perlin 2002, "Improving noise"), four of them twice.
const DIRECTIONS: [DVec3; 16] = {
    let v = DVec3::new;
    [
        v(1., 1., 0.),
        v(-1., 1., 0.),
        v(1., -1., 0.),
        v(-1., -1., 0.),
        v(1., 0., 1.),
        v(-1., 0., 1.),
        v(1., 0., -1.),
        v(-1., 0., -1.),
        v(0., 1., 1.),
        v(0., -1., 1.),
        v(0., 1., -1.),
        v(0., -1., -1.),
        v(1., 1., 0.),
        v(-1., 1., 0.),
        v(0., -1., 1.),
        v(0., -1., -1.),
    ]
};

/// Gradient noise, within about -1 to 1 and of period about 1, and its gradient (Perlin 2002).
fn gradient_noise(p: DVec3, seed: u64) -> (f64, DVec3) {
    let cell = p.floor();
    let f = p - cell;
    let [x, y, z] = cell.to_array().map(|x| x as i64 as u64);
    let [dx, dy, dz] = STEPS;
    let home = mix(seed)
        .wrapping_add(x.wrapping_mul(dx))
        .wrapping_add(y.wrapping_mul(dy))
        .wrapping_add(z.wrapping_mul(dz));
    // The quintic fade and its derivative, per axis, for the lower and the upper corner of the cell.
    let fade = f * f * f * (f * (6.0 * f - 15.0) + 10.0);
    let slope = 30.0 * f * f * (f - 1.0) * (f - 1.0);
    let (mut value, mut gradient) = (0.0, DVec3::ZERO);
    for corner in 0..8_u64 {
        let bits = [corner & 1, corner >> 1 & 1, corner >> 2];
        let offset = DVec3::from_array(bits.map(|bit| bit as f64));
        let lattice = (0..3).fold(home, |sum, axis| sum.wrapping_add(bits[axis].wrapping_mul(STEPS[axis])));
        let direction = DIRECTIONS[(mix(lattice) >> 60) as usize];
        let ramp = direction.dot(f - offset);
        let weight = DVec3::select(offset.cmpeq(DVec3::ONE), fade, 1.0 - fade);
        let rise = (2.0 * offset - 1.0) * slope;
        let product = weight.x * weight.y * weight.z;
        value += product * ramp;
        gradient += product * direction
            + ramp * rise * DVec3::new(weight.y * weight.z, weight.x * weight.z, weight.x * weight.y);
    }
    (value, gradient)
}

/// The octaves that triangles of the given edge length can show: at least eight edges to a period.
///
/// More would make normals that the triangles know nothing of.
pub(super) fn octaves_for(frequency: f64, edge: f64) -> u32 {
    (1.0 / (8.0 * frequency * edge)).log2().floor().clamp(0.0, 9.0) as u32 + 1
}

/// A sum of octaves of noise, each of twice the frequency and half the height of the one before, and its gradient.
pub(super) fn fractal_noise(p: DVec3, octaves: u32, seed: u64) -> (f64, DVec3) {
    let (mut value, mut gradient) = (0.0, DVec3::ZERO);
    let mut frequency = 1.0;
    for octave in 0..octaves {
        let (v, g) = gradient_noise(frequency * p, seed.wrapping_add(u64::from(octave)));
        value += v / frequency;
        gradient += g;
        frequency *= 2.0;
    }
    (value, gradient)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gradient_is_that_of_the_value() {
        let step = 1e-5;
        for i in 0..200 {
            let p = DVec3::new(0.37, -1.61, 2.23) * f64::from(i) * 0.171;
            let (_, gradient) = fractal_noise(p, 4, 9);
            for (axis, expected) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().zip(gradient.to_array()) {
                let ends = [p - step * axis, p + step * axis].map(|q| fractal_noise(q, 4, 9).0);
                let difference = (ends[1] - ends[0]) / (2.0 * step);
                assert!((difference - expected).abs() < 1e-6, "{p}: {difference} and {expected}");
            }
        }
    }

    #[test]
    fn seeds_give_different_noise() {
        let p = DVec3::new(0.3, 0.4, 0.6);
        assert_ne!(fractal_noise(p, 3, 1).0, fractal_noise(p, 3, 2).0);
    }
}
