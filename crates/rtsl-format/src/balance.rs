//! The requirement that brackets pair, in each branch of `#if` alone.

use rtsl_source::{Diagnostic, FileId, Span, deep_stack, diagnostic_codes as codes};

use crate::token::{Token, Trivia};

/// Checks that brackets pair, and that no branch of a conditional leaves one open or closes one from before it.
pub(crate) fn check_balance(file: FileId, tokens: &[Token<'_>]) -> Result<(), Diagnostic> {
    let mut balance = Balance { file, open: Vec::new(), conditionals: Vec::new() };
    for token in tokens {
        for trivia in token.before.iter().filter(|trivia| trivia.is_directive) {
            balance.directive(trivia, token)?;
        }
        balance.token(token)?;
    }
    match balance.open.last() {
        None => Ok(()),
        Some(open) => Err(unpaired(open, balance.span(open.start), "never closed")),
    }
}

/// The brackets and conditionals that are open.
struct Balance<'t, 'a> {
    file: FileId,
    open: Vec<&'t Token<'a>>,
    /// The number of brackets that were open at each `#if`.
    conditionals: Vec<usize>,
}

impl<'t, 'a> Balance<'t, 'a> {
    fn directive(&mut self, trivia: &Trivia<'a>, next: &Token<'a>) -> Result<(), Diagnostic> {
        let name = trivia.text.trim_start_matches(['#', ' ', '\t']);
        if name.starts_with("if") {
            self.conditionals.push(self.open.len());
            return Ok(());
        }
        let ends = name.starts_with("endif");
        if !ends && !name.starts_with("el") {
            return Ok(());
        }
        let before = if ends { self.conditionals.pop() } else { self.conditionals.last().copied() };
        match before {
            Some(before) if before != self.open.len() => {
                let place = self.open.last().map_or(next.start, |open| open.start);
                let message = "a branch of `#if` in which brackets do not pair";
                Err(Diagnostic::new(codes::UNFORMATTABLE, message)
                    .at(self.span(place), "the branch ends after this")
                    .help("let each branch contain whole statements or declarations"))
            }
            Some(_) | None => Ok(()),
        }
    }

    fn token(&mut self, token: &'t Token<'a>) -> Result<(), Diagnostic> {
        let opening = match token.text {
            "(" | "[" | "{" => {
                self.open.push(token);
                return self.check_depth(token);
            }
            ")" => "(",
            "]" => "[",
            "}" => "{",
            _ => return Ok(()),
        };
        match self.open.pop() {
            Some(open) if open.is(opening) => Ok(()),
            Some(open) => Err(unpaired(token, self.span(token.start), "closes nothing")
                .label(self.span(open.start), "the last open bracket")),
            None => Err(unpaired(token, self.span(token.start), "closes nothing")),
        }
    }

    fn check_depth(&self, token: &Token<'_>) -> Result<(), Diagnostic> {
        let limit = deep_stack::MAX_DEPTH;
        if self.open.len() <= limit {
            return Ok(());
        }
        let message = format!("nested more than {limit} deep");
        Err(Diagnostic::new(codes::NESTED_TOO_DEEPLY, message)
            .at(self.span(token.start), "too deep here"))
    }

    fn span(&self, start: usize) -> Span {
        Span::new(self.file, start as u32, start as u32 + 1)
    }
}

fn unpaired(bracket: &Token<'_>, span: Span, label: &str) -> Diagnostic {
    let message = format!("`{}` without its pair", bracket.text);
    Diagnostic::new(codes::UNCLOSED_DELIMITER, message).at(span, label)
}
