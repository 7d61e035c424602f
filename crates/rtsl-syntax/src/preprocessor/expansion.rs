//! Macro expansion.

use std::collections::HashMap;
use std::rc::Rc;

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};

use super::Preprocessor;
use super::macros::Macro;
use crate::lexer::lex;
use crate::message::shorten;
use crate::symbol::Symbol;
use crate::token::{Punctuator, Token, TokenKind};

/// The maximum nesting of macro calls in the arguments of macro calls.
const MAX_ARGUMENT_DEPTH: usize = 64;

/// A source of tokens: expansions in progress, then the open files if `files` is set.
pub(super) struct Input {
    expansions: Vec<Expansion>,
    files: bool,
    depth: usize,
}

/// The replacement tokens of a macro, and the position of the next one to read.
struct Expansion {
    tokens: Vec<Token>,
    position: usize,
    /// The macro, which is not expanded again inside its own expansion.
    of: Option<Symbol>,
}

impl Input {
    /// Reads from the open files, from their current positions on.
    pub fn files() -> Self {
        Input { expansions: Vec::new(), files: true, depth: 0 }
    }

    /// Reads these tokens only.
    fn list(tokens: Vec<Token>, depth: usize) -> Self {
        Input { expansions: vec![Expansion { tokens, position: 0, of: None }], files: false, depth }
    }
}

/// An argument of a macro call.
#[derive(Default)]
struct Argument {
    raw: Vec<Token>,
    expanded: Option<Vec<Token>>,
}

impl Preprocessor<'_> {
    /// Returns the next token with macros expanded.
    pub(super) fn next_expanded(&mut self, input: &mut Input) -> Option<Token> {
        loop {
            let token = self.next_raw(input)?;
            if token.kind != TokenKind::Name || token.painted {
                return Some(token);
            }
            if self.is_built_in(token.spelling) {
                return Some(self.built_in_value(token));
            }
            if self.in_condition && token.spelling == self.names.defined {
                return Some(self.resolve_defined(token, input));
            }
            let Some(definition) = self.macros.get(&token.spelling) else { return Some(token) };
            if self.active.get(&token.spelling).is_some_and(|count| *count > 0) {
                return Some(Token { painted: true, ..token });
            }
            let definition = definition.clone();
            match self.expand(token, &definition, input) {
                Expanded::Tokens(tokens) => self.push_expansion(input, token, tokens),
                Expanded::NotACall => return Some(token),
                Expanded::Failed => {
                    // A number instead of it keeps the parser from a second error.
                    self.after_invalid = true;
                    let spelling = self.symbols.intern("0");
                    return Some(Token { kind: TokenKind::Number, spelling, ..token });
                }
            }
        }
    }

    /// Returns `tokens` with macros expanded.
    pub(super) fn expand_list(&mut self, tokens: Vec<Token>, depth: usize) -> Vec<Token> {
        let mut input = Input::list(tokens, depth);
        let mut expanded = Vec::new();
        while let Some(token) = self.next_expanded(&mut input) {
            expanded.push(token);
        }
        expanded
    }

    fn push_expansion(&mut self, input: &mut Input, name: Token, mut tokens: Vec<Token>) {
        if let Some(first) = tokens.first_mut() {
            first.spaced = name.spaced;
            first.starts_line = name.starts_line;
        }
        *self.active.entry(name.spelling).or_default() += 1;
        input.expansions.push(Expansion { tokens, position: 0, of: Some(name.spelling) });
    }

    /// Returns the next token without expanding macros.
    pub(super) fn next_raw(&mut self, input: &mut Input) -> Option<Token> {
        while let Some(innermost) = input.expansions.last_mut() {
            if self.exhausted {
                return None;
            }
            if let Some(token) = innermost.tokens.get(innermost.position) {
                innermost.position += 1;
                return Some(*token);
            }
            if let Some(name) = innermost.of
                && let Some(count) = self.active.get_mut(&name)
            {
                *count -= 1;
            }
            input.expansions.pop();
        }
        if input.files { self.next_file_token() } else { None }
    }

    fn at_left_parenthesis(&self, input: &Input) -> bool {
        let waiting = input
            .expansions
            .iter()
            .rev()
            .find_map(|expansion| expansion.tokens.get(expansion.position).copied());
        let next = waiting.or_else(|| if input.files { self.peek_file_token() } else { None });
        next.is_some_and(|token| token.is(Punctuator::LeftParenthesis))
    }

    fn expand(&mut self, name: Token, definition: &Macro, input: &mut Input) -> Expanded {
        let Some(parameters) = &definition.parameters else {
            let tokens = self.substitute(definition, &HashMap::new(), Vec::new(), name.span, 0);
            return tokens.map_or(Expanded::Failed, Expanded::Tokens);
        };
        if !self.at_left_parenthesis(input) {
            return Expanded::NotACall;
        }
        let Some((arguments, end)) = self.collect_arguments(name, input) else {
            return Expanded::Failed;
        };
        if !self.accepts_argument_count(name, definition, parameters.len(), &arguments) {
            return Expanded::Failed;
        }
        let places = parameters.iter().enumerate().map(|(i, name)| (*name, i)).collect();
        let invocation = name.span.to(end);
        self.substitute(definition, &places, arguments, invocation, input.depth)
            .map_or(Expanded::Failed, Expanded::Tokens)
    }

    /// Reads `( ... )`. Returns the arguments and the span of the closing parenthesis.
    fn collect_arguments(
        &mut self,
        name: Token,
        input: &mut Input,
    ) -> Option<(Vec<Argument>, Span)> {
        let mut arguments = vec![Argument::default()];
        self.next_raw(input);
        let mut nesting = 0_usize;
        while let Some(token) = self.next_raw(input) {
            match token.kind {
                TokenKind::Punctuator(Punctuator::RightParenthesis) if nesting == 0 => {
                    return Some((arguments, token.span));
                }
                TokenKind::Punctuator(Punctuator::Comma) if nesting == 0 => {
                    arguments.push(Argument::default());
                    continue;
                }
                TokenKind::Punctuator(Punctuator::LeftParenthesis) => nesting += 1,
                TokenKind::Punctuator(Punctuator::RightParenthesis) => nesting -= 1,
                _ => {}
            }
            if let Some(argument) = arguments.last_mut() {
                argument.raw.push(token);
            }
        }
        if !self.exhausted {
            let message =
                format!("the call of macro `{}` is never closed", shorten(self.text(name)));
            self.report(
                Diagnostic::new(codes::MACRO_ARGUMENTS, message)
                    .at(name.span, "its `(` has no `)`"),
            );
        }
        None
    }

    fn accepts_argument_count(
        &mut self,
        name: Token,
        definition: &Macro,
        expected: usize,
        arguments: &[Argument],
    ) -> bool {
        let empty = arguments.len() == 1 && arguments[0].raw.is_empty();
        let given = if empty && expected == 0 { 0 } else { arguments.len() };
        if given == expected {
            return true;
        }
        let plural = if expected == 1 { "" } else { "s" };
        let message = format!(
            "macro `{}` takes {expected} argument{plural}, but {given} {} given",
            shorten(self.text(name)),
            if given == 1 { "is" } else { "are" },
        );
        self.report(
            Diagnostic::new(codes::MACRO_ARGUMENTS, message)
                .at(name.span, "called here")
                .label(definition.span, "defined here"),
        );
        false
    }

    /// Returns the body of `definition` with its parameters replaced.
    fn substitute(
        &mut self,
        definition: &Macro,
        places: &HashMap<Symbol, usize>,
        mut arguments: Vec<Argument>,
        invocation: Span,
        depth: usize,
    ) -> Option<Vec<Token>> {
        let body: &Rc<[Token]> = &definition.body;
        let mut result: Vec<Token> = Vec::new();
        // The index in `result` at which the left operand of a `##` begins.
        let mut operand = 0;
        for (index, token) in body.iter().enumerate() {
            let after_paste = index > 0 && body[index - 1].is(Punctuator::HashHash);
            let before_paste =
                body.get(index + 1).is_some_and(|next| next.is(Punctuator::HashHash));
            if token.is(Punctuator::HashHash) {
                continue;
            }
            let place = (token.kind == TokenKind::Name).then(|| places.get(&token.spelling));
            let mut piece = match place.flatten() {
                Some(place) if after_paste || before_paste => arguments[*place].raw.clone(),
                Some(place) => self.expanded_argument(&mut arguments[*place], invocation, depth)?,
                // An invalid token keeps the span of the macro's definition, where its author can
                // fix it.
                None if matches!(token.kind, TokenKind::Invalid(_)) => vec![*token],
                None => vec![Token { span: invocation, ..*token }],
            };
            if let Some(first) = piece.first_mut() {
                first.spaced = token.spaced;
                first.starts_line = false;
            }
            if !self.spend(piece.len() + 1, invocation) {
                return None;
            }
            let start = result.len();
            if after_paste && operand < result.len() && !piece.is_empty() {
                let left = result.pop()?;
                result.push(self.paste(left, piece[0], invocation)?);
                result.extend_from_slice(&piece[1..]);
            } else {
                result.extend_from_slice(&piece);
            }
            if !after_paste {
                operand = start;
            }
        }
        Some(result)
    }

    fn expanded_argument(
        &mut self,
        argument: &mut Argument,
        invocation: Span,
        depth: usize,
    ) -> Option<Vec<Token>> {
        if argument.expanded.is_none() {
            if depth >= MAX_ARGUMENT_DEPTH {
                self.exhausted = true;
                self.report(
                    Diagnostic::new(
                        codes::EXPANSION_LIMIT,
                        format!("macro calls nested more than {MAX_ARGUMENT_DEPTH} deep"),
                    )
                    .at(invocation, "the limit is reached here; the rest is not read"),
                );
                return None;
            }
            if !self.spend(argument.raw.len(), invocation) {
                return None;
            }
            argument.expanded = Some(self.expand_list(argument.raw.clone(), depth + 1));
        }
        argument.expanded.clone()
    }

    /// Returns the token that `left ## right` forms.
    fn paste(&mut self, left: Token, right: Token, invocation: Span) -> Option<Token> {
        let text = format!("{}{}", self.text(left), self.text(right));
        if !self.spend(text.len() / 16, invocation) {
            return None;
        }
        let pasted = lex(invocation.file, &text, self.symbols);
        match pasted[..] {
            [token] if !matches!(token.kind, TokenKind::Invalid(_)) => {
                Some(Token { span: invocation, spaced: left.spaced, starts_line: false, ..token })
            }
            _ => {
                let message = format!("`##` makes `{}`, which is not a token", shorten(&text));
                self.report(
                    Diagnostic::new(codes::INVALID_PASTE, message).at(invocation, "expanded here"),
                );
                None
            }
        }
    }
}

/// The result of expanding a macro's name.
enum Expanded {
    Tokens(Vec<Token>),
    /// A function-like macro without parentheses is an ordinary name.
    NotACall,
    /// An error, already reported.
    Failed,
}
