//! C++ statements as trees, and how they are laid out.

use crate::expression::{Expression, INDENT, Room};

/// Blocks that lie deeper are not indented further.
const MAX_INDENT: usize = 40;

/// A statement.
#[derive(Clone, Debug)]
pub(crate) enum Statement {
    /// `const float name = value;`, or without `const` where it is assigned to later.
    Define {
        is_constant: bool,
        type_name: String,
        name: String,
        value: Option<Expression>,
    },
    /// `target = value;`
    Assign {
        target: String,
        value: Expression,
    },
    /// `expression;`
    Evaluate(Expression),
    If {
        condition: Expression,
        then: Vec<Statement>,
        otherwise: Vec<Statement>,
    },
    /// `while (condition) { ... }`
    While(Expression, Vec<Statement>),
    /// `for (;;) { ... }`
    Repeat(Vec<Statement>),
    /// `break` out of the innermost loop where the condition holds.
    BreakIf(Expression),
    /// `{ ... }`
    Block(Vec<Statement>),
    Return(Expression),
}

/// Appends the statements' lines.
pub(crate) fn write_statements(statements: &[Statement], indentation: usize, text: &mut String) {
    for statement in statements {
        write_statement(statement, indentation, text);
    }
}

fn write_statement(statement: &Statement, indentation: usize, text: &mut String) {
    let margin = " ".repeat(indentation);
    match statement {
        Statement::Define { is_constant, type_name, name, value } => {
            let constant = if *is_constant { "const " } else { "" };
            let declaration = format!("{constant}{type_name} {name}");
            match value {
                Some(value) => {
                    write_with_value(&format!("{declaration} = "), value, indentation, text)
                }
                None => text.push_str(&format!("{margin}{declaration};\n")),
            }
        }
        Statement::Assign { target, value } => {
            write_with_value(&format!("{target} = "), value, indentation, text);
        }
        Statement::Evaluate(value) => write_with_value("", value, indentation, text),
        Statement::If { condition, then, otherwise } => {
            text.push_str(&margin);
            write_if(condition, then, otherwise, indentation, text);
        }
        Statement::While(condition, body) => {
            let room =
                Room { column: indentation + 7, indentation: indentation + INDENT, after: 3 };
            let condition = condition.lay_out(room);
            text.push_str(&format!("{margin}while ({condition}) {{\n"));
            write_statements(body, deeper(indentation), text);
            text.push_str(&format!("{margin}}}\n"));
        }
        Statement::Repeat(body) => {
            text.push_str(&format!("{margin}for (;;) {{\n"));
            write_statements(body, deeper(indentation), text);
            text.push_str(&format!("{margin}}}\n"));
        }
        Statement::BreakIf(condition) => {
            let room =
                Room { column: indentation + 4, indentation: indentation + INDENT, after: 9 };
            let condition = condition.lay_out(room);
            text.push_str(&format!("{margin}if ({condition}) break;\n"));
        }
        Statement::Block(body) => {
            text.push_str(&format!("{margin}{{\n"));
            write_statements(body, deeper(indentation), text);
            text.push_str(&format!("{margin}}}\n"));
        }
        Statement::Return(value) => write_with_value("return ", value, indentation, text),
    }
}

/// `if (condition) { ... } else if ...`, from behind the margin.
fn write_if(
    condition: &Expression,
    then: &[Statement],
    otherwise: &[Statement],
    indentation: usize,
    text: &mut String,
) {
    let margin = " ".repeat(indentation);
    let room = Room { column: indentation + 4, indentation: indentation + INDENT, after: 3 };
    let condition = condition.lay_out(room);
    text.push_str(&format!("if ({condition}) {{\n"));
    write_statements(then, deeper(indentation), text);
    match otherwise {
        [] => {}
        [Statement::If { condition, then, otherwise }] => {
            text.push_str(&format!("{margin}}} else "));
            return write_if(condition, then, otherwise, indentation, text);
        }
        otherwise => {
            text.push_str(&format!("{margin}}} else {{\n"));
            write_statements(otherwise, deeper(indentation), text);
        }
    }
    text.push_str(&format!("{margin}}}\n"));
}

fn write_with_value(start: &str, value: &Expression, indentation: usize, text: &mut String) {
    let column = indentation + start.len();
    let value = value.lay_out(Room { column, indentation: indentation + INDENT, after: 1 });
    text.push_str(&format!("{}{start}{value};\n", " ".repeat(indentation)));
}

fn deeper(indentation: usize) -> usize {
    (indentation + INDENT).min(MAX_INDENT.max(indentation))
}
