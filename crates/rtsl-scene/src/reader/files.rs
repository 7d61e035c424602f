//! Sources of a scene's files: the disk, or memory in tests.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{self, Cursor, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use rtsl::{Diagnostic, diagnostic_codes as codes};
use rtsl_memory::{
    Amount, Held, InputBudget, OverBudget, Refused, lies_within, open_regular_file, open_within,
    real_place, reserved,
};

use super::gzip;

/// A source of files.
pub trait FileSource: Sync {
    /// Returns the contents of a file.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;

    /// Returns the size of a file in bytes.
    fn size(&self, path: &Path) -> io::Result<u64> {
        Ok(self.read(path)?.len() as u64)
    }

    /// Opens a file for streaming, for large files that are not kept.
    fn open(&self, path: &Path) -> io::Result<Box<dyn Read>> {
        Ok(Box::new(Cursor::new(self.read(path)?)))
    }

    /// Opens a file for streaming that lies in one of the folders, or below. Returns its size, too.
    ///
    /// # Errors
    /// [`Refused::Outside`] for every path that leads outside, whether anything is there or not.
    fn open_within(&self, path: &Path, folders: &[PathBuf]) -> io::Result<Opened> {
        if !lies_within(path, folders, |path| self.real_path(path)) {
            return Err(Refused::Outside.into());
        }
        Ok(Opened { size: self.size(path)?, contents: self.open(path)? })
    }

    /// Returns the files in a folder, sorted by name, and the links, whether they lead to a file or not.
    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>>;

    /// Returns the place to which a path leads, whether anything is there or not; `None` for a link to nothing. Sources
    /// without links return the path.
    fn real_path(&self, path: &Path) -> Option<PathBuf> {
        Some(resolve(Path::new(""), &path.to_string_lossy()))
    }
}

/// An open file.
pub struct Opened {
    /// Its size in bytes.
    pub size: u64,
    /// Its contents.
    pub contents: Box<dyn Read>,
}

/// The file system.
#[derive(Clone, Copy, Debug, Default)]
pub struct DiskFiles;

/// The greatest size of a scene or shader text; spans are 32-bit byte offsets.
const LARGEST_FILE: u64 = 1 << 30;

impl FileSource for DiskFiles {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let file = open_regular_file(path)?;
        let length = file.metadata()?.len();
        read_open(file, length)
    }

    fn size(&self, path: &Path) -> io::Result<u64> {
        Ok(open_regular_file(path)?.metadata()?.len())
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn Read>> {
        Ok(Box::new(open_regular_file(path)?))
    }

    fn open_within(&self, path: &Path, folders: &[PathBuf]) -> io::Result<Opened> {
        let file = open_within(path, folders)?;
        Ok(Opened { size: file.metadata()?.len(), contents: Box::new(file) })
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        // The folder of "scene.pbrt" is "", which is no valid path for the operating system.
        let shown = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let mut files = Vec::new();
        for entry in std::fs::read_dir(shown)? {
            let entry = entry?;
            // What a link leads to is not looked at: nobody learns what lies outside.
            let kind = entry.file_type()?;
            if kind.is_file() || kind.is_symlink() {
                files.push(folder.join(entry.file_name()));
            }
        }
        files.sort();
        Ok(files)
    }

    fn real_path(&self, path: &Path) -> Option<PathBuf> {
        real_place(path)
    }
}

/// The contents of files in memory, by their paths.
pub type EmbeddedFiles = BTreeMap<PathBuf, Arc<[u8]>>;

/// The files that the entities of a scene name, relative to the folder of the scene.
#[derive(Clone, Copy)]
pub struct SceneFiles<'a> {
    /// The scene's file.
    pub scene: &'a Path,
    /// The source of the files.
    pub files: &'a dyn FileSource,
    /// Files in memory, which come before those of the source.
    pub embedded: &'a EmbeddedFiles,
    /// The memory budget of the files.
    pub budget: &'a InputBudget,
    /// The memory of textures from images; an eighth of the budget if `None`.
    pub texture_memory: Option<Amount>,
}

/// The contents of a file, and their memory.
pub struct Input {
    /// The contents.
    pub bytes: Vec<u8>,
    /// Their memory, held while they exist.
    pub held: Held,
}

impl Input {
    /// Reads a file, decompressed, if the budget allows it.
    ///
    /// # Errors
    /// If the file cannot be read, or an [`OverBudget`].
    pub fn read(files: &dyn FileSource, path: &Path, budget: &InputBudget) -> io::Result<Self> {
        let mut held = budget.hold(Amount(files.size(path)?))?;
        let bytes = files.read(path)?;
        // The file may have grown since its size was queried.
        held.grow_to(Amount(bytes.len() as u64))?;
        gzip::decompressed(Input { bytes, held }, budget)
    }

    /// Reads a file that lies in one of the folders, or below, as [`Input::read`] does.
    ///
    /// # Errors
    /// As for [`FileSource::open_within`], or an [`OverBudget`].
    pub fn read_within(
        files: &dyn FileSource,
        path: &Path,
        folders: &[PathBuf],
        budget: &InputBudget,
    ) -> io::Result<Self> {
        let Opened { size, contents } = files.open_within(path, folders)?;
        let mut held = budget.hold(Amount(size))?;
        let bytes = read_open(contents, size)?;
        // The file may have grown since it was opened.
        held.grow_to(Amount(bytes.len() as u64))?;
        gzip::decompressed(Input { bytes, held }, budget)
    }
}

/// Reads an open file of the given size.
fn read_open(contents: impl Read, size: u64) -> io::Result<Vec<u8>> {
    if size > LARGEST_FILE {
        return Err(io::Error::other("larger than 1 GiB"));
    }
    let mut bytes = reserved(size as usize)?;
    contents.take(LARGEST_FILE).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The diagnostic for a file that cannot be read.
pub fn unreadable(path: &Path, error: &io::Error) -> Diagnostic {
    match OverBudget::of(error) {
        Some(over) => over.diagnostic(path.display()),
        None => {
            let message = format!("cannot read `{}`: {error}", path.display());
            Diagnostic::new(codes::UNREADABLE_FILE, message)
        }
    }
}

impl SceneFiles<'_> {
    /// Opens a file for streaming, decompressed.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn open(&self, path: &Path) -> io::Result<Box<dyn Read>> {
        gzip::opened(self.files.open(path)?)
    }

    /// Reads a file, if the budget allows it.
    ///
    /// # Errors
    /// As for [`Input::read`].
    pub fn read(&self, path: &Path) -> io::Result<Input> {
        if let Some(bytes) = self.embedded.get(path) {
            let held = self.budget.hold(Amount(bytes.len() as u64))?;
            return Ok(Input { bytes: bytes.to_vec(), held });
        }
        Input::read(self.files, path, self.budget)
    }

    /// Returns the path of the file that the scene calls `name`.
    pub fn path(&self, name: &str) -> PathBuf {
        resolve(self.scene, name)
    }
}

/// Returns the start of a file, up to the texels of an image.
///
/// # Errors
/// If it cannot be read.
pub fn file_start(files: &dyn FileSource, path: &Path) -> Result<Vec<u8>, String> {
    const LENGTH: u64 = 1 << 16;
    let mut start = Vec::new();
    let read = files.open(path).and_then(|file| file.take(LENGTH).read_to_end(&mut start));
    match read {
        Ok(_) => Ok(start),
        Err(error) => Err(format!("cannot read `{}`: {error}", path.display())),
    }
}

/// Files that exist in memory only, with texts or bytes as their contents.
#[derive(Clone, Debug)]
pub struct MemoryFiles<C = String>(pub BTreeMap<PathBuf, C>);

impl<C> Default for MemoryFiles<C> {
    fn default() -> Self {
        MemoryFiles(BTreeMap::new())
    }
}

impl<C> MemoryFiles<C> {
    /// Adds a file.
    #[must_use]
    pub fn with(mut self, path: &str, contents: impl Into<C>) -> Self {
        self.0.insert(path.into(), contents.into());
        self
    }

    fn contents(&self, path: &Path) -> io::Result<&C> {
        self.0.get(path).ok_or_else(|| io::ErrorKind::NotFound.into())
    }
}

impl<C: AsRef<[u8]> + Sync> FileSource for MemoryFiles<C> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        Ok(self.contents(path)?.as_ref().to_vec())
    }

    fn size(&self, path: &Path) -> io::Result<u64> {
        Ok(self.contents(path)?.as_ref().len() as u64)
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        Ok(self.0.keys().filter(|path| path.parent() == Some(folder)).cloned().collect())
    }
}

/// Returns the name of a file with slashes for the backslashes that it has on Windows. The texts of scenes take some of
/// these for escapes: of ends of lines and of tabs, which no name has.
pub fn with_slashes(name: &str) -> Cow<'_, str> {
    if !name.contains(['\\', '\n', '\r', '\t']) {
        return Cow::Borrowed(name);
    }
    let name = name.replace('\n', "/n").replace('\r', "/r").replace('\t', "/t");
    Cow::Owned(name.replace('\\', "/"))
}

/// Resolves `path` relative to the file `from`, with `.` and `..` removed as far as the text allows, so that each file
/// has one name. Backslashes count as slashes.
pub fn resolve(from: &Path, path: &str) -> PathBuf {
    let joined = from.parent().unwrap_or(Path::new("")).join(&*with_slashes(path));
    let mut resolved = PathBuf::new();
    for component in joined.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir
                if matches!(resolved.components().next_back(), Some(Component::Normal(_))) =>
            {
                resolved.pop();
            }
            Component::ParentDir
            | Component::Normal(_)
            | Component::RootDir
            | Component::Prefix(_) => {
                resolved.push(component);
            }
        }
    }
    resolved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_seen_from_the_including_file() {
        let resolved = |path| resolve(Path::new("scenes/a/main.pbrt"), path);
        assert_eq!(resolved("part.pbrt"), Path::new("scenes/a/part.pbrt"));
        assert_eq!(resolved("./../b/../part.pbrt"), Path::new("scenes/part.pbrt"));
        assert_eq!(resolve(Path::new("main.pbrt"), "../../x"), Path::new("../../x"));
        assert_eq!(resolved("/x/../y"), Path::new("/y"));
        assert_eq!(resolved("..\\b\tex\\c.png"), Path::new("scenes/b/tex/c.png"));
    }
}
