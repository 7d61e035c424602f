//! Files that replace others at once: written beside their place, flushed to the disk, then renamed. Whatever
//! happens meanwhile, the place holds the old file or the new one, whole.

use std::ffi::OsString;
use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// Writes a file beside its place with `write`, and puts it there when all of it is on the disk.
///
/// # Errors
/// What the system says; the place is then as before, and nothing lies beside it.
pub fn replace_file(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<()> {
    let (temporary, mut file) = open_beside(path)?;
    let written = write(&mut file)
        .and_then(|()| file.sync_all())
        .and_then(|()| std::fs::rename(&temporary, path));
    if let Err(error) = written {
        // That it cannot be removed either is no further news.
        let _ = std::fs::remove_file(&temporary);
        return Err(error);
    }
    sync_folder(path);
    Ok(())
}

/// Whether a file could be written there: the folder exists and takes files.
///
/// # Errors
/// What the system says.
pub fn check_replaceable(path: &Path) -> io::Result<()> {
    let (temporary, _) = open_beside(path)?;
    std::fs::remove_file(temporary)
}

/// Opens the file that will take a place.
fn open_beside(path: &Path) -> io::Result<(PathBuf, File)> {
    if path.file_name().is_none() {
        return Err(io::Error::other("the path does not end in the name of a file"));
    }
    if path.is_dir() {
        return Err(io::Error::other("it is a folder"));
    }
    let temporary = temporary_path(path);
    let file = open_alone(&temporary)?;
    Ok((temporary, file))
}

/// Opens a file for this process alone. Its name is always the same, so that what a process left that was killed
/// is written over; the lock, which dies with its process, keeps two that live apart.
fn open_alone(path: &Path) -> io::Result<File> {
    let file = OpenOptions::new().write(true).read(true).create(true).truncate(false).open(path)?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            return Err(io::Error::other("another process is writing it"));
        }
        // A file system without locks.
        Err(TryLockError::Error(_)) => {}
    }
    file.set_len(0)?;
    Ok(file)
}

fn temporary_path(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".part");
    path.with_file_name(name)
}

/// Makes the new name last through a loss of power. Not all systems can; the file itself is safe without.
fn sync_folder(path: &Path) {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Ok(folder) = File::open(folder.unwrap_or(Path::new("."))) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    /// A folder that goes when the test ends.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path =
                std::env::temp_dir().join(format!("rtsl-replace-{name}-{}", std::process::id()));
            std::fs::create_dir_all(&path).unwrap();
            Folder(path)
        }

        fn files(&self) -> Vec<String> {
            let entries = std::fs::read_dir(&self.0).unwrap();
            entries.map(|it| it.unwrap().file_name().into_string().unwrap()).collect()
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_full_disk_loses_nothing() {
        let folder = Folder::new("full");
        let path = folder.0.join("kept");
        replace_file(&path, |file| file.write_all(b"earlier")).unwrap();
        let error = replace_file(&path, |file| {
            file.write_all(b"half of the n")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert_eq!(error.unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(std::fs::read(&path).unwrap(), b"earlier");
        assert_eq!(folder.files(), ["kept"]);
    }

    #[test]
    fn what_a_killed_process_left_is_written_over() {
        let folder = Folder::new("killed");
        let path = folder.0.join("kept");
        std::fs::write(temporary_path(&path), b"much longer than what comes now").unwrap();
        replace_file(&path, |file| file.write_all(b"short")).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"short");
        assert_eq!(folder.files(), ["kept"]);
    }

    #[test]
    fn two_at_once_do_not_mix() {
        let folder = Folder::new("two");
        let path = folder.0.join("kept");
        replace_file(&path, |file| {
            let second = replace_file(&path, |file| file.write_all(b"second"));
            assert!(second.unwrap_err().to_string().contains("another process"));
            file.write_all(b"first")
        })
        .unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"first");
    }

    #[test]
    fn places_that_cannot_be_are_refused_first() {
        let folder = Folder::new("places");
        let write = |path: &Path| {
            replace_file(path, |_| panic!("nothing is written")).unwrap_err().to_string()
        };
        assert_eq!(write(&folder.0), "it is a folder");
        assert_eq!(write(Path::new("..")), "the path does not end in the name of a file");
        let missing = folder.0.join("missing").join("file");
        assert_eq!(replace_file(&missing, |_| Ok(())).unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
