//! C++ statements as trees, and their layout.

use crate::expression::{Expression, INDENT, Room};

/// The greatest indentation of nested blocks.
const MAX_INDENT: usize = 40;

/// A statement.
#[derive(Clone, Debug)]
pub(crate) enum Statement {
    /// `const float name = value;`, without `const` if it is assigned later.
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
    /// `break` out of the innermost loop if the condition is true.
    BreakIf(Expression),
    /// `{ ... }`
    Block(Vec<Statement>),
    Return(Expression),
}

/// Appends the lines of the statements.
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

/// Appends `if (condition) { ... } else if ...`, after the margin.
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
