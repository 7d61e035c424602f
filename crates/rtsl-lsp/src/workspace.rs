//! The texts: those that are open in the editor, and the shaders of its folders.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use lsp_types::{TextDocumentContentChangeEvent, Uri};
use rtsl::{FileLoader, IncludeError, IncludeLoader, IncludedFile};
use rtsl_ide::Document;

use crate::library::LibraryFolder;
use crate::look::has_same_lines;
use crate::place::{Encoding, Lines, path_of};
use crate::{SearchPath, ServerOptions};

/// The greatest number of files in folders that are looked at.
const MAX_FILES: usize = 10_000;
/// The greatest size in bytes of a file that is not open.
const MAX_BYTES: u64 = 4 << 20;

/// The texts and the folders of an editor.
pub struct Workspace {
    /// The open texts by their URIs.
    open: BTreeMap<String, OpenText>,
    /// The folders of the editor.
    pub folders: Vec<PathBuf>,
    /// The folder of the library's files.
    pub library: LibraryFolder,
    search_path: SearchPath,
    /// The unit of columns.
    pub encoding: Encoding,
}

/// An open text.
#[derive(Debug)]
struct OpenText {
    uri: Uri,
    path: Option<PathBuf>,
    text: String,
    version: i32,
    document: Option<Rc<Document>>,
    /// True if its diagnostics are to be published.
    is_stale: bool,
}

impl Workspace {
    /// A workspace of these folders.
    pub fn new(options: ServerOptions, folders: Vec<PathBuf>, encoding: Encoding) -> Workspace {
        let library = LibraryFolder::new(options.cache_folder);
        let search_path = options.search_path;
        Workspace { open: BTreeMap::new(), folders, library, search_path, encoding }
    }

    /// Opens a text, or replaces it.
    pub fn open(&mut self, uri: &Uri, text: String, version: i32) {
        let path = path_of(uri);
        let opened =
            OpenText { uri: uri.clone(), path, text, version, document: None, is_stale: true };
        self.open.insert(uri.as_str().to_owned(), opened);
        self.forget_users(uri);
    }

    /// Changes a text.
    pub fn change(
        &mut self,
        uri: &Uri,
        version: i32,
        changes: Vec<TextDocumentContentChangeEvent>,
    ) {
        let encoding = self.encoding;
        let Some(open) = self.open.get_mut(uri.as_str()) else { return };
        for change in changes {
            match change.range {
                None => open.text = change.text,
                Some(range) => {
                    let lines = Lines::new(&open.text, encoding);
                    let (start, end) = (lines.offset(range.start), lines.offset(range.end));
                    open.text.replace_range(start..end.max(start), &change.text);
                }
            }
        }
        open.version = version;
        self.forget_users(uri);
    }

    /// Closes a text: the file on the disk counts from now on.
    pub fn close(&mut self, uri: &Uri) {
        self.open.remove(uri.as_str());
        self.forget_users(uri);
    }

    /// Forgets the analyses of all texts, since files on the disk have changed.
    pub fn forget_all(&mut self) {
        for open in self.open.values_mut() {
            open.document = None;
            open.is_stale = true;
        }
    }

    /// Forgets the analyses of a text and of those that include or import it, or may do so once it is there.
    fn forget_users(&mut self, uri: &Uri) {
        let name = name_of(uri);
        for open in self.open.values_mut() {
            let uses = open.document.as_ref().is_none_or(|document| {
                let mut files = document.analysis.sources.files();
                files.any(|(_, file)| file.name == name)
                    || document.analysis.diagnostics.has_errors()
            });
            if uses || open.uri == *uri {
                open.document = None;
                open.is_stale = true;
            }
        }
    }

    /// The text of an open file.
    pub fn text(&self, uri: &Uri) -> Option<&str> {
        self.open.get(uri.as_str()).map(|open| open.text.as_str())
    }

    /// The URI and the text of an open file; the path has no symbolic links.
    pub fn open_at(&self, path: &Path) -> Option<(&Uri, &str)> {
        let is_at = |open: &&OpenText| {
            open.path.as_ref().is_some_and(|other| other == path || without_links(other) == path)
        };
        self.open.values().find(is_at).map(|open| (&open.uri, open.text.as_str()))
    }

    /// The open texts by their paths without symbolic links, as programs see them on the disk.
    ///
    /// # Errors
    /// The name of a text that is not saved.
    pub fn saved_texts(&self) -> Result<BTreeMap<PathBuf, String>, String> {
        let mut texts = BTreeMap::new();
        for open in self.open.values() {
            let Some(path) = &open.path else { continue };
            let saved = std::fs::read_to_string(path);
            if !saved.is_ok_and(|saved| has_same_lines(&saved, &open.text)) {
                return Err(path.display().to_string());
            }
            texts.insert(without_links(path), open.text.clone());
        }
        Ok(texts)
    }

    /// The folders in which the includes and modules of a shader or a scene are searched.
    pub fn search_path(&self, path: &Path) -> Vec<PathBuf> {
        (self.search_path)(path)
    }

    /// Publishes the diagnostics of a text again; false if it is not open.
    pub fn refresh(&mut self, uri: &Uri) -> bool {
        let open = self.open.get_mut(uri.as_str());
        open.map(|open| open.is_stale = true).is_some()
    }

    /// The version of an open text.
    pub fn version(&self, uri: &Uri) -> Option<i32> {
        self.open.get(uri.as_str()).map(|open| open.version)
    }

    /// True for a text of the library, which has no errors that concern anyone.
    pub fn is_of_library(&self, uri: &Uri) -> bool {
        path_of(uri).is_some_and(|path| self.library.contains(&path))
    }

    /// Takes the texts whose diagnostics are to be published.
    pub fn take_stale(&mut self) -> Vec<Uri> {
        let taken = self
            .open
            .values_mut()
            .filter_map(|open| std::mem::take(&mut open.is_stale).then(|| open.uri.clone()));
        taken.collect()
    }

    /// The analysis of an open text.
    pub fn document(&mut self, uri: &Uri) -> Option<Rc<Document>> {
        let open = self.open.get(uri.as_str())?;
        if let Some(document) = &open.document {
            return Some(document.clone());
        }
        let document = Rc::new(Document::new(&name_of(uri), &open.text, &mut self.loader(uri)));
        if let Some(open) = self.open.get_mut(uri.as_str()) {
            open.document = Some(document.clone());
        }
        Some(document)
    }

    /// The loader of what a text includes and imports: open texts before files.
    pub fn loader(&self, uri: &Uri) -> Overlay<'_> {
        let files = match path_of(uri) {
            Some(path) => FileLoader::beside(&path, self.search_path(&path)),
            None => FileLoader::default(),
        };
        Overlay { open: &self.open, files }
    }

    /// The URIs and analyses of all texts that may contain what is wanted: open ones, and shaders of the folders.
    pub fn documents_where(
        &mut self,
        is_wanted: impl Fn(&str) -> bool,
    ) -> Vec<(Uri, Rc<Document>)> {
        let open: Vec<Uri> = self.open.values().map(|open| open.uri.clone()).collect();
        let mut documents = Vec::new();
        for uri in open {
            let contains = self.text(&uri).is_some_and(&is_wanted);
            if contains && let Some(document) = self.document(&uri) {
                documents.push((uri, document));
            }
        }
        for path in self.shaders() {
            let Some(uri) = crate::place::uri_of(&path) else { continue };
            let is_open = self.open.values().any(|open| open.path.as_deref() == Some(&path));
            if is_open {
                continue;
            }
            // Strangers may place links in a folder.
            let text = rtsl::open_within(&path, &self.folders).ok().and_then(text_of_small);
            let Some(text) = text.filter(|text| is_wanted(text)) else { continue };
            let document = Document::new(&name_of(&uri), &text, &mut self.loader(&uri));
            documents.push((uri, Rc::new(document)));
        }
        documents
    }

    /// The shaders in the folders.
    fn shaders(&self) -> Vec<PathBuf> {
        let mut folders = self.folders.clone();
        let mut found = Vec::new();
        let mut seen = 0;
        while let Some(folder) = folders.pop() {
            let Ok(entries) = std::fs::read_dir(&folder) else { continue };
            for entry in entries.flatten() {
                seen += 1;
                if seen > MAX_FILES {
                    return found;
                }
                let path = entry.path();
                let name = entry.file_name().to_string_lossy().into_owned();
                let kind = entry.file_type();
                let is_hidden =
                    name.starts_with('.') || matches!(name.as_str(), "target" | "node_modules");
                if is_hidden {
                    continue;
                }
                if kind.is_ok_and(|kind| kind.is_dir()) {
                    folders.push(path);
                } else if path.extension().is_some_and(|it| it == "rtsl") {
                    found.push(path);
                }
            }
        }
        found.sort();
        found
    }
}

/// The name of a text in analyses: its path, or its URI if it has none.
pub fn name_of(uri: &Uri) -> String {
    path_of(uri).map_or_else(|| uri.as_str().to_owned(), |path| path.display().to_string())
}

/// A path without symbolic links, so that equal files have equal paths.
pub fn without_links(path: &Path) -> PathBuf {
    std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

/// The text of a file, unless it is large.
pub fn small_text(path: &Path) -> Option<String> {
    text_of_small(rtsl::open_regular_file(path).ok()?)
}

fn text_of_small(file: File) -> Option<String> {
    let mut text = String::new();
    file.take(MAX_BYTES + 1).read_to_string(&mut text).ok()?;
    (text.len() as u64 <= MAX_BYTES).then_some(text)
}

/// Loads open texts before the files of the disk.
pub struct Overlay<'w> {
    open: &'w BTreeMap<String, OpenText>,
    files: FileLoader,
}

impl IncludeLoader for Overlay<'_> {
    fn load(&mut self, path: &str, including: &str) -> Result<IncludedFile, IncludeError> {
        let found = self.files.load(path, including);
        let of_name = |name: &str| {
            let named = |open: &&OpenText| {
                open.path.as_ref().is_some_and(|path| path.display().to_string() == name)
            };
            self.open.values().find(named).map(|open| open.text.clone())
        };
        match found {
            Ok(file) => {
                let text = of_name(&file.name).unwrap_or(file.text);
                Ok(IncludedFile { name: file.name, text })
            }
            // A file that is not saved yet.
            Err(IncludeError::NotFound(places)) => {
                let open = places.iter().find_map(|name| Some((name.clone(), of_name(name)?)));
                match open {
                    Some((name, text)) => Ok(IncludedFile { name, text }),
                    None => Err(IncludeError::NotFound(places)),
                }
            }
            Err(error) => Err(error),
        }
    }
}
