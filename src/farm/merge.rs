//! Parts of a picture, in any order, become the whole to the bit.

use super::file::{Checkpoint, CheckpointError, Summary};
use super::header::{Header, Part};
use crate::film::Film;
use std::path::{Path, PathBuf};

/// Why parts do not go together.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// There are none.
    #[error("there is nothing to merge: name the shards' files")]
    Nothing,
    /// A file cannot be used.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// Two files are of different pictures.
    #[error("{} does not belong to {}: {}", path.display(), first.display(), differences.join("; "))]
    Mixed {
        /// The file that does not fit.
        path: PathBuf,
        /// The file that came first.
        first: PathBuf,
        /// What differs, a line each.
        differences: Vec<String>,
    },
    /// A file is of another picture than is asked for.
    #[error("{} is of another picture or part: {}", path.display(), differences.join("; "))]
    Other {
        /// The file.
        path: PathBuf,
        /// What differs, a line each.
        differences: Vec<String>,
    },
    /// Two files share samples but not all of them: they were cut differently.
    #[error("{} ({part}) and {} ({other_part}) share samples: shards of one cut only can be merged", path.display(), other.display())]
    Overlap {
        /// One file.
        path: PathBuf,
        /// Its part.
        part: String,
        /// The other.
        other: PathBuf,
        /// Its part.
        other_part: String,
    },
    /// A file has been merged into another already.
    #[error("{} has samples ({part}) that are in {} already: leave one of the two out", path.display(), other.display())]
    Contained {
        /// The file.
        path: PathBuf,
        /// Its part.
        part: String,
        /// The other, which has all of the part.
        other: PathBuf,
    },
    /// Two complete files of the same samples differ.
    #[error("{} and {} claim the same samples ({part}) but differ: at least one was not made by this scene on this program", path.display(), other.display())]
    Differ {
        /// One file.
        path: PathBuf,
        /// The other.
        other: PathBuf,
        /// Their part.
        part: String,
    },
}

/// Parts put together.
#[derive(Clone, Debug, PartialEq)]
pub struct Merged {
    /// The film and what is known of it; complete if nothing is missing.
    pub checkpoint: Checkpoint,
    /// What is not there, a line each.
    pub missing: Vec<String>,
    /// Files that were there twice and were left out, with what they are copies of.
    pub repeated: Vec<(PathBuf, PathBuf)>,
}

/// A file that will be added.
struct Piece {
    path: PathBuf,
    summary: Summary,
}

/// Adds the parts in these files, which may come in any order and more than once.
///
/// What an unfinished part has is added too, and what it lacks is missing.
///
/// # Errors
/// If a file is no checkpoint, is damaged, is of another picture, or was cut differently.
pub fn merge(paths: &[PathBuf]) -> Result<Merged, MergeError> {
    let (pieces, repeated) = choose(paths)?;
    let first = &pieces.first().ok_or(MergeError::Nothing)?.summary.header;
    let identity = first.identity.clone();
    let missing = missing(&pieces);

    // One film at a time is in memory besides the whole.
    let mut film = Film::new(identity.resolution, identity.picture).with_guides(!identity.aovs.is_empty());
    let mut header = Header {
        parts: vec![],
        dropped: Default::default(),
        tally: Default::default(),
        seconds: 0.0,
        ..first.clone()
    };
    for piece in &pieces {
        let part = Checkpoint::read(&piece.path)?;
        film.merge(&part.film);
        header.parts.extend(part.header.parts);
        header.tally.merge(&part.header.tally);
        header.seconds += part.header.seconds;
    }
    header.dropped = film.dropped;
    if missing.is_empty() {
        let (rect, end) = (identity.picture, identity.spp);
        header.parts = vec![Part { rect, first: 0, end, shard: None, finished: true }];
    }
    Ok(Merged { checkpoint: Checkpoint { header, film }, missing, repeated })
}

/// A file and the other one that holds the same part.
type Repeated = (PathBuf, PathBuf);

/// The files to add, each sample once: of two of the same part, one that is complete.
fn choose(paths: &[PathBuf]) -> Result<(Vec<Piece>, Vec<Repeated>), MergeError> {
    let (mut pieces, mut repeated): (Vec<Piece>, _) = (vec![], vec![]);
    for path in paths {
        let summary = Summary::read(path)?;
        if let Some(first) = pieces.first() {
            let differences = first.summary.header.identity.differences(&summary.header.identity, false);
            if !differences.is_empty() {
                let (path, first) = (path.clone(), first.path.clone());
                return Err(MergeError::Mixed { path, first, differences });
            }
        }
        let mut piece = Piece { path: path.clone(), summary };
        match pieces.iter_mut().find(|other| other.same_samples(&piece)) {
            None => {
                for other in &pieces {
                    other.check_apart(&piece)?;
                }
                pieces.push(piece);
            }
            Some(other) => {
                other.check_agrees(&piece)?;
                if piece.is_better_than(other) {
                    std::mem::swap(other, &mut piece);
                }
                repeated.push((piece.path, other.path.clone()));
            }
        }
    }
    Ok((pieces, repeated))
}

impl Piece {
    fn parts(&self) -> &[Part] {
        &self.summary.header.parts
    }

    fn samples(&self) -> u64 {
        self.parts().iter().map(Part::samples).sum()
    }

    fn is_finished(&self) -> bool {
        self.summary.header.is_finished()
    }

    /// Complete, or at least further on.
    fn is_better_than(&self, other: &Self) -> bool {
        let done = |piece: &Self| (piece.is_finished(), piece.summary.header.tally.samples);
        done(self) > done(other)
    }

    fn same_samples(&self, other: &Self) -> bool {
        // Parts without samples differ by the shard that they were cut as.
        let same = |(a, b): (&Part, &Part)| a.same_samples(b) && (a.samples() > 0 || a.shard == b.shard);
        self.parts().len() == other.parts().len() && self.parts().iter().zip(other.parts()).all(same)
    }

    fn check_apart(&self, other: &Self) -> Result<(), MergeError> {
        for part in self.parts() {
            if let Some(shared) = other.parts().iter().find(|p| p.overlaps(part)) {
                let mut both = [(self, part), (other, shared)];
                both.sort_by_key(|(piece, _)| piece.samples());
                let [(small, part), (large, of_large)] = both;
                if of_large.finished && of_large.contains(part) {
                    return Err(MergeError::Contained {
                        path: small.path.clone(),
                        part: part.to_string(),
                        other: large.path.clone(),
                    });
                }
                return Err(MergeError::Overlap {
                    path: small.path.clone(),
                    part: part.to_string(),
                    other: large.path.clone(),
                    other_part: of_large.to_string(),
                });
            }
        }
        Ok(())
    }

    fn check_agrees(&self, other: &Self) -> Result<(), MergeError> {
        let both = self.is_finished() && other.is_finished();
        if both && self.summary.pixels_sum != other.summary.pixels_sum {
            let part = self.parts().iter().map(Part::to_string).collect::<Vec<_>>().join(", ");
            return Err(MergeError::Differ { path: self.path.clone(), other: other.path.clone(), part });
        }
        Ok(())
    }
}

/// What the pieces lack of the whole picture.
fn missing(pieces: &[Piece]) -> Vec<String> {
    let Some(first) = pieces.first() else { return vec![] };
    let identity = &first.summary.header.identity;
    let unfinished = |piece: &Piece| -> Vec<String> {
        let parts = piece.parts().iter().filter(|part| !part.finished);
        parts.map(|part| format!("{part} in {} is not finished", piece.path.display())).collect()
    };
    let mut lines: Vec<String> = pieces.iter().flat_map(unfinished).collect();

    let whole = identity.picture.area() as u64 * u64::from(identity.spp);
    let there: u64 = pieces.iter().map(Piece::samples).sum();
    if there < whole {
        lines.extend(missing_shards(pieces).unwrap_or_else(|| {
            vec![format!("{} of {whole} samples are in none of the files", whole - there)]
        }));
    }
    lines
}

/// The shards that are in none of the pieces, if all were cut alike.
fn missing_shards(pieces: &[Piece]) -> Option<Vec<String>> {
    let identity = &pieces.first()?.summary.header.identity;
    let shards: Option<Vec<_>> = pieces.iter().flat_map(Piece::parts).map(|part| part.shard).collect();
    let shards = shards?;
    let first = *shards.first()?;
    if shards.iter().any(|s| (s.count, s.by) != (first.count, first.by)) {
        return None;
    }
    let absent = (0..first.count).filter(|index| shards.iter().all(|s| s.index != *index));
    let parts = absent.filter_map(|index| {
        super::Shard { index, ..first }.part(identity.picture, identity.spp).ok().filter(|p| p.samples() > 0)
    });
    Some(parts.map(|part| format!("{part} is in none of the files")).collect())
}

/// What is at `path` of the part of a picture that is asked for: `None` if there is no file.
///
/// With `more_samples`, a file of fewer samples per pixel will do, unless its samples depend on their number.
///
/// # Errors
/// If there is a file that is damaged or another picture's.
pub fn find(path: &Path, wanted: &Header, more_samples: bool) -> Result<Option<Checkpoint>, MergeError> {
    if !path.exists() {
        return Ok(None);
    }
    let mut found = Checkpoint::read(path)?;
    let mut differences = found.header.identity.differences(&wanted.identity, more_samples);
    let whole = |header: &Header| match header.parts[..] {
        [part] if part.shard.is_none() && part.end == header.identity.spp => Some((part.rect, part.first)),
        _ => None,
    };
    let grows = more_samples && whole(&found.header).is_some() && whole(&found.header) == whole(wanted);
    let key =
        |header: &Header| header.parts.iter().map(|p| (p.rect, p.first, p.end, p.shard)).collect::<Vec<_>>();
    if !grows && key(&found.header) != key(wanted) {
        let list = |header: &Header| header.parts.iter().map(Part::to_string).collect::<Vec<_>>().join(", ");
        differences.push(format!("part: {} in the file, {} now", list(&found.header), list(wanted)));
    }
    if !differences.is_empty() {
        return Err(MergeError::Other { path: path.to_owned(), differences });
    }
    if found.header.identity.spp < wanted.identity.spp {
        found.header.parts.clone_from(&wanted.parts);
    }
    Ok(Some(found))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farm::header::tests::identity;
    use crate::farm::{Identity, Shard, ShardBy};
    use crate::film::{Pixel, RadianceGathered};
    use crate::render::Decisions;

    /// A part whose samples are functions of their pixel and number.
    fn part(part: Part, identity: &Identity) -> Checkpoint {
        let mut film = Film::new(identity.resolution, part.rect);
        let columns = part.rect.width();
        for (i, pixel) in (0..).zip(&mut film.pixels) {
            let (x, y) = (part.rect.x0 + i % columns, part.rect.y0 + i / columns);
            for sample in part.first..part.end {
                pixel.add([(x * 7 + y) as f32, 0.1 * sample as f32, 1e-7].map(RadianceGathered::from));
            }
        }
        let header = Header {
            format: crate::farm::header::FORMAT,
            identity: identity.clone(),
            parts: vec![part],
            dropped: film.dropped,
            tally: Default::default(),
            decisions: Decisions::default(),
            seconds: 1.0,
        };
        Checkpoint { header, film }
    }

    struct Farm {
        directory: tempfile::TempDir,
        identity: Identity,
    }

    impl Farm {
        fn new() -> Self {
            Self { directory: tempfile::tempdir().unwrap(), identity: identity() }
        }

        fn write(&self, name: &str, checkpoint: &Checkpoint) -> PathBuf {
            let path = self.directory.path().join(name);
            checkpoint.write(&path).unwrap();
            path
        }

        fn shard(&self, index: u32, count: u32, by: ShardBy) -> Checkpoint {
            let cut = Shard::new(index, count, by).unwrap();
            let cut = cut.part(self.identity.picture, self.identity.spp).unwrap();
            part(Part { finished: true, ..cut }, &self.identity)
        }

        fn shards(&self, count: u32, by: ShardBy) -> Vec<PathBuf> {
            (0..count).map(|i| self.write(&format!("{i}.exr"), &self.shard(i, count, by))).collect()
        }

        fn whole(&self) -> Vec<Pixel> {
            let (rect, end) = (self.identity.picture, self.identity.spp);
            part(Part { rect, first: 0, end, shard: None, finished: true }, &self.identity).film.pixels
        }
    }

    #[test]
    fn parts_in_any_order_and_twice_are_the_whole() {
        let farm = Farm::new();
        for (count, by) in
            [(1, ShardBy::Samples), (7, ShardBy::Samples), (40, ShardBy::Samples), (3, ShardBy::Tiles)]
        {
            let mut paths = farm.shards(count, by);
            paths.reverse();
            paths.push(farm.write("again.exr", &farm.shard(0, count, by)));
            let merged = merge(&paths).unwrap();
            assert_eq!(merged.checkpoint.film.pixels, farm.whole(), "{count} by {by:?}");
            assert!(merged.missing.is_empty() && merged.checkpoint.header.parts.len() == 1);
            assert_eq!(merged.repeated.len(), 1);
        }
    }

    #[test]
    fn what_is_missing_is_named_and_can_be_added_later() {
        let farm = Farm::new();
        let paths = farm.shards(4, ShardBy::Samples);
        let half = merge(&[paths[3].clone(), paths[0].clone()]).unwrap();
        assert_eq!(
            half.missing,
            [
                "shard 1/4, samples 4 to 8 is in none of the files",
                "shard 2/4, samples 8 to 12 is in none of the files"
            ]
        );
        let half = farm.write("half.exr", &half.checkpoint);
        let again = merge(&[half.clone(), paths[1].clone(), paths[3].clone()]).unwrap_err().to_string();
        let told = ["3.exr has samples (shard 3/4, samples 12 to 16)", "half.exr already"];
        assert!(told.iter().all(|words| again.contains(words)), "{again}");
        let merged = merge(&[half, paths[1].clone(), paths[2].clone()]).unwrap();
        assert_eq!((merged.missing.len(), merged.checkpoint.film.pixels), (0, farm.whole()));
    }

    #[test]
    fn an_unfinished_part_gives_way_to_a_finished_one() {
        let farm = Farm::new();
        let paths = farm.shards(2, ShardBy::Samples);
        let mut unfinished = farm.shard(1, 2, ShardBy::Samples);
        unfinished.film = Film::new(farm.identity.resolution, farm.identity.picture);
        unfinished.header.parts[0].finished = false;
        let unfinished = farm.write("unfinished.exr", &unfinished);
        let merged = merge(&[paths[0].clone(), unfinished.clone()]).unwrap();
        assert_eq!(merged.missing.len(), 1);
        assert!(merged.missing[0].contains("not finished"), "{:?}", merged.missing);
        let merged = merge(&[paths[0].clone(), unfinished, paths[1].clone()]).unwrap();
        assert_eq!((merged.missing.len(), merged.checkpoint.film.pixels), (0, farm.whole()));
    }

    #[test]
    fn what_does_not_belong_together_is_refused() {
        let mut farm = Farm::new();
        let halves = farm.shards(2, ShardBy::Samples);
        let third = farm.write("third.exr", &farm.shard(1, 3, ShardBy::Samples));
        assert!(matches!(merge(&[halves[0].clone(), third]), Err(MergeError::Overlap { .. })));

        let mut odd = farm.shard(0, 2, ShardBy::Samples);
        odd.film.pixels[3].count += 1;
        let odd = farm.write("odd.exr", &odd);
        assert!(matches!(merge(&[halves[0].clone(), odd]), Err(MergeError::Differ { .. })));

        farm.identity.scene_hash = "another".into();
        let other = farm.write("other.exr", &farm.shard(1, 2, ShardBy::Samples));
        let message = merge(&[halves[0].clone(), other]).unwrap_err().to_string();
        assert!(message.contains("other.exr does not belong to") && message.contains("scene:"), "{message}");
        assert!(matches!(merge(&[]), Err(MergeError::Nothing)));
    }

    #[test]
    fn a_file_is_gone_on_with_if_it_is_the_same_part_or_grows() {
        let farm = Farm::new();
        let wanted = farm.shard(1, 4, ShardBy::Samples).header;
        let path = farm.directory.path().join("none.exr");
        assert!(find(&path, &wanted, false).unwrap().is_none());
        let path = farm.write("1.exr", &farm.shard(1, 4, ShardBy::Samples));
        assert!(find(&path, &wanted, false).unwrap().unwrap().header.is_finished());
        let message = find(&path, &farm.shard(2, 4, ShardBy::Samples).header, false).unwrap_err().to_string();
        assert!(message.contains("part: shard 1/4, samples 4 to 8 in the file"), "{message}");

        let (rect, end) = (farm.identity.picture, farm.identity.spp);
        let part_of = |end, identity: &Identity| {
            part(Part { rect, first: 0, end, shard: None, finished: true }, identity)
        };
        let path = farm.write("whole.exr", &part_of(end, &farm.identity));
        let more = Identity { spp: 2 * end, ..farm.identity.clone() };
        let mut wanted = part_of(2 * end, &more).header;
        wanted.parts[0].finished = false;
        assert!(find(&path, &wanted, false).is_err());
        let found = find(&path, &wanted, true).unwrap().unwrap();
        assert_eq!(found.header.parts, wanted.parts);
    }
}
