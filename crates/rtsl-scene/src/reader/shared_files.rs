//! References to sources of files.

use std::ops::Deref;
use std::sync::Arc;

use super::files::FileSource;

/// A source of files, borrowed or shared.
#[derive(Clone)]
pub enum FilesRef<'f> {
    /// One that outlives its user.
    Borrowed(&'f dyn FileSource),
    /// One that its users keep.
    Shared(Arc<dyn FileSource + Send>),
}

impl<'f> Deref for FilesRef<'f> {
    type Target = dyn FileSource + 'f;

    fn deref(&self) -> &Self::Target {
        match self {
            FilesRef::Borrowed(files) => *files,
            FilesRef::Shared(files) => &**files,
        }
    }
}
