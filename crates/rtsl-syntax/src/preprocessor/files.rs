//! The open files, their conditional groups, and `#include`.

use std::rc::Rc;

use rtsl_source::{Diagnostic, FileId, Span, diagnostic_codes as codes};

use super::Preprocessor;
use crate::comments::Comments;
use crate::include::IncludeError;
use crate::lexer::lex_with_comments;
use crate::message::shorten;
use crate::token::{Punctuator, Token};

/// The maximum depth of includes.
const MAX_INCLUDE_DEPTH: usize = 64;
/// The maximum size in bytes of all included files together.
const MAX_INCLUDED_BYTES: usize = 64 << 20;
/// The number of skipped tokens that cost as much as one token passed on, when a file is read
/// again. Include guards make skipped tokens common, and they are cheap.
const SKIPPED_FOR_ONE: usize = 16;

/// The tokens of a file, which is lexed once.
pub(super) struct LexedFile {
    pub file: FileId,
    pub tokens: Rc<[Token]>,
    pub comments: Comments,
}

/// A file that is being read.
pub(super) struct OpenFile {
    pub file: FileId,
    pub tokens: Rc<[Token]>,
    pub position: usize,
    pub conditions: Vec<Conditional>,
    /// The offset that `#line` adds to line numbers.
    pub line_offset: i64,
    /// The value of `__FILE__`.
    pub number: i64,
    /// True if the file was read before, so that its tokens count as expansion.
    pub repeated: bool,
    /// The span of the directive that included it.
    pub included_at: Option<Span>,
}

/// An `#if` whose `#endif` has not been read yet.
pub(super) struct Conditional {
    /// The span of the `#if`.
    pub span: Span,
    pub state: GroupState,
    /// The span of the `#else`, once read.
    pub otherwise: Option<Span>,
}

/// The state of a conditional.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GroupState {
    /// The current group is read.
    Reading,
    /// No group has been read yet.
    Seeking,
    /// A group was read, or the whole conditional is skipped.
    Finished,
}

impl OpenFile {
    /// True if the current text belongs to a group that is skipped.
    pub fn skips(&self) -> bool {
        self.conditions.last().is_some_and(|innermost| innermost.state != GroupState::Reading)
    }

    /// The index of the first token after the line of token `start`.
    pub fn line_end(&self, start: usize) -> usize {
        let rest = &self.tokens[start + 1..];
        start + 1 + rest.iter().position(|token| token.starts_line).unwrap_or(rest.len())
    }
}

impl Preprocessor<'_> {
    /// Opens `file`.
    pub(super) fn open(&mut self, file: FileId, included_at: Option<Span>) {
        let known = self.lexed.iter().position(|lexed| lexed.file == file);
        let number = known.unwrap_or_else(|| {
            let text = &self.map.file(file).text;
            let (tokens, ranges) = lex_with_comments(file, text, self.symbols);
            let (tokens, comments) = (tokens.into(), Comments { ranges });
            self.lexed.push(LexedFile { file, tokens, comments });
            self.lexed.len() - 1
        });
        let tokens = self.lexed[number].tokens.clone();
        if let (Some(_), Some(place)) = (known, included_at)
            && !self.spend(1 + tokens.len() / SKIPPED_FOR_ONE, place)
        {
            return;
        }
        self.open.push(OpenFile {
            file,
            tokens,
            position: 0,
            conditions: Vec::new(),
            line_offset: 0,
            number: number as i64,
            repeated: known.is_some(),
            included_at,
        });
    }

    /// Returns the next token of the files and executes the directives before it.
    pub(super) fn next_file_token(&mut self) -> Option<Token> {
        loop {
            if self.exhausted {
                return None;
            }
            let file = self.open.last_mut()?;
            let Some(token) = file.tokens.get(file.position).copied() else {
                self.close();
                continue;
            };
            let start = file.position;
            let counts = file.repeated && !file.skips();
            if token.starts_line && token.is(Punctuator::Hash) {
                let end = file.line_end(start);
                file.position = end;
                let tokens = file.tokens.clone();
                if !counts || self.spend(end - start, token.span) {
                    self.obey(&tokens[start..end]);
                }
            } else if file.skips() {
                file.position = file.line_end(start);
            } else {
                file.position += 1;
                if !counts || self.spend(1, token.span) {
                    return Some(token);
                }
            }
        }
    }

    /// The next token of the innermost file, if it can be the `(` of a macro's call.
    pub(super) fn peek_file_token(&self) -> Option<Token> {
        let file = self.open.last()?;
        file.tokens.get(file.position).copied()
    }

    fn close(&mut self) {
        let Some(file) = self.open.pop() else { return };
        for unclosed in file.conditions {
            self.report(
                Diagnostic::new(
                    codes::UNBALANCED_CONDITIONAL,
                    "a conditional without its `#endif`",
                )
                .at(unclosed.span, "begins here")
                .help("add `#endif` before the end of the file"),
            );
        }
    }

    /// Executes an `#include` of `path` at the span `place`.
    pub(super) fn include(&mut self, path: &str, place: Span) {
        let Some(including) = self.open.last().map(|file| file.file) else { return };
        let key = (including, path.to_string());
        let file = match self.includes.get(&key) {
            Some(known) => *known,
            None => {
                let found = self.find_include(path, including, place);
                self.includes.insert(key, found);
                found
            }
        };
        let Some(file) = file else { return };
        if self.once.contains(&file) {
            return;
        }
        if self.open.len() >= MAX_INCLUDE_DEPTH {
            let cycle = self.cycle(self.open.len(), file, place);
            let too_deep = Diagnostic::new(
                codes::EXPANSION_LIMIT,
                format!("more than {MAX_INCLUDE_DEPTH} files include each other"),
            );
            self.exhausted |= cycle.is_some();
            self.report(cycle.unwrap_or_else(|| too_deep.at(place, "not included")));
            return;
        }
        self.open(file, Some(place));
    }

    fn find_include(&mut self, path: &str, including: FileId, place: Span) -> Option<FileId> {
        let shown = shorten(path);
        let error = match self.loader.load(path, &self.map.file(including).name) {
            Ok(found) => {
                let known = self
                    .lexed
                    .iter()
                    .map(|lexed| lexed.file)
                    .find(|file| self.map.file(*file).name == found.name);
                if known.is_some() {
                    return known;
                }
                let included: usize =
                    self.lexed.iter().map(|lexed| self.map.file(lexed.file).text.len()).sum();
                if included + found.text.len() <= MAX_INCLUDED_BYTES {
                    return Some(self.map.add(found.name, found.text));
                }
                Diagnostic::new(
                    codes::EXPANSION_LIMIT,
                    format!("included files hold more than {MAX_INCLUDED_BYTES} bytes"),
                )
                .at(place, "not included")
            }
            Err(IncludeError::NotFound(searched)) => {
                let diagnostic =
                    Diagnostic::new(codes::INCLUDE_NOT_FOUND, format!("no file `{shown}`"))
                        .at(place, "not found");
                if searched.is_empty() {
                    diagnostic.note("this text does not come from a file, so no folder is searched")
                } else {
                    diagnostic.note(format!("looked for {}", searched.join(", ")))
                }
            }
            Err(IncludeError::Escapes) => Diagnostic::new(
                codes::INCLUDE_ESCAPES,
                format!("`{shown}` leads out of the folders that may be included from"),
            )
            .at(place, "not included")
            .help("add the folder to the search path, and include by a path relative to it"),
            Err(IncludeError::Unreadable(reason)) => {
                Diagnostic::new(codes::INCLUDE_NOT_FOUND, format!("can't read `{shown}`: {reason}"))
                    .at(place, "not included")
            }
        };
        self.report(error);
        None
    }

    /// The error for a cycle of includes: the last of the first `depth` open files includes `file`
    /// at `place`, and `file` is one of them.
    fn cycle(&self, depth: usize, file: FileId, place: Span) -> Option<Diagnostic> {
        let start = self.open[..depth].iter().rposition(|open| open.file == file)?;
        let name = shorten(&self.map.file(file).name);
        let mut diagnostic =
            Diagnostic::new(codes::RECURSIVE_INCLUDE, format!("`{name}` includes itself"))
                .at(place, "the cycle closes here");
        for span in self.open[start + 1..depth].iter().filter_map(|open| open.included_at) {
            diagnostic = diagnostic.label(span, "by way of this include");
        }
        Some(
            diagnostic
                .help("`#pragma once` or a guard ends it; move what both need to a third file"),
        )
    }

    /// The error for the innermost cycle among the open files.
    pub(super) fn open_cycle(&self) -> Option<Diagnostic> {
        let mut open = self.open.iter().enumerate().rev();
        open.find_map(|(depth, open)| self.cycle(depth, open.file, open.included_at?))
    }
}
