//! Atomic replacement of files: the new content is written to a temporary file in the same folder, flushed to the disk
//! and renamed. At any time, the path has either the complete old content or the complete new one.
//!
//! Only regular files are replaced. A symbolic link stays, and its target is replaced; devices and pipes are written
//! to; folders, block devices and sockets are rejected.

use std::ffi::OsString;
use std::fs::{File, FileType, OpenOptions, TryLockError};
use std::io::{self, Cursor, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The time to wait for another process that writes the same file.
const PATIENCE: Duration = Duration::from_secs(1);
/// The interval between attempts to lock the file.
const PAUSE: Duration = Duration::from_millis(5);
/// The greatest length of a chain of symbolic links, as in Linux.
const MAX_LINKS: usize = 40;

/// A seekable output.
pub trait Output: Write + Seek {}

impl<T: Write + Seek> Output for T {}

/// Writes a temporary file with `write`, and renames it to `path` when all of it is on the disk. A path that is not a
/// regular file but can be written to, such as a pipe, receives the bytes when they are complete.
///
/// # Errors
/// Any error of the file system; `path` is then unchanged and the temporary file is removed.
pub fn replace_file(
    path: &Path,
    write: impl FnOnce(&mut dyn Output) -> io::Result<()>,
) -> io::Result<()> {
    match Destination::of(path)? {
        Destination::File(place) => Replacement::of_file(place)?.finish(write),
        Destination::Stream => {
            let mut contents = Cursor::new(Vec::new());
            write(&mut contents)?;
            // The pipe is opened after the content is complete: opening it earlier would wait for its reader, which may
            // itself wait for this process.
            let mut stream = OpenOptions::new().append(true).open(path)?;
            stream.write_all(contents.get_ref())
        }
    }
}

/// Checks that a file could be written to `path`: the folder exists and is writable, or the path is that of a stream.
///
/// # Errors
/// Any error of the file system.
pub fn check_replaceable(path: &Path) -> io::Result<()> {
    match Destination::of(path)? {
        Destination::File(place) => Replacement::of_file(place).map(drop),
        Destination::Stream => Ok(()),
    }
}

/// The file that a path leads to.
enum Destination {
    /// A regular file, or one that does not exist yet, at this path, which is not a link.
    File(PathBuf),
    /// A stream, which is written to and not replaced.
    Stream,
}

impl Destination {
    fn of(path: &Path) -> io::Result<Self> {
        if path.file_name().is_none() {
            return Err(io::Error::other("the path does not end in the name of a file"));
        }
        match std::fs::metadata(path) {
            Ok(metadata) if metadata.is_file() => Destination::of_link(path),
            Ok(metadata) => check_stream(metadata.file_type()).map(|()| Destination::Stream),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Destination::of_link(path),
            Err(error) => Err(error),
        }
    }

    /// Follows links to a file, or to a path without a file.
    fn of_link(path: &Path) -> io::Result<Self> {
        let mut place = path.to_owned();
        for _ in 0..MAX_LINKS {
            let Ok(target) = std::fs::read_link(&place) else {
                return Ok(Destination::File(place));
            };
            let folder = folder_of(&place).canonicalize()?;
            // Links of open files, such as `/dev/stdout`: the file behind them belongs to another process.
            if cfg!(target_os = "linux") && folder.starts_with("/proc") {
                return Ok(Destination::Stream);
            }
            place = folder.join(target);
        }
        Err(io::Error::other("too many levels of symbolic links"))
    }
}

/// Checks that a path that is not a regular file can be written to.
fn check_stream(kind: FileType) -> io::Result<()> {
    if kind.is_dir() {
        return Err(io::Error::other("it is a folder, expected a file"));
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_block_device() {
            return Err(io::Error::other("it is a block device, expected a file"));
        }
        if kind.is_socket() {
            return Err(io::Error::other("it is a socket, expected a file"));
        }
    }
    Ok(())
}

/// A pending replacement of a file, which holds a lock: no other process replaces the same file meanwhile. If dropped
/// before it is finished, the temporary file is removed.
pub struct Replacement {
    place: PathBuf,
    temporary: PathBuf,
    file: File,
    is_finished: bool,
}

impl Replacement {
    /// Begins to replace a file that will be read again.
    ///
    /// # Errors
    /// Any error of the file system, or that the path is not that of a regular file.
    pub fn begin(path: &Path) -> io::Result<Self> {
        match Destination::of(path)? {
            Destination::File(place) => Replacement::of_file(place),
            Destination::Stream => {
                Err(io::Error::other("it is a device or a pipe, expected a file"))
            }
        }
    }

    fn of_file(place: PathBuf) -> io::Result<Self> {
        let temporary = temporary_path(&place);
        let file = open_alone(&temporary)?;
        Ok(Replacement { place, temporary, file, is_finished: false })
    }

    /// Returns the path of the file with all links resolved.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Writes the file and renames it to its path.
    ///
    /// # Errors
    /// Any error of the file system; the path is then unchanged.
    pub fn finish(
        mut self,
        write: impl FnOnce(&mut dyn Output) -> io::Result<()>,
    ) -> io::Result<()> {
        write(&mut self.file)?;
        self.file.sync_all()?;
        std::fs::rename(&self.temporary, &self.place)?;
        self.is_finished = true;
        sync_folder(&self.place);
        Ok(())
    }
}

impl Drop for Replacement {
    fn drop(&mut self) {
        if !self.is_finished {
            // The lock is held, so the file belongs to this process. An error of removing it is not reported.
            let _ = std::fs::remove_file(&self.temporary);
        }
    }
}

/// Opens a file exclusively. Its name is always the same, so that the leftover of a killed process is overwritten; the
/// lock, which ends with its process, separates concurrent ones.
fn open_alone(path: &Path) -> io::Result<File> {
    let give_up = Instant::now() + PATIENCE;
    loop {
        if std::fs::symlink_metadata(path).is_ok_and(|metadata| !metadata.is_file()) {
            return Err(io::Error::other(format!("`{}` is in the way", path.display())));
        }
        let file =
            OpenOptions::new().write(true).read(true).create(true).truncate(false).open(path)?;
        match file.try_lock() {
            // Between opening and locking, the other process may have renamed the file: this is then the finished file,
            // no longer the temporary one.
            Ok(()) if !is_at(&file, path) => {}
            // The second error comes from file systems without locks.
            Ok(()) | Err(TryLockError::Error(_)) => {
                file.set_len(0)?;
                return Ok(file);
            }
            Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
        }
        if Instant::now() > give_up {
            return Err(io::Error::other("another process is writing it"));
        }
    }
}

/// True if an open file is the one at a path.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let opened = file.metadata();
    let named = std::fs::symlink_metadata(path);
    match (opened, named) {
        (Ok(opened), Ok(named)) => opened.dev() == named.dev() && opened.ino() == named.ino(),
        (Err(_), _) | (_, Err(_)) => false,
    }
}

/// Other systems have no file ids in `std`; there, a renamed file leaves none under its old name.
#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

fn temporary_path(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".part");
    path.with_file_name(name)
}

fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

/// Makes the new name survive a loss of power. Some systems do not support it; the content is safe anyway.
fn sync_folder(path: &Path) {
    if let Ok(folder) = File::open(folder_of(path)) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {
    use tempfile::TempDir;

    use super::*;

    fn folder() -> TempDir {
        tempfile::tempdir().unwrap()
    }

    fn files(folder: &TempDir) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|it| it.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_full_disk_loses_nothing() {
        let folder = folder();
        let path = folder.path().join("kept");
        replace_file(&path, |file| file.write_all(b"earlier")).unwrap();
        let error = replace_file(&path, |file| {
            file.write_all(b"half of the n")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert_eq!(error.unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(std::fs::read(&path).unwrap(), b"earlier");
        assert_eq!(files(&folder), ["kept"]);
    }

    #[test]
    fn what_a_killed_process_left_is_written_over() {
        let folder = folder();
        let path = folder.path().join("kept");
        std::fs::write(temporary_path(&path), b"much longer than what comes now").unwrap();
        replace_file(&path, |file| file.write_all(b"short")).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"short");
        assert_eq!(files(&folder), ["kept"]);
    }

    #[test]
    fn a_file_that_took_its_place_is_not_opened_again() {
        let folder = folder();
        let path = folder.path().join("kept");
        let first = Replacement::begin(&path).unwrap();
        // A second process opens the file before the first renames it, and locks it afterwards.
        let late = File::open(temporary_path(&path)).unwrap();
        assert!(is_at(&late, &temporary_path(&path)));
        first.finish(|file| file.write_all(b"first")).unwrap();
        late.try_lock().unwrap();
        assert!(!is_at(&late, &temporary_path(&path)));
        // That lock does not affect a third process, because it is on another file.
        replace_file(&path, |file| file.write_all(b"third")).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"third");
    }

    #[test]
    fn what_is_unfinished_leaves_nothing() {
        let folder = folder();
        drop(Replacement::begin(&folder.path().join("kept")).unwrap());
        check_replaceable(&folder.path().join("kept")).unwrap();
        assert_eq!(files(&folder), [""; 0]);
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_and_lead_to_what_is_replaced() {
        use std::os::unix::fs::symlink;
        let folder = folder();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("below")).unwrap();
        std::fs::write(path("below/file"), "earlier").unwrap();
        symlink("below/file", path("link")).unwrap();
        symlink(path("link"), path("link of link")).unwrap();
        replace_file(&path("link of link"), |file| file.write_all(b"later")).unwrap();
        assert_eq!(std::fs::read(path("below/file")).unwrap(), b"later");
        assert!(path("link").is_symlink() && path("link of link").is_symlink());
        symlink("below/new", path("dangling")).unwrap();
        replace_file(&path("dangling"), |file| file.write_all(b"new")).unwrap();
        assert_eq!(std::fs::read(path("below/new")).unwrap(), b"new");
        symlink("endless", path("endless")).unwrap();
        assert!(replace_file(&path("endless"), |_| Ok(())).is_err());
        // A link at the temporary file's name may be an attack.
        std::fs::write(path("victim"), "victim").unwrap();
        symlink("victim", path(".trap.part")).unwrap();
        let error = replace_file(&path("trap"), |_| Ok(())).unwrap_err().to_string();
        assert!(error.ends_with(".trap.part` is in the way"), "{error}");
        assert_eq!(std::fs::read(path("victim")).unwrap(), b"victim");
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_written_to() {
        use std::os::unix::fs::FileTypeExt;
        // The test uses a link: if the code were wrong, only the link would be replaced and not the device.
        let folder = folder();
        let null = folder.path().join("null");
        std::os::unix::fs::symlink("/dev/null", &null).unwrap();
        check_replaceable(&null).unwrap();
        replace_file(&null, |file| file.write_all(b"nothing")).unwrap();
        assert!(null.is_symlink());
        assert!(std::fs::metadata(&null).unwrap().file_type().is_char_device());
        let error = Replacement::begin(&null).err().expect("it cannot be read again").to_string();
        assert_eq!(error, "it is a device or a pipe, expected a file");
    }

    #[test]
    fn two_at_once_do_not_mix() {
        let folder = folder();
        let path = folder.path().join("kept");
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
        let folder = folder();
        let write = |path: &Path| {
            replace_file(path, |_| panic!("nothing is written")).unwrap_err().to_string()
        };
        assert_eq!(write(folder.path()), "it is a folder, expected a file");
        assert_eq!(write(Path::new("..")), "the path does not end in the name of a file");
        let missing = folder.path().join("missing").join("file");
        assert_eq!(replace_file(&missing, |_| Ok(())).unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
