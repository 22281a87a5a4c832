//! Vectors of 4 and 8 floats on AVX2, on SSE2 and in plain Rust: the only file here with intrinsics.
//!
//! The traversal is written once, over [`Simd`], and compiled once per instruction set: a [`Kernel`] handed to
//! [`Isa::run`] is inlined into a function with the right `#[target_feature]`. A vector of a set can only be made
//! by that set's token, and a token only by [`Isa::run`] after detection: that is why the operations are safe.
//!
//! Every operation gives the same bits on every set but [`Lanes::mul_sub`], which is for bounds alone.

#![allow(unsafe_code)] // Intrinsics: the reasons are at the blocks.

#[cfg(target_arch = "x86_64")]
use core::arch::x86_64::*;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// Instruction sets that the traversal is compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Isa {
    /// 8 lanes of AVX2 with fused multiply-add and bit manipulation (x86-64-v3).
    Avx2,
    /// 8 lanes as two of 4: what every x86-64 processor has.
    Sse2,
    /// Plain arrays.
    Portable,
}

impl Isa {
    /// All of them, the fastest first.
    pub const ALL: [Self; 3] = [Self::Avx2, Self::Sse2, Self::Portable];

    /// The fastest that this processor has.
    pub fn detect() -> Self {
        Self::ALL.into_iter().find(|isa| isa.is_available()).unwrap_or(Self::Portable)
    }

    /// Whether this processor has it.
    pub fn is_available(self) -> bool {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => {
                is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("fma")
                    && is_x86_feature_detected!("bmi1")
                    && is_x86_feature_detected!("bmi2")
                    && is_x86_feature_detected!("lzcnt")
                    && is_x86_feature_detected!("popcnt")
            }
            #[cfg(target_arch = "x86_64")]
            Self::Sse2 => true,
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Sse2 => false,
            Self::Portable => true,
        }
    }
}

/// An instruction set that was found on this processor: what makes [`run`](Self::run) sound.
#[derive(Clone, Copy, Debug)]
pub(super) struct Available(Isa);

impl Available {
    /// The set, if the processor has it.
    pub(super) fn new(isa: Isa) -> Option<Self> {
        isa.is_available().then_some(Self(isa))
    }

    /// The fastest set.
    pub(super) fn best() -> Self {
        Self(Isa::detect())
    }

    /// Which set it is.
    pub(super) fn isa(self) -> Isa {
        self.0
    }

    /// Runs the kernel, compiled for the set.
    #[inline]
    pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            // SAFETY: `self` exists only if `is_available` found every feature that `run_avx2` enables.
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2 => unsafe { run_avx2(kernel) },
            #[cfg(target_arch = "x86_64")]
            Isa::Sse2 => run_sse2(kernel),
            _ => run_portable(kernel),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
#[inline(never)]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(Avx2(()))
}

#[cfg(target_arch = "x86_64")]
#[inline(never)]
fn run_sse2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(Sse2(()))
}

#[inline(never)]
fn run_portable<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(Portable)
}

/// A loop to compile for each instruction set; `run` has to be `#[inline(always)]`, and so has what it calls.
pub(super) trait Kernel {
    /// What it gives.
    type Output;
    /// The loop.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Lane masks.
pub(super) trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> {
    /// Bit i is lane i.
    fn bits(self) -> u32;
}

/// A vector of `N` floats.
pub(super) trait Lanes<const N: usize>:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// What comparisons give.
    type Mask: Mask;

    /// `x` in every lane, on the same instruction set.
    fn splat(self, x: f32) -> Self;
    /// `self < other ? self : other`: the other where either is NaN.
    fn min(self, other: Self) -> Self;
    /// `self > other ? self : other`: the other where either is NaN.
    fn max(self, other: Self) -> Self;
    /// `self * factor - other` with one rounding or two, whichever is faster.
    fn mul_sub(self, factor: Self, other: Self) -> Self;
    /// `self <= other`, false for NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// `self != other`, true for NaN.
    fn ne(self, other: Self) -> Self::Mask;
    /// `mask ? self : other`.
    fn select(self, mask: Self::Mask, other: Self) -> Self;
    /// The lanes.
    fn to_array(self) -> [f32; N];
}

/// An instruction set that is there.
pub(super) trait Simd: Copy {
    /// Four floats.
    type F4: Lanes<4>;
    /// Eight floats.
    type F8: Lanes<8>;
    /// Eight sets of 32.
    type Marks: Copy;
    /// Whether packets and streams were measured to win over single rays on this set.
    const BATCHES: bool;

    /// Four floats from memory.
    fn load4(self, from: &[f32; 4]) -> Self::F4;
    /// One float, four times.
    fn splat4(self, x: f32) -> Self::F4;
    /// Eight floats from memory.
    fn load8(self, from: &[f32; 8]) -> Self::F8;
    /// One float, eight times.
    fn splat8(self, x: f32) -> Self::F8;

    /// The lanes whose bits are set.
    fn mask8(self, bits: u32) -> <Self::F8 as Lanes<8>>::Mask;
    /// Eight empty sets.
    fn no_marks(self) -> Self::Marks;
    /// The sets with `bit` added to those of the mask's lanes.
    fn mark(self, marks: Self::Marks, mask: <Self::F8 as Lanes<8>>::Mask, bit: u32) -> Self::Marks;
    /// The sets in memory.
    fn marks(self, marks: Self::Marks) -> [u32; 8];

    /// Asks for four cache lines from an address, which may be any.
    #[inline(always)]
    fn prefetch(self, address: *const u8) {
        #[cfg(target_arch = "x86_64")]
        for line in 0..4 {
            // SAFETY: prefetching is a hint that reads nothing and faults on no address.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(address.cast::<i8>().wrapping_add(64 * line)) };
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = address;
    }
}

// ---- plain arrays ----

/// Plain arrays: no instruction set at all.
#[derive(Clone, Copy)]
pub(super) struct Portable;

/// Lanes in an array.
#[derive(Clone, Copy)]
#[repr(C, align(16))]
pub(super) struct Array<const N: usize>(pub(super) [f32; N]);

/// Bit i is lane i.
#[derive(Clone, Copy)]
pub(super) struct Bits(u32);

impl BitAnd for Bits {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        Self(self.0 & o.0)
    }
}

impl BitOr for Bits {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, o: Self) -> Self {
        Self(self.0 | o.0)
    }
}

impl Mask for Bits {
    #[inline(always)]
    fn bits(self) -> u32 {
        self.0
    }
}

macro_rules! array_operators {
    ($($trait:ident $name:ident;)*) => { $(
        impl<const N: usize> $trait for Array<N> {
            type Output = Self;
            #[inline(always)]
            fn $name(mut self, o: Self) -> Self {
                for i in 0..N {
                    self.0[i] = f32::$name(self.0[i], o.0[i]);
                }
                self
            }
        }
    )* };
}
array_operators! { Add add; Sub sub; Mul mul; Div div; }

impl<const N: usize> Array<N> {
    #[inline(always)]
    fn compare(self, o: Self, holds: impl Fn(f32, f32) -> bool) -> Bits {
        let mut bits = 0;
        for i in 0..N {
            bits |= u32::from(holds(self.0[i], o.0[i])) << i;
        }
        Bits(bits)
    }
}

impl<const N: usize> Lanes<N> for Array<N> {
    type Mask = Bits;
    #[inline(always)]
    fn splat(self, x: f32) -> Self {
        Self([x; N])
    }
    #[inline(always)]
    fn min(mut self, o: Self) -> Self {
        for i in 0..N {
            self.0[i] = if self.0[i] < o.0[i] { self.0[i] } else { o.0[i] };
        }
        self
    }
    #[inline(always)]
    fn max(mut self, o: Self) -> Self {
        for i in 0..N {
            self.0[i] = if self.0[i] > o.0[i] { self.0[i] } else { o.0[i] };
        }
        self
    }
    #[inline(always)]
    fn mul_sub(self, factor: Self, o: Self) -> Self {
        self * factor - o
    }
    #[inline(always)]
    fn le(self, o: Self) -> Bits {
        self.compare(o, |a, b| a <= b)
    }
    #[inline(always)]
    fn ne(self, o: Self) -> Bits {
        self.compare(o, |a, b| a != b)
    }
    #[inline(always)]
    fn select(mut self, mask: Bits, o: Self) -> Self {
        for i in 0..N {
            self.0[i] = if mask.0 >> i & 1 == 1 { self.0[i] } else { o.0[i] };
        }
        self
    }
    #[inline(always)]
    fn to_array(self) -> [f32; N] {
        self.0
    }
}

impl Simd for Portable {
    type F4 = Array<4>;
    type F8 = Array<8>;
    type Marks = [u32; 8];
    const BATCHES: bool = false;
    #[inline(always)]
    fn load4(self, from: &[f32; 4]) -> Array<4> {
        Array(*from)
    }
    #[inline(always)]
    fn splat4(self, x: f32) -> Array<4> {
        Array([x; 4])
    }
    #[inline(always)]
    fn load8(self, from: &[f32; 8]) -> Array<8> {
        Array(*from)
    }
    #[inline(always)]
    fn splat8(self, x: f32) -> Array<8> {
        Array([x; 8])
    }
    #[inline(always)]
    fn mask8(self, bits: u32) -> Bits {
        Bits(bits)
    }
    #[inline(always)]
    fn no_marks(self) -> [u32; 8] {
        [0; 8]
    }
    #[inline(always)]
    fn mark(self, mut marks: [u32; 8], mask: Bits, bit: u32) -> [u32; 8] {
        for (i, mark) in marks.iter_mut().enumerate() {
            *mark |= if mask.0 >> i & 1 == 1 { bit } else { 0 };
        }
        marks
    }
    #[inline(always)]
    fn marks(self, marks: [u32; 8]) -> [u32; 8] {
        marks
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Sse2};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::*;

    /// Proof that the features of `run_avx2` are enabled where this value is.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx2(pub(super) ());

    /// Proof of nothing: x86-64 has SSE2.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Sse2(pub(super) ());

    /// Four floats of SSE2.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Sse4(__m128);

    /// Eight floats of SSE2.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Sse8(__m128, __m128);

    /// Eight floats of AVX2; exists only where [`Avx2`] does.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx8(__m256);

    // SAFETY (of every block in the three macros): the SSE2 intrinsics are in the baseline of x86-64, and a value of
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

    operators! { Sse4,
        Add add |a, b| Self(_mm_add_ps(a.0, b.0));
        Sub sub |a, b| Self(_mm_sub_ps(a.0, b.0));
        Mul mul |a, b| Self(_mm_mul_ps(a.0, b.0));
        Div div |a, b| Self(_mm_div_ps(a.0, b.0));
        BitAnd bitand |a, b| Self(_mm_and_ps(a.0, b.0));
        BitOr bitor |a, b| Self(_mm_or_ps(a.0, b.0));
    }
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
        le |a, b| Self(_mm_cmple_ps(a.0, b.0)),
        ne |a, b| Self(_mm_cmpneq_ps(a.0, b.0)),
        select |k, a, b| Self(_mm_or_ps(_mm_and_ps(k.0, a.0), _mm_andnot_ps(k.0, b.0))),
        store |v, to| _mm_storeu_ps(to, v.0)
    }
    lanes! { Sse8, 8,
        bits |m| (_mm_movemask_ps(m.0) | _mm_movemask_ps(m.1) << 4) as u32,
        splat |x| Self(_mm_set1_ps(x), _mm_set1_ps(x)),
        min |a, b| Self(_mm_min_ps(a.0, b.0), _mm_min_ps(a.1, b.1)),
        max |a, b| Self(_mm_max_ps(a.0, b.0), _mm_max_ps(a.1, b.1)),
        mul_sub |a, f, b| a * f - b,
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
        le |a, b| Self(_mm256_cmp_ps::<_CMP_LE_OQ>(a.0, b.0)),
        ne |a, b| Self(_mm256_cmp_ps::<_CMP_NEQ_UQ>(a.0, b.0)),
        select |k, a, b| Self(_mm256_blendv_ps(b.0, a.0, k.0)),
        store |v, to| _mm256_storeu_ps(to, v.0)
    }

    macro_rules! tokens {
        ($($token:ident $f8:ident $batches:literal |$p:ident| $load:expr, |$x:ident| $splat:expr;)*) => { $(
            impl Simd for $token {
                type F4 = Sse4;
                type F8 = $f8;
                type Marks = $f8;
                const BATCHES: bool = $batches;
                #[inline(always)]
                fn load4(self, from: &[f32; 4]) -> Sse4 {
                    // SAFETY: four floats are read from an array of four; SSE2 is in the baseline.
                    Sse4(unsafe { _mm_loadu_ps(from.as_ptr()) })
                }
                #[inline(always)]
                fn splat4(self, x: f32) -> Sse4 {
                    // SAFETY: SSE2 is in the baseline.
                    Sse4(unsafe { _mm_set1_ps(x) })
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
                fn marks(self, marks: $f8) -> [u32; 8] {
                    marks.to_array().map(f32::to_bits)
                }
            }
        )* };
    }
    tokens! {
        Avx2 Avx8 true |p| Avx8(_mm256_loadu_ps(p)), |x| Avx8(_mm256_set1_ps(x));
        Sse2 Sse8 false |p| Sse8(_mm_loadu_ps(p), _mm_loadu_ps(p.add(4))), |x| Sse8(_mm_set1_ps(x), _mm_set1_ps(x));
    }
}
