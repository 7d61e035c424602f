//! Which files a scene was loaded from, and what stood in them.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::files::FileSource;

/// A digest of a file's content by BLAKE3: nobody finds two contents with one digest, so a scene that was edited is never
/// taken for the old one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Digest(pub [u8; 32]);

impl Digest {
    /// The digest of bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Digest(*blake3::hash(bytes).as_bytes())
    }
}

/// Files of another source, of which it remembers which were read, by digests of what was read of them.
pub struct RecordedFiles<'a> {
    files: &'a dyn FileSource,
    record: Record,
}

/// The digests of each file; several where it changed while the scene was loaded, or was read in part.
type Record = Arc<Mutex<BTreeMap<PathBuf, BTreeSet<Digest>>>>;

impl<'a> RecordedFiles<'a> {
    /// Nothing is read yet.
    pub fn new(files: &'a dyn FileSource) -> Self {
        RecordedFiles { files, record: Record::default() }
    }

    /// The files that were read, each with a digest of what was read of it, sorted by path. Paths are from the folder of
    /// `scene` where they lie below that: a scene that was moved, or is rendered from another folder, is the same scene.
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
        let source = self.files.open(path)?;
        let (path, record) = (path.to_owned(), Arc::clone(&self.record));
        Ok(Box::new(RecordedFile { source, path, record, hasher: blake3::Hasher::new() }))
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        // What is read of it counts, and that is noted.
        self.files.list(folder)
    }
}

/// A file that is read piece by piece.
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
        // A reader may stop before the end: it does so at the same place for the same bytes.
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
