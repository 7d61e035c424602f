//! The loader of files.

use std::io::Read;
use std::path::{Component, Path, PathBuf};

use rtsl_memory::open_regular_file;
use rtsl_syntax::{IncludeError, IncludeLoader, IncludedFile, join_path};

use super::library;

/// The greatest size of a file in bytes.
const SIZE_LIMIT: u64 = 16 << 20;

/// Loads the files of `#include`: from the folder of the including file, then from the search path, then from the
/// standard library, which is built in. It reads no file outside these folders and that of the first file, through
/// paths or links.
#[derive(Clone, Debug)]
pub struct FileLoader<F = DiskIncludes> {
    /// The folder of the compiled file, if there is one.
    folder: Option<PathBuf>,
    search_path: Vec<PathBuf>,
    files: F,
}

/// The files among which a [`FileLoader`] looks.
pub trait IncludeFiles {
    /// True if there is a regular file of this name.
    fn is_file(&self, path: &Path) -> bool;

    /// Returns the place to which the path leads, as [`real_place`] does.
    fn real_path(&self, path: &Path) -> Option<PathBuf>;

    /// Reads a text. The error is a reason, as a part of a sentence.
    ///
    /// # Errors
    /// If the file cannot be read, or is no text.
    fn read_text(&self, path: &Path) -> Result<String, String>;
}

/// The file system.
#[derive(Clone, Copy, Debug, Default)]
pub struct DiskIncludes;

impl IncludeFiles for DiskIncludes {
    fn is_file(&self, path: &Path) -> bool {
        path.is_file()
    }

    fn real_path(&self, path: &Path) -> Option<PathBuf> {
        real_place(path)
    }

    fn read_text(&self, path: &Path) -> Result<String, String> {
        read_text(path)
    }
}

/// A loader without a search path.
impl Default for FileLoader {
    fn default() -> Self {
        FileLoader::new([])
    }
}

impl FileLoader {
    /// A loader for text that is in no file, with the search path only.
    pub fn new(search_path: impl Into<Vec<PathBuf>>) -> FileLoader {
        let mut search_path = search_path.into();
        for folder in &mut search_path {
            // The folder of a file named without one, which the system does not know.
            if folder.as_os_str().is_empty() {
                *folder = PathBuf::from(".");
            }
        }
        FileLoader { folder: None, search_path, files: DiskIncludes }
    }

    /// A loader for the text in `file`.
    pub fn beside(file: &Path, search_path: impl Into<Vec<PathBuf>>) -> FileLoader {
        FileLoader { folder: Some(folder_of(file).to_owned()), ..FileLoader::new(search_path) }
    }
}

impl<F: IncludeFiles> FileLoader<F> {
    /// Returns the loader, looking among other files.
    pub fn among<G: IncludeFiles>(self, files: G) -> FileLoader<G> {
        FileLoader { folder: self.folder, search_path: self.search_path, files }
    }

    /// Returns the folders to search, that of the including file first.
    fn folders(&self, including: &str) -> Vec<PathBuf> {
        let path = Path::new(including);
        // Text in no file has a name that leads nowhere, unlike the files that it includes.
        let is_found = |folder: &PathBuf| path.starts_with(without_detours(folder));
        let is_included =
            || self.search_path.iter().any(is_found) && library::file(including).is_none();
        let is_in_file = self.folder.is_some() || is_included();
        let beside = is_in_file.then(|| folder_of(path).to_owned());
        beside.into_iter().chain(self.search_path.iter().cloned()).collect()
    }

    fn is_allowed(&self, file: &Path) -> bool {
        let roots = self.folder.iter().chain(&self.search_path);
        lies_within(file, roots, |path| self.files.real_path(path))
    }
}

impl<F: IncludeFiles> IncludeLoader for FileLoader<F> {
    fn load(&mut self, path: &str, including: &str) -> Result<IncludedFile, IncludeError> {
        if Path::new(path).is_absolute() || path.contains('\0') {
            return Err(IncludeError::Escapes);
        }
        let (mut looked_at, mut escapes) = (Vec::new(), false);
        for folder in self.folders(including) {
            let candidate = without_detours(&folder.join(path));
            // What lies outside is not looked at: nobody learns whether it is there.
            if !self.is_allowed(&candidate) {
                escapes = true;
                continue;
            }
            if self.files.is_file(&candidate) {
                let text = self.files.read_text(&candidate).map_err(IncludeError::Unreadable)?;
                return Ok(IncludedFile { name: candidate.display().to_string(), text });
            }
            looked_at.push(candidate.display().to_string());
        }
        // A file of the library may include one by a path that would lead outside on the disk.
        library_file(path, including).ok_or(match escapes {
            true => IncludeError::Escapes,
            false => IncludeError::NotFound(looked_at),
        })
    }
}

/// Returns the file of the standard library that `path` names: from the root of the library, or from the folder of an
/// including file of the library.
fn library_file(path: &str, including: &str) -> Option<IncludedFile> {
    let folder = including.rsplit_once('/').map_or("", |(folder, _)| folder);
    let of_library = library::files().iter().any(|file| file.path == including);
    let names = [join_path(folder, path).filter(|_| of_library), join_path("", path)];
    let file = names.into_iter().flatten().find_map(|name| library::file(&name))?;
    Some(IncludedFile { name: file.path.to_owned(), text: file.text.to_owned() })
}

/// Reads a text file. The error is a reason: it is missing, not a regular file, too large, or not UTF-8.
pub(crate) fn read_text(path: &Path) -> Result<String, String> {
    let describe = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
        std::io::ErrorKind::PermissionDenied => "it may not be read".to_owned(),
        _ => error.to_string(),
    };
    let file = open_regular_file(path).map_err(describe)?;
    let mut bytes = Vec::new();
    file.take(SIZE_LIMIT + 1).read_to_end(&mut bytes).map_err(describe)?;
    if bytes.len() as u64 > SIZE_LIMIT {
        return Err(format!("it is larger than {} MiB", SIZE_LIMIT >> 20));
    }
    rtsl_source::encoding::utf8(bytes).map_err(str::to_owned)
}

/// True if a path leads to a place within one of the folders, whether anything is there or not. `real` returns the
/// place to which a path leads, such as [`real_place`].
pub fn lies_within<'a>(
    path: &Path,
    folders: impl IntoIterator<Item = &'a PathBuf>,
    real: impl Fn(&Path) -> Option<PathBuf>,
) -> bool {
    let Some(place) = real(path) else { return false };
    folders.into_iter().any(|folder| real(folder).is_some_and(|folder| place.starts_with(folder)))
}

/// Returns the place to which a path leads, without links, whether anything is there or not; `None` for a link to
/// nothing.
pub fn real_place(path: &Path) -> Option<PathBuf> {
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    if let Ok(real) = path.canonicalize() {
        return Some(real);
    }
    if path.is_symlink() {
        return None;
    }
    // Nothing is there, so the rest of the path has no links.
    let folder = real_place(path.parent()?)?;
    Some(without_detours(&match path.components().next_back()? {
        Component::Normal(name) => folder.join(name),
        Component::ParentDir => folder.join(".."),
        _ => folder,
    }))
}

fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Removes `.`, and `..` after a folder's name.
fn without_detours(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for component in path.components() {
        let after_name = matches!(plain.components().next_back(), Some(Component::Normal(_)));
        match component {
            Component::CurDir => {}
            Component::ParentDir if after_name => {
                plain.pop();
            }
            other => plain.push(other),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_the_library_are_found_after_all_others() {
        let mut loader = FileLoader::new([]);
        let name = "shaders/textures/mapping.rtsl";
        assert_eq!(loader.load(name, "mine.rtsl").unwrap().name, name);
        let beside = loader.load("mapping.rtsl", "shaders/textures/image.rtsl").unwrap();
        assert_eq!(beside.name, name);
        assert!(matches!(loader.load("mapping.rtsl", "x.rtsl"), Err(IncludeError::NotFound(_))));
    }

    /// Tests run in the folder of their crate, where `Cargo.toml` lies.
    #[test]
    fn the_folder_of_a_file_named_without_one_is_the_current_one() {
        for mut loader in
            [FileLoader::new([PathBuf::new()]), FileLoader::beside(Path::new("main.rtsl"), [])]
        {
            let found = loader.load("Cargo.toml", "main.rtsl").unwrap();
            assert_eq!(found.name, "Cargo.toml");
            for outside in ["../nothing", "../../Cargo.toml"] {
                let error = loader.load(outside, "main.rtsl").unwrap_err();
                assert_eq!(error, IncludeError::Escapes, "{outside}");
            }
        }
    }

    #[test]
    fn files_are_found_beside_and_on_the_path_and_nowhere_else() {
        let root = tempfile::tempdir().unwrap();
        let root = root.path();
        let (program, library) = (root.join("program"), root.join("library"));
        std::fs::create_dir_all(program.join("parts")).unwrap();
        std::fs::create_dir_all(&library).unwrap();
        std::fs::write(root.join("secret.rtsl"), "secret").unwrap();
        std::fs::write(program.join("parts/a.rtsl"), "a").unwrap();
        std::fs::write(program.join("b.rtsl"), "b").unwrap();
        std::fs::write(library.join("c.rtsl"), "c").unwrap();
        std::fs::write(library.join("d.rtsl"), [0xff, 0xfe]).unwrap();
        let main = program.join("main.rtsl").display().to_string();
        let mut loader = FileLoader::beside(Path::new(&main), [library.clone()]);
        let text = |found: Result<IncludedFile, IncludeError>| found.unwrap().text;

        let part = loader.load("parts/a.rtsl", &main).unwrap();
        assert_eq!(part.text, "a");
        assert_eq!(text(loader.load("../b.rtsl", &part.name)), "b");
        assert_eq!(text(loader.load("c.rtsl", &part.name)), "c");
        assert_eq!(loader.load("../secret.rtsl", &main).unwrap_err(), IncludeError::Escapes);
        assert_eq!(loader.load("/etc/passwd", &main).unwrap_err(), IncludeError::Escapes);
        assert!(
            matches!(loader.load("x.rtsl", &main), Err(IncludeError::NotFound(it)) if it.len() == 2)
        );
        assert!(matches!(loader.load("d.rtsl", &main), Err(IncludeError::Unreadable(_))));
        assert!(matches!(loader.load("parts", &main), Err(IncludeError::NotFound(_))));
    }

    #[test]
    fn files_of_the_path_include_those_beside_them_in_text_of_no_file() {
        let root = tempfile::tempdir().unwrap();
        let root = root.path();
        std::fs::create_dir_all(root.join("parts")).unwrap();
        std::fs::write(root.join("a.rtsl"), "a").unwrap();
        std::fs::write(root.join("parts/b.rtsl"), "b").unwrap();
        std::fs::write(root.join("parts/c.rtsl"), "c").unwrap();
        let mut loader = FileLoader::new([root.to_owned()]);
        let b = loader.load("parts/b.rtsl", "text").unwrap();
        assert_eq!(loader.load("c.rtsl", &b.name).unwrap().text, "c");
        assert_eq!(loader.load("../a.rtsl", &b.name).unwrap().text, "a");
        let outside = loader.load("../../../x.rtsl", &b.name);
        assert_eq!(outside.unwrap_err(), IncludeError::Escapes);
        assert!(matches!(loader.load("c.rtsl", "text"), Err(IncludeError::NotFound(_))));
    }

    /// Links too, to what is there and to what is not.
    #[cfg(unix)]
    #[test]
    fn nobody_learns_what_is_outside() {
        use std::os::unix::fs::symlink;

        let root = tempfile::tempdir().unwrap();
        let root = root.path();
        let (program, outside) = (root.join("program"), root.join("outside"));
        std::fs::create_dir_all(&program).unwrap();
        std::fs::create_dir_all(&outside).unwrap();
        std::fs::write(outside.join("there"), "secret").unwrap();
        symlink(&outside, program.join("folder")).unwrap();
        symlink(outside.join("there"), program.join("link")).unwrap();
        symlink(outside.join("absent"), program.join("dangling")).unwrap();
        let main = program.join("main.rtsl");
        let mut loader = FileLoader::beside(&main, []);
        for path in [
            "../outside/there",
            "../outside/absent",
            "folder/there",
            "folder/absent",
            "link",
            "dangling",
            "folder/../../x",
            "/etc/passwd",
            "/etc/absent",
        ] {
            let error = loader.load(path, &main.display().to_string()).unwrap_err();
            assert_eq!(error, IncludeError::Escapes, "{path}");
        }
    }
}
