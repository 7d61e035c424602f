//! The macros of a text and of what it includes.

use std::collections::HashMap;

use rtsl::{Analysis, Span};
use rtsl_syntax::raw::{RawKind, raw_tokens, words};

use crate::document::Document;

/// The definitions of macros by their names, those of the text first.
#[derive(Debug, Default)]
pub struct Macros {
    definitions: HashMap<String, Span>,
}

impl Macros {
    /// Collects the definitions.
    pub fn of(analysis: &Analysis) -> Macros {
        let mut definitions = HashMap::new();
        let files = analysis.sources.files().filter(|(id, _)| !analysis.is_of_prelude(*id));
        for (id, file) in files {
            if !file.text.contains("define") {
                continue;
            }
            let directives = raw_tokens(&file.text).into_iter();
            for token in directives.filter(|token| token.kind == RawKind::Directive) {
                let Some(name) = defined_name(&file.text[token.range.clone()]) else { continue };
                let span = Span::new(id, token.range.start as u32, token.range.end as u32);
                definitions.entry(name.to_owned()).or_insert(span);
            }
        }
        Macros { definitions }
    }

    /// The word at an offset that names a macro, and the definition.
    pub fn at(&self, document: &Document, offset: u32) -> Option<(Span, Span)> {
        if self.definitions.is_empty() {
            return None;
        }
        let text = document.text();
        let is_letter = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
        let before = text.get(..offset as usize)?;
        let start = before.rfind(|letter| !is_letter(letter)).map_or(0, |it| it + 1);
        let after = &text[offset as usize..];
        let end = offset as usize + after.find(|letter| !is_letter(letter)).unwrap_or(after.len());
        let definition = self.definitions.get(text.get(start..end)?)?;
        Some((Span::new(document.file(), start as u32, end as u32), *definition))
    }

    /// The names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.definitions.keys().map(String::as_str)
    }
}

fn defined_name(directive: &str) -> Option<&str> {
    match words(directive)[..] {
        ["define", name, ..] => Some(name),
        _ => None,
    }
}
