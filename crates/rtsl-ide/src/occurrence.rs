//! The places at which something is declared and used: definitions, references, renaming.

use rtsl::{FileId, Method, Span};
use rtsl_sema::index::Symbol;
use rtsl_syntax::raw::{RawKind, RawToken, raw_tokens, words};

use crate::declaration::{DeclarationId, DeclarationKind};
use crate::document::{Document, Meaning};

/// An identity that is the same in all documents: a declaration by its file and offset, or a name of the language.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Key {
    /// The name of the file, and the offset of the name in it.
    Declared(String, u32),
    /// The name of a state variable, function, method, role or type.
    Language(String),
}

/// A place at which something is declared or used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Occurrence {
    /// The name.
    pub span: Span,
    /// True if this declares it.
    pub is_declaration: bool,
}

/// Returns what stands at an offset.
pub fn key_at(document: &Document, offset: u32) -> Option<Key> {
    let word = document.word(offset)?;
    key_of(document, &word.meaning)
}

/// Returns the place where the word at an offset is declared: its name.
pub fn definition(document: &Document, offset: u32) -> Option<Span> {
    match document.word(offset)?.meaning {
        Meaning::Declared(id) => {
            let declaration = document.declarations.get(id);
            // A module's declaration is its file.
            match declaration.kind {
                DeclarationKind::Module => module_file(document, id).or(Some(declaration.span)),
                _ => Some(declaration.span),
            }
        }
        Meaning::Language(Symbol::Builtin(_, declared)) => declared,
        Meaning::Language(Symbol::Declared(span)) => Some(span),
        Meaning::Language(_) => None,
        Meaning::Macro(definition) => Some(definition),
    }
}

/// The beginning of the file that a module is.
fn module_file(document: &Document, id: DeclarationId) -> Option<Span> {
    let extent = document.declarations.get(id).extent;
    let path = document.analysis.tree().imports.iter().find(|it| it.span == extent)?.file();
    let mut files = document.analysis.sources.files();
    let (file, _) = files.find(|(_, file)| is_at(&file.name, &path))?;
    Some(Span::new(file, 0, 0))
}

/// True if the name of a file ends in a path.
fn is_at(name: &str, path: &str) -> bool {
    let name = name.replace('\\', "/");
    name.strip_suffix(path).is_some_and(|folder| folder.is_empty() || folder.ends_with('/'))
}

/// Returns the import or the directive by which the text uses a file, if it does so itself.
pub fn use_of_file(document: &Document, file: FileId) -> Option<Span> {
    let name = &document.analysis.sources.file(file).name;
    let imports = document.analysis.tree().imports.iter();
    let mut own = imports.filter(|it| it.span.file == document.file());
    if let Some(import) = own.find(|it| is_at(name, &it.file())) {
        return Some(import.span);
    }
    let text = document.text();
    let mut directives =
        raw_tokens(text).into_iter().filter(|token| token.kind == RawKind::Directive);
    let includes = |token: &RawToken| {
        let written = &text[token.range.clone()];
        let path = written.split('"').nth(1).filter(|_| words(written).first() == Some(&"include"));
        path.is_some_and(|path| is_at(name, path.rsplit('/').next().unwrap_or(path)))
    };
    let found = directives.find(includes)?;
    Some(Span::new(document.file(), found.range.start as u32, found.range.end as u32))
}

/// Returns the places in all files of the document at which something occurs, in the order of the text.
pub fn occurrences(document: &Document, key: &Key) -> Vec<Occurrence> {
    let declared = document.declarations.iter().filter_map(|(id, declaration)| {
        let own = key_of_declaration(document, id)?;
        (own == *key).then_some(Occurrence { span: declaration.span, is_declaration: true })
    });
    let used = document.uses().iter().filter_map(|used| {
        let own = key_of(document, &document.meaning(used))?;
        (own == *key).then_some(Occurrence { span: used.span, is_declaration: false })
    });
    let mut found: Vec<Occurrence> = declared.chain(used).collect();
    found.sort_by_key(|it| (it.span.file, it.span.start, !it.is_declaration));
    found.dedup_by_key(|it| it.span);
    found
}

/// The reason why something cannot be renamed; `None` if it can.
pub fn rename_refusal(document: &Document, offset: u32) -> Option<String> {
    let word = document.word(offset);
    let refusal = match word.map(|word| word.meaning) {
        None => "there is no name here",
        Some(Meaning::Language(_)) => "this name belongs to the language",
        Some(Meaning::Macro(_)) => "macros are not renamed, since their text may have any meaning",
        Some(Meaning::Declared(id)) => {
            let id = document.declarations.canonical(id);
            let declaration = document.declarations.get(id);
            let parent = declaration.parent.map(|id| document.declarations.get(id).kind);
            let in_class = parent == Some(DeclarationKind::Class);
            let is_method = in_class
                && declaration.kind == DeclarationKind::Function
                && Method::from_name(&declaration.name).is_some();
            let file = &document.analysis.sources.file(declaration.span.file).name;
            if is_method {
                "renderers call this method by its name"
            } else if declaration.kind == DeclarationKind::Constructor {
                "hosts call the constructor by this name"
            } else if declaration.kind == DeclarationKind::Module {
                "a module has the name of its file"
            } else if rtsl::library::file(file).is_some() {
                "this is declared in the standard library"
            } else {
                return None;
            }
        }
    };
    Some(refusal.to_owned())
}

/// The reason why a text cannot be a new name; `None` if it can.
pub fn name_refusal(name: &str) -> Option<String> {
    let tokens = raw_tokens(name);
    let is_name = matches!(tokens.as_slice(), [token] if token.kind == RawKind::Name
        && token.range == (0..name.len()));
    if !is_name {
        return Some(format!("`{name}` is no name"));
    }
    rtsl_syntax::reserved_name(name).map(str::to_owned)
}

fn key_of(document: &Document, meaning: &Meaning) -> Option<Key> {
    match meaning {
        Meaning::Declared(id) => key_of_declaration(document, *id),
        Meaning::Language(symbol) => Some(Key::Language(match symbol {
            Symbol::Declared(span) => return Some(key_of_place(document, span.file, span.start)),
            Symbol::State(variable) => variable.name.to_owned(),
            Symbol::Builtin(name, _) => (*name).to_owned(),
            Symbol::Method(method) => format!("{}.{}", method.role.class(), method.name),
            Symbol::Role(role) => role.class().to_owned(),
            Symbol::Type(name) => name.clone(),
            Symbol::RayType(ray_type) => ray_type.name().to_owned(),
        })),
        Meaning::Macro(span) => Some(key_of_place(document, span.file, span.start)),
    }
}

fn key_of_declaration(document: &Document, id: DeclarationId) -> Option<Key> {
    let span = document.declarations.get(document.declarations.canonical(id)).span;
    Some(key_of_place(document, span.file, span.start))
}

fn key_of_place(document: &Document, file: FileId, start: u32) -> Key {
    Key::Declared(document.analysis.sources.file(file).name.clone(), start)
}
