//! Rays eight at a time, those together that go the same way: the order of [sweeps](super::sweep).

use super::rows::EIGHT;
use crate::core::Ray;
use glam::{Vec3A, Vec3Swizzles};

/// Rays that are sorted together.
const CHUNK: usize = 512;

/// Ways that rays can go: by the fastest axis, and there by the octant.
const WAYS: usize = 3 * 8;

/// Up to eight rays with the same fastest axis.
pub(super) struct Group {
    /// The axis.
    pub(super) axis: usize,
    /// The octant of one in the middle; that of the others is most often the same.
    pub(super) octant: usize,
    /// Indices; after the first `count` the last one, again and again.
    pub(super) indices: [usize; EIGHT],
    pub(super) count: usize,
}

/// The groups of a slice.
pub(super) struct Groups<'a> {
    rays: &'a [Ray],
    /// Where the rays begin that are sorted now, and which way each of those goes.
    start: usize,
    ways: [u8; CHUNK],
    /// Their indices from there, sorted.
    order: [u16; CHUNK],
    /// Where each axis ends in `order`.
    ends: [usize; 3],
    next: usize,
    axis: usize,
}

impl<'a> Groups<'a> {
    #[inline(always)]
    pub(super) fn new(rays: &'a [Ray]) -> Self {
        let (ways, order) = ([0; CHUNK], [0; CHUNK]);
        let mut groups = Self { rays, start: 0, ways, order, ends: [0; 3], next: 0, axis: 0 };
        groups.sort();
        groups
    }

    /// The next group.
    #[inline(always)]
    pub(super) fn next(&mut self) -> Option<Group> {
        while self.next == self.ends[self.axis] {
            self.axis += 1;
            if self.axis == 3 {
                self.start += CHUNK;
                if self.start >= self.rays.len() {
                    self.axis = 2;
                    return None;
                }
                self.sort();
            }
        }
        let count = (self.ends[self.axis] - self.next).min(EIGHT);
        let mut indices = [0; EIGHT];
        for (i, index) in indices.iter_mut().enumerate() {
            *index = usize::from(self.order[(self.next + i.min(count - 1)) % CHUNK]);
        }
        let octant = usize::from(self.ways[indices[count / 2] % CHUNK] % 8);
        for index in &mut indices {
            *index += self.start;
        }
        self.next += count;
        Some(Group { axis: self.axis, octant, indices, count })
    }

    /// Sorts the chunk that begins at `start`.
    #[inline(always)]
    fn sort(&mut self) {
        let end = self.rays.len().min(self.start + CHUNK);
        let rays = &self.rays[self.start..end];
        let mut ends = [0; WAYS];
        for (way_of, ray) in self.ways.iter_mut().zip(rays) {
            *way_of = way(ray);
            ends[usize::from(*way_of) % WAYS] += 1;
        }
        let mut sum = 0;
        for end in &mut ends {
            (*end, sum) = (sum, sum + *end);
        }
        for (i, &way) in self.ways[..rays.len()].iter().enumerate() {
            let end = &mut ends[usize::from(way) % WAYS];
            self.order[*end % CHUNK] = i as u16;
            *end += 1;
        }
        (self.ends, self.next, self.axis) = ([ends[7], ends[15], ends[23]], 0, 0);
    }
}

/// Which way a ray goes.
#[inline(always)]
fn way(ray: &Ray) -> u8 {
    // The fastest axis is found as the watertight test does it.
    const BY_ORDER: [u8; 8] = [0, 0, 1, 0, 2, 2, 1, 0];
    let dir = Vec3A::from(ray.dir);
    let length = dir.abs();
    let axis = BY_ORDER[length.cmpge(length.yzx()).bitmask() as usize & 7];
    axis * 8 + (dir.is_negative_bitmask() & 7) as u8
}
