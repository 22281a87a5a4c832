//! The files of a command: none is written over what is read, nor over another.

use super::exit::Failure;
use crate::scene::Scene;
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

/// What a command reads and writes, each file once, by whatever name.
#[derive(Default)]
pub(super) struct Files(HashMap<Identity, (PathBuf, Use)>);

/// What a file is to the command.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Use {
    /// It is read, as this.
    Read(&'static str),
    /// It will be written for the flag.
    Written(&'static str),
}

impl Files {
    /// Notes a file that is read, such as `the scene`; refuses one that will be written.
    pub(super) fn reads(&mut self, what: &'static str, path: &Path) -> Result<(), Failure> {
        match self.note(path, Use::Read(what)) {
            Some((output, Use::Written(flag))) => Err(taken(output, what, flag)),
            _ => Ok(()),
        }
    }

    /// Notes the files that the scene names, such as its meshes.
    pub(super) fn reads_files_of(&mut self, scene: &Scene) -> Result<(), Failure> {
        scene.files.iter().try_for_each(|path| self.reads(OF_SCENE, path))
    }

    /// Notes a file to write, which `flag` names; refuses one that is read, and one that is another's.
    pub(super) fn writes(&mut self, flag: &'static str, path: &Path) -> Result<(), Failure> {
        match self.note(path, Use::Written(flag)) {
            None => Ok(()),
            Some((_, Use::Read(what))) => Err(taken(path, what, flag)),
            Some((_, Use::Written(other))) if other == flag => {
                Err(Failure::bad(format!("{} is given twice as {flag}", path.display())))
            }
            Some((_, Use::Written(other))) => Err(taken(path, &format!("{other} already"), flag)),
        }
    }

    /// What the file is noted as; if it is not yet, it is now.
    fn note(&mut self, path: &Path, new: Use) -> Option<(&Path, Use)> {
        use std::collections::hash_map::Entry;
        match self.0.entry(Identity::of(path)) {
            Entry::Vacant(free) => {
                free.insert((path.to_owned(), new));
                None
            }
            Entry::Occupied(known) => {
                let (path, known) = known.into_mut();
                Some((path, *known))
            }
        }
    }
}

/// What a mesh, its materials or an environment is to whoever renders them.
pub(super) const OF_SCENE: &str = "a file of the scene";

fn taken(path: &Path, what: &str, flag: &str) -> Failure {
    Failure::bad(format!("{} is {what}: give {flag} another name", path.display()))
}

/// Whether both names are of one file.
pub(super) fn are_same(a: &Path, b: &Path) -> bool {
    Identity::of(a) == Identity::of(b)
}

/// What all names of a file have in common.
#[derive(PartialEq, Eq, Hash)]
enum Identity {
    /// Device and number of a file that is there: links to it have the same.
    #[cfg(unix)]
    Inode(u64, u64),
    /// The real path, as far as it is there.
    Path(PathBuf),
}

impl Identity {
    fn of(path: &Path) -> Self {
        #[cfg(unix)]
        if let Ok(found) = fs::metadata(path) {
            use std::os::unix::fs::MetadataExt;
            return Self::Inode(found.dev(), found.ino());
        }
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let real = path.ancestors().find_map(|there| {
            let (real, rest) = (fs::canonicalize(there).ok()?, path.strip_prefix(there).ok()?);
            // Joining nothing would add a separator, which makes a directory of a file.
            Some(if rest.as_os_str().is_empty() { real } else { real.join(rest) })
        });
        Self::Path(real.unwrap_or(path))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_one_file_are_the_same() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        fs::create_dir(at("a")).unwrap();
        for file in ["there", "other"] {
            fs::write(at(file), "").unwrap();
        }
        for (x, y) in [("there", "./there"), ("there", "a/../there"), ("new", "a/../new"), ("no/x", "no/./x")]
        {
            assert!(are_same(&at(x), &at(y)), "{x} and {y}");
        }
        for (x, y) in [("there", "other"), ("there", "new"), ("new", "newer"), ("new", "a/new")] {
            assert!(!are_same(&at(x), &at(y)), "{x} and {y}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_are_what_they_point_to() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        fs::create_dir(at("a")).unwrap();
        fs::write(at("a/there"), "").unwrap();
        std::os::unix::fs::symlink(at("a"), at("b")).unwrap();
        std::os::unix::fs::symlink("a/there", at("soft")).unwrap();
        fs::hard_link(at("a/there"), at("hard")).unwrap();
        for (x, y) in [("soft", "a/there"), ("hard", "a/there"), ("b/there", "a/there"), ("b/new", "a/new")] {
            assert!(are_same(&at(x), &at(y)), "{x} and {y}");
        }
    }

    #[test]
    fn a_file_may_be_read_twice_and_written_once() {
        let (a, b) = (Path::new("a.toml"), Path::new("b.png"));
        let mut files = Files::default();
        assert!(files.reads("the scene", a).is_ok() && files.reads(OF_SCENE, a).is_ok());
        assert!(files.writes("--output", b).is_ok());
        assert!(files.writes("--output", b).is_err() && files.writes("--html", b).is_err());
        assert!(files.writes("--html", a).is_err() && files.reads(OF_SCENE, b).is_err());
    }
}
