//! Which files a scene was loaded from, and what stood in them.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::checkpoint::{Digest, Fingerprint};

use super::files::FileSource;

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

    /// Sets an entry for each file that was read, by its path from the folder of `scene` where it lies below that:
    /// a scene that was moved, or is rendered from another folder, is the same scene.
    pub fn add_to(&self, fingerprint: &mut Fingerprint, scene: &Path) {
        let folder = scene.parent().unwrap_or(Path::new(""));
        for (path, digests) in locked(&self.record).iter() {
            let name = path.strip_prefix(folder).unwrap_or(path).display().to_string();
            let all: Vec<u8> = digests.iter().flat_map(|Digest(bytes)| *bytes).collect();
            fingerprint.set_digest(name, Digest::of(&all));
        }
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

    /// The fingerprint of a scene that reads two files, the second piece by piece.
    fn fingerprint(folder: &str, text: &str, mesh: &str) -> Fingerprint {
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
        let mut fingerprint = Fingerprint::default();
        recorded.add_to(&mut fingerprint, &path("scene.pbrt"));
        fingerprint
    }

    #[test]
    fn what_is_read_is_noted_by_what_stands_in_it() {
        let first = fingerprint("a", "scene", "mesh");
        let names: Vec<&str> = first.entries().map(|(name, _)| name).collect();
        assert_eq!(names, ["mesh.ply", "scene.pbrt"]);
        assert_eq!(first, fingerprint("elsewhere/b", "scene", "mesh"));
        let difference = |text, mesh| first.difference(&fingerprint("a", text, mesh)).unwrap().name;
        assert_eq!(difference("scene", "other mesh"), "mesh.ply");
        assert_eq!(difference("other scene", "mesh"), "scene.pbrt");
    }
}
