//! Vectors of 4 and 8 floats on AVX2, on SSE2 and in plain Rust: intrinsics are in `x86` and here alone.
//!
//! The traversal is written once, over [`Simd`], and compiled once per instruction set: a [`Kernel`] handed to
//! [`Isa::run`] is inlined into a function with the right `#[target_feature]`. A vector of a set can only be made
//! by that set's token, and a token only by [`Isa::run`] after detection: that is why the operations are safe.
//!
//! Every operation gives the same bits on every set but [`Lanes::mul_sub`] and [`Lanes::mul_add`], which are for
//! bounds and for the fast mode.

#![allow(unsafe_code)] // Intrinsics: the reasons are at the blocks.

mod portable;
#[cfg(target_arch = "x86_64")]
mod x86;

pub(super) use portable::{Array, Portable};
#[cfg(target_arch = "x86_64")]
use x86::{Avx2, Sse2};

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

    /// Whether packets and streams were measured to win over single rays on this set.
    pub(super) fn wants_batches(self) -> bool {
        self.0 != Isa::Portable
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
    // SAFETY: this function enables the features.
    kernel.run(unsafe { Avx2::proven() })
}

#[cfg(target_arch = "x86_64")]
#[inline(never)]
fn run_sse2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(Sse2)
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
    /// `self * factor + other` with one rounding or two, whichever is faster.
    fn mul_add(self, factor: Self, other: Self) -> Self;
    /// `self`, negated where the other has a sign bit.
    fn flip_sign(self, by: Self) -> Self;
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

    /// Four floats from memory.
    fn load4(self, from: &[f32; 4]) -> Self::F4;
    /// One float, four times.
    fn splat4(self, x: f32) -> Self::F4;
    /// Eight floats from memory.
    fn load8(self, from: &[f32; 8]) -> Self::F8;
    /// One float, eight times.
    fn splat8(self, x: f32) -> Self::F8;

    /// `a` in lanes 0 to 3, `b` in 4 to 7.
    fn pair8(self, a: f32, b: f32) -> Self::F8;
    /// Four floats from memory, then four others.
    fn join8(self, low: &[f32; 4], high: &[f32; 4]) -> Self::F8;
    /// Lanes 4 to 7, then 0 to 3.
    fn swap_halves(self, v: Self::F8) -> Self::F8;

    /// The lanes whose bits are set.
    fn mask8(self, bits: u32) -> <Self::F8 as Lanes<8>>::Mask;
    /// Eight empty sets.
    fn no_marks(self) -> Self::Marks;
    /// The sets with `bit` added to those of the mask's lanes.
    fn mark(self, marks: Self::Marks, mask: <Self::F8 as Lanes<8>>::Mask, bit: u32) -> Self::Marks;
    /// The lanes whose sets have a member, and their sets, packed to the front in the order that `order` gives in
    /// the 3 bits from `shift`. What lies behind them means nothing.
    fn pack_marked(self, order: &[u32; 8], shift: u32, lanes: &[u32; 8], marks: Self::Marks) -> Packed;

    /// Asks for four cache lines from an address, which may be any.
    #[inline(always)]
    fn prefetch(self, address: *const u8) {
        #[cfg(target_arch = "x86_64")]
        for line in 0..4 {
            // SAFETY: prefetching is a hint that reads nothing and faults on no address.
            unsafe {
                use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
                _mm_prefetch::<_MM_HINT_T0>(address.cast::<i8>().wrapping_add(64 * line));
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = address;
    }
}

/// What [`Simd::pack_marked`] gives.
pub(super) struct Packed {
    /// The lanes' values.
    pub(super) lanes: [u32; 8],
    /// Their sets.
    pub(super) marks: [u32; 8],
    /// How many there are.
    pub(super) count: usize,
}
