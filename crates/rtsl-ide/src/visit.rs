//! Visits of all expressions of a function.

use rtsl_sema::hir::{Expression, ExpressionKind, Function, Statement, StatementKind};

/// Calls `visit` for each expression of a function, outer ones before inner ones.
pub(crate) fn for_each_expression(function: &Function, visit: &mut impl FnMut(&Expression)) {
    statements(&function.body, visit);
}

pub(crate) fn statements(body: &[Statement], visit: &mut impl FnMut(&Expression)) {
    for statement in body {
        match &statement.kind {
            StatementKind::Expression(value) => expression(value, visit),
            StatementKind::Declare(_, value) | StatementKind::Return(value) => {
                value.iter().for_each(|value| expression(value, visit));
            }
            StatementKind::Block(body) => statements(body, visit),
            StatementKind::If { condition, then, otherwise } => {
                expression(condition, visit);
                statements(then, visit);
                statements(otherwise, visit);
            }
            StatementKind::Switch { selector, cases } => {
                expression(selector, visit);
                cases.iter().for_each(|case| statements(&case.body, visit));
            }
            StatementKind::Loop(it) => {
                statements(&it.initializer, visit);
                it.condition.iter().chain(&it.step).for_each(|value| expression(value, visit));
                statements(&it.body, visit);
            }
            StatementKind::Illuminance(it) => {
                it.point.iter().for_each(|point| expression(point, visit));
                if let Some((axis, angle)) = &it.cone {
                    expression(axis, visit);
                    expression(angle, visit);
                }
                statements(&it.body, visit);
            }
            StatementKind::Print { arguments, .. } => {
                arguments.iter().for_each(|value| expression(value, visit));
            }
            StatementKind::Break | StatementKind::Continue => {}
        }
    }
}

/// Calls `visit` for an expression and those inside it.
pub(crate) fn expression(whole: &Expression, visit: &mut impl FnMut(&Expression)) {
    // Chains may be as long as the text.
    let (first, links) = whole.chain();
    for link in links.into_iter().rev() {
        visit(link);
        right_operand(link).into_iter().for_each(|right| expression(right, visit));
    }
    visit(first);
    for part in operands(first) {
        expression(part, visit);
    }
}

/// The right operand of a link of a chain.
pub(crate) fn right_operand(link: &Expression) -> Option<&Expression> {
    match &link.kind {
        ExpressionKind::Binary(_, _, right)
        | ExpressionKind::And(_, right)
        | ExpressionKind::Or(_, right)
        | ExpressionKind::Sequence(_, right) => Some(right),
        _ => None,
    }
}

/// The operands of an expression that is no link of a chain.
pub(crate) fn operands(expression: &Expression) -> Vec<&Expression> {
    match &expression.kind {
        ExpressionKind::Swizzle(part, _)
        | ExpressionKind::Field(part, _)
        | ExpressionKind::Convert(part)
        | ExpressionKind::Unary(_, part)
        | ExpressionKind::IsSet(part)
        | ExpressionKind::Length(part) => vec![part],
        ExpressionKind::Index(base, index) => vec![base, index],
        ExpressionKind::Construct(parts) | ExpressionKind::Call(_, parts) => parts.iter().collect(),
        ExpressionKind::Assign { target, value, .. } => vec![target, value],
        ExpressionKind::Step { target, .. } => vec![target],
        ExpressionKind::Conditional(condition, then, otherwise) => vec![condition, then, otherwise],
        ExpressionKind::Builtin(call) => call.arguments.iter().collect(),
        ExpressionKind::ReferenceCall(call) => {
            let values = call.arguments.iter().map(|argument| &argument.value);
            std::iter::once(&call.reference).chain(values).collect()
        }
        ExpressionKind::Binary(..)
        | ExpressionKind::And(..)
        | ExpressionKind::Or(..)
        | ExpressionKind::Sequence(..)
        | ExpressionKind::Constant(_)
        | ExpressionKind::Local(_)
        | ExpressionKind::Member(_)
        | ExpressionKind::Textured(_)
        | ExpressionKind::Computed(..)
        | ExpressionKind::State(_)
        | ExpressionKind::Error => Vec::new(),
    }
}
