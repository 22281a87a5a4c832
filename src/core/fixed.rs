//! Sums that do not depend on the order of their terms.

/// A fixed-point number with `FRACTION` of its 128 bits behind the point: its sums are exact, so that they are
/// the same bits in whatever order, thread, tile or shard the terms came.
///
/// A term is cut to a multiple of `2^-FRACTION`; a sum beyond the range stays at the end of the range.
///
/// serde sees the words of [`to_words`](Fixed::to_words).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(into = "[u32; 4]", from = "[u32; 4]")]
pub struct Fixed<const FRACTION: i32>(i128);

impl<const FRACTION: i32> Fixed<FRACTION> {
    /// Nothing added yet.
    pub const ZERO: Self = Self(0);

    /// The multiple of `2^-FRACTION` next to `x` towards zero; zero for a NaN.
    #[inline]
    pub fn new(x: f64) -> Self {
        // A power of two scales without rounding, and `as` cuts towards zero and stays within the range.
        let scaled = x * f64::from_bits(((1023 + FRACTION) as u64) << 52);
        let exponent = (scaled.to_bits() >> 52) as i32 - 1075;
        // Whole numbers from 2^52 to 2^116 are the mantissa, shifted: what `as` calls a function for.
        if (0..64).contains(&exponent) {
            let mantissa = scaled.to_bits() & ((1 << 52) - 1) | 1 << 52;
            return Self(i128::from(mantissa) << exponent);
        }
        Self(scaled as i128)
    }

    /// The multiple of `2^-FRACTION` next to a finite `x` towards zero: the same as [`new`](Self::new), faster.
    ///
    /// `|x|` stays below `2^(127 - FRACTION)`.
    #[inline]
    pub fn from_finite(x: f32) -> Self {
        let bits = x.to_bits();
        let exponent = (bits >> 23 & 0xff) as i32;
        let mantissa = i128::from(bits & 0x007f_ffff | if exponent == 0 { 0 } else { 0x0080_0000 });
        let shift = exponent.max(1) - 150 + FRACTION;
        let magnitude = if shift >= 0 { mantissa << shift.min(103) } else { mantissa >> (-shift).min(127) };
        Self(if x < 0.0 { -magnitude } else { magnitude })
    }

    /// The sum as an `f64`, cut to its 64 leading bits and then rounded.
    #[inline]
    pub fn to_f64(self) -> f64 {
        let magnitude = self.0.unsigned_abs();
        let shift = 64u32.saturating_sub(magnitude.leading_zeros());
        let scale = f64::from_bits(((1023 + shift as i64 - i64::from(FRACTION)) as u64) << 52);
        let value = (magnitude >> shift) as u64 as f64 * scale;
        if self.0 < 0 { -value } else { value }
    }

    /// The bits, least significant word first: what a file stores.
    pub fn to_words(self) -> [u32; 4] {
        let bits = self.0 as u128;
        [bits as u32, (bits >> 32) as u32, (bits >> 64) as u32, (bits >> 96) as u32]
    }

    /// The number that [`to_words`](Self::to_words) wrote.
    pub fn from_words(words: [u32; 4]) -> Self {
        Self(words.iter().rev().fold(0u128, |bits, &w| bits << 32 | u128::from(w)) as i128)
    }
}

impl<const FRACTION: i32> From<Fixed<FRACTION>> for [u32; 4] {
    fn from(fixed: Fixed<FRACTION>) -> Self {
        fixed.to_words()
    }
}

impl<const FRACTION: i32> From<[u32; 4]> for Fixed<FRACTION> {
    fn from(words: [u32; 4]) -> Self {
        Self::from_words(words)
    }
}

impl<const FRACTION: i32> std::ops::AddAssign for Fixed<FRACTION> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.0 = self.0.saturating_add(other.0);
    }
}

/// Bits behind the point of the ordinary terms.
const ORDINARY: i32 = 43;
/// The least ordinary number but zero, `2^-20`, and the first beyond all, `2^11`, by their bits.
const ORDINARY_BITS: std::ops::Range<u32> = 0x3580_0000..0x4500_0000;

/// A sum of terms of ordinary size in 64 bits, where they add up in a fraction of the time that a [`Fixed`] takes.
///
/// It is exact: an ordinary term is a multiple of `2^-43`, which is the unit of the sum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ordinary(u64);

impl Ordinary {
    /// Whether a term is of ordinary size: zero or in `[2^-20, 2^11)`.
    #[inline(always)]
    pub fn holds(x: f32) -> bool {
        let bits = x.to_bits();
        ORDINARY_BITS.contains(&bits) || bits == 0
    }

    /// Adds a term that it [`holds`](Self::holds) to a sum that is not [full](Self::is_full).
    #[inline(always)]
    pub fn add(&mut self, x: f32) {
        let bits = x.to_bits();
        let mantissa = u64::from(bits & 0x007f_ffff | 0x0080_0000);
        self.0 += if bits == 0 { 0 } else { mantissa << ((bits >> 23) as i32 - 150 + ORDINARY) };
    }

    /// Whether it is to be emptied before the next term, which may be as large as `2^54` units.
    #[inline(always)]
    pub fn is_full(self) -> bool {
        self.0 >= 1 << 63
    }
}

impl<const FRACTION: i32> From<Ordinary> for Fixed<FRACTION> {
    /// The same sum, where `FRACTION` is at least 43.
    #[inline]
    fn from(sum: Ordinary) -> Self {
        Self(i128::from(sum.0) << (FRACTION - ORDINARY))
    }
}

/// A sum in two parts: that of its ordinary terms, and that of the others, which is nearly always zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gathered<const FRACTION: i32> {
    /// Of ordinary terms.
    pub ordinary: Ordinary,
    /// Of all others.
    pub rest: Fixed<FRACTION>,
}

impl<const FRACTION: i32> Gathered<FRACTION> {
    /// The sum.
    #[inline]
    pub fn sum(self) -> Fixed<FRACTION> {
        let mut sum = self.ordinary.into();
        if self.rest != Fixed::ZERO {
            sum += self.rest;
        }
        sum
    }

    /// The sum as [`Fixed::to_f64`] has it.
    #[inline]
    pub fn to_f64(self) -> f64 {
        if self.rest != Fixed::ZERO || self.ordinary.is_full() {
            return self.sum().to_f64();
        }
        // Below 2^63, so that the signed conversion, which is faster, is the same.
        self.ordinary.0 as i64 as f64 * (1.0 / (1u64 << ORDINARY) as f64)
    }
}

impl<const FRACTION: i32> From<f32> for Gathered<FRACTION> {
    /// A finite number, cut to a multiple of `2^-FRACTION`; `|x|` stays below `2^(127 - FRACTION)`.
    fn from(x: f32) -> Self {
        Self { rest: Fixed::from_finite(x), ..Self::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gathered_sums_are_the_sums() {
        let edges = [0.0, -0.0, 2f32.powi(-20), 2048.0, -1.5, 1e-30, 3e9, f32::MIN_POSITIVE / 8.0];
        let below = [2f32.powi(-20), 2048.0].map(f32::next_down);
        let many = (0..3000).map(|i| (i as f32 * 0.37).sin().exp2() * 2047.0 / (1 + i % 7) as f32);
        let (mut gathered, mut sum, mut emptied) = (Gathered::<72>::default(), Fixed::<72>::ZERO, 0);
        for x in edges.into_iter().chain(below).chain(many) {
            if gathered.ordinary.is_full() {
                gathered = Gathered { rest: gathered.sum(), ..Gathered::default() };
                emptied += 1;
            }
            if Ordinary::holds(x) {
                gathered.ordinary.add(x);
            } else {
                gathered.rest += Fixed::from_finite(x);
            }
            sum += Fixed::from_finite(x);
            assert_eq!((gathered.sum(), gathered.to_f64()), (sum, sum.to_f64()), "{x}");
        }
        assert!(emptied > 0, "so many are too much for 64 bits");
        assert_eq!(Gathered::<72>::from(0.1).sum(), Fixed::from_finite(0.1));
    }

    #[test]
    fn a_million_small_terms_do_not_stall_against_a_large_one() {
        let mut sum = Fixed::<72>::new(1e8);
        for _ in 0..1_000_000 {
            sum += Fixed::new(f64::from(1e-8f32));
        }
        let exact = 1e8 + 1e6 * f64::from(1e-8f32);
        assert!((sum.to_f64() - exact).abs() < 1e-7, "{}", sum.to_f64());
    }

    #[test]
    fn the_order_of_the_terms_changes_no_bit() {
        let terms: Vec<f64> =
            (0..1000).map(|i| f64::from((i as f32 * 0.37).sin().exp2() * 10f32.powi(i % 13 - 6))).collect();
        let sum = |order: &mut dyn Iterator<Item = &f64>| {
            let mut sum = Fixed::<72>::ZERO;
            order.for_each(|&x| sum += Fixed::new(x));
            sum
        };
        assert_eq!(sum(&mut terms.iter()), sum(&mut terms.iter().rev()));
    }

    #[test]
    fn the_fast_conversion_is_the_conversion() {
        for exponent in -40..52 {
            for mantissa in [1.0f32, 1.000_000_1, 1.5, 1.999_999_9] {
                for x in [mantissa * 2f32.powi(exponent), -mantissa * 2f32.powi(exponent)] {
                    assert_eq!(Fixed::<72>::from_finite(x), Fixed::new(f64::from(x)), "{x}");
                }
            }
        }
        for x in [0.0, -0.0, f32::MIN_POSITIVE, f32::MIN_POSITIVE / 8.0, 1e-30] {
            assert_eq!(Fixed::<72>::from_finite(x), Fixed::new(f64::from(x)), "{x}");
        }
    }

    #[test]
    fn a_number_is_cut_as_a_conversion_cuts_it() {
        for exponent in -60..64 {
            for mantissa in [1.0f64, 1.0 + f64::EPSILON, 1.3, 2.0 - f64::EPSILON] {
                let x = mantissa * 2f64.powi(exponent);
                for x in [x, -x] {
                    assert_eq!(Fixed::<64>::new(x).0, (x * 2f64.powi(64)) as i128, "{x}");
                }
            }
        }
    }

    #[test]
    fn words_round_trip_and_the_ends_of_the_range_hold() {
        for x in [0.0, -1.5, 3.25e7, -1e-15, 1e300, -1e300] {
            let fixed = Fixed::<72>::new(x);
            assert_eq!(Fixed::from_words(fixed.to_words()), fixed);
        }
        assert_eq!(Fixed::<72>::new(f64::NAN), Fixed::ZERO);
        let mut end = Fixed::<72>::new(f64::INFINITY);
        end += Fixed::new(1.0);
        assert!(end.to_f64() > 3e16);
    }
}
