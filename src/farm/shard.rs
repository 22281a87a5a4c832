//! How a picture's work is cut.

use super::Part;
use crate::film::PixelRect;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Along which side work is cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum ShardBy {
    /// Every shard has all pixels and some of their samples: shards take equally long, and each is a noisy picture
    #[default]
    Samples,
    /// Every shard has some pixels, a rectangle, with all their samples
    Tiles,
}

/// One of `count` shares, by its index from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Which one.
    pub index: u32,
    /// Of how many.
    pub count: u32,
    /// Shares of what.
    pub by: ShardBy,
}

/// Why work is not cut so.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShardError {
    /// There is no such shard.
    #[error("there is no shard {index}/{count}: {count} shards are numbered 0/{count} to {last}/{count}", last = count.saturating_sub(1))]
    OutOfRange {
        /// The index asked for.
        index: u32,
        /// Of how many.
        count: u32,
    },
    /// A shard would have no pixel.
    #[error(
        "{count} shards cannot be cut from {width} x {height} pixels without empty ones: use fewer, or --shard-by samples"
    )]
    TooMany {
        /// How many were asked for.
        count: u32,
        /// Columns of the picture.
        width: u32,
        /// Rows of the picture.
        height: u32,
    },
}

impl Shard {
    /// Shard `index` of `count`.
    ///
    /// # Errors
    /// If there is no such shard.
    pub fn new(index: u32, count: u32, by: ShardBy) -> Result<Self, ShardError> {
        if index < count {
            Ok(Self { index, count, by })
        } else {
            Err(ShardError::OutOfRange { index, count })
        }
    }

    /// The shard's part, not finished yet, of a picture of `spp` samples per pixel.
    ///
    /// The parts of all shards do not overlap and make up the whole. By samples, one may be empty.
    ///
    /// # Errors
    /// If there are too few pixels for so many.
    pub fn part(self, picture: PixelRect, spp: u32) -> Result<Part, ShardError> {
        let shard = Some(self);
        match self.by {
            ShardBy::Samples => {
                let [first, end] = [self.index, self.index + 1].map(|i| share(spp, i, self.count));
                Ok(Part { rect: picture, first, end, shard, finished: false })
            }
            ShardBy::Tiles => {
                Ok(Part { rect: self.rect(picture)?, first: 0, end: spp, shard, finished: false })
            }
        }
    }

    /// The shard's cell of a grid whose cells are as square as the number allows.
    fn rect(self, picture: PixelRect) -> Result<PixelRect, ShardError> {
        let (width, height) = (picture.width(), picture.height());
        let grids = (1..=self.count).filter(|columns| self.count.is_multiple_of(*columns));
        let possible = grids.map(|columns| [columns, self.count / columns]);
        let possible = possible.filter(|&[columns, rows]| columns <= width && rows <= height);
        let squareness = |&[columns, rows]: &[u32; 2]| {
            let aspect = f64::from(width) * f64::from(rows) / (f64::from(height) * f64::from(columns));
            aspect.ln().abs()
        };
        let best = possible.min_by(|a, b| squareness(a).total_cmp(&squareness(b)));
        let [columns, rows] = best.ok_or(ShardError::TooMany { count: self.count, width, height })?;
        let (column, row) = (self.index % columns, self.index / columns);
        Ok(PixelRect {
            x0: picture.x0 + share(width, column, columns),
            x1: picture.x0 + share(width, column + 1, columns),
            y0: picture.y0 + share(height, row, rows),
            y1: picture.y0 + share(height, row + 1, rows),
        })
    }
}

/// `total * i / count`, rounded down.
fn share(total: u32, i: u32, count: u32) -> u32 {
    (u64::from(total) * u64::from(i) / u64::from(count)) as u32
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_make_up_the_whole_without_overlap() {
        let picture = PixelRect { x0: 3, y0: 5, x1: 40, y1: 29 };
        for by in [ShardBy::Samples, ShardBy::Tiles] {
            for count in [1, 2, 7, 12, 64] {
                let part = |i| Shard::new(i, count, by).unwrap().part(picture, 30);
                if (by, count) == (ShardBy::Tiles, 7) {
                    assert!(part(0).is_ok());
                }
                let parts: Vec<_> = (0..count).map(|i| part(i).unwrap()).collect();
                let samples: u64 = parts.iter().map(Part::samples).sum();
                assert_eq!(samples, picture.area() as u64 * 30, "{by:?} {count}");
                for (i, a) in parts.iter().enumerate() {
                    assert!(parts[..i].iter().all(|b| !a.overlaps(b)), "{by:?} {count}");
                }
            }
        }
    }

    #[test]
    fn cells_are_about_square() {
        let picture = PixelRect { x0: 0, y0: 0, x1: 160, y1: 90 };
        let part = Shard::new(5, 12, ShardBy::Tiles).unwrap().part(picture, 1).unwrap();
        assert_eq!((part.rect.width(), part.rect.height()), (40, 30));
    }

    #[test]
    fn shards_that_there_are_not_are_refused() {
        let message = Shard::new(8, 8, ShardBy::Samples).unwrap_err().to_string();
        assert!(message.contains("0/8 to 7/8"), "{message}");
        let small = PixelRect { x0: 0, y0: 0, x1: 4, y1: 4 };
        assert!(Shard::new(0, 7, ShardBy::Tiles).unwrap().part(small, 1).is_err());
        assert!(Shard::new(0, 0, ShardBy::Tiles).is_err());
    }
}
