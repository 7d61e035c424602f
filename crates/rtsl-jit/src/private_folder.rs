//! A folder whose contents no other user can have written.

use std::fs::{DirBuilder, File, Metadata, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use crate::code_cache::StoredFile;
use crate::error::CodeCacheError;

/// The age from which unfinished files are removed.
const UNFINISHED_AGE: Duration = Duration::from_secs(3600);
/// The age of the mark of a file from which it is marked again.
const MARK_AGE: Duration = Duration::from_secs(3600 * 24);
/// The bits of a mode that let others write.
const WRITABLE_BY_OTHERS: u32 = 0o022;
/// The bit of a folder in which users can only rename and remove files of their own.
const STICKY: u32 = 0o1000;
/// The first part of the names of files that are being written.
const UNFINISHED: &str = "unfinished-";

/// A folder of this user, below folders that no other user can rename. It and its files were not written by others, so
/// that code may be read from it.
#[derive(Debug)]
pub struct PrivateFolder {
    path: PathBuf,
}

impl PrivateFolder {
    /// Opens the folder, which is created with the mode 700 if it is missing, as are those above it.
    ///
    /// # Errors
    /// If it can't be created or belongs to another user, or if others may write in it or replace it.
    pub fn open(path: &Path) -> Result<PrivateFolder, CodeCacheError> {
        let failed = |error: io::Error| CodeCacheError::Folder {
            path: path.to_owned(),
            reason: error.to_string(),
        };
        DirBuilder::new().recursive(true).mode(0o700).create(path).map_err(failed)?;
        let path = path.canonicalize().map_err(failed)?;
        for folder in path.ancestors() {
            let metadata = folder.symlink_metadata().map_err(failed)?;
            check_folder(folder, &metadata, folder == path)?;
        }
        Ok(PrivateFolder { path })
    }

    /// The folder, without links.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads a file of at most `max_bytes`; `None` if there is none that this user alone can have written. It is marked
    /// as used now, which is not written to the disk each time.
    pub fn read(&self, name: &str, max_bytes: u64) -> Option<Vec<u8>> {
        let mut options = OpenOptions::new();
        options.read(true).custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK);
        let file = options.open(self.path.join(name)).ok()?;
        let metadata = file.metadata().ok()?;
        let is_private = metadata.is_file()
            && metadata.uid() == user()
            && metadata.mode() & 0o077 == 0
            // None once another process has written the file again.
            && metadata.nlink() <= 1
            && metadata.len() <= max_bytes;
        if !is_private {
            return None;
        }
        let mut bytes = Vec::with_capacity(metadata.len() as usize);
        (&file).take(max_bytes).read_to_end(&mut bytes).ok()?;
        let now = SystemTime::now();
        let marked = metadata.modified().ok().and_then(|marked| now.duration_since(marked).ok());
        if marked.is_some_and(|age| age > MARK_AGE) {
            // A failure only means that the file goes earlier.
            let _ = file.set_modified(now);
        }
        Some(bytes)
    }

    /// Writes a file: beside its place first, so that no reader finds a part of it.
    pub fn write(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        static WRITTEN: AtomicU64 = AtomicU64::new(0);
        let number = WRITTEN.fetch_add(1, Ordering::Relaxed);
        let beside = self.path.join(format!("{UNFINISHED}{}-{number}", std::process::id()));
        let mut options = OpenOptions::new();
        let created = options.write(true).create_new(true).mode(0o600).open(&beside);
        let written = created
            .and_then(|mut file: File| file.write_all(bytes))
            .and_then(|()| std::fs::rename(&beside, self.path.join(name)));
        if written.is_err() {
            let _ = std::fs::remove_file(&beside);
        }
        written
    }

    /// Returns the finished files. Others are removed if they are so old that their writers must have ended.
    pub fn files(&self) -> Vec<StoredFile> {
        let mut files = Vec::new();
        for entry in std::fs::read_dir(&self.path).into_iter().flatten().flatten() {
            let Ok(metadata) = entry.metadata() else { continue };
            let used = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            let (path, bytes) = (entry.path(), metadata.len());
            if !entry.file_name().to_string_lossy().starts_with(UNFINISHED) {
                files.push(StoredFile { path, bytes, used });
            } else if used.elapsed().is_ok_and(|age| age > UNFINISHED_AGE) {
                let _ = std::fs::remove_file(path);
            }
        }
        files
    }
}

/// Checks that no other user can write in a folder, or for one `above` the folder itself, replace what lies in it.
fn check_folder(path: &Path, metadata: &Metadata, is_itself: bool) -> Result<(), CodeCacheError> {
    let owner = metadata.uid();
    let is_trusted = owner == user() || owner == 0 && !is_itself;
    if !is_trusted {
        return Err(CodeCacheError::Owner(path.to_owned()));
    }
    let mode = metadata.mode();
    let keeps_names = mode & STICKY != 0 && !is_itself;
    if mode & WRITABLE_BY_OTHERS != 0 && !keeps_names {
        return Err(CodeCacheError::Writable(path.to_owned()));
    }
    Ok(())
}

/// The user with whose rights this process accesses files.
fn user() -> u32 {
    // Safety: the function takes no arguments and can't fail.
    unsafe { libc::geteuid() }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::{PermissionsExt, symlink};

    use super::*;

    fn set_mode(path: &Path, mode: u32) {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    }

    fn mode(path: &Path) -> u32 {
        path.metadata().unwrap().mode() & 0o777
    }

    #[test]
    fn folders_and_files_are_for_one_user() {
        let outer = tempfile::tempdir().unwrap();
        let path = outer.path().join("a/b");
        let folder = PrivateFolder::open(&path).unwrap();
        assert_eq!((mode(&path), mode(&outer.path().join("a"))), (0o700, 0o700));
        folder.write("x", b"code").unwrap();
        folder.write("x", b"new code").unwrap();
        assert_eq!(mode(&path.join("x")), 0o600);
        assert_eq!(folder.read("x", 8).as_deref(), Some(&b"new code"[..]));
        assert_eq!(folder.read("x", 7), None);
        assert_eq!(folder.read("y", 8), None);
        assert_eq!(folder.files().len(), 1);
    }

    #[test]
    fn folders_that_others_may_write_are_refused() {
        let outer = tempfile::tempdir().unwrap();
        let (above, path) = (outer.path().join("above"), outer.path().join("above/folder"));
        PrivateFolder::open(&path).unwrap();
        for lax in [0o720, 0o702, 0o1777] {
            set_mode(&path, lax);
            let error = PrivateFolder::open(&path).unwrap_err();
            assert!(matches!(error, CodeCacheError::Writable(_)), "{error}");
        }
        set_mode(&path, 0o755);
        assert!(PrivateFolder::open(&path).is_ok(), "others may read");
        set_mode(&above, 0o770);
        assert!(
            matches!(PrivateFolder::open(&path), Err(CodeCacheError::Writable(it)) if it == above.canonicalize().unwrap())
        );
        // As in /tmp.
        set_mode(&above, 0o1777);
        assert!(PrivateFolder::open(&path).is_ok());
        // A link leads to the folder that is checked.
        let link = outer.path().join("link");
        symlink(&path, &link).unwrap();
        assert_eq!(PrivateFolder::open(&link).unwrap().path(), path.canonicalize().unwrap());
        set_mode(&path, 0o777);
        assert!(PrivateFolder::open(&link).is_err());
        std::fs::write(outer.path().join("file"), "").unwrap();
        let error = PrivateFolder::open(&outer.path().join("file")).unwrap_err();
        assert!(matches!(error, CodeCacheError::Folder { .. }), "{error}");
    }

    #[test]
    fn files_that_others_may_have_written_are_not_read() {
        let outer = tempfile::tempdir().unwrap();
        let folder = PrivateFolder::open(&outer.path().join("folder")).unwrap();
        let path = |name: &str| folder.path().join(name);
        let is_read = |name: &str| folder.read(name, 100).is_some();
        folder.write("a", b"code").unwrap();
        assert!(is_read("a"));
        for lax in [0o620, 0o602, 0o640, 0o604] {
            set_mode(&path("a"), lax);
            assert!(!is_read("a"), "mode {lax:o}");
        }
        set_mode(&path("a"), 0o600);
        symlink(path("a"), path("link")).unwrap();
        assert!(!is_read("link"));
        std::fs::hard_link(path("a"), path("b")).unwrap();
        assert!(!is_read("a") && !is_read("b"));
        std::fs::create_dir(path("c")).unwrap();
        assert!(!is_read("c"));
        let made = std::process::Command::new("mkfifo").arg(path("pipe")).status();
        assert!(made.unwrap().success());
        assert!(!is_read("pipe"));
    }
}
