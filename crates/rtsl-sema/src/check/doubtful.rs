//! Warns about text that is valid and never meant: loops without an end, rounded quotients of integers where a number
//! was meant, changes that are always 0, boxes without extent.

use std::sync::Arc;

use rtsl_ir::{Constant, Scalar};
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_spec::builtins::{Lowering, Special};
use rtsl_spec::{Method, state_variables};

use super::Checker;
use super::types::component_scalar;
use crate::hir::{
    BinaryOperator, BuiltinCall, Expression, ExpressionKind, Function, FunctionId, Loop, Statement,
    StatementKind, Type, UnaryOperator,
};
use crate::walk::{Node, parts, walk_expression, walk_statements};

/// The state variables that change over the width of a filter.
const PLACE: [&str; 3] = ["rt_TextureUV", "rt_TextureUVW", "rt_HitPoint"];

impl Checker<'_> {
    /// Warns about the text of a function. Text with errors is left alone.
    pub(super) fn check_doubtful(&mut self, id: FunctionId) {
        if self.in_prelude || self.modules.home().is_some() || self.errors > 0 {
            return;
        }
        let function = Arc::clone(self.function(id));
        let (mut loops, mut quotients, mut changes) = (Vec::new(), Vec::new(), Vec::new());
        walk_statements(&function.body, |node| match node {
            Node::Statement(statement) => {
                if let StatementKind::Loop(repeated) = &statement.kind {
                    loops.push((&**repeated, statement.span));
                }
            }
            Node::Expression(expression) => match &expression.kind {
                ExpressionKind::Convert(_) | ExpressionKind::Construct(_)
                    if component_scalar(&expression.ty) == Some(Scalar::F32) =>
                {
                    let terms = parts(expression).into_iter();
                    quotients.extend(terms.filter_map(|it| rounded_quotient(it, expression)));
                }
                ExpressionKind::Builtin(call) => {
                    if let Lowering::Special(Special::Change(_)) = call.builtin.lowering {
                        changes.push(call);
                    }
                }
                _ => {}
            },
        });
        loops.into_iter().for_each(|(repeated, span)| self.check_end(repeated, span));
        quotients.into_iter().for_each(|(span, quotient)| self.report_quotient(span, quotient));
        changes.into_iter().for_each(|call| self.check_change(call));
        if function.method == Some(Method::ComputeBounds) {
            self.check_extent(&function);
        }
    }

    /// Warns about a loop that nothing leaves.
    fn check_end(&mut self, repeated: &Loop, span: Span) {
        let Loop { declaration, condition, body, .. } = repeated;
        let is_endless = match condition {
            None => true,
            Some(condition) => {
                declaration.is_none()
                    && self.constant_scalar(condition) == Some(Constant::Bool(true))
            }
        };
        if is_endless && !leaves(body, true) {
            let diagnostic = Diagnostic::new(codes::ENDLESS_LOOP, "this loop never ends")
                .at(span, "its condition is always true, and nothing in it leaves it")
                .help("leave it by `break` or `return`, or give it a condition that becomes false");
            self.report(diagnostic);
        }
    }

    fn report_quotient(&mut self, span: Span, quotient: i64) {
        let message = format!("this quotient is {quotient}");
        let diagnostic = Diagnostic::new(codes::INTEGER_QUOTIENT, message)
            .at(span, "the quotient of integers is rounded towards 0")
            .help("divide floats: `1.0 / 2.0`");
        self.report(match quotient {
            0 => diagnostic,
            _ => diagnostic.help("convert the quotient if it is meant: `float(3 / 2)`"),
        });
    }

    /// Warns about the change of a value that is the same over the width of the filter.
    fn check_change(&mut self, call: &BuiltinCall) {
        let Some(value) = call.arguments.first() else { return };
        let mut changes = false;
        walk_expression(value, |node| {
            let Node::Expression(part) = node else { return };
            changes |= match &part.kind {
                ExpressionKind::State(id) => PLACE.contains(&state_variables()[id.0 as usize].name),
                ExpressionKind::Member(id) => self
                    .class
                    .as_ref()
                    .is_none_or(|class| class.members[id.0 as usize].storage.is_of_ray()),
                ExpressionKind::Local(_)
                | ExpressionKind::Textured(_)
                | ExpressionKind::Computed(..)
                | ExpressionKind::Call(..)
                | ExpressionKind::ReferenceCall(_)
                | ExpressionKind::Error => true,
                _ => false,
            };
        });
        if !changes {
            let name = call.builtin.name;
            let diagnostic =
                Diagnostic::new(codes::NO_CHANGE, format!("this `{name}` is always 0"))
                    .at(value.span, "the same over the width of the filter")
                    .note("changes are known of what is computed from `rt_TextureUV`, `rt_TextureUVW` and `rt_HitPoint`")
                    .note("members and attributes are constants in this respect");
            self.report(diagnostic);
        }
    }

    /// Warns about a `computeBounds` with a box whose least corner is beyond the greatest, where both are known: they are
    /// constants, or the parameters that they depend on have defaults.
    fn check_extent(&mut self, function: &Function) {
        let (Some(least), Some(greatest)) =
            (corner(function, "rt_BoundMin"), corner(function, "rt_BoundMax"))
        else {
            return;
        };
        let values = [least, greatest].map(|it| self.evaluate_with_defaults(it));
        let [Some(low), Some(high)] = values else { return };
        let float = |value: &Constant| match value {
            Constant::F32(value) => *value,
            _ => 0.0,
        };
        if low.iter().zip(high.iter()).any(|(low, high)| float(low) > float(high)) {
            let diagnostic = Diagnostic::new(codes::NO_EXTENT, "no ray meets this box")
                .at(least.span, "a coordinate of the least corner is beyond")
                .label(greatest.span, "that of the greatest corner");
            let diagnostic = match reads_members(least) || reads_members(greatest) {
                true => diagnostic.note("this is so where the parameters have their defaults"),
                false => diagnostic,
            };
            let help = "exchange them: renderers test only rays that meet the box";
            self.report(diagnostic.help(help));
        }
    }

    /// Evaluates an expression with the defaults of the parameters of the class, unless a constructor may set others.
    fn evaluate_with_defaults(&mut self, expression: &Expression) -> Option<Vec<Constant>> {
        let class = self.class.as_ref().filter(|class| class.constructor.is_none());
        let members = class.map_or(&[][..], |class| &class.members);
        let evaluator = self.evaluator(self.evaluation_fuel).with_defaults(members);
        let (value, spent) = evaluator.without_calls().evaluate(expression);
        self.evaluation_fuel -= spent;
        value.ok()
    }
}

/// True if the value of an expression depends on members.
fn reads_members(expression: &Expression) -> bool {
    let mut reads = false;
    walk_expression(expression, |node| {
        reads |=
            matches!(node, Node::Expression(it) if matches!(it.kind, ExpressionKind::Member(_)));
    });
    reads
}

/// True if a statement of the list leaves the loop around it: a `return`, or a `break` of that loop.
fn leaves(list: &[Statement], is_own: bool) -> bool {
    list.iter().any(|statement| match &statement.kind {
        StatementKind::Return(_) => true,
        StatementKind::Break => is_own,
        StatementKind::Block(body) => leaves(body, is_own),
        StatementKind::If { then, otherwise, .. } => {
            leaves(then, is_own) || leaves(otherwise, is_own)
        }
        StatementKind::Switch { cases, .. } => cases.iter().any(|case| leaves(&case.body, false)),
        StatementKind::Loop(inner) => leaves(&inner.body, false),
        StatementKind::Illuminance(inner) => leaves(&inner.body, false),
        StatementKind::Expression(_)
        | StatementKind::Declare(..)
        | StatementKind::Print { .. }
        | StatementKind::Continue => false,
    })
}

/// The span and the value of a quotient of constants with a remainder, where the terms of an integer have one that
/// becomes the float `whole` or a part of it. A quotient other than 0 may be meant where the text writes the
/// conversion, `float(7 / 2)`, and in products: `7 / 2 * 2` is the even number below.
fn rounded_quotient(value: &Expression, whole: &Expression) -> Option<(Span, i64)> {
    let is_implicit = match whole.kind {
        ExpressionKind::Convert(_) => whole.span == value.span,
        _ => !matches!(whole.ty, Type::Scalar(_)),
    };
    let mut open = vec![(value, is_implicit)];
    while let Some((term, must_be_exact)) = open.pop() {
        match &term.kind {
            ExpressionKind::Binary(BinaryOperator::Divide, above, below) => {
                if let (Some(above), Some(below)) = (integer(above), integer(below))
                    && let Some(quotient) = above.checked_div(below)
                    && quotient * below != above
                    && (must_be_exact || quotient == 0)
                {
                    return Some((term.span, quotient));
                }
            }
            ExpressionKind::Binary(
                operator @ (BinaryOperator::Add
                | BinaryOperator::Subtract
                | BinaryOperator::Multiply),
                left,
                right,
            ) => {
                let must_be_exact = must_be_exact && *operator != BinaryOperator::Multiply;
                open.extend([(&**left, must_be_exact), (right, must_be_exact)]);
            }
            ExpressionKind::Unary(_, operand) => open.push((operand, must_be_exact)),
            _ => {}
        }
    }
    None
}

/// The value of a constant integer.
fn integer(expression: &Expression) -> Option<i64> {
    match &expression.kind {
        ExpressionKind::Constant(values) => match values[..] {
            [Constant::I32(value)] => Some(i64::from(value)),
            [Constant::U32(value)] => Some(i64::from(value)),
            _ => None,
        },
        ExpressionKind::Unary(UnaryOperator::Negate, operand)
            if operand.ty == Type::Scalar(Scalar::I32) =>
        {
            Some(-integer(operand)?)
        }
        _ => None,
    }
}

/// The value of the only statement that sets a state variable, if it is one of the function itself.
fn corner<'f>(function: &'f Function, name: &str) -> Option<&'f Expression> {
    let is_target = |it: &Expression| matches!(it.kind, ExpressionKind::State(id) if state_variables()[id.0 as usize].name == name);
    let mut uses = 0;
    walk_statements(&function.body, |node| {
        uses += usize::from(matches!(node, Node::Expression(it) if is_target(it)));
    });
    let own = function.body.iter().find_map(|statement| match &statement.kind {
        StatementKind::Expression(Expression {
            kind: ExpressionKind::Assign { target, operator: None, value },
            ..
        }) if is_target(target) => Some(&**value),
        _ => None,
    });
    own.filter(|_| uses == 1)
}
