//! GLSL's preprocessor with `#include`: reads files and produces one list of tokens.
//!
//! Tokens pass from a stack of open files through a stack of macro expansions to the output. The
//! only recursion is the separate expansion of a macro's argument, to a bounded depth; all other
//! nesting uses stacks on the heap. One budget bounds the work of expansions and repeated
//! inclusions.

mod condition;
pub(crate) mod directive;
mod expansion;
mod files;
mod macros;

use std::collections::{BTreeMap, HashMap, HashSet};

use rtsl_source::{Diagnostic, Diagnostics, FileId, SourceMap, Span, diagnostic_codes as codes};

use crate::comments::Comments;
use crate::include::IncludeLoader;
use crate::symbol::{Interner, Symbol};
use crate::token::{LexicalError, Punctuator, Token, TokenKind};
use expansion::Input;
use files::{LexedFile, OpenFile};
use macros::Macro;

/// The number of tokens that macros and repeated includes may produce in all.
const BUDGET: usize = 1 << 20;
/// The longest name, in bytes, as in GLSL.
const MAX_NAME: usize = 1024;

/// Returns the tokens of the translation unit that starts with `file`, the last of which is the end
/// token, and the comments of its files.
pub(crate) fn preprocess(
    map: &mut SourceMap,
    file: FileId,
    loader: &mut dyn IncludeLoader,
    symbols: &mut Interner,
    diagnostics: &mut Diagnostics,
) -> (Vec<Token>, HashMap<FileId, Comments>) {
    let mut preprocessor = Preprocessor::new(map, loader, symbols, diagnostics);
    preprocessor.open(file, None);
    preprocessor.run();
    // A text cut short by a limit would give errors that its author cannot fix.
    let mut tokens = if preprocessor.exhausted { Vec::new() } else { preprocessor.output };
    let after_invalid = preprocessor.after_invalid;
    let comments =
        preprocessor.lexed.into_iter().map(|lexed| (lexed.file, lexed.comments)).collect();
    let end = map.file(file).text.len() as u32;
    tokens.push(Token {
        kind: TokenKind::End,
        spelling: symbols.intern(""),
        span: Span::new(file, end, end),
        starts_line: true,
        spaced: true,
        after_invalid,
        painted: false,
    });
    (tokens, comments)
}

/// The state of the preprocessor for one translation unit.
struct Preprocessor<'a> {
    map: &'a mut SourceMap,
    loader: &'a mut dyn IncludeLoader,
    symbols: &'a mut Interner,
    diagnostics: &'a mut Diagnostics,
    macros: HashMap<Symbol, Macro>,
    /// The number of expansions of each macro in progress.
    active: HashMap<Symbol, usize>,
    /// The open files, the innermost last.
    open: Vec<OpenFile>,
    /// Every file read so far; its index here is its number for `__FILE__`.
    lexed: Vec<LexedFile>,
    /// The results of includes, by including file and path as written.
    includes: BTreeMap<(FileId, String), Option<FileId>>,
    /// The files with `#pragma once`.
    once: HashSet<FileId>,
    /// The positions of reported invalid tokens. Macros may produce a token several times.
    reported: HashSet<(FileId, u32)>,
    output: Vec<Token>,
    /// True if the token before was invalid, and reported.
    after_invalid: bool,
    budget: usize,
    exhausted: bool,
    /// True while the macros of a condition are expanded, where `defined` is an operator.
    in_condition: bool,
    /// True if a `defined` of the condition has no name, which was reported.
    malformed_defined: bool,
    names: Names,
}

/// The spellings that the preprocessor itself looks for.
struct Names {
    defined: Symbol,
    line: Symbol,
    file: Symbol,
    version: Symbol,
    rtsl: Symbol,
}

impl Names {
    fn new(symbols: &mut Interner) -> Self {
        Names {
            defined: symbols.intern("defined"),
            line: symbols.intern("__LINE__"),
            file: symbols.intern("__FILE__"),
            version: symbols.intern("__VERSION__"),
            rtsl: symbols.intern("__RTSL__"),
        }
    }
}

impl<'a> Preprocessor<'a> {
    fn new(
        map: &'a mut SourceMap,
        loader: &'a mut dyn IncludeLoader,
        symbols: &'a mut Interner,
        diagnostics: &'a mut Diagnostics,
    ) -> Self {
        let names = Names::new(symbols);
        Preprocessor {
            map,
            loader,
            symbols,
            diagnostics,
            macros: HashMap::new(),
            active: HashMap::new(),
            open: Vec::new(),
            lexed: Vec::new(),
            includes: BTreeMap::new(),
            once: HashSet::new(),
            reported: HashSet::new(),
            output: Vec::new(),
            after_invalid: false,
            budget: BUDGET,
            exhausted: false,
            in_condition: false,
            malformed_defined: false,
            names,
        }
    }

    fn run(&mut self) {
        let mut input = Input::files();
        while let Some(token) = self.next_expanded(&mut input) {
            self.emit(token);
        }
    }

    /// Passes a token to the parser, or reports that it is invalid.
    fn emit(&mut self, token: Token) {
        match token.kind {
            TokenKind::Invalid(error) => {
                self.report_invalid(token, error);
                match error {
                    LexicalError::NonAsciiName => {
                        self.push(Token { kind: TokenKind::Name, ..token });
                    }
                    LexicalError::UnterminatedText => {
                        self.after_invalid = true;
                        self.push(token);
                    }
                    LexicalError::UnexpectedCharacter
                    | LexicalError::NonAsciiCharacter
                    | LexicalError::UnterminatedComment => self.after_invalid = true,
                }
            }
            TokenKind::Punctuator(Punctuator::Hash | Punctuator::HashHash) => {
                let message = format!("`{}` outside a directive", self.text(token));
                self.report(
                    Diagnostic::new(codes::UNEXPECTED_CHARACTER, message)
                        .at(token.span, "not part of any directive")
                        .note("a directive's `#` is the first thing on its line"),
                );
                self.after_invalid = true;
            }
            TokenKind::Name if self.text(token).len() > MAX_NAME => {
                let message = format!(
                    "a name of {} characters, but the limit is {MAX_NAME}",
                    self.text(token).len()
                );
                self.report(
                    Diagnostic::new(codes::NAME_TOO_LONG, message).at(token.span, "this name"),
                );
                // Later stages get a name within the limit.
                let short = self.text(token)[..MAX_NAME].to_string();
                let spelling = self.symbols.intern(&short);
                self.push(Token { spelling, ..token });
            }
            TokenKind::Name
            | TokenKind::Number
            | TokenKind::Text
            | TokenKind::Punctuator(_)
            | TokenKind::End => self.push(token),
        }
    }

    fn push(&mut self, token: Token) {
        let after_invalid = std::mem::take(&mut self.after_invalid);
        self.output.push(Token { after_invalid, ..token });
    }

    fn report_invalid(&mut self, token: Token, error: LexicalError) {
        if !self.reported.insert((token.span.file, token.span.start)) {
            return;
        }
        let diagnostic = error.diagnostic(token.span, self.map.text(token.span));
        self.report(diagnostic);
    }

    /// Takes `amount` from the budget. Returns false if it is exhausted, and reports that the first
    /// time.
    fn spend(&mut self, amount: usize, place: Span) -> bool {
        if self.exhausted {
            return false;
        }
        match self.budget.checked_sub(amount) {
            Some(left) => {
                self.budget = left;
                true
            }
            None => {
                self.exhausted = true;
                let diagnostic = self.open_cycle().unwrap_or_else(|| {
                    Diagnostic::new(
                        codes::EXPANSION_LIMIT,
                        format!("macros and repeated includes make more than {BUDGET} tokens"),
                    )
                    .at(place, "the limit is reached here; the rest is not read")
                });
                self.report(diagnostic);
                false
            }
        }
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    fn text(&self, token: Token) -> &str {
        self.symbols.text(token.spelling)
    }
}
