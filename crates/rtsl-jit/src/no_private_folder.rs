//! Systems without machine code, which need no folder for it.

use std::io;
use std::path::Path;

use crate::code_cache::StoredFile;
use crate::error::CodeCacheError;

/// There is none.
#[derive(Debug)]
pub enum PrivateFolder {}

impl PrivateFolder {
    /// Refuses.
    ///
    /// # Errors
    /// Always.
    pub fn open(path: &Path) -> Result<PrivateFolder, CodeCacheError> {
        let reason = "there is no machine code on this system".to_owned();
        Err(CodeCacheError::Folder { path: path.to_owned(), reason })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        match *self {}
    }

    /// Reads a file.
    pub fn read(&self, _: &str, _: u64) -> Option<Vec<u8>> {
        match *self {}
    }

    /// Writes a file.
    pub fn write(&self, _: &str, _: &[u8]) -> io::Result<()> {
        match *self {}
    }

    /// Returns the files.
    pub fn files(&self) -> Vec<StoredFile> {
        match *self {}
    }
}
