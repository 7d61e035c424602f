//! Files that lie elsewhere than a scene says.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::files::{DiskFiles, FileSource};

/// The files of a scene that was sent from another machine: the places on the disk, by the paths that they had there.
/// There are no others.
#[derive(Clone, Debug, Default)]
pub struct MovedFiles(pub BTreeMap<PathBuf, PathBuf>);

impl MovedFiles {
    fn place(&self, path: &Path) -> io::Result<&Path> {
        let place = self.0.get(path).ok_or(io::ErrorKind::NotFound)?;
        Ok(place)
    }
}

impl FileSource for MovedFiles {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        DiskFiles.read(self.place(path)?)
    }

    fn size(&self, path: &Path) -> io::Result<u64> {
        DiskFiles.size(self.place(path)?)
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn Read>> {
        DiskFiles.open(self.place(path)?)
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        Ok(self.0.keys().filter(|path| path.parent() == Some(folder)).cloned().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_by_the_paths_that_they_had() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("0123");
        std::fs::write(&place, "contents").unwrap();
        let path = PathBuf::from("/elsewhere/scene.pbrt");
        let files = MovedFiles([(path.clone(), place.clone())].into());
        assert_eq!(files.read(&path).unwrap(), b"contents");
        assert_eq!(files.size(&path).unwrap(), 8);
        let mut text = String::new();
        files.open(&path).unwrap().read_to_string(&mut text).unwrap();
        assert_eq!(text, "contents");
        assert_eq!(files.list(Path::new("/elsewhere")).unwrap(), [path]);
        assert_eq!(files.read(&place).unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
