//! Files that may lie in folders of strangers.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use super::place::{place_of_open, real_place};

/// The reason for which a file is not opened that the system would open.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// It is a folder, a pipe or a device: reading might never end.
    #[error("it is not a regular file")]
    NotRegular,
    /// It lies outside the folders where it may lie, or would lie there if there were one.
    #[error("it lies outside the folders where it may lie")]
    Outside,
}

impl Refused {
    /// Returns the reason that an error of this module has.
    pub fn of(error: &io::Error) -> Option<Refused> {
        error.get_ref()?.downcast_ref().copied()
    }
}

impl From<Refused> for io::Error {
    fn from(refused: Refused) -> Self {
        io::Error::other(refused)
    }
}

/// Opens a regular file for reading. The file is checked once it is open, so that nothing else can take its place, and
/// opening a pipe does not wait: reading a pipe or a device might never end.
///
/// # Errors
/// If it cannot be opened, or is not a regular file.
pub fn open_regular_file(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK);
    let file = options.open(path)?;
    match file.metadata()?.is_file() {
        true => Ok(file),
        false => Err(Refused::NotRegular.into()),
    }
}

/// Opens a regular file that lies in one of the folders, or below. It is checked once more where it lies when it is
/// open, so that no link can take the place of a file or a folder in between.
///
/// # Errors
/// [`Refused::Outside`] for every path that leads outside, whether anything is there or not; otherwise as for
/// [`open_regular_file`].
pub fn open_within(path: &Path, folders: &[PathBuf]) -> io::Result<File> {
    let folders: Vec<PathBuf> = folders.iter().filter_map(|folder| real_place(folder)).collect();
    let is_within = |place: Option<PathBuf>| {
        place.is_some_and(|place| folders.iter().any(|folder| place.starts_with(folder)))
    };
    // Files outside are not even opened, which devices would notice.
    if !is_within(real_place(path)) {
        return Err(Refused::Outside.into());
    }
    let opened = open_regular_file(path);
    let place = match &opened {
        Ok(file) => place_of_open(file, path),
        Err(_) => real_place(path),
    };
    if is_within(place) { opened } else { Err(Refused::Outside.into()) }
}

#[cfg(all(test, unix))]
mod tests {
    use std::io::Read;
    use std::os::unix::fs::symlink;
    use std::process::Command;
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    fn text(mut file: File) -> String {
        let mut text = String::new();
        file.read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn pipes_folders_and_devices_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("file"), "text").unwrap();
        assert!(Command::new("mkfifo").arg(path("pipe")).status().unwrap().success());
        assert_eq!(text(open_regular_file(&path("file")).unwrap()), "text");
        for other in [path("pipe"), folder.path().to_owned(), "/dev/zero".into()] {
            let error = open_regular_file(&other).unwrap_err();
            assert_eq!(Refused::of(&error), Some(Refused::NotRegular), "{}", other.display());
            assert_eq!(error.to_string(), "it is not a regular file");
        }
        let missing = open_regular_file(&path("missing")).unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }

    #[test]
    fn what_lies_outside_is_refused_whether_it_is_there_or_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(path("inside/below")).unwrap();
        std::fs::write(path("secret"), "secret").unwrap();
        std::fs::write(path("inside/below/file"), "text").unwrap();
        symlink(path("secret"), path("inside/link")).unwrap();
        symlink(path("absent"), path("inside/dangling")).unwrap();
        symlink("below/file", path("inside/near")).unwrap();
        symlink(folder.path(), path("inside/up")).unwrap();
        let open = |name: &str| open_within(&path(name), &[path("inside")]);
        for name in ["inside/below/file", "inside/near"] {
            assert_eq!(text(open(name).unwrap()), "text");
        }
        assert_eq!(open("inside/absent").unwrap_err().kind(), io::ErrorKind::NotFound);
        let outside = ["secret", "absent", "inside/link", "inside/dangling", "inside/up/secret"];
        for name in outside {
            let error = open(name).unwrap_err();
            assert_eq!(Refused::of(&error), Some(Refused::Outside), "{name}");
        }
    }

    /// A check by name before the file is opened by name lets some of these through.
    #[test]
    fn links_that_take_the_place_of_a_file_meanwhile_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("inside")).unwrap();
        std::fs::write(path("secret"), "secret").unwrap();
        let (name, is_done) = (path("inside/name"), AtomicBool::new(false));
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !is_done.load(Ordering::Relaxed) {
                    std::fs::write(path("inside/file"), "text").unwrap();
                    std::fs::rename(path("inside/file"), &name).unwrap();
                    symlink(path("secret"), path("inside/link")).unwrap();
                    std::fs::rename(path("inside/link"), &name).unwrap();
                }
            });
            for _ in 0..3000 {
                if let Ok(file) = open_within(&name, &[path("inside")]) {
                    assert_eq!(text(file), "text");
                }
            }
            is_done.store(true, Ordering::Relaxed);
        });
    }
}
