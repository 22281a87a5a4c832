//! References moved to the sides of a split, in place.

use super::binning::{Binner, Split};
use super::boxes::{Bounds, Ref, center};
use super::simd::{Available, Kernel, Lanes, Simd};
use core::ops::Range;
use rayon::prelude::*;

/// References that one thread bins or moves at a time.
pub(super) const CHUNK: usize = 32 * 1024;

/// Moves what goes to the left to the front. Gives its number and the boxes around the centres on either side.
///
/// The order on a side depends on nothing but the order before: many references are moved chunk by chunk, and then what
/// lies on the wrong side changes places, whether there are many threads or one.
pub(super) fn partition(
    isa: Available,
    refs: &mut [Ref],
    binner: &Binner,
    split: &Split,
) -> (usize, [Bounds; 2]) {
    if refs.len() <= 2 * CHUNK {
        return isa.run(Partition { refs, binner, split });
    }
    let chunks: Vec<(usize, [Bounds; 2])> =
        refs.par_chunks_mut(CHUNK).map(|refs| isa.run(Partition { refs, binner, split })).collect();
    let mut centers = [Bounds::EMPTY; 2];
    for (_, of_chunk) in &chunks {
        for (all, part) in centers.iter_mut().zip(of_chunk) {
            all.join(part);
        }
    }
    let left = chunks.iter().map(|(left, _)| left).sum();
    exchange(refs, left, chunks.iter().map(|chunk| chunk.0));
    (left, centers)
}

/// Changes the places of right ones in the left part and left ones in the right part. Each chunk has so many left ones,
/// and then its right ones.
fn exchange(refs: &mut [Ref], left: usize, lefts: impl Iterator<Item = usize>) {
    let total = refs.len();
    let (mut in_front, mut in_back) = (vec![], vec![]);
    for (i, own) in lefts.enumerate() {
        let (start, end) = (i * CHUNK, ((i + 1) * CHUNK).min(total));
        let middle = start + own;
        if middle < left {
            in_front.push(middle..end.min(left));
        } else {
            in_back.push(start.max(left)..middle);
        }
    }
    let (front, back) = refs.split_at_mut(left);
    let mut in_front = pieces(front, 0, in_front).into_iter();
    let mut in_back = pieces(back, left, in_back).into_iter();
    let mut pairs = vec![];
    let (mut a, mut b) = (in_front.next(), in_back.next());
    while let (Some(wrong), Some(right)) = (a.take(), b.take()) {
        let both = wrong.len().min(right.len());
        let (wrong, rest_a) = wrong.split_at_mut(both);
        let (right, rest_b) = right.split_at_mut(both);
        pairs.push((wrong, right));
        a = if rest_a.is_empty() { in_front.next() } else { Some(rest_a) };
        b = if rest_b.is_empty() { in_back.next() } else { Some(rest_b) };
    }
    pairs.into_par_iter().for_each(|(wrong, right)| wrong.swap_with_slice(right));
}

/// Rising ranges of references whose first has the index `first`.
fn pieces(refs: &mut [Ref], first: usize, ranges: Vec<Range<usize>>) -> Vec<&mut [Ref]> {
    let (mut rest, mut at) = (refs, first);
    let mut pieces = Vec::with_capacity(ranges.len());
    for range in ranges {
        let (piece, others) = rest.split_at_mut(range.end - at);
        pieces.push(&mut piece[range.start - at..]);
        (rest, at) = (others, range.end);
    }
    pieces
}

/// To what centres are raised that count, and that do not.
static RAISED: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

struct Partition<'a> {
    refs: &'a mut [Ref],
    binner: &'a Binner,
    split: &'a Split,
}

impl Kernel for Partition<'_> {
    type Output = (usize, [Bounds; 2]);

    /// Each reference changes places with the first right one, and stays in front of it if it goes to the left: no branch
    /// to mispredict.
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> (usize, [Bounds; 2]) {
        let Self { refs, binner, split } = self;
        let places = binner.places(simd);
        let (mut left, mut right) = (simd.splat8(f32::INFINITY), simd.splat8(f32::INFINITY));
        let mut front = 0;
        for i in 0..refs.len() {
            let r = refs[i].bounds().load(simd);
            refs[i] = refs[front];
            refs[front].set(r);
            let center = center(simd, r);
            let is_left = places.bin_of(center, split.axis) < split.bin;
            // A centre that is raised to infinity counts nothing.
            let side = usize::from(is_left);
            left = center.max(simd.splat8(RAISED[1 - side])).min(left);
            right = center.max(simd.splat8(RAISED[side])).min(right);
            front += side;
        }
        (front, [Bounds::store(left), Bounds::store(right)])
    }
}
