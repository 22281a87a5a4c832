//! Replacing a file whole or not at all.

use super::ImageError;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use tempfile::{Builder, NamedTempFile};

/// Writes a file under a temporary name beside it, makes it durable, and gives it its name.
///
/// On an error, a file that was there before is untouched and nothing is left behind. A symbolic link stays one: the
/// file that it points to is replaced.
///
/// # Errors
/// If the directory is not writable, the disk is full, or `write` fails.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut File) -> Result<(), String>,
) -> Result<(), ImageError> {
    let failed = |reason: String| ImageError::Write { path: path.to_owned(), reason };
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let mut file = temporary_beside(&target).map_err(|e| failed(e.to_string()))?;
    write(file.as_file_mut()).map_err(failed)?;
    file.as_file().sync_all().map_err(|e| failed(e.to_string()))?;
    file.persist(&target).map_err(|e| failed(e.error.to_string()))?;
    // The rename itself is durable once the directory is; a file system that cannot do that has done what it can.
    let _ = File::open(directory_of(&target)).and_then(|d| d.sync_all());
    Ok(())
}

/// The same for a writer that wants a path: it fills the (empty, existing) file of that name.
///
/// # Errors
/// As [`write_atomically`].
pub fn replace(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> Result<(), ImageError> {
    let failed = |e: io::Error| ImageError::Write { path: path.to_owned(), reason: e.to_string() };
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let temporary = temporary_beside(&target).map_err(failed)?.into_temp_path();
    write(&temporary).map_err(failed)?;
    File::open(&temporary).and_then(|file| file.sync_all()).map_err(failed)?;
    temporary.persist(&target).map_err(|e| failed(e.error))
}

/// Whether [`write_atomically`] could write this file now: for jobs that would be sorry to learn it at their end.
///
/// # Errors
/// If the path is a directory, or its directory is missing or not writable.
pub fn check_writable(path: &Path) -> Result<(), ImageError> {
    let failed = |reason: String| ImageError::Write { path: path.to_owned(), reason };
    if path.is_dir() {
        return Err(failed("it is a directory".to_owned()));
    }
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let directory = directory_of(&target);
    match fs::metadata(&directory) {
        Err(e) => Err(failed(format!("its directory {}: {e}", directory.display()))),
        Ok(found) if !found.is_dir() => Err(failed(format!("{} is not a directory", directory.display()))),
        Ok(_) => temporary_beside(&target)
            .map(drop)
            .map_err(|e| failed(format!("its directory {} is not writable: {e}", directory.display()))),
    }
}

fn directory_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// An empty file in the directory of `path`, with the rights that the user's umask gives to new files.
///
/// # Errors
/// If the directory is missing or not writable.
pub fn temporary_beside(path: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".gloss-").suffix(".tmp");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(directory_of(path)).map_err(|e| e.kind().into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn names(directory: &Path) -> Vec<String> {
        fs::read_dir(directory)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect()
    }

    #[test]
    fn a_failed_write_keeps_the_old_file_and_leaves_nothing_behind() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("picture.png");
        fs::write(&path, "old").unwrap();
        let result = write_atomically(&path, |file| {
            file.write_all(b"half").unwrap();
            Err("the disk is full".to_owned())
        });
        assert!(result.unwrap_err().to_string().contains("picture.png: the disk is full"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(directory.path()), ["picture.png"]);
    }

    #[test]
    fn a_write_replaces_the_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("picture.png");
        fs::write(&path, "a longer old text").unwrap();
        write_atomically(&path, |file| file.write_all(b"new").map_err(|e| e.to_string())).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(names(directory.path()), ["picture.png"]);
    }

    #[test]
    fn a_writer_by_path_replaces_the_file_or_leaves_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("mesh.obj");
        replace(&path, |temporary| fs::write(temporary, "first")).unwrap();
        let failed = replace(&path, |temporary| {
            fs::write(temporary, "half")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(failed.is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), "first");
        assert_eq!(names(directory.path()), ["mesh.obj"]);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link() {
        let directory = tempfile::tempdir().unwrap();
        let (file, link) = (directory.path().join("a.png"), directory.path().join("b.png"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_atomically(&link, |f| f.write_all(b"new").map_err(|e| e.to_string())).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
    }

    #[cfg(unix)]
    #[test]
    fn a_new_file_has_the_rights_of_any_new_file() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let (ours, plain) = (directory.path().join("ours.png"), directory.path().join("plain"));
        write_atomically(&ours, |_| Ok(())).unwrap();
        fs::write(&plain, "").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }

    #[test]
    fn places_that_cannot_be_written_are_known_beforehand() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        fs::write(at("file"), "").unwrap();
        assert!(check_writable(&at("new.png")).is_ok());
        assert!(check_writable(&at("file")).is_ok());
        for (bad, why) in
            [(at(""), "is a directory"), (at("none/a.png"), "No such file"), (at("file/a.png"), "file")]
        {
            let message = check_writable(&bad).unwrap_err().to_string();
            assert!(message.contains(why), "{message}");
        }
        assert_eq!(names(directory.path()), ["file"]);
    }
}
