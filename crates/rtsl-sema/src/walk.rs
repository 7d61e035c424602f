//! Traverses every statement and expression of a part of the typed tree, in no particular order and
//! without recursion.

use crate::hir::{Expression, ExpressionKind, FunctionId, Statement, StatementKind};

/// A part of the tree.
#[derive(Clone, Copy, Debug)]
pub enum Node<'h> {
    /// A statement.
    Statement(&'h Statement),
    /// An expression.
    Expression(&'h Expression),
}

/// Calls `see` for the statements and every node in them.
pub fn walk_statements<'h>(list: &'h [Statement], see: impl FnMut(Node<'h>)) {
    walk(list.iter().map(Node::Statement).collect(), see);
}

/// Calls `see` for the expression and every node in it.
pub fn walk_expression<'h>(expression: &'h Expression, see: impl FnMut(Node<'h>)) {
    walk(vec![Node::Expression(expression)], see);
}

/// Calls `see` for the nodes and every node in them.
pub fn walk<'h>(mut open: Vec<Node<'h>>, mut see: impl FnMut(Node<'h>)) {
    while let Some(node) = open.pop() {
        see(node);
        match node {
            Node::Statement(statement) => push_parts_of_statement(statement, &mut open),
            Node::Expression(expression) => {
                open.extend(parts(expression).into_iter().map(Node::Expression));
            }
        }
    }
}

fn push_parts_of_statement<'h>(statement: &'h Statement, open: &mut Vec<Node<'h>>) {
    match &statement.kind {
        StatementKind::Expression(value) => open.push(Node::Expression(value)),
        StatementKind::Declare(_, value) | StatementKind::Return(value) => {
            open.extend(value.as_ref().map(Node::Expression));
        }
        StatementKind::Block(list) => open.extend(list.iter().map(Node::Statement)),
        StatementKind::If { condition, then, otherwise } => {
            open.push(Node::Expression(condition));
            open.extend(then.iter().chain(otherwise).map(Node::Statement));
        }
        StatementKind::Switch { selector, cases } => {
            open.push(Node::Expression(selector));
            open.extend(cases.iter().flat_map(|case| &case.body).map(Node::Statement));
        }
        StatementKind::Loop(repeat) => {
            open.extend(repeat.initializer.iter().chain(&repeat.body).map(Node::Statement));
            open.extend(repeat.condition.iter().chain(&repeat.step).map(Node::Expression));
        }
        StatementKind::Illuminance(illuminance) => {
            open.extend(illuminance.point.as_ref().map(Node::Expression));
            if let Some((axis, angle)) = &illuminance.cone {
                open.extend([Node::Expression(axis), Node::Expression(angle)]);
            }
            open.extend(illuminance.body.iter().map(Node::Statement));
        }
        StatementKind::Print { arguments, .. } => {
            open.extend(arguments.iter().map(Node::Expression));
        }
        StatementKind::Break | StatementKind::Continue => {}
    }
}

/// Returns the operands of an expression.
pub fn parts(expression: &Expression) -> Vec<&Expression> {
    match &expression.kind {
        ExpressionKind::Constant(_)
        | ExpressionKind::Local(_)
        | ExpressionKind::Member(_)
        | ExpressionKind::Textured(_)
        | ExpressionKind::Computed(..)
        | ExpressionKind::State(_)
        | ExpressionKind::Error => Vec::new(),
        ExpressionKind::Swizzle(a, _)
        | ExpressionKind::Field(a, _)
        | ExpressionKind::Convert(a)
        | ExpressionKind::Unary(_, a)
        | ExpressionKind::Step { target: a, .. }
        | ExpressionKind::IsSet(a)
        | ExpressionKind::Length(a) => vec![a],
        ExpressionKind::Index(a, b)
        | ExpressionKind::Binary(_, a, b)
        | ExpressionKind::And(a, b)
        | ExpressionKind::Or(a, b)
        | ExpressionKind::Sequence(a, b)
        | ExpressionKind::Assign { target: a, value: b, .. } => vec![a, b],
        ExpressionKind::Conditional(a, b, c) => vec![a, b, c],
        ExpressionKind::Construct(list) | ExpressionKind::Call(_, list) => list.iter().collect(),
        ExpressionKind::Builtin(call) => call.arguments.iter().collect(),
        ExpressionKind::ReferenceCall(call) => {
            let values = call.arguments.iter().map(|argument| &argument.value);
            std::iter::once(&call.reference).chain(values).collect()
        }
    }
}

/// Returns the function that an expression calls, with its arguments: the module's own or the prelude's.
pub fn called(expression: &Expression) -> Option<(FunctionId, &[Expression])> {
    match &expression.kind {
        ExpressionKind::Call(function, arguments) => Some((*function, arguments)),
        ExpressionKind::Computed(_, function) => Some((*function, &[])),
        ExpressionKind::Builtin(call) => call.prelude.map(|function| (function, &*call.arguments)),
        _ => None,
    }
}
