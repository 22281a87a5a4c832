//! The fast builder: references sorted along a Morton curve, whose bits are the splits (Lauterbach et al. 2009, "Fast BVH
//! Construction on GPUs"), opened 8 wide by count.

use super::boxes::{Bounds, Ref, bounds_of};
use super::builder::{Build, PARALLEL};
use super::data::{BLOCK, Child, WIDTH};
use super::emit::{Piece, Tree};
use core::ops::Range;
use glam::{Vec4, Vec4Swizzles};
use rayon::prelude::*;

/// Bits of a code per axis.
const BITS: u32 = 10;

/// Bits of a digit of the sort: three passes over a code.
const DIGIT: u32 = 10;

/// References, and in the order of their codes these and, in the lower half, the references' indices.
struct Sorted<'b, 's> {
    build: &'b Build<'s>,
    refs: &'b [Ref],
    keys: Vec<u64>,
}

/// The tree over all references, whose centres lie in a box.
pub(super) fn tree(build: &Build<'_>, refs: &[Ref], centers: &Bounds) -> Tree {
    let mut keys: Vec<u64> = (0..refs.len())
        .into_par_iter()
        .zip(codes(refs, centers))
        .map(|(index, code)| u64::from(code) << 32 | index as u64)
        .collect();
    sort(&mut keys);
    let sorted = Sorted { build, refs, keys };
    sorted.tree(0..refs.len()).0
}

/// Morton codes of the centres: the bits of the axes in turns.
fn codes(refs: &[Ref], centers: &Bounds) -> impl IndexedParallelIterator<Item = u32> {
    let cells = (1 << BITS) as f32;
    let scale = cells / (centers.hi() - centers.lo());
    // No extent, or one that f32 cannot divide by: all in one cell.
    let scale = Vec4::from_array(scale.to_array().map(|s| if s.is_finite() { s } else { 0.0 }));
    let base = centers.lo();
    let code = move |r: &Ref| {
        let cell = ((r.center() - base) * scale).min(Vec4::splat(cells - 1.0)).xyz();
        [cell.x, cell.y, cell.z].map(|x| spread(x as u32)).iter().zip(0..).fold(0, |sum, (b, i)| sum | b << i)
    };
    refs.par_iter().map(code)
}

/// Two zeros before each of ten bits.
fn spread(x: u32) -> u32 {
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

/// Sorts keys by their codes, in the upper half, and stably, digit by digit.
fn sort(keys: &mut Vec<u64>) {
    let mut other = vec![0; keys.len()];
    for pass in 0..3 * BITS / DIGIT {
        let digit = |key: u64| (key >> (32 + pass * DIGIT)) as usize % (1 << DIGIT);
        let mut next = [0; 1 << DIGIT];
        for &key in &*keys {
            next[digit(key)] += 1;
        }
        let mut before = 0;
        for count in &mut next {
            before += std::mem::replace(count, before);
        }
        for &key in &*keys {
            other[next[digit(key)]] = key;
            next[digit(key)] += 1;
        }
        std::mem::swap(keys, &mut other);
    }
}

impl Sorted<'_, '_> {
    /// The tree over a range and its box: large nodes in parallel, and small ones as one piece each.
    fn tree(&self, range: Range<usize>) -> (Tree, Bounds) {
        if range.len() <= PARALLEL || rayon::current_num_threads() == 1 {
            let mut piece = Piece::with_room(self.build.primitives, self.refs, range.len());
            let (root, bounds) = self.small(range, &mut piece);
            return (Tree::Piece(piece, root), bounds);
        }
        let (trees, bounds): (Vec<_>, Vec<_>) =
            self.open(range).into_par_iter().map(|part| self.tree(part)).unzip();
        let whole = around(&bounds);
        (Tree::Inner(bounds, trees), whole)
    }

    /// The same on one thread, straight into nodes.
    fn small(&self, range: Range<usize>, piece: &mut Piece) -> (Child, Bounds) {
        if self.is_leaf(&range) {
            let (refs, count) = self.leaf(&range);
            let refs = &refs[..count];
            return (piece.leaf(self.build.primitives, refs), bounds_of(refs));
        }
        let node = piece.reserve_node();
        let parts = self.open(range);
        let mut children = [Child::EMPTY; WIDTH];
        let mut bounds = [Bounds::EMPTY; WIDTH];
        let count = parts.len();
        for (i, part) in parts.into_iter().enumerate() {
            (children[i], bounds[i]) = self.small(part, piece);
        }
        piece.set_node(node, &bounds[..count], &children[..count]);
        (Child::node(node), around(&bounds))
    }

    fn is_leaf(&self, range: &Range<usize>) -> bool {
        if range.len() > BLOCK || !self.build.is_mixed() {
            return range.len() <= BLOCK;
        }
        let (refs, count) = self.leaf(range);
        self.build.is_uniform(&refs[..count])
    }

    /// The references of a range of at most a block, and their number.
    fn leaf(&self, range: &Range<usize>) -> ([Ref; BLOCK], usize) {
        let mut refs = [Ref::NONE; BLOCK];
        for (r, &key) in refs.iter_mut().zip(&self.keys[range.clone()]) {
            *r = self.refs[key as u32 as usize];
        }
        (refs, range.len())
    }

    /// Up to eight parts of a range, the largest in front: the one with the most references is split first. At each level either the part
    /// that is followed has at most half of the references or more than one bit of the codes is used up, so that the
    /// depth stays within a traversal stack.
    fn open(&self, range: Range<usize>) -> Vec<Range<usize>> {
        let mut parts = Vec::with_capacity(WIDTH);
        parts.push(range);
        while parts.len() < WIDTH {
            let open = (0..parts.len()).filter(|&i| !self.is_leaf(&parts[i]));
            let Some(most) = open.max_by_key(|&i| (parts[i].len(), i)) else { break };
            let part = parts[most].clone();
            let middle = self.middle(&part);
            parts[most] = part.start..middle;
            parts.push(middle..part.end);
        }
        parts.sort_by_key(|part| core::cmp::Reverse(part.len()));
        parts
    }

    /// Where the highest bit that differs within a range changes; the middle if none does.
    fn middle(&self, range: &Range<usize>) -> usize {
        let keys = &self.keys[range.clone()];
        let differing = (keys[0] ^ keys[keys.len() - 1]) >> 32;
        if differing == 0 {
            return range.start + range.len() / 2;
        }
        let bit = 1 << (32 + differing.ilog2());
        range.start + keys.partition_point(|key| key & bit == 0)
    }
}

fn around(parts: &[Bounds]) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for part in parts {
        bounds.join(part);
    }
    bounds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread_to_every_third() {
        for x in [0, 1, 0b10_1100_1011, 0x3ff] {
            let expected = (0..10).fold(0, |sum, bit| sum | (x >> bit & 1) << (3 * bit));
            assert_eq!(spread(x), expected);
        }
    }

    #[test]
    fn keys_are_sorted_by_code_and_then_by_index() {
        let mut keys: Vec<u64> =
            (0..5000u64).map(|i| (i * 2_654_435_761 % (1 << 30) / 7) << 32 | i).collect();
        let mut expected = keys.clone();
        expected.sort_unstable();
        sort(&mut keys);
        assert_eq!(keys, expected);
    }
}
