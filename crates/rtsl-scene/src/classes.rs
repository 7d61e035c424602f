//! Lookup of classes by name.
//!
//! The class `Torus` is searched for in the folder of the scene: first in the file `torus.rtsl`, then in every other
//! `.rtsl` file there that declares a class of this name, in the order of file names. The standard library comes last,
//! so a file beside the scene overrides the library.
//!
//! [`Classes::refresh`] makes the next lookups read the files again. A class whose text did not change stays the same
//! object: engines identify classes by address, so its kernels are reused.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rtsl::library::{LibraryFile, classes, declared_classes};
use rtsl::{
    Class, Compilation, Compiler, CompilerOptions, Diagnostic, Diagnostics, FileLoader,
    IncludeError, IncludeFiles, IncludeLoader, IncludedFile, Messages, Refused, SourceMap, Unit,
    Unread, diagnostic_codes as codes, encoding,
};
use rtsl_memory::{Amount, InputBudget, OverBudget};

use crate::description::DescribedClass;
use crate::reader::{FileSource, FilesRef, Input, Opened};

/// Classes by name, compiled when they are asked for.
#[derive(Clone)]
pub struct Classes<'a> {
    compiler: Compiler,
    files: FilesRef<'a>,
    /// The memory budget for files.
    budget: InputBudget,
    folder: PathBuf,
    /// The shader files beside the scene that can be read.
    beside: Option<Vec<ShaderFile>>,
    /// The compiled units; `None` for a file with errors, which are reported once.
    units: BTreeMap<PathBuf, Option<Unit>>,
    /// Classes whose texts the description has, by the names that entities have for them.
    described: BTreeMap<String, DescribedClass>,
    /// Results of earlier lookups: scenes refer to few classes many times.
    found: BTreeMap<String, Found>,
    /// The results before the last refresh, until that is accepted.
    found_before: Option<BTreeMap<String, Found>>,
    /// Files that compiled without errors, with their source texts.
    compiled: BTreeMap<PathBuf, Compilation>,
    messages: Messages,
    /// The classes of texts that the reader makes, by the text and the address of the class that they derive from, which
    /// the entry keeps alive.
    made: BTreeMap<(String, usize), MadeClass>,
}

/// A class of a text that the reader makes.
#[derive(Clone)]
struct MadeClass {
    class: Option<Arc<Class>>,
    _base: Option<Arc<Class>>,
}

/// A file, its text, and the classes that it seems to declare.
#[derive(Clone)]
struct ShaderFile {
    path: PathBuf,
    text: String,
    declares: BTreeSet<String>,
}

/// The result of a lookup.
#[derive(Clone)]
pub enum Found {
    /// The class.
    Class(Arc<Class>),
    /// A file that declares the class has errors, which were reported.
    Broken,
    /// There is no such class.
    Nothing,
}

impl Found {
    /// Returns the class.
    pub fn class(self) -> Option<Arc<Class>> {
        match self {
            Found::Class(class) => Some(class),
            Found::Broken | Found::Nothing => None,
        }
    }
}

impl<'a> Classes<'a> {
    /// The classes visible to a scene in `folder`.
    pub fn new(compiler: Compiler, files: FilesRef<'a>, folder: &Path) -> Self {
        Classes {
            compiler,
            files,
            budget: InputBudget::default(),
            folder: folder.to_owned(),
            beside: None,
            units: BTreeMap::new(),
            described: BTreeMap::new(),
            found: BTreeMap::new(),
            found_before: None,
            compiled: BTreeMap::new(),
            messages: Messages::default(),
            made: BTreeMap::new(),
        }
    }

    /// Discards the contents of files, so that the next lookup reads them again.
    pub fn refresh(&mut self) {
        self.beside = None;
        self.units.clear();
        let found = std::mem::take(&mut self.found);
        self.found_before.get_or_insert(found);
        self.messages = Messages::default();
    }

    /// Accepts the results since the last refresh.
    pub fn accept_refresh(&mut self) {
        self.found_before = None;
    }

    /// Restores the results before the last refresh, unless that was accepted.
    pub fn undo_refresh(&mut self) {
        if let Some(found) = self.found_before.take() {
            self.found = found;
            self.messages = Messages::default();
        }
    }

    /// Sets the budget for files read from now on.
    pub fn set_budget(&mut self, budget: &InputBudget) {
        self.budget = budget.clone();
    }

    /// Sets the classes whose texts the description has.
    pub fn set_described(&mut self, described: &BTreeMap<String, DescribedClass>) {
        if self.described != *described {
            let earlier = std::mem::replace(&mut self.described, described.clone());
            for name in earlier.keys() {
                self.found.remove(name);
                self.units.remove(Path::new(name));
            }
        }
    }

    /// Sets the compiler. Earlier compilations are discarded if its options differ.
    pub fn set_compiler(&mut self, compiler: Compiler) {
        if compiler.options() != self.compiler.options() {
            self.refresh();
            self.compiled.clear();
            self.compiler = compiler;
        }
    }

    /// Compiles classes with prints and places from now on.
    pub fn set_traced(&mut self) {
        let options = CompilerOptions { traced: true, ..self.compiler.options().clone() };
        self.set_compiler(Compiler::new(options));
    }

    /// True if a text of the compiled classes may print.
    pub fn has_prints(&self) -> bool {
        self.compiled.values().any(Compilation::has_prints)
    }

    /// The files, other than the library's, that classes were compiled from, including files that they include and
    /// files that did not compile.
    pub fn source_files(&self) -> impl Iterator<Item = PathBuf> {
        let included = self.compiled.iter();
        let included = included.flat_map(|(path, it)| texts(path, &it.sources).skip(1));
        let included = included.map(|(name, _)| PathBuf::from(name));
        let beside = self.beside.iter().flatten().map(|file| file.path.clone());
        beside.chain(included)
    }

    /// Returns the class with this name.
    pub fn find(&mut self, name: &str) -> Found {
        if let Some(found) = self.found.get(name) {
            return found.clone();
        }
        let found = self.search(name);
        self.found.insert(name.to_owned(), found.clone());
        found
    }

    /// Returns the class with this name in the standard library, whatever files beside the scene declare.
    pub fn find_standard(&mut self, name: &str) -> Found {
        self.first_of(standard_files(name).collect(), name)
    }

    /// Returns the class `name` of a text that the reader makes; `None` if the text has errors. The text may import
    /// the file of the class `base` as the module `base`.
    pub fn of_text(
        &mut self,
        text: &str,
        name: &str,
        base: Option<&Arc<Class>>,
    ) -> Option<Arc<Class>> {
        let key = (text.to_owned(), base.map_or(0, |base| Arc::as_ptr(base).addr()));
        if let Some(made) = self.made.get(&key) {
            return made.class.clone();
        }
        let file = base.and_then(|base| self.file_of(base));
        let files = self.files.clone();
        let mut loader = BaseLoader { file, includes: includes(&self.compiler, &files) };
        let made = self.compiler.compile_with("attributes.rtsl", text, &mut loader).unit;
        let made = made.and_then(|unit| unit.class(name).ok().cloned());
        self.made.insert(key, MadeClass { class: made.clone(), _base: base.cloned() });
        made
    }

    /// Returns the file that a class was compiled from, with its text.
    fn file_of(&mut self, class: &Arc<Class>) -> Option<(PathBuf, String)> {
        let candidates = self.candidates(&class.name);
        candidates.into_iter().find(|(path, _)| {
            let unit = self.units.get(path).and_then(Option::as_ref);
            let of_unit = unit.and_then(|unit| unit.class(&class.name).ok());
            of_unit.is_some_and(|it| Arc::ptr_eq(it, class))
        })
    }

    fn search(&mut self, name: &str) -> Found {
        if let Some(DescribedClass { class, text }) = self.described.get(name).cloned() {
            let unit = if text.is_empty() { None } else { self.unit(Path::new(name), &text) };
            let class = unit.and_then(|unit| unit.class(&class).ok().cloned());
            return class.map_or(Found::Broken, Found::Class);
        }
        let is_identifier = name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
        if name.is_empty() || !is_identifier {
            return Found::Nothing;
        }
        let files = self.candidates(name);
        self.first_of(files, name)
    }

    /// Returns the class with this name in the first of these files that declares it.
    fn first_of(&mut self, files: Vec<(PathBuf, String)>, name: &str) -> Found {
        for (path, text) in files {
            match self.unit(&path, &text) {
                None => return Found::Broken,
                Some(unit) => {
                    if let Ok(class) = unit.class(name) {
                        return Found::Class(class.clone());
                    }
                }
            }
        }
        Found::Nothing
    }

    /// The names of all classes of the standard library.
    pub fn standard_names() -> impl Iterator<Item = &'static str> {
        classes().map(|(name, _)| name)
    }

    /// The names of the integrators of the standard library.
    pub fn standard_integrators() -> impl Iterator<Item = &'static str> {
        let is_integrator = |file: &LibraryFile| file.path.starts_with("shaders/integrators/");
        classes().filter(move |(_, file)| is_integrator(file)).map(|(name, _)| name)
    }

    /// The errors and warnings of the compiler.
    pub fn messages(&self) -> &Messages {
        &self.messages
    }

    fn candidates(&mut self, name: &str) -> Vec<(PathBuf, String)> {
        let preferred = format!("{}.rtsl", snake_case(name));
        let beside = self.beside().iter().filter(|file| file.declares.contains(name));
        let beside = beside.map(|file| (file.path.clone(), file.text.clone()));
        let (first, others): (Vec<_>, Vec<_>) = beside
            .partition(|(path, _)| path.file_name().is_some_and(|file| file == preferred.as_str()));
        first.into_iter().chain(others).chain(standard_files(name)).collect()
    }

    fn beside(&mut self) -> &[ShaderFile] {
        // Strangers may place links there: a shader lies in one of the folders in which the files lie that it includes.
        let search_path = &self.compiler.options().search_path;
        let allowed: Vec<PathBuf> =
            [self.folder.clone()].into_iter().chain(search_path.iter().cloned()).collect();
        let (files, folder, budget) = (&*self.files, &self.folder, &self.budget);
        let messages = &mut self.messages;
        self.beside.get_or_insert_with(|| {
            let paths = files.list(folder).unwrap_or_default();
            let shaders =
                paths.into_iter().filter(|path| path.extension().is_some_and(|it| it == "rtsl"));
            let read = |path: PathBuf| match shader_file(files, &path, &allowed, budget) {
                Ok(file) => Some(file),
                Err(message) => {
                    message.into_iter().for_each(|it| messages.push_one(it));
                    None
                }
            };
            shaders.filter_map(read).collect()
        })
    }

    fn unit(&mut self, path: &Path, text: &str) -> Option<&Unit> {
        if !self.units.contains_key(path) {
            let unit = match self.compiled.get(path) {
                Some(earlier) if is_current(path, text, earlier, &*self.files) => {
                    self.accept(path, earlier.clone())
                }
                Some(_) | None => {
                    let mut loader = includes(&self.compiler, &self.files);
                    let name = path.display().to_string();
                    let compilation = self.compiler.compile_with(&name, text, &mut loader);
                    self.accept(path, compilation)
                }
            };
            self.units.insert(path.to_owned(), unit);
        }
        self.units.get(path).and_then(Option::as_ref)
    }

    /// Records the messages and the result of compiling a file; if it has errors, its previous result is used.
    fn accept(&mut self, path: &Path, compilation: Compilation) -> Option<Unit> {
        let mut diagnostics = Diagnostics::new();
        diagnostics.extend(compilation.diagnostics.iter().cloned());
        self.messages.push(compilation.sources.clone(), diagnostics);
        let unit = compilation.unit.clone();
        if unit.is_some() {
            self.compiled.insert(path.to_owned(), compilation);
        }
        unit
    }
}

/// Reads a shader file beside the scene that lies in one of the folders. The error is the message about one that is
/// left out: none for a file that cannot be read, which may not belong to the scene.
fn shader_file(
    files: &dyn FileSource,
    path: &Path,
    folders: &[PathBuf],
    budget: &InputBudget,
) -> Result<ShaderFile, Option<Diagnostic>> {
    let Input { bytes, held } =
        Input::read_within(files, path, folders, budget).map_err(|error| {
            let over = OverBudget::of(&error).map(|over| over.diagnostic(path.display()));
            over.or_else(|| (Refused::of(&error) == Some(Refused::Outside)).then(|| outside(path)))
        })?;
    let text = encoding::utf8(bytes).map_err(|problem| {
        let message = format!("`{}` is left out: {problem}", path.display());
        Diagnostic::new(codes::IGNORED_SETTING, message)
    })?;
    held.keep(Amount(text.len() as u64));
    let declares = declared_classes(&text).map(str::to_owned).collect();
    Ok(ShaderFile { path: path.to_owned(), text, declares })
}

/// The warning about a link that leaves the folder of the scene, the same whether anything is there or not.
fn outside(path: &Path) -> Diagnostic {
    let message = format!("`{}` is not read: it is a link that leaves its folder", path.display());
    Diagnostic::new(codes::OUTSIDE_FOLDER, message)
        .help("if you want it to be read, name the folder of the shader with `-I`")
}

/// The loader of the files that shaders include.
fn includes<'a>(compiler: &Compiler, files: &'a FilesRef<'_>) -> FileLoader<SceneIncludes<'a>> {
    FileLoader::new(compiler.options().search_path.clone()).among(SceneIncludes(&**files))
}

/// The files of a scene, as those that shaders include.
struct SceneIncludes<'a>(&'a dyn FileSource);

/// The greatest size of a file that is included.
const LARGEST_INCLUDE: u64 = 16 << 20;

impl IncludeFiles for SceneIncludes<'_> {
    fn read_within(&self, path: &Path, folders: &[PathBuf]) -> Result<String, Unread> {
        let Opened { size, contents } = self.0.open_within(path, folders)?;
        let mut bytes = Vec::new();
        if size <= LARGEST_INCLUDE {
            contents.take(LARGEST_INCLUDE + 1).read_to_end(&mut bytes)?;
        }
        if size.max(bytes.len() as u64) > LARGEST_INCLUDE {
            let reason = format!("it is larger than {} MiB", LARGEST_INCLUDE >> 20);
            return Err(Unread::Unreadable(reason));
        }
        encoding::utf8(bytes).map_err(|reason| Unread::Unreadable(reason.to_owned()))
    }
}

/// Loads the file of a base class as the module `base`, and what it includes as usual.
struct BaseLoader<'a> {
    file: Option<(PathBuf, String)>,
    includes: FileLoader<SceneIncludes<'a>>,
}

impl IncludeLoader for BaseLoader<'_> {
    fn load(&mut self, path: &str, including: &str) -> Result<IncludedFile, IncludeError> {
        match &self.file {
            Some((file, text)) if path == "base.rtsl" => {
                Ok(IncludedFile { name: file.display().to_string(), text: text.clone() })
            }
            _ => self.includes.load(path, including),
        }
    }
}

/// The files of the standard library that declare a class, with their texts.
fn standard_files(name: &str) -> impl Iterator<Item = (PathBuf, String)> {
    let files = classes().filter(move |(declared, _)| *declared == name);
    files.map(|(_, file)| (PathBuf::from(file.path), file.text.to_owned()))
}

/// True if a file and the files that it includes still have the texts of a compilation.
fn is_current(path: &Path, text: &str, compilation: &Compilation, files: &dyn FileSource) -> bool {
    let mut texts = texts(path, &compilation.sources);
    let is_own = texts.next().is_some_and(|(_, own)| own == text);
    let is_as_it_was = |(name, text): (&str, &str)| {
        if rtsl::library::file(name).is_some_and(|file| file.text == text) {
            return true;
        }
        // The length alone shows that a file changed that may have become very long.
        let name = Path::new(name);
        files.size(name).is_ok_and(|size| size == text.len() as u64)
            && files.read(name).is_ok_and(|now| now == text.as_bytes())
    };
    is_own && texts.all(is_as_it_was)
}

/// The texts of a compilation with their names: the file itself, then those that it includes. The prelude's come before
/// them in the map and are skipped.
fn texts<'a>(path: &Path, sources: &'a SourceMap) -> impl Iterator<Item = (&'a str, &'a str)> {
    let own = path.display().to_string();
    let files = sources.files().map(|(_, file)| (file.name.as_str(), file.text.as_str()));
    files.skip_while(move |(name, _)| *name != own)
}

/// Converts `ThinLens` to the spelling of file names, `thin_lens`.
fn snake_case(name: &str) -> String {
    let mut spelled = String::new();
    let mut previous_lower = false;
    for letter in name.chars() {
        if letter.is_ascii_uppercase() && previous_lower {
            spelled.push('_');
        }
        previous_lower = letter.is_ascii_lowercase() || letter.is_ascii_digit();
        spelled.push(letter.to_ascii_lowercase());
    }
    spelled
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_named_after_their_classes() {
        assert_eq!(
            ["Torus", "ThinLens", "FBm", "Sphere2D"].map(snake_case),
            ["torus", "thin_lens", "fbm", "sphere2_d"]
        );
    }

    #[test]
    fn declared_classes_are_found_without_parsing() {
        let text = "struct A {}; class Box : rt_Primitive; class Lamp : rt_Light, rt_Material {}";
        assert_eq!(declared_classes(text).collect::<Vec<_>>(), ["Box", "Lamp"]);
        let text = "// A class that\n/* is no class of */ class /* named */ A; [[doc \"class B\"]] int subclass C;\n\
                    #error no class here\n#define MAKE class D : rt_Texture;\n";
        assert_eq!(declared_classes(text).collect::<Vec<_>>(), ["A", "D"]);
    }
}
