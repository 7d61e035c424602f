//! Files that replace others at once: written beside their place, flushed to the disk, then renamed. Whatever
//! happens meanwhile, the place holds the old file or the new one, whole.
//!
//! Only regular files are replaced. A symbolic link stays, and the file that it names is replaced; devices and pipes
//! are written to; folders, block devices and sockets are refused.

use std::ffi::OsString;
use std::fs::{File, FileType, OpenOptions, TryLockError};
use std::io::{self, Cursor, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long to wait for another process that writes the same file.
const PATIENCE: Duration = Duration::from_secs(1);
/// The time between two looks at its lock.
const PAUSE: Duration = Duration::from_millis(5);
/// Links that lead to links, as many as Linux follows.
const MAX_LINKS: usize = 40;

/// A file that is written from its beginning, whose writers may go back.
pub trait Output: Write + Seek {}

impl<T: Write + Seek> Output for T {}

/// Writes a file beside its place with `write`, and puts it there when all of it is on the disk. What is no regular
/// file but takes bytes, a pipe for example, gets them when all are made.
///
/// # Errors
/// What the system says; the place is then as before, and nothing lies beside it.
pub fn replace_file(
    path: &Path,
    write: impl FnOnce(&mut dyn Output) -> io::Result<()>,
) -> io::Result<()> {
    match Destination::of(path)? {
        Destination::File(place) => Replacement::of_file(place)?.finish(write),
        Destination::Stream => {
            let mut contents = Cursor::new(Vec::new());
            write(&mut contents)?;
            // Opened before, a pipe would wait for its reader during the work, and the reader for us.
            let mut stream = OpenOptions::new().append(true).open(path)?;
            stream.write_all(contents.get_ref())
        }
    }
}

/// Whether a file could be written there: the folder exists and takes files, or the path is that of a stream.
///
/// # Errors
/// What the system says.
pub fn check_replaceable(path: &Path) -> io::Result<()> {
    match Destination::of(path)? {
        Destination::File(place) => Replacement::of_file(place).map(drop),
        Destination::Stream => Ok(()),
    }
}

/// What a path leads to.
enum Destination {
    /// A regular file, or nothing yet, at this path, which is no link.
    File(PathBuf),
    /// Something that takes bytes and keeps its place.
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

    /// Follows links to a file, or to where there is none yet.
    fn of_link(path: &Path) -> io::Result<Self> {
        let mut place = path.to_owned();
        for _ in 0..MAX_LINKS {
            let Ok(target) = std::fs::read_link(&place) else {
                return Ok(Destination::File(place));
            };
            let folder = folder_of(&place).canonicalize()?;
            // Links of open files, such as `/dev/stdout`: the file behind them belongs to somebody else.
            if cfg!(target_os = "linux") && folder.starts_with("/proc") {
                return Ok(Destination::Stream);
            }
            place = folder.join(target);
        }
        Err(io::Error::other("links lead to links without end"))
    }
}

/// Whether what is no regular file takes bytes.
fn check_stream(kind: FileType) -> io::Result<()> {
    if kind.is_dir() {
        return Err(io::Error::other("it is a folder"));
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

/// A file that is to take a place, alone with its lock: no other process replaces the same file meanwhile. Where it
/// is dropped unfinished, nothing of it is left.
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
    /// What the system says, or that the path is not that of a regular file.
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

    /// The place, behind all links.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Writes the file, and puts it in its place.
    ///
    /// # Errors
    /// What the system says; the place is then as before.
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
            // Under the lock, so that it is ours. That it cannot be removed is no further news.
            let _ = std::fs::remove_file(&self.temporary);
        }
    }
}

/// Opens a file for this process alone. Its name is always the same, so that what a process left that was killed
/// is written over; the lock, which dies with its process, keeps two that live apart.
fn open_alone(path: &Path) -> io::Result<File> {
    let give_up = Instant::now() + PATIENCE;
    loop {
        if std::fs::symlink_metadata(path).is_ok_and(|metadata| !metadata.is_file()) {
            return Err(io::Error::other(format!("`{}` is in the way", path.display())));
        }
        let file =
            OpenOptions::new().write(true).read(true).create(true).truncate(false).open(path)?;
        match file.try_lock() {
            // Between opening and locking the other process may have put it in its place: then it is the finished
            // file, and no longer the one of this name.
            Ok(()) if !is_at(&file, path) => {}
            // The second error is that of a file system without locks.
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

/// Whether an open file is the one that a path names.
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

/// Elsewhere files have no numbers that `std` tells; a file that was renamed has left no other under its name.
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

/// Makes the new name last through a loss of power. Not all systems can; the file itself is safe without.
fn sync_folder(path: &Path) {
    if let Ok(folder) = File::open(folder_of(path)) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {

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
    fn a_file_that_took_its_place_is_not_opened_again() {
        let folder = Folder::new("inode");
        let path = folder.0.join("kept");
        let first = Replacement::begin(&path).unwrap();
        // What a second process opens before the first renames, and locks after it.
        let late = File::open(temporary_path(&path)).unwrap();
        assert!(is_at(&late, &temporary_path(&path)));
        first.finish(|file| file.write_all(b"first")).unwrap();
        late.try_lock().unwrap();
        assert!(!is_at(&late, &temporary_path(&path)));
        // A third is not hindered by that lock, since it is another file.
        replace_file(&path, |file| file.write_all(b"third")).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"third");
    }

    #[test]
    fn what_is_unfinished_leaves_nothing() {
        let folder = Folder::new("unfinished");
        drop(Replacement::begin(&folder.0.join("kept")).unwrap());
        check_replaceable(&folder.0.join("kept")).unwrap();
        assert_eq!(folder.files(), [""; 0]);
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_and_lead_to_what_is_replaced() {
        use std::os::unix::fs::symlink;
        let folder = Folder::new("links");
        let path = |name: &str| folder.0.join(name);
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
        // A link at the name of the file beside is somebody's trap.
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
        // By a link: were it replaced, the machine would keep its device.
        let folder = Folder::new("devices");
        let null = folder.0.join("null");
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
