//! Vectors in plain arrays.

use super::{Lanes, Mask, Packed, Simd};
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// Plain arrays: no instruction set at all.
#[derive(Clone, Copy)]
pub(in super::super) struct Portable;

/// Lanes in an array.
#[derive(Clone, Copy)]
#[repr(C, align(16))]
pub(in super::super) struct Array<const N: usize>(pub(in super::super) [f32; N]);

/// Bit i is lane i.
#[derive(Clone, Copy)]
pub(in super::super) struct Bits(u32);

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
    fn mul_add(self, factor: Self, o: Self) -> Self {
        self * factor + o
    }
    #[inline(always)]
    fn flip_sign(mut self, by: Self) -> Self {
        for i in 0..N {
            self.0[i] = f32::from_bits(self.0[i].to_bits() ^ by.0[i].to_bits() & 1 << 31);
        }
        self
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
    fn pair8(self, a: f32, b: f32) -> Array<8> {
        Array([a, a, a, a, b, b, b, b])
    }
    #[inline(always)]
    fn join8(self, l: &[f32; 4], h: &[f32; 4]) -> Array<8> {
        Array([l[0], l[1], l[2], l[3], h[0], h[1], h[2], h[3]])
    }
    #[inline(always)]
    fn swap_halves(self, Array([a, b, c, d, e, f, g, h]): Array<8>) -> Array<8> {
        Array([e, f, g, h, a, b, c, d])
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
    fn pack_marked(self, order: &[u32; 8], shift: u32, lanes: &[u32; 8], marks: [u32; 8]) -> Packed {
        pack(order, shift, lanes, marks)
    }
}

/// [`Simd::pack_marked`] without vectors.
#[inline(always)]
pub(super) fn pack(order: &[u32; 8], shift: u32, lanes: &[u32; 8], marks: [u32; 8]) -> Packed {
    let mut packed = Packed { lanes: [0; 8], marks: [0; 8], count: 0 };
    for place in order {
        let lane = (place >> shift) as usize % 8;
        if marks[lane] != 0 {
            (packed.lanes[packed.count], packed.marks[packed.count]) = (lanes[lane], marks[lane]);
            packed.count += 1;
        }
    }
    packed
}
