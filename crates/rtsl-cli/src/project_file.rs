//! The file `rtsl.toml`: settings for the shaders and scenes beside it.

use std::fmt::Display;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use rtsl::{
    Diagnostic, Diagnostics, FileId, Refused, SourceMap, Span, diagnostic_codes as codes, encoding,
    lies_within, most_similar, open_within, real_place,
};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The name of the file.
const NAME: &str = "rtsl.toml";
/// The folders of included files and modules, relative to the file.
const SEARCH_PATH: &str = "search-path";
/// All keys.
const KEYS: [&str; 1] = [SEARCH_PATH];
/// The greatest size in bytes.
const MAX_SIZE: u64 = 1 << 20;

/// The settings in the file, with their faults.
#[derive(Default)]
pub struct ProjectFile {
    /// The folders to search for included files and modules.
    pub search_path: Vec<PathBuf>,
    /// The text of the file.
    pub sources: SourceMap,
    /// Errors and warnings.
    pub diagnostics: Diagnostics,
}

impl ProjectFile {
    /// Reads the project file beside a shader or a scene. Without one, there are no settings. The file may be a
    /// stranger's: it chooses among folders that lie beside it or in those that the user named.
    pub fn beside(file: &Path, named: &[PathBuf]) -> ProjectFile {
        let folder = match file.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let path = folder.join(NAME);
        let mut project = ProjectFile::default();
        let allowed: Vec<PathBuf> = [folder]
            .into_iter()
            .chain(named.iter().map(PathBuf::as_path))
            .map(Path::to_owned)
            .collect();
        match read(&path, &allowed) {
            Ok(Some(text)) => Reader::new(&path, allowed, &text, &mut project).read(&text),
            // Nothing to read is no fault. What is no file, such as a folder of that name, is one.
            Ok(None) => {}
            Err(diagnostic) => project.diagnostics.push(diagnostic),
        }
        project
    }
}

/// Returns the text of the file; `None` if there is none.
fn read(path: &Path, allowed: &[PathBuf]) -> Result<Option<String>, Diagnostic> {
    let unreadable = |reason: &dyn Display| {
        let message = format!("`{}` can't be read: {reason}", path.display());
        Diagnostic::new(codes::UNREADABLE_FILE, message)
    };
    let file = match open_within(path, allowed) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) if Refused::of(&error) == Some(Refused::Outside) => {
            let message =
                format!("`{}` is not read: it is a link that leaves its folder", path.display());
            return Err(Diagnostic::new(codes::OUTSIDE_FOLDER, message));
        }
        Err(error) => return Err(unreadable(&error)),
    };
    let mut bytes = Vec::new();
    let read = file.take(MAX_SIZE + 1).read_to_end(&mut bytes);
    read.map_err(|error| unreadable(&error))?;
    if bytes.len() as u64 > MAX_SIZE {
        return Err(unreadable(&format!("it is larger than {} MiB", MAX_SIZE >> 20)));
    }
    encoding::utf8(bytes).map(Some).map_err(|reason| unreadable(&reason))
}

/// Reads the settings and reports their faults.
struct Reader<'a> {
    /// The folder of the file, and those in which further folders may lie.
    allowed: Vec<PathBuf>,
    file: FileId,
    project: &'a mut ProjectFile,
}

impl<'a> Reader<'a> {
    fn new(path: &Path, allowed: Vec<PathBuf>, text: &str, project: &'a mut ProjectFile) -> Self {
        // A file beside "scene.pbrt" is named as that is.
        let shown = path.strip_prefix(".").unwrap_or(path);
        let file = project.sources.add(shown.display().to_string(), text);
        Reader { allowed, file, project }
    }

    fn read(&mut self, text: &str) {
        let table = match DeTable::parse(text) {
            Ok(table) => table.into_inner(),
            Err(error) => {
                let message = format!("`{NAME}` is no TOML: {}", error.message().trim_end());
                self.report(message, error.span().unwrap_or(0..0), "");
                return;
            }
        };
        for (key, value) in table {
            let name: &str = key.get_ref();
            if name == SEARCH_PATH {
                self.read_search_path(&value);
                continue;
            }
            let message = format!("`{NAME}` has no key `{name}`");
            let help = match most_similar(name, KEYS) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("it has `{}`", KEYS.join("`, `")),
            };
            self.report_with_help(message, key.span(), "", help);
        }
    }

    fn read_search_path(&mut self, value: &Spanned<DeValue<'_>>) {
        const EXPECTED: &str =
            "expected a list of folders, for example `[\"lib\", \"shaders/tones\"]`";
        let DeValue::Array(folders) = value.get_ref() else {
            let message = format!("`{SEARCH_PATH}` is {}", kind_of(value.get_ref()));
            return self.report(message, value.span(), EXPECTED);
        };
        for folder in folders {
            match folder.get_ref() {
                DeValue::String(name) if !name.is_empty() => self.add_folder(name, folder.span()),
                DeValue::String(_) => {
                    let message = format!("a folder of `{SEARCH_PATH}` has no name");
                    self.report(message, folder.span(), "`.` is the folder of this file");
                }
                other => {
                    let message = format!("a folder of `{SEARCH_PATH}` is {}", kind_of(other));
                    self.report(message, folder.span(), "expected a string");
                }
            }
        }
    }

    fn add_folder(&mut self, name: &str, place: std::ops::Range<usize>) {
        let folder = self.allowed[0].join(name);
        // Before it is looked at: nobody learns whether it is there.
        if !lies_within(&folder, &self.allowed, real_place) {
            let message = format!("`{name}` leaves the folder of `{NAME}`");
            let warning = Diagnostic::new(codes::OUTSIDE_FOLDER, message)
                .at(self.span(place), "not searched")
                .help(format!("if you want it to be searched, add `-I {}`", folder.display()));
            self.project.diagnostics.push(warning);
            return;
        }
        if !folder.is_dir() {
            let message = format!("there is no folder `{}`", folder.display());
            let warning = Diagnostic::new(codes::MISSING_FOLDER, message);
            let span = self.span(place);
            self.project.diagnostics.push(warning.at(span, "searched for shaders"));
        }
        self.project.search_path.push(folder);
    }

    fn span(&self, place: std::ops::Range<usize>) -> Span {
        Span { file: self.file, start: place.start as u32, end: place.end as u32 }
    }

    fn report(&mut self, message: String, place: std::ops::Range<usize>, label: &str) {
        let diagnostic = Diagnostic::new(codes::WRONG_PROJECT_FILE, message);
        let span = self.span(place);
        self.project.diagnostics.push(diagnostic.at(span, label));
    }

    fn report_with_help(
        &mut self,
        message: String,
        place: std::ops::Range<usize>,
        label: &str,
        help: String,
    ) {
        let diagnostic = Diagnostic::new(codes::WRONG_PROJECT_FILE, message).help(help);
        let span = self.span(place);
        self.project.diagnostics.push(diagnostic.at(span, label));
    }
}

/// The kind of a value, with its article.
fn kind_of(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) | DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "a truth value",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}
