//! Prints: `print("t = {}", t);`.
//!
//! Where prints are dropped, an argument with side effects remains as a statement, so that a program computes the same
//! whether it prints or not.

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_syntax::ast;

use super::Checker;
use super::effects::has_effect;
use super::types::component_count;
use crate::hir::{Expression, Statement, StatementKind, Type};

/// The decision about the prints of a unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Prints {
    /// The typed tree has none.
    #[default]
    Dropped,
    /// The typed tree has them.
    Kept,
}

impl Checker<'_> {
    /// Checks a print and returns its statement, if anything is left of it.
    pub(super) fn check_print(&mut self, print: &ast::Print) -> Option<StatementKind> {
        let pieces = self.check_text(print);
        let arguments = print.arguments.iter().map(|argument| self.check_printed(argument));
        let arguments: Vec<Expression> = arguments.collect();
        if self.prints == Prints::Kept {
            return Some(StatementKind::Print { pieces: pieces?, arguments });
        }
        let effects = arguments.into_iter().filter(|argument| has_effect(argument, &[]));
        let statement = |argument: Expression| Statement {
            span: argument.span,
            kind: StatementKind::Expression(argument),
        };
        let effects: Vec<Statement> = effects.map(statement).collect();
        (!effects.is_empty()).then_some(StatementKind::Block(effects))
    }

    /// Splits the text at its placeholders, one for each argument.
    fn check_text(&mut self, print: &ast::Print) -> Option<Vec<String>> {
        let pieces = match pieces(&print.text) {
            Ok(pieces) => pieces,
            Err(brace) => {
                self.report_brace(brace, print.text_span);
                return None;
            }
        };
        let (places, values) = (pieces.len() - 1, print.arguments.len());
        if places == values {
            return Some(pieces);
        }
        let diagnostic = Diagnostic::new(
            codes::BAD_PRINT,
            format!("the text has {} for {}", counted(places, "`{}`"), counted(values, "value")),
        )
        .at(print.text_span, "each `{}` stands for one value")
        .help("write a `{}` for each value; `{{` and `}}` are the characters themselves");
        self.report(diagnostic);
        None
    }

    fn report_brace(&mut self, brace: char, text: Span) {
        let message = match brace {
            '{' => "a `{` in a text to print begins a `{}`",
            _ => "a `}` in a text to print ends a `{}`",
        };
        let diagnostic = Diagnostic::new(codes::BAD_PRINT, message)
            .at(text, format!("this text has a `{brace}` alone"))
            .help("values have one format, `{}`; `{{` and `}}` are the characters themselves");
        self.report(diagnostic);
    }

    /// Checks a value, which must have components that can be printed.
    fn check_printed(&mut self, argument: &ast::Expression) -> Expression {
        let checked = self.check_expression(argument);
        if component_count(&checked.ty).is_none() && checked.ty != Type::Error {
            let shown = self.show(&checked.ty);
            let diagnostic = Diagnostic::new(
                codes::NOT_PRINTABLE,
                format!("`print` does not take a value of type `{shown}`"),
            )
            .at(checked.span, format!("this is `{shown}`"))
            .help("print its fields or elements: scalars, vectors, matrices and colors");
            self.report(diagnostic);
        }
        checked
    }
}

/// Splits a text at each `{}`.
///
/// # Errors
/// A brace that is neither part of a `{}` nor doubled.
fn pieces(text: &str) -> Result<Vec<String>, char> {
    let mut pieces = vec![String::new()];
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        match (character, characters.peek()) {
            ('{', Some('}')) => {
                characters.next();
                pieces.push(String::new());
                continue;
            }
            ('{', Some('{')) | ('}', Some('}')) => {
                characters.next();
            }
            ('{' | '}', _) => return Err(character),
            _ => {}
        }
        pieces.last_mut().expect("there is a first piece").push(character);
    }
    Ok(pieces)
}

fn counted(count: usize, name: &str) -> String {
    match count {
        0 => format!("no {name}"),
        1 => format!("1 {name}"),
        _ if name.ends_with('`') => format!("{count} {name}"),
        _ => format!("{count} {name}s"),
    }
}
