//! The outline of a text, and the regions that can be folded.

use rtsl::Span;
use rtsl_syntax::raw::{RawKind, raw_tokens, words};

use crate::declaration::{DeclarationId, DeclarationKind};
use crate::document::Document;

/// An entry of the outline.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutlineEntry {
    /// The name.
    pub name: String,
    /// The declaration as text.
    pub detail: String,
    /// The kind of what is declared.
    pub kind: DeclarationKind,
    /// The name in the text.
    pub span: Span,
    /// The whole declaration.
    pub extent: Span,
    /// The declarations inside, without the variables of functions.
    pub children: Vec<OutlineEntry>,
}

/// Returns the declarations of the text itself.
pub fn outline(document: &Document) -> Vec<OutlineEntry> {
    entries(document, None)
}

fn entries(document: &Document, parent: Option<DeclarationId>) -> Vec<OutlineEntry> {
    let own = document.declarations.inside(parent).filter(|(_, declaration)| {
        let is_inside =
            matches!(declaration.kind, DeclarationKind::Local | DeclarationKind::Argument);
        declaration.span.file == document.file() && !is_inside
    });
    let entry = |(id, declaration): (DeclarationId, &crate::Declaration)| OutlineEntry {
        name: declaration.name.clone(),
        detail: declaration.text.clone(),
        kind: declaration.kind,
        span: declaration.span,
        extent: declaration.extent.to(declaration.span),
        children: entries(document, Some(id)),
    };
    own.map(entry).collect()
}

/// A region that can be folded, by its first and last line from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Fold {
    /// The first line.
    pub first: u32,
    /// The last line.
    pub last: u32,
    /// True for comments.
    pub is_comment: bool,
}

/// Returns the regions of a text that can be folded: brackets, comments, branches of `#if`.
pub fn folds(text: &str) -> Vec<Fold> {
    let starts: Vec<usize> =
        std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
    let line = |offset: usize| starts.partition_point(|start| *start <= offset) as u32 - 1;
    let mut folds = Vec::new();
    let mut open: Vec<u32> = Vec::new();
    let mut conditionals: Vec<u32> = Vec::new();
    let mut comment: Option<(u32, u32)> = None;
    let mut add = |first: u32, last: u32, is_comment: bool| {
        if last > first {
            folds.push(Fold { first, last, is_comment });
        }
    };
    for token in raw_tokens(text) {
        let (first, last) = (line(token.range.start), line(token.range.end.max(1) - 1));
        let written = &text[token.range.clone()];
        if token.kind == RawKind::LineComment {
            comment = match comment {
                Some((start, end)) if end + 1 == first => Some((start, first)),
                other => {
                    other.into_iter().for_each(|(start, end)| add(start, end, true));
                    Some((first, first))
                }
            };
            continue;
        }
        match token.kind {
            RawKind::BlockComment => add(first, last, true),
            RawKind::Directive => {
                let name = words(written).first().copied().unwrap_or_default();
                let (begins, ends) = match name {
                    "if" | "ifdef" | "ifndef" => (true, false),
                    "elif" | "else" => (true, true),
                    "endif" => (false, true),
                    _ => (false, false),
                };
                if ends && let Some(start) = conditionals.pop() {
                    add(start, first.saturating_sub(1), false);
                }
                if begins {
                    conditionals.push(first);
                }
            }
            _ => match written {
                "{" | "(" | "[" => open.push(first),
                "}" | ")" | "]" => {
                    // The line of the closing bracket stays visible.
                    if let Some(start) = open.pop() {
                        add(start, first.saturating_sub(1).max(start), false);
                    }
                }
                _ => {}
            },
        }
    }
    comment.into_iter().for_each(|(start, end)| add(start, end, true));
    folds.sort_unstable();
    folds.dedup_by_key(|fold| fold.first);
    folds
}
