//! Directives: lines that begin with `#`.

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes, most_similar};

use super::Preprocessor;
use super::files::{Conditional, GroupState};
use crate::message::shorten;
use crate::token::{Punctuator, Token, TokenKind};

/// The names of directives.
pub const DIRECTIVES: [&str; 14] = [
    "define",
    "undef",
    "if",
    "ifdef",
    "ifndef",
    "elif",
    "else",
    "endif",
    "error",
    "pragma",
    "extension",
    "version",
    "line",
    "include",
];

impl Preprocessor<'_> {
    /// Executes the directive on `line`, whose first token is `#`.
    pub(super) fn obey(&mut self, line: &[Token]) {
        let Some(name) = line.get(1).copied() else { return };
        let rest = &line[2..];
        let whole = line[0].span.to(line[line.len() - 1].span);
        let text = self.text(name).to_string();
        match text.as_str() {
            "if" => self.begin_conditional(whole, |this| this.condition_holds(name, rest)),
            "ifdef" => self.begin_conditional(whole, |this| this.tests_name(name, rest)),
            "ifndef" => {
                self.begin_conditional(whole, |this| this.tests_name(name, rest).map(|is| !is))
            }
            "elif" => self.continue_conditional(name, rest),
            "else" => self.turn_conditional(name, rest),
            "endif" => self.end_conditional(name, rest),
            _ if self.open.last().is_some_and(|file| file.skips()) => {}
            "define" => self.define(name, rest),
            "undef" => self.undefine(name, rest),
            "error" => self.obey_error(name, rest),
            "pragma" => self.obey_pragma(name, rest),
            "extension" => self.obey_extension(name, rest),
            "version" => self.obey_version(name, rest),
            "line" => self.obey_line(name, rest),
            "include" => self.obey_include(name, rest),
            _ => self.report_unknown(name, &text),
        }
    }

    fn report_unknown(&mut self, name: Token, text: &str) {
        let message = format!("unknown directive `#{}`", shorten(text));
        let mut diagnostic = Diagnostic::new(codes::UNKNOWN_PREPROCESSING_DIRECTIVE, message)
            .at(name.span, "not a directive");
        if let Some(meant) = most_similar(text, DIRECTIVES) {
            diagnostic = diagnostic.suggest("did you mean", name.span, meant);
        }
        self.report(diagnostic);
    }

    fn begin_conditional(&mut self, span: Span, condition: impl FnOnce(&mut Self) -> Option<bool>) {
        let skipped = self.open.last().is_some_and(|file| file.skips());
        let state = if skipped {
            GroupState::Finished
        } else {
            match condition(self) {
                Some(true) => GroupState::Reading,
                Some(false) => GroupState::Seeking,
                // The error is reported; skipping both branches avoids further errors.
                None => GroupState::Finished,
            }
        };
        if let Some(file) = self.open.last_mut() {
            file.conditions.push(Conditional { span, state, otherwise: None });
        }
    }

    /// Executes `#elif`, whose condition matters only if no group was read.
    fn continue_conditional(&mut self, name: Token, rest: &[Token]) {
        let Some(state) = self.check_continues(name, "elif") else { return };
        let next = match state {
            GroupState::Reading | GroupState::Finished => GroupState::Finished,
            GroupState::Seeking => match self.condition_holds(name, rest) {
                Some(true) => GroupState::Reading,
                Some(false) => GroupState::Seeking,
                None => GroupState::Finished,
            },
        };
        self.set_state(next);
    }

    fn turn_conditional(&mut self, name: Token, rest: &[Token]) {
        let Some(state) = self.check_continues(name, "else") else { return };
        let outer = self.open.last().map_or(0, |file| file.conditions.len().saturating_sub(1));
        self.expect_end_of_conditional(rest, name, outer);
        self.set_state(match state {
            GroupState::Seeking => GroupState::Reading,
            GroupState::Reading | GroupState::Finished => GroupState::Finished,
        });
        if let Some(conditional) = self.open.last_mut().and_then(|file| file.conditions.last_mut())
        {
            conditional.otherwise = Some(name.span);
        }
    }

    fn end_conditional(&mut self, name: Token, rest: &[Token]) {
        let ended = self.open.last_mut().and_then(|file| file.conditions.pop());
        if ended.is_none() {
            self.report_unmatched(name, "endif");
        }
        let outer = self.open.last().map_or(0, |file| file.conditions.len());
        self.expect_end_of_conditional(rest, name, outer);
    }

    /// Reports tokens after `#else` or `#endif`, unless the first `outer` conditionals skip this
    /// one as a whole.
    fn expect_end_of_conditional(&mut self, rest: &[Token], name: Token, outer: usize) {
        let innermost = outer.checked_sub(1);
        let around = innermost.and_then(|index| self.open.last()?.conditions.get(index));
        if around.is_none_or(|conditional| conditional.state == GroupState::Reading) {
            self.expect_line_end(rest, name);
        }
    }

    fn set_state(&mut self, state: GroupState) {
        if let Some(conditional) = self.open.last_mut().and_then(|file| file.conditions.last_mut())
        {
            conditional.state = state;
        }
    }

    /// The state of the conditional that `#elif` or `#else` continues.
    fn check_continues(&mut self, name: Token, directive: &str) -> Option<GroupState> {
        let Some(conditional) = self.open.last().and_then(|file| file.conditions.last()) else {
            self.report_unmatched(name, directive);
            return None;
        };
        if let Some(otherwise) = conditional.otherwise {
            let message = format!("`#{directive}` after `#else`");
            self.report(
                Diagnostic::new(codes::UNBALANCED_CONDITIONAL, message)
                    .at(name.span, "comes too late")
                    .label(otherwise, "the `#else`"),
            );
            return None;
        }
        Some(conditional.state)
    }

    fn report_unmatched(&mut self, name: Token, directive: &str) {
        let message = format!("`#{directive}` without `#if`");
        self.report(
            Diagnostic::new(codes::UNBALANCED_CONDITIONAL, message)
                .at(name.span, "no `#if` is open"),
        );
    }

    fn tests_name(&mut self, directive: Token, rest: &[Token]) -> Option<bool> {
        let name = self.expect_name(directive, rest)?;
        self.expect_line_end(&rest[1..], directive);
        Some(self.is_defined(name.spelling))
    }

    fn obey_error(&mut self, name: Token, rest: &[Token]) {
        let text = self.line_text(rest);
        let message = if text.is_empty() { "`#error`".to_string() } else { text };
        self.report(
            Diagnostic::new(codes::ERROR_DIRECTIVE, message)
                .at(name.span, "reported by this directive"),
        );
    }

    /// The text of a line's tokens as the author wrote it, on one line.
    fn line_text(&self, tokens: &[Token]) -> String {
        const LIMIT: usize = 200;
        let (Some(first), Some(last)) = (tokens.first(), tokens.last()) else {
            return String::new();
        };
        let text = self.map.text(first.span.to(last.span));
        text.chars().take(LIMIT).map(|c| if c.is_control() { ' ' } else { c }).collect()
    }

    /// Executes `#pragma once`, `#pragma once(off)`, and the pragmas of GLSL.
    fn obey_pragma(&mut self, name: Token, rest: &[Token]) {
        let words: Vec<String> =
            rest.iter().take(5).map(|token| self.text(*token).to_string()).collect();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        match words[..] {
            ["once"] | ["once", "(", "on", ")"] => {
                self.once.extend(self.open.last().map(|file| file.file));
            }
            ["once", "(", "off", ")"] => {
                if let Some(file) = self.open.last() {
                    self.once.remove(&file.file);
                }
            }
            [] => {}
            ["STDGL" | "optimize" | "debug", ..] => {}
            _ => {
                let message = format!("unknown pragma `{}`", shorten(&self.line_text(rest)));
                self.report(
                    Diagnostic::new(codes::UNKNOWN_PRAGMA, message)
                        .at(name.span, "has no effect")
                        .note("RTSL knows `#pragma once`, `#pragma once(off)`"),
                );
            }
        }
    }

    fn obey_extension(&mut self, name: Token, rest: &[Token]) {
        let expected = match rest {
            [extension, colon, behavior]
                if extension.kind == TokenKind::Name && colon.is(Punctuator::Colon) =>
            {
                match (self.text(*extension), self.text(*behavior)) {
                    ("all", "require" | "enable") => Some("`all` takes `warn` or `disable`"),
                    (_, "require" | "enable" | "warn" | "disable") => None,
                    _ => Some("the behaviours are `require`, `enable`, `warn` and `disable`"),
                }
            }
            _ => Some("expected `#extension name : behaviour`"),
        };
        if let Some(expected) = expected {
            self.report_malformed(name, rest, expected);
            return;
        }
        let message = format!("extension `{}` has no effect", shorten(self.text(rest[0])));
        self.report(
            Diagnostic::new(codes::EXTENSION_IGNORED, message)
                .at(rest[0].span, "RTSL has no extensions"),
        );
    }

    fn obey_version(&mut self, name: Token, rest: &[Token]) {
        let well_formed = match rest {
            [number] => number.kind == TokenKind::Number,
            [number, profile] => {
                number.kind == TokenKind::Number && profile.kind == TokenKind::Name
            }
            _ => false,
        };
        if !well_formed {
            self.report_malformed(
                name,
                rest,
                "expected `#version number` or `#version number profile`",
            );
        }
    }

    /// Executes `#line 12`, or `#line 12 3` with the value that `__FILE__` has from there on; both
    /// are expressions as in `#if`. A file name as in C instead of that value has no effect.
    fn obey_line(&mut self, name: Token, rest: &[Token]) {
        let expanded = self.expand_list(rest.to_vec(), 0);
        let end = rest.last().unwrap_or(&name).span.after();
        let line = self.evaluate(&expanded, end);
        let numbers = line.and_then(|(line, after)| match after {
            [] => Ok((line, None)),
            [file] if file.kind == TokenKind::Text => Ok((line, None)),
            _ => match self.evaluate(after, end)? {
                (file, []) => Ok((line, Some(file))),
                (_, [extra, ..]) => Err((extra.span, String::new())),
            },
        });
        let Ok((line, number)) = numbers else {
            self.report_malformed(name, rest, "expected `#line number` or `#line number file`");
            return;
        };
        let next_line = i64::from(self.map.line(name.span.file, name.span.start)) + 1;
        if let Some(file) = self.open.last_mut() {
            file.line_offset = line.saturating_sub(next_line);
            file.number = number.unwrap_or(file.number);
        }
    }

    /// Executes `#include "file"`; a macro may supply the text.
    fn obey_include(&mut self, name: Token, rest: &[Token]) {
        let line = match rest.first() {
            Some(first) if first.kind == TokenKind::Name => self.expand_list(rest.to_vec(), 0),
            _ => rest.to_vec(),
        };
        match line[..] {
            [path] if path.kind == TokenKind::Text => {
                let quoted = self.text(path);
                let path_text = quoted[1..quoted.len() - 1].to_string();
                self.include(&path_text, path.span);
            }
            [path, ..] if path.kind == TokenKind::Text => {
                self.report_malformed(name, &line[1..], "nothing may follow the file's name");
            }
            _ => {
                self.report_malformed(name, rest, "expected `#include \"file\"`");
            }
        }
    }

    fn report_malformed(&mut self, directive: Token, rest: &[Token], expected: &str) {
        let message = format!("malformed `#{}`", self.text(directive));
        let place = match (rest.first(), rest.last()) {
            (Some(first), Some(last)) => first.span.to(last.span),
            _ => directive.span.after(),
        };
        self.report(Diagnostic::new(codes::MALFORMED_DIRECTIVE, message).at(place, expected));
    }

    /// Expects a name after `directive`.
    pub(super) fn expect_name(&mut self, directive: Token, rest: &[Token]) -> Option<Token> {
        match rest.first() {
            Some(name) if name.kind == TokenKind::Name => Some(*name),
            _ => {
                self.report_malformed(directive, &rest[..rest.len().min(1)], "expected a name");
                None
            }
        }
    }

    /// Reports tokens after a complete directive.
    pub(super) fn expect_line_end(&mut self, rest: &[Token], directive: Token) {
        if let (Some(first), Some(last)) = (rest.first(), rest.last()) {
            let message = format!("text after `#{}`", self.text(directive));
            self.report(
                Diagnostic::new(codes::TEXT_AFTER_DIRECTIVE, message)
                    .at(first.span.to(last.span), "expected the end of the line")
                    .help("make it a comment"),
            );
        }
    }
}
