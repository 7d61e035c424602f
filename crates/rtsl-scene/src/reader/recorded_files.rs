//! A record of the files from which a scene was loaded, with digests of their contents.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::files::{DiskFiles, FileSource, Opened};
use super::shared_files::FilesRef;

/// The BLAKE3 digest of a file's content. It is collision resistant, so an edited scene is never mistaken for the
/// original.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Digest(pub [u8; 32]);

impl Digest {
    /// Computes the digest of bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Digest(*blake3::hash(bytes).as_bytes())
    }

    /// Computes the digest of a file on the disk, and its size.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn of_file(path: &Path) -> io::Result<(Self, u64)> {
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(DiskFiles.open(path)?)?;
        Ok((Digest(*hasher.finalize().as_bytes()), hasher.count()))
    }
}

/// In hexadecimal digits.
impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// A file source that records the files read from another one, with digests of the bytes read.
pub struct RecordedFiles<'a> {
    files: FilesRef<'a>,
    record: Record,
}

/// The digests of each file; several if it changed while the scene was loaded, or was read in part.
type Record = Arc<Mutex<BTreeMap<PathBuf, BTreeSet<Digest>>>>;

impl<'a> RecordedFiles<'a> {
    /// Wraps a source; no file is recorded yet.
    pub fn new(files: &'a dyn FileSource) -> Self {
        RecordedFiles { files: FilesRef::Borrowed(files), record: Record::default() }
    }

    /// Returns the paths of the files read, sorted.
    pub fn paths(&self) -> Vec<PathBuf> {
        locked(&self.record).keys().cloned().collect()
    }

    /// Returns the files read, each with a digest of the bytes read from it, sorted by path. Paths are relative to the
    /// folder of `scene` if they lie below it: a scene that was moved, or is rendered from another folder, is the same
    /// scene.
    pub fn digests(&self, scene: &Path) -> Vec<(String, Digest)> {
        let folder = scene.parent().unwrap_or(Path::new(""));
        let digest = |(path, digests): (&PathBuf, &BTreeSet<Digest>)| {
            let name = path.strip_prefix(folder).unwrap_or(path).display().to_string();
            let all: Vec<u8> = digests.iter().flat_map(|Digest(bytes)| *bytes).collect();
            (name, Digest::of(&all))
        };
        locked(&self.record).iter().map(digest).collect()
    }
}

impl RecordedFiles<'_> {
    /// Returns an open file that is recorded when it was read.
    fn recorded(&self, path: &Path, source: Box<dyn Read>) -> Box<dyn Read> {
        let (path, record) = (path.to_owned(), Arc::clone(&self.record));
        Box::new(RecordedFile { source, path, record, hasher: blake3::Hasher::new() })
    }
}

impl RecordedFiles<'static> {
    /// Wraps a source and keeps it.
    pub fn keeping(files: impl FileSource + Send + 'static) -> Self {
        RecordedFiles { files: FilesRef::Shared(Arc::new(files)), record: Record::default() }
    }
}

impl FileSource for RecordedFiles<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let bytes = self.files.read(path)?;
        note(&self.record, path, Digest::of(&bytes));
        Ok(bytes)
    }

    fn size(&self, path: &Path) -> io::Result<u64> {
        self.files.size(path)
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn Read>> {
        Ok(self.recorded(path, self.files.open(path)?))
    }

    fn open_within(&self, path: &Path, folders: &[PathBuf]) -> io::Result<Opened> {
        let Opened { size, contents } = self.files.open_within(path, folders)?;
        Ok(Opened { size, contents: self.recorded(path, contents) })
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        // Only files that are read are recorded, not the listing.
        self.files.list(folder)
    }

    fn real_path(&self, path: &Path) -> Option<PathBuf> {
        self.files.real_path(path)
    }
}

/// A file that is read in pieces.
struct RecordedFile {
    source: Box<dyn Read>,
    path: PathBuf,
    record: Record,
    hasher: blake3::Hasher,
}

impl Read for RecordedFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(buffer)?;
        self.hasher.update(&buffer[..count]);
        Ok(count)
    }
}

impl Drop for RecordedFile {
    fn drop(&mut self) {
        // A reader may stop before the end: for the same bytes it stops at the same position.
        note(&self.record, &self.path, Digest(*self.hasher.finalize().as_bytes()));
    }
}

fn note(record: &Record, path: &Path, digest: Digest) {
    locked(record).entry(path.to_owned()).or_default().insert(digest);
}

fn locked(record: &Record) -> MutexGuard<'_, BTreeMap<PathBuf, BTreeSet<Digest>>> {
    // No code panics while it holds the lock.
    record.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reader::MemoryFiles;

    /// The digests of a scene that reads two files, the second piece by piece.
    fn digests(folder: &str, text: &str, mesh: &str) -> Vec<(String, Digest)> {
        let path = |name: &str| Path::new(folder).join(name);
        let files = [("scene.pbrt", text), ("mesh.ply", mesh), ("other.ply", "unread")];
        let files = MemoryFiles(files.map(|(name, text)| (path(name), text.to_owned())).into());
        let recorded = RecordedFiles::new(&files);
        recorded.read(&path("scene.pbrt")).unwrap();
        recorded.read(&path("scene.pbrt")).unwrap();
        let mut opened = recorded.open(&path("mesh.ply")).unwrap();
        opened.read_to_end(&mut Vec::new()).unwrap();
        drop(opened);
        assert!(recorded.read(&path("missing")).is_err());
        recorded.digests(&path("scene.pbrt"))
    }

    #[test]
    fn files_that_were_read_have_digests_of_their_content() {
        let first = digests("a", "scene", "mesh");
        let names: Vec<&str> = first.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["mesh.ply", "scene.pbrt"]);
        assert_eq!(first, digests("elsewhere/b", "scene", "mesh"));
        let changed = |text, mesh| {
            let second = digests("a", text, mesh);
            let differ = first.iter().zip(second).find(|(one, other)| *one != other);
            differ.unwrap().0.0.clone()
        };
        assert_eq!(changed("scene", "other mesh"), "mesh.ply");
        assert_eq!(changed("other scene", "mesh"), "scene.pbrt");
    }
}
