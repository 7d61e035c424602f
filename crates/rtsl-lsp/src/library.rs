//! The files of the standard library and of the prelude, which are built into the program. Editors show files of the
//! disk, so those that someone goes to are written to a folder.

use std::cell::OnceCell;
use std::fs::DirBuilder;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::{NamedTempFile, TempDir};

/// The folder of the library's files. Nobody but the user can write there: an editor shows what lies in it as the
/// library.
#[derive(Debug)]
pub struct LibraryFolder {
    /// The user's folder for files that may be made again, if there is one.
    cache: Option<PathBuf>,
    place: OnceCell<Option<Place>>,
}

/// A folder that is the user's own.
#[derive(Debug)]
enum Place {
    /// One that stays.
    Kept(PathBuf),
    /// One of a name that nobody knows before, which goes with this value.
    Temporary(TempDir),
}

impl LibraryFolder {
    /// A folder of this version of the program in the user's folder for files that may be made again; a temporary one
    /// if there is none, or if another user can write to that of the program.
    pub fn new(cache: Option<PathBuf>) -> LibraryFolder {
        LibraryFolder { cache, place: OnceCell::new() }
    }

    /// Writes a file, unless it is there, and returns its path; `None` if it cannot be written.
    pub fn path_of(&self, name: &str, text: &str) -> Option<PathBuf> {
        let folder = self.place()?.path();
        let path = folder.join(name);
        let is_there = path.symlink_metadata().is_ok_and(|it| it.is_file())
            && std::fs::read_to_string(&path).is_ok_and(|found| found == text);
        if !is_there {
            write(folder, &path, text).ok()?;
        }
        Some(path)
    }

    /// True for the files in the folder.
    pub fn contains(&self, path: &Path) -> bool {
        let place = self.place.get().and_then(Option::as_ref);
        place.is_some_and(|place| path.starts_with(place.path()))
    }

    fn place(&self) -> Option<&Place> {
        let make = || {
            let kept = self.cache.as_ref().and_then(|cache| kept_folder(cache).ok());
            kept.map(Place::Kept).or_else(|| temporary_folder().map(Place::Temporary).ok())
        };
        self.place.get_or_init(make).as_ref()
    }
}

impl Place {
    fn path(&self) -> &Path {
        match self {
            Place::Kept(folder) => folder,
            Place::Temporary(folder) => folder.path(),
        }
    }
}

fn temporary_folder() -> io::Result<TempDir> {
    let mut builder = tempfile::Builder::new();
    builder.prefix("rtsl-library-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o700));
    builder.tempdir()
}

/// Makes the folder of this version in that of the user.
fn kept_folder(cache: &Path) -> io::Result<PathBuf> {
    let mut builder = DirBuilder::new();
    builder.recursive(true);
    builder.create(cache)?;
    let mut folder = cache.to_owned();
    for name in ["rtsl", "library", env!("CARGO_PKG_VERSION")] {
        folder.push(name);
        make_own(&folder)?;
    }
    Ok(folder)
}

/// Writes a file of a folder in the place of what is there: a link is replaced, and not followed.
fn write(folder: &Path, path: &Path, text: &str) -> io::Result<()> {
    let parent = path.parent().unwrap_or(folder);
    let below = parent.strip_prefix(folder).unwrap_or(Path::new(""));
    let mut made = folder.to_owned();
    for name in below {
        made.push(name);
        make_own(&made)?;
    }
    let mut file = NamedTempFile::new_in(parent)?;
    file.write_all(text.as_bytes())?;
    file.persist(path).map(drop).map_err(|error| error.error)
}

/// Makes a folder, unless it is there, to which nobody but the user can write.
fn make_own(folder: &Path) -> io::Result<()> {
    let mut builder = DirBuilder::new();
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    match builder.create(folder) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => keep_others_out(folder),
        made => made,
    }
}

#[cfg(unix)]
fn keep_others_out(folder: &Path) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, PermissionsExt};

    let metadata = folder.symlink_metadata()?;
    let user = tempfile::tempfile()?.metadata()?.uid();
    if !metadata.is_dir() || metadata.uid() != user {
        return Err(io::Error::other("it is not a folder of this user"));
    }
    match metadata.mode() & 0o022 {
        0 => Ok(()),
        _ => std::fs::set_permissions(folder, std::fs::Permissions::from_mode(0o700)),
    }
}

/// Folders of a user are closed to others by the system.
#[cfg(not(unix))]
fn keep_others_out(folder: &Path) -> io::Result<()> {
    match folder.symlink_metadata()?.is_dir() {
        true => Ok(()),
        false => Err(io::Error::other("it is not a folder")),
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::{PermissionsExt, symlink};

    use super::*;

    fn mode(path: &Path) -> u32 {
        path.symlink_metadata().unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn links_are_replaced_and_not_followed() {
        let root = tempfile::tempdir().unwrap();
        let victim = root.path().join("victim.txt");
        std::fs::write(&victim, "precious").unwrap();
        let library = LibraryFolder::new(Some(root.path().join("cache")));
        let path = library.path_of("shaders/a.rtsl", "text").unwrap();
        assert!(library.contains(&path) && path.starts_with(root.path()));
        assert_eq!((mode(path.parent().unwrap()), mode(&path)), (0o700, 0o600));
        std::fs::remove_file(&path).unwrap();
        symlink(&victim, &path).unwrap();
        assert_eq!(library.path_of("shaders/a.rtsl", "text").as_ref(), Some(&path));
        assert_eq!(std::fs::read_to_string(&victim).unwrap(), "precious");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "text");
        assert!(path.symlink_metadata().unwrap().is_file());
    }

    #[test]
    fn a_folder_that_is_not_the_users_is_not_used() {
        let root = tempfile::tempdir().unwrap();
        let (cache, elsewhere) = (root.path().join("cache"), root.path().join("elsewhere"));
        std::fs::create_dir_all(&cache).unwrap();
        std::fs::create_dir(&elsewhere).unwrap();
        symlink(&elsewhere, cache.join("rtsl")).unwrap();
        for cache in [Some(cache), None] {
            let library = LibraryFolder::new(cache);
            let path = library.path_of("a.rtsl", "text").unwrap();
            assert!(!path.starts_with(root.path()) && library.contains(&path));
            assert_eq!(mode(path.parent().unwrap()), 0o700);
            drop(library);
            assert!(!path.exists());
        }
        assert_eq!(std::fs::read_dir(&elsewhere).unwrap().count(), 0);
    }

    #[test]
    fn others_lose_what_they_could_do() {
        let root = tempfile::tempdir().unwrap();
        let open = root.path().join("rtsl");
        std::fs::create_dir(&open).unwrap();
        std::fs::set_permissions(&open, std::fs::Permissions::from_mode(0o777)).unwrap();
        assert!(LibraryFolder::new(Some(root.path().to_owned())).path_of("a", "b").is_some());
        assert_eq!(mode(&open), 0o700);
    }
}
