//! Tiles: the parts of a picture that one thread renders at a time.

use crate::film::{Film, PixelRect};
use crate::integrator::z_order;
use std::collections::BTreeMap;

/// A part of the picture.
pub(super) struct Tile {
    /// Its pixels.
    pub rect: PixelRect,
    /// Those that may still get samples, in the integrator's order.
    pub active: Vec<(u32, u32)>,
}

/// What pixels of a tile lack.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Lack {
    /// Samples that they have.
    pub count: u32,
    /// Samples that they are to have.
    pub target: u32,
}

impl Tile {
    /// The active pixels that have fewer samples than their target, by what they lack.
    ///
    /// Mostly that is one group; after an interruption, and where samples are shared out, neighbours may differ.
    pub(super) fn pixels_by_lack(
        &self,
        film: &Film,
        target: impl Fn(&(u32, u32)) -> u32,
    ) -> BTreeMap<Lack, Vec<(u32, u32)>> {
        let mut groups: BTreeMap<Lack, Vec<(u32, u32)>> = BTreeMap::new();
        for pixel in &self.active {
            let (count, target) = (film.pixel(pixel.0, pixel.1).count, target(pixel));
            if count < target {
                groups.entry(Lack { count, target }).or_default().push(*pixel);
            }
        }
        groups
    }
}

/// The tiles of a rectangle, cut along multiples of `size` of the full image.
pub(super) fn tiles(rect: PixelRect, size: u32) -> Vec<Tile> {
    let cuts = |from: u32, to: u32| {
        let inner = (from / size + 1..to.div_ceil(size)).map(|k| k * size);
        std::iter::once(from).chain(inner).chain([to]).collect::<Vec<_>>()
    };
    let (xs, ys) = (cuts(rect.x0, rect.x1), cuts(rect.y0, rect.y1));
    let rects = ys
        .windows(2)
        .flat_map(|y| xs.windows(2).map(|x| PixelRect { x0: x[0], y0: y[0], x1: x[1], y1: y[1] }));
    rects.filter(|rect| rect.area() > 0).map(|rect| Tile { rect, active: z_order(rect) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_each_pixel_once_and_are_cut_where_the_image_says() {
        for (rect, size) in [
            (PixelRect { x0: 0, y0: 0, x1: 50, y1: 33 }, 16),
            (PixelRect { x0: 7, y0: 16, x1: 9, y1: 17 }, 8),
            (PixelRect { x0: 3, y0: 3, x1: 3, y1: 9 }, 8),
        ] {
            let tiles = tiles(rect, size);
            let mut pixels: Vec<_> = tiles.iter().flat_map(|t| t.active.clone()).collect();
            pixels.sort_unstable();
            pixels.dedup();
            assert_eq!(pixels.len(), rect.area());
            assert_eq!(tiles.iter().map(|t| t.rect.area()).sum::<usize>(), rect.area());
            assert!(tiles.iter().all(|t| t.rect.x0 == rect.x0 || t.rect.x0 % size == 0));
        }
    }
}
