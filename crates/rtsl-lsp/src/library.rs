//! The files of the standard library and of the prelude, which are built into the program. Editors show files of the
//! disk, so those that someone goes to are written to a folder.

use std::path::{Path, PathBuf};

/// The folder of the library's files.
#[derive(Debug)]
pub struct LibraryFolder {
    folder: PathBuf,
}

impl LibraryFolder {
    /// The folder at this path, for this version of the program.
    pub fn new(folder: PathBuf) -> LibraryFolder {
        LibraryFolder { folder: folder.join(env!("CARGO_PKG_VERSION")) }
    }

    /// Writes a file, unless it is there, and returns its path; `None` if it cannot be written.
    pub fn path_of(&self, name: &str, text: &str) -> Option<PathBuf> {
        let path = self.folder.join(name);
        if std::fs::read_to_string(&path).is_ok_and(|found| found == text) {
            return Some(path);
        }
        std::fs::create_dir_all(path.parent()?).ok()?;
        std::fs::write(&path, text).ok()?;
        Some(path)
    }

    /// True for the files in the folder.
    pub fn contains(&self, path: &Path) -> bool {
        path.starts_with(&self.folder)
    }
}
