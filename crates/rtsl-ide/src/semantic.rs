//! The kinds of a text's words, for colours.

use std::collections::HashMap;

use rtsl_sema::index::Symbol;
use rtsl_syntax::raw::{RawKind, raw_tokens};

use crate::declaration::DeclarationKind;
use crate::document::{Document, Meaning};

/// A word with its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SemanticToken {
    /// The offset of its first byte.
    pub start: u32,
    /// The offset just past it.
    pub end: u32,
    /// The kind.
    pub kind: SemanticKind,
    /// True for a declaration.
    pub is_declaration: bool,
    /// True for what does not change.
    pub is_readonly: bool,
    /// True for what belongs to the language.
    pub is_of_language: bool,
}

/// The kinds of words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "each is what its name says")]
pub enum SemanticKind {
    Keyword,
    Type,
    Class,
    Struct,
    Enumeration,
    Choice,
    Function,
    Method,
    Variable,
    Parameter,
    Property,
    Module,
    Macro,
    Number,
    Text,
    Comment,
}

impl SemanticKind {
    /// All kinds, in the order of their names for editors.
    pub const ALL: [SemanticKind; 16] = [
        SemanticKind::Keyword,
        SemanticKind::Type,
        SemanticKind::Class,
        SemanticKind::Struct,
        SemanticKind::Enumeration,
        SemanticKind::Choice,
        SemanticKind::Function,
        SemanticKind::Method,
        SemanticKind::Variable,
        SemanticKind::Parameter,
        SemanticKind::Property,
        SemanticKind::Module,
        SemanticKind::Macro,
        SemanticKind::Number,
        SemanticKind::Text,
        SemanticKind::Comment,
    ];
}

/// Returns the words of the text in their order.
pub fn semantic_tokens(document: &Document) -> Vec<SemanticToken> {
    let meanings = meanings(document);
    let text = document.text();
    let tokens = raw_tokens(text).into_iter().filter_map(|token| {
        let (start, end) = (token.range.start as u32, token.range.end as u32);
        let plain = |kind| {
            let is_of_language = false;
            let is_readonly = false;
            SemanticToken { start, end, kind, is_declaration: false, is_readonly, is_of_language }
        };
        if let Some(found) = meanings.get(&start).filter(|found| found.end == end) {
            return Some(*found);
        }
        Some(plain(match token.kind {
            RawKind::Keyword => SemanticKind::Keyword,
            RawKind::Type => SemanticKind::Type,
            RawKind::Number => SemanticKind::Number,
            RawKind::Text => SemanticKind::Text,
            RawKind::LineComment | RawKind::BlockComment => SemanticKind::Comment,
            RawKind::Directive => SemanticKind::Macro,
            RawKind::Name if document.macros.at(document, start).is_some() => SemanticKind::Macro,
            RawKind::Name | RawKind::Punctuator | RawKind::Invalid => return None,
        }))
    });
    tokens.collect()
}

/// The words that have a meaning, by their offsets.
fn meanings(document: &Document) -> HashMap<u32, SemanticToken> {
    let mut meanings = HashMap::new();
    let file = document.file();
    for used in document.uses().iter().filter(|used| used.span.file == file) {
        let Some((kind, is_readonly, is_of_language)) = kind_of(document, &document.meaning(used))
        else {
            continue;
        };
        let (start, end) = (used.span.start, used.span.end);
        let is_declaration = false;
        let token = SemanticToken { start, end, kind, is_declaration, is_readonly, is_of_language };
        meanings.insert(start, token);
    }
    for (id, declaration) in document.declarations.iter() {
        if declaration.span.file != file {
            continue;
        }
        let Some((kind, is_readonly, is_of_language)) = kind_of(document, &Meaning::Declared(id))
        else {
            continue;
        };
        let (start, end) = (declaration.span.start, declaration.span.end);
        let is_declaration = true;
        let token = SemanticToken { start, end, kind, is_declaration, is_readonly, is_of_language };
        meanings.insert(start, token);
    }
    meanings
}

/// The kind of a word, whether it stays the same, and whether it belongs to the language.
fn kind_of(document: &Document, meaning: &Meaning) -> Option<(SemanticKind, bool, bool)> {
    Some(match meaning {
        Meaning::Declared(id) => {
            let declaration = document.declarations.get(*id);
            let in_class = declaration.parent.is_some_and(|parent| {
                document.declarations.get(parent).kind == DeclarationKind::Class
            });
            let is_constant = declaration.text.starts_with("const ");
            let kind = match declaration.kind {
                DeclarationKind::Class => SemanticKind::Class,
                DeclarationKind::Struct => SemanticKind::Struct,
                DeclarationKind::Enumeration => SemanticKind::Enumeration,
                DeclarationKind::Choice => SemanticKind::Choice,
                DeclarationKind::Field | DeclarationKind::Parameter | DeclarationKind::Member => {
                    SemanticKind::Property
                }
                DeclarationKind::Function if in_class => SemanticKind::Method,
                DeclarationKind::Function => SemanticKind::Function,
                DeclarationKind::Constructor => SemanticKind::Method,
                DeclarationKind::Constant | DeclarationKind::Local => SemanticKind::Variable,
                DeclarationKind::Argument => SemanticKind::Parameter,
                DeclarationKind::Module => SemanticKind::Module,
            };
            (kind, is_constant || declaration.kind == DeclarationKind::Constant, false)
        }
        Meaning::Language(symbol) => match symbol {
            Symbol::Declared(_) => return None,
            Symbol::State(_) => (SemanticKind::Variable, false, true),
            Symbol::Builtin(..) => (SemanticKind::Function, false, true),
            Symbol::Method(_) => (SemanticKind::Method, false, true),
            Symbol::Role(_) => (SemanticKind::Class, false, true),
            Symbol::Type(_) => (SemanticKind::Type, false, true),
            Symbol::RayType(_) => (SemanticKind::Variable, true, true),
        },
        Meaning::Macro(_) => (SemanticKind::Macro, false, false),
    })
}
