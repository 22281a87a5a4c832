//! Vectors of SSE2 and AVX2.

use super::portable::pack;
use super::{Lanes, Mask, Packed, Simd};
use core::arch::x86_64::*;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// Proof that the features of `run_avx2` are enabled where this value is.
#[derive(Clone, Copy)]
pub(in super::super) struct Avx2(());

impl Avx2 {
    /// # Safety
    /// Only where the features of `run_avx2` are enabled.
    #[inline(always)]
    pub(super) unsafe fn proven() -> Self {
        Self(())
    }
}

/// Proof of nothing: x86-64 has SSE2.
#[derive(Clone, Copy)]
pub(in super::super) struct Sse2;

/// Four floats of SSE2.
#[derive(Clone, Copy)]
pub(in super::super) struct Sse4(__m128);

/// Four floats with fused multiply-add; exists only where [`Avx2`] does.
#[derive(Clone, Copy)]
pub(in super::super) struct Avx4(__m128);

/// Eight floats of SSE2.
#[derive(Clone, Copy)]
pub(in super::super) struct Sse8(__m128, __m128);

/// Eight floats of AVX2; exists only where [`Avx2`] does.
#[derive(Clone, Copy)]
pub(in super::super) struct Avx8(__m256);

// SAFETY (of every block in the macros): the SSE2 intrinsics are in the baseline of x86-64, and a value of
// `Avx8` was made by the token `Avx2`, that is under the features of `run_avx2`. None touches memory but the
// stores, whose targets are local arrays of the right length.
macro_rules! operators {
    ($type:ident, $($trait:ident $name:ident |$a:ident, $b:ident| $result:expr;)*) => { $(
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                let ($a, $b) = (self, other);
                // SAFETY: see above the macro.
                unsafe { $result }
            }
        }
    )* };
}

macro_rules! operators_of_four {
    ($($type:ident)*) => { $(
        operators! { $type,
            Add add |a, b| Self(_mm_add_ps(a.0, b.0));
            Sub sub |a, b| Self(_mm_sub_ps(a.0, b.0));
            Mul mul |a, b| Self(_mm_mul_ps(a.0, b.0));
            Div div |a, b| Self(_mm_div_ps(a.0, b.0));
            BitAnd bitand |a, b| Self(_mm_and_ps(a.0, b.0));
            BitOr bitor |a, b| Self(_mm_or_ps(a.0, b.0));
        }
    )* };
}
operators_of_four! { Sse4 Avx4 }
operators! { Sse8,
    Add add |a, b| Self(_mm_add_ps(a.0, b.0), _mm_add_ps(a.1, b.1));
    Sub sub |a, b| Self(_mm_sub_ps(a.0, b.0), _mm_sub_ps(a.1, b.1));
    Mul mul |a, b| Self(_mm_mul_ps(a.0, b.0), _mm_mul_ps(a.1, b.1));
    Div div |a, b| Self(_mm_div_ps(a.0, b.0), _mm_div_ps(a.1, b.1));
    BitAnd bitand |a, b| Self(_mm_and_ps(a.0, b.0), _mm_and_ps(a.1, b.1));
    BitOr bitor |a, b| Self(_mm_or_ps(a.0, b.0), _mm_or_ps(a.1, b.1));
}
operators! { Avx8,
    Add add |a, b| Self(_mm256_add_ps(a.0, b.0));
    Sub sub |a, b| Self(_mm256_sub_ps(a.0, b.0));
    Mul mul |a, b| Self(_mm256_mul_ps(a.0, b.0));
    Div div |a, b| Self(_mm256_div_ps(a.0, b.0));
    BitAnd bitand |a, b| Self(_mm256_and_ps(a.0, b.0));
    BitOr bitor |a, b| Self(_mm256_or_ps(a.0, b.0));
}

macro_rules! lanes {
    ($type:ident, $n:literal, bits |$m:ident| $bits:expr, splat |$x:ident| $splat:expr,
     min |$a0:ident, $b0:ident| $min:expr, max |$a1:ident, $b1:ident| $max:expr,
     mul_sub |$a2:ident, $f2:ident, $b2:ident| $mul_sub:expr,
     mul_add |$a6:ident, $f6:ident, $b6:ident| $mul_add:expr,
     flip_sign |$a7:ident, $b7:ident| $flip_sign:expr,
     le |$a3:ident, $b3:ident| $le:expr,
     ne |$a4:ident, $b4:ident| $ne:expr, select |$k:ident, $a5:ident, $b5:ident| $select:expr,
     store |$v:ident, $to:ident| $store:expr) => {
        impl Mask for $type {
            #[inline(always)]
            fn bits(self) -> u32 {
                let $m = self;
                // SAFETY: see above the first macro.
                unsafe { $bits }
            }
        }
        impl Lanes<$n> for $type {
            type Mask = Self;
            #[inline(always)]
            fn splat(self, $x: f32) -> Self {
                // SAFETY: see above the first macro.
                unsafe { $splat }
            }
            #[inline(always)]
            fn min(self, $b0: Self) -> Self {
                let $a0 = self;
                // SAFETY: see above the first macro.
                unsafe { $min }
            }
            #[inline(always)]
            fn max(self, $b1: Self) -> Self {
                let $a1 = self;
                // SAFETY: see above the first macro.
                unsafe { $max }
            }
            #[inline(always)]
            fn mul_sub(self, $f2: Self, $b2: Self) -> Self {
                let $a2 = self;
                $mul_sub
            }
            #[inline(always)]
            fn mul_add(self, $f6: Self, $b6: Self) -> Self {
                let $a6 = self;
                $mul_add
            }
            #[inline(always)]
            fn flip_sign(self, $b7: Self) -> Self {
                let $a7 = self;
                // SAFETY: see above the first macro.
                unsafe { $flip_sign }
            }
            #[inline(always)]
            fn le(self, $b3: Self) -> Self {
                let $a3 = self;
                // SAFETY: see above the first macro.
                unsafe { $le }
            }
            #[inline(always)]
            fn ne(self, $b4: Self) -> Self {
                let $a4 = self;
                // SAFETY: see above the first macro.
                unsafe { $ne }
            }
            #[inline(always)]
            fn select(self, $k: Self, $b5: Self) -> Self {
                let $a5 = self;
                // SAFETY: see above the first macro.
                unsafe { $select }
            }
            #[inline(always)]
            fn to_array(self) -> [f32; $n] {
                let $v = self;
                let mut array = [0.0; $n];
                let $to: *mut f32 = array.as_mut_ptr();
                // SAFETY: see above the first macro.
                unsafe { $store };
                array
            }
        }
    };
}

lanes! { Sse4, 4,
    bits |m| _mm_movemask_ps(m.0) as u32, splat |x| Self(_mm_set1_ps(x)),
    min |a, b| Self(_mm_min_ps(a.0, b.0)), max |a, b| Self(_mm_max_ps(a.0, b.0)),
    mul_sub |a, f, b| a * f - b,
    mul_add |a, f, b| a * f + b,
    flip_sign |a, b| Self(_mm_xor_ps(a.0, _mm_and_ps(b.0, _mm_set1_ps(-0.0)))),
    le |a, b| Self(_mm_cmple_ps(a.0, b.0)),
    ne |a, b| Self(_mm_cmpneq_ps(a.0, b.0)),
    select |k, a, b| Self(_mm_or_ps(_mm_and_ps(k.0, a.0), _mm_andnot_ps(k.0, b.0))),
    store |v, to| _mm_storeu_ps(to, v.0)
}
lanes! { Avx4, 4,
    bits |m| _mm_movemask_ps(m.0) as u32, splat |x| Self(_mm_set1_ps(x)),
    min |a, b| Self(_mm_min_ps(a.0, b.0)), max |a, b| Self(_mm_max_ps(a.0, b.0)),
    // SAFETY: see above the first macro.
    mul_sub |a, f, b| Self(unsafe { _mm_fmsub_ps(a.0, f.0, b.0) }),
    // SAFETY: see above the first macro.
    mul_add |a, f, b| Self(unsafe { _mm_fmadd_ps(a.0, f.0, b.0) }),
    flip_sign |a, b| Self(_mm_xor_ps(a.0, _mm_and_ps(b.0, _mm_set1_ps(-0.0)))),
    le |a, b| Self(_mm_cmple_ps(a.0, b.0)),
    ne |a, b| Self(_mm_cmpneq_ps(a.0, b.0)),
    select |k, a, b| Self(_mm_blendv_ps(b.0, a.0, k.0)),
    store |v, to| _mm_storeu_ps(to, v.0)
}
lanes! { Sse8, 8,
    bits |m| (_mm_movemask_ps(m.0) | _mm_movemask_ps(m.1) << 4) as u32,
    splat |x| Self(_mm_set1_ps(x), _mm_set1_ps(x)),
    min |a, b| Self(_mm_min_ps(a.0, b.0), _mm_min_ps(a.1, b.1)),
    max |a, b| Self(_mm_max_ps(a.0, b.0), _mm_max_ps(a.1, b.1)),
    mul_sub |a, f, b| a * f - b,
    mul_add |a, f, b| a * f + b,
    flip_sign |a, b| {
        let sign = _mm_set1_ps(-0.0);
        Self(_mm_xor_ps(a.0, _mm_and_ps(b.0, sign)), _mm_xor_ps(a.1, _mm_and_ps(b.1, sign)))
    },
    le |a, b| Self(_mm_cmple_ps(a.0, b.0), _mm_cmple_ps(a.1, b.1)),
    ne |a, b| Self(_mm_cmpneq_ps(a.0, b.0), _mm_cmpneq_ps(a.1, b.1)),
    select |k, a, b| Self(
        _mm_or_ps(_mm_and_ps(k.0, a.0), _mm_andnot_ps(k.0, b.0)),
        _mm_or_ps(_mm_and_ps(k.1, a.1), _mm_andnot_ps(k.1, b.1))
    ),
    store |v, to| { _mm_storeu_ps(to, v.0); _mm_storeu_ps(to.add(4), v.1) }
}
lanes! { Avx8, 8,
    bits |m| _mm256_movemask_ps(m.0) as u32, splat |x| Self(_mm256_set1_ps(x)),
    min |a, b| Self(_mm256_min_ps(a.0, b.0)), max |a, b| Self(_mm256_max_ps(a.0, b.0)),
    // SAFETY: see above the first macro.
    mul_sub |a, f, b| Self(unsafe { _mm256_fmsub_ps(a.0, f.0, b.0) }),
    // SAFETY: see above the first macro.
    mul_add |a, f, b| Self(unsafe { _mm256_fmadd_ps(a.0, f.0, b.0) }),
    flip_sign |a, b| Self(_mm256_xor_ps(a.0, _mm256_and_ps(b.0, _mm256_set1_ps(-0.0)))),
    le |a, b| Self(_mm256_cmp_ps::<_CMP_LE_OQ>(a.0, b.0)),
    ne |a, b| Self(_mm256_cmp_ps::<_CMP_NEQ_UQ>(a.0, b.0)),
    select |k, a, b| Self(_mm256_blendv_ps(b.0, a.0, k.0)),
    store |v, to| _mm256_storeu_ps(to, v.0)
}

macro_rules! tokens {
    ($($token:ident $f4:ident $f8:ident |$p:ident| $load:expr, |$x:ident| $splat:expr, |$a:ident, $b:ident| $pair:expr, |$lo:ident, $hi:ident| $join:expr, |$w:ident| $swap:expr, |$o:ident, $s:ident, $l:ident, $m:ident| $pack:expr;)*) => { $(
        impl Simd for $token {
            type F4 = $f4;
            type F8 = $f8;
            type Marks = $f8;
            #[inline(always)]
            fn load4(self, from: &[f32; 4]) -> $f4 {
                // SAFETY: four floats are read from an array of four; SSE2 is in the baseline.
                $f4(unsafe { _mm_loadu_ps(from.as_ptr()) })
            }
            #[inline(always)]
            fn splat4(self, x: f32) -> $f4 {
                // SAFETY: SSE2 is in the baseline.
                $f4(unsafe { _mm_set1_ps(x) })
            }
            #[inline(always)]
            fn load8(self, from: &[f32; 8]) -> $f8 {
                let $p = from.as_ptr();
                // SAFETY: eight floats are read from an array of eight; the token proves the features.
                unsafe { $load }
            }
            #[inline(always)]
            fn splat8(self, $x: f32) -> $f8 {
                // SAFETY: the token proves the features.
                unsafe { $splat }
            }
            #[inline(always)]
            fn pair8(self, $a: f32, $b: f32) -> $f8 {
                // SAFETY: the token proves the features.
                unsafe { $pair }
            }
            #[inline(always)]
            fn join8(self, low: &[f32; 4], high: &[f32; 4]) -> $f8 {
                let ($lo, $hi) = (low.as_ptr(), high.as_ptr());
                // SAFETY: four floats are read from each array of four; the token proves the features.
                unsafe { $join }
            }
            #[inline(always)]
            fn swap_halves(self, $w: $f8) -> $f8 {
                $swap
            }
            #[inline(always)]
            fn mask8(self, bits: u32) -> $f8 {
                let lane = |i: u32| f32::from_bits((bits >> i & 1).wrapping_neg());
                self.load8(&[lane(0), lane(1), lane(2), lane(3), lane(4), lane(5), lane(6), lane(7)])
            }
            #[inline(always)]
            fn no_marks(self) -> $f8 {
                self.splat8(0.0)
            }
            #[inline(always)]
            fn mark(self, marks: $f8, mask: $f8, bit: u32) -> $f8 {
                marks | mask & self.splat8(f32::from_bits(bit))
            }
            #[inline(always)]
            fn pack_marked(self, $o: &[u32; 8], $s: u32, $l: &[u32; 8], $m: $f8) -> Packed {
                $pack
            }
        }
    )* };
}
tokens! {
    Avx2 Avx4 Avx8 |p| Avx8(_mm256_loadu_ps(p)), |x| Avx8(_mm256_set1_ps(x)),
        |a, b| Avx8(_mm256_blend_ps::<0xf0>(_mm256_set1_ps(a), _mm256_set1_ps(b))),
        |low, high| Avx8(_mm256_insertf128_ps::<1>(_mm256_castps128_ps256(_mm_loadu_ps(low)), _mm_loadu_ps(high))),
        // SAFETY: the token proves the features.
        |v| Avx8(unsafe { _mm256_permute2f128_ps::<1>(v.0, v.0) }),
        // SAFETY: the token proves the features.
        |order, shift, lanes, marks| unsafe { pack_avx2(order, shift, lanes, marks.0) };
    Sse2 Sse4 Sse8 |p| Sse8(_mm_loadu_ps(p), _mm_loadu_ps(p.add(4))), |x| Sse8(_mm_set1_ps(x), _mm_set1_ps(x)),
        |a, b| Sse8(_mm_set1_ps(a), _mm_set1_ps(b)), |low, high| Sse8(_mm_loadu_ps(low), _mm_loadu_ps(high)),
        |v| Sse8(v.1, v.0),
        |order, shift, lanes, marks| pack(order, shift, lanes, marks.to_array().map(f32::to_bits));
}

/// For each set of lanes their numbers, packed to the front.
static PACKED: [[u8; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut set = 0;
    while set < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < 8 {
            if set >> lane & 1 == 1 {
                table[set][count] = lane as u8;
                count += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    table
};

/// [`Simd::pack_marked`] by permutations.
///
/// # Safety
/// Only where the features of `run_avx2` are enabled.
#[inline(always)]
unsafe fn pack_avx2(order: &[u32; 8], shift: u32, lanes: &[u32; 8], marks: __m256) -> Packed {
    let mut packed = Packed { lanes: [0; 8], marks: [0; 8], count: 0 };
    // SAFETY: eight integers are read from arrays of eight, unaligned, and written to such; the caller has the features.
    unsafe {
        let load = |from: &[u32; 8]| _mm256_loadu_si256(from.as_ptr().cast());
        let order = _mm256_srl_epi32(load(order), _mm_cvtsi32_si128(shift as i32));
        let in_order = _mm256_permutevar8x32_epi32(_mm256_castps_si256(marks), order);
        let empty = _mm256_cmpeq_epi32(in_order, _mm256_setzero_si256());
        let members = !_mm256_movemask_ps(_mm256_castsi256_ps(empty)) as usize & 0xff;
        let front = _mm256_cvtepu8_epi32(_mm_loadl_epi64(PACKED[members].as_ptr().cast()));
        let kept = _mm256_permutevar8x32_epi32(load(lanes), _mm256_permutevar8x32_epi32(order, front));
        _mm256_storeu_si256(packed.lanes.as_mut_ptr().cast(), kept);
        let marks = _mm256_permutevar8x32_epi32(in_order, front);
        _mm256_storeu_si256(packed.marks.as_mut_ptr().cast(), marks);
        packed.count = members.count_ones() as usize;
    }
    packed
}
