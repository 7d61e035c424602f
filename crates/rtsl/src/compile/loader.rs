//! The loader of files.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use rtsl_memory::{Refused, open_regular_file, open_within, without_detours};
use rtsl_syntax::{IncludeError, IncludeLoader, IncludedFile, join_path};

use super::library;

/// The greatest size of a file in bytes.
const SIZE_LIMIT: u64 = 16 << 20;

/// Loads the files of `#include`: from the folder of the including file, then from the search path, then from the
/// standard library, which is built in. It reads no file outside these folders and that of the first file, through
/// paths or links. The files of the standard library include one another, whatever the folders have.
#[derive(Clone, Debug)]
pub struct FileLoader<F = DiskIncludes> {
    /// The folder of the compiled file, if there is one.
    folder: Option<PathBuf>,
    search_path: Vec<PathBuf>,
    files: F,
    /// The names of texts from the folders, which may be those of files of the standard library.
    on_disk: BTreeSet<String>,
}

/// The files among which a [`FileLoader`] looks.
pub trait IncludeFiles {
    /// Reads a text that lies in one of the folders, or below.
    ///
    /// # Errors
    /// If there is none, or it cannot be read, or is no text.
    fn read_within(&self, path: &Path, folders: &[PathBuf]) -> Result<String, Unread>;
}

/// The reason for which a text was not read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unread {
    /// It lies outside the folders, or would lie there if there were one.
    Outside,
    /// There is no such file.
    Absent,
    /// It cannot be read, or is no text: a reason, as a part of a sentence.
    Unreadable(String),
}

impl From<io::Error> for Unread {
    fn from(error: io::Error) -> Self {
        match (Refused::of(&error), error.kind()) {
            (Some(Refused::Outside), _) => Unread::Outside,
            (Some(Refused::NotRegular), _)
            | (None, io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => Unread::Absent,
            (None, _) => Unread::Unreadable(reason_of(&error)),
        }
    }
}

/// The file system.
#[derive(Clone, Copy, Debug, Default)]
pub struct DiskIncludes;

impl IncludeFiles for DiskIncludes {
    fn read_within(&self, path: &Path, folders: &[PathBuf]) -> Result<String, Unread> {
        match open_within(path, folders) {
            Ok(file) => text_of(file).map_err(Unread::Unreadable),
            // Windows opens no folders, for another reason than that they are some.
            Err(error) if Refused::of(&error).is_none() && path.is_dir() => Err(Unread::Absent),
            Err(error) => Err(error.into()),
        }
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
        FileLoader { folder: None, search_path, files: DiskIncludes, on_disk: BTreeSet::new() }
    }

    /// A loader for the text in `file`.
    pub fn beside(file: &Path, search_path: impl Into<Vec<PathBuf>>) -> FileLoader {
        let on_disk = BTreeSet::from([file.display().to_string()]);
        let folder = Some(folder_of(file).to_owned());
        FileLoader { folder, on_disk, ..FileLoader::new(search_path) }
    }
}

impl<F: IncludeFiles> FileLoader<F> {
    /// Returns the loader, looking among other files.
    pub fn among<G: IncludeFiles>(self, files: G) -> FileLoader<G> {
        let FileLoader { folder, search_path, on_disk, files: _ } = self;
        FileLoader { folder, search_path, files, on_disk }
    }

    /// Returns the folders to search, that of the including file first.
    fn folders(&self, including: &str) -> Vec<PathBuf> {
        let path = Path::new(including);
        // Text in no file has a name that leads nowhere, unlike the files that it includes.
        let is_found = |folder: &PathBuf| path.starts_with(without_detours(folder));
        let is_included = || self.search_path.iter().any(is_found);
        let is_in_file = self.folder.is_some() || is_included();
        let beside = is_in_file.then(|| folder_of(path).to_owned());
        beside.into_iter().chain(self.search_path.iter().cloned()).collect()
    }

    /// True if the including text is a file of the standard library, rather than one on the disk of the same path.
    fn is_of_library(&self, including: &str) -> bool {
        library::file(including).is_some() && !self.on_disk.contains(including)
    }

    /// Reads the file in the first folder that has it.
    fn find(&self, path: &str, including: &str) -> Result<IncludedFile, IncludeError> {
        let allowed: Vec<PathBuf> = self.folder.iter().chain(&self.search_path).cloned().collect();
        let (mut looked_at, mut escapes) = (Vec::new(), false);
        for folder in self.folders(including) {
            let candidate = without_detours(&folder.join(path));
            let name = candidate.display().to_string();
            match self.files.read_within(&candidate, &allowed) {
                Ok(text) => return Ok(IncludedFile { name, text }),
                Err(Unread::Outside) => escapes = true,
                Err(Unread::Absent) => looked_at.push(name),
                Err(Unread::Unreadable(reason)) => return Err(IncludeError::Unreadable(reason)),
            }
        }
        match escapes {
            true => Err(IncludeError::Escapes),
            false => Err(IncludeError::NotFound(looked_at)),
        }
    }
}

impl<F: IncludeFiles> IncludeLoader for FileLoader<F> {
    fn load(&mut self, path: &str, including: &str) -> Result<IncludedFile, IncludeError> {
        if Path::new(path).is_absolute() || path.contains('\0') {
            return Err(IncludeError::Escapes);
        }
        let of_library = self.is_of_library(including);
        if of_library && let Some(file) = library_file(path, including, of_library) {
            return Ok(file);
        }
        match self.find(path, including) {
            Ok(file) => {
                self.on_disk.insert(file.name.clone());
                Ok(file)
            }
            Err(IncludeError::Unreadable(reason)) => Err(IncludeError::Unreadable(reason)),
            Err(error) => library_file(path, including, of_library).ok_or(error),
        }
    }
}

/// Returns the file of the standard library that `path` names: from the root of the library, or from the folder of an
/// including file of the library.
fn library_file(path: &str, including: &str, of_library: bool) -> Option<IncludedFile> {
    let folder = including.rsplit_once('/').map_or("", |(folder, _)| folder);
    let names = [join_path(folder, path).filter(|_| of_library), join_path("", path)];
    let file = names.into_iter().flatten().find_map(|name| library::file(&name))?;
    Some(IncludedFile { name: file.path.to_owned(), text: file.text.to_owned() })
}

/// Reads a text file. The error is a reason: it is missing, not a regular file, too large, or not UTF-8.
pub(crate) fn read_text(path: &Path) -> Result<String, String> {
    text_of(open_regular_file(path).map_err(|error| reason_of(&error))?)
}

fn text_of(file: File) -> Result<String, String> {
    let mut bytes = Vec::new();
    let read = file.take(SIZE_LIMIT + 1).read_to_end(&mut bytes);
    read.map_err(|error| reason_of(&error))?;
    if bytes.len() as u64 > SIZE_LIMIT {
        return Err(format!("it is larger than {} MiB", SIZE_LIMIT >> 20));
    }
    rtsl_source::encoding::utf8(bytes).map_err(str::to_owned)
}

fn reason_of(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".to_owned(),
        io::ErrorKind::PermissionDenied => "it may not be read".to_owned(),
        _ => error.to_string(),
    }
}

fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
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

    #[test]
    fn files_of_the_library_include_one_another_whatever_the_folders_have() {
        let root = tempfile::tempdir().unwrap();
        let root = root.path();
        std::fs::create_dir(root.join("primitives")).unwrap();
        std::fs::write(root.join("triangle_test.rtsl"), "mine").unwrap();
        std::fs::write(root.join("primitives/triangle_test.rtsl"), "mine").unwrap();
        let main = root.join("main.rtsl");
        let including = "shaders/primitives/triangle.rtsl";
        for mut loader in [
            FileLoader::new([root.to_owned()]),
            FileLoader::beside(&main, []),
            FileLoader::beside(Path::new("main.rtsl"), [root.to_owned()]),
        ] {
            let found = loader.load("triangle_test.rtsl", including).unwrap();
            assert_eq!(found.name, "shaders/primitives/triangle_test.rtsl");
        }
        // But a text on the disk that has the path of one of the library includes those beside it.
        std::fs::create_dir_all(root.join("shaders/primitives")).unwrap();
        std::fs::write(root.join("shaders/primitives/triangle.rtsl"), "mine").unwrap();
        std::fs::write(root.join("shaders/primitives/triangle_test.rtsl"), "mine").unwrap();
        struct InFolder<'a>(&'a Path);
        impl IncludeFiles for InFolder<'_> {
            fn read_within(&self, path: &Path, _: &[PathBuf]) -> Result<String, Unread> {
                DiskIncludes.read_within(&self.0.join(path), &[self.0.to_owned()])
            }
        }
        let mut loader = FileLoader::beside(Path::new(including), []).among(InFolder(root));
        assert_eq!(loader.load("triangle_test.rtsl", including).unwrap().text, "mine");
        let mut loader = FileLoader::new([PathBuf::new()]).among(InFolder(root));
        let triangle = loader.load(including, "text").unwrap();
        assert_eq!(loader.load("triangle_test.rtsl", &triangle.name).unwrap().text, "mine");
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
