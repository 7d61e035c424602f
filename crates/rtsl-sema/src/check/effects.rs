//! Statements that have no effect: `x == 2.0;`, `if (x > 0.5);`, `while (x < 5.0);`.

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_spec::builtins::{Builtin, Lowering, Special, Usable};
use rtsl_syntax::ast::{self, StatementKind as Ast};

use super::Checker;
use super::expressions::error_expression;
use super::lvalues::root;
use crate::hir::{
    BinaryOperator, BuiltinCall, Expression, ExpressionKind, LocalId, Loop, Statement,
    StatementKind,
};

/// The maximum distance in characters between a condition and a `;` after it that is taken for a
/// mistake: a parenthesis and a space. A greater distance may be a macro that expands to nothing,
/// or an intentional `;` on its own line.
const CLOSE: u32 = 2;

impl Checker<'_> {
    /// Warns about a statement, or the step of a loop, that does nothing.
    pub(super) fn check_statement_effect(
        &mut self,
        written: &ast::Expression,
        checked: &Expression,
    ) {
        match (&written.kind, &checked.kind) {
            // The first operand was judged when the sequence was checked.
            (ast::ExpressionKind::Sequence(_, written), ExpressionKind::Sequence(_, checked)) => {
                self.check_statement_effect(written, checked);
            }
            _ => self.check_effect(checked),
        }
    }

    /// Warns about an expression without side effects whose value is not used.
    pub(super) fn check_effect(&mut self, expression: &Expression) {
        if has_effect(expression, &[]) {
            return;
        }
        let mut diagnostic =
            no_effect("this has no effect", expression.span, "its value is not used");
        if let ExpressionKind::Binary(BinaryOperator::Equal, left, _) = &expression.kind
            && matches!(
                root(left).kind,
                ExpressionKind::Local(_)
                    | ExpressionKind::Member(_)
                    | ExpressionKind::Textured(_)
                    | ExpressionKind::Computed(..)
                    | ExpressionKind::State(_)
            )
        {
            diagnostic = diagnostic.help("`==` compares; to assign, write `=`");
        }
        self.report(diagnostic);
    }

    /// Warns about an `if` whose body is a `;` directly after the condition.
    pub(super) fn check_if_body(&mut self, condition: &Expression, then: &ast::Statement) {
        if matches!(then.kind, Ast::Empty) && follows(then.span, condition.span) {
            self.report(
                no_effect(
                    "this `if` has an empty body",
                    then.span,
                    "nothing depends on the condition",
                )
                .suggest("remove the `;`", then.span, ""),
            );
        }
    }

    /// Warns about a `;` that ends a loop and is followed by a block, which was probably meant to
    /// be the body.
    pub(super) fn check_stray_semicolons(&mut self, statements: &[ast::Statement]) {
        for pair in statements.windows(2) {
            let (end, body) = match &pair[0].kind {
                Ast::While { condition, body } => (condition_span(condition), body),
                Ast::For { condition, step, body, .. } => {
                    let condition = condition.as_ref().map(condition_span);
                    let Some(end) = step.as_ref().map(|step| step.span).or(condition) else {
                        continue;
                    };
                    (end, body)
                }
                _ => continue,
            };
            let is_stray = matches!(body.kind, Ast::Empty)
                && matches!(pair[1].kind, Ast::Block(_))
                && follows(body.span, end);
            if is_stray {
                self.report(
                    no_effect("this loop has an empty body", body.span, "the loop ends here")
                        .label(pair[1].span, "the block is not part of it, and runs once")
                        .suggest("remove the `;`", body.span, ""),
                );
            }
        }
    }

    /// Warns about a loop whose body is a `;` and whose condition and step affect only the loop's
    /// variables.
    pub(super) fn check_loop_effect(&mut self, checked: &Loop, body: &ast::Statement) {
        // `{ }` and an endless loop without a condition are intentional.
        if !matches!(body.kind, Ast::Empty) || checked.condition.is_none() {
            return;
        }
        let own = declared(&checked.initializer);
        let parts = || checked.condition.iter().chain(&checked.step);
        if parts().any(|part| has_effect(part, &own)) || initializes(&checked.initializer) {
            return;
        }
        let changes = parts().any(|part| has_effect(part, &[]));
        let diagnostic = if changes || checked.declaration.is_some() {
            no_effect("this loop has no effect", body.span, "its body is empty")
        } else {
            no_effect("this loop does nothing, or never ends", body.span, "its body is empty")
                .note("nothing that the condition depends on changes")
        };
        self.report(diagnostic);
    }

    /// Reports an assignment as a condition: `if (x = 2.0)`.
    pub(super) fn report_assignment_as_condition(&mut self, assignment: &Expression) -> Expression {
        let shown = self.show(&assignment.ty);
        self.report(
            Diagnostic::new(
                codes::MISMATCHED_TYPES,
                format!("a condition must be `bool`, but this assignment is `{shown}`"),
            )
            .at(assignment.span, format!("expected `bool`, found `{shown}`"))
            .help("`=` assigns; to compare, write `==`"),
        );
        error_expression(assignment.span)
    }
}

fn no_effect(message: &str, span: Span, label: &str) -> Diagnostic {
    Diagnostic::new(codes::NO_EFFECT, message).at(span, label)
}

fn condition_span(condition: &ast::Condition) -> Span {
    match condition {
        ast::Condition::Expression(condition) => condition.span,
        ast::Condition::Declaration(variable) => variable.span,
    }
}

/// True if an empty statement is a `;` close after `before`. Statements with errors become empty
/// statements, too.
fn follows(statement: Span, before: Span) -> bool {
    statement.file == before.file
        && statement.end == statement.start + 1
        && statement.start.saturating_sub(before.end) <= CLOSE
}

/// The variables that the statements declare.
fn declared(statements: &[Statement]) -> Vec<LocalId> {
    let locals = statements.iter().filter_map(|statement| match &statement.kind {
        StatementKind::Declare(id, _) => Some(*id),
        _ => None,
    });
    locals.collect()
}

/// True if the initializer of a loop does more than declare variables.
fn initializes(statements: &[Statement]) -> bool {
    statements.iter().any(|statement| match &statement.kind {
        StatementKind::Declare(_, value) => {
            value.as_ref().is_some_and(|value| has_effect(value, &[]))
        }
        _ => true,
    })
}

/// True if evaluating the expression has a side effect. Assignments to `own` variables do not
/// count.
pub(super) fn has_effect(expression: &Expression, own: &[LocalId]) -> bool {
    let mut pending = vec![expression];
    while let Some(expression) = pending.pop() {
        match &expression.kind {
            // Erroneous expressions were reported.
            ExpressionKind::Error | ExpressionKind::Call(..) | ExpressionKind::ReferenceCall(_) => {
                return true;
            }
            ExpressionKind::Assign { target, value, .. } => {
                if !is_own(target, own) {
                    return true;
                }
                pending.extend([&**target, value]);
            }
            ExpressionKind::Step { target, .. } => {
                if !is_own(target, own) {
                    return true;
                }
                pending.push(target);
            }
            ExpressionKind::Builtin(call) => {
                if builtin_has_effect(call) {
                    return true;
                }
                pending.extend(&call.arguments);
            }
            ExpressionKind::Construct(arguments) => pending.extend(arguments),
            ExpressionKind::Swizzle(part, _)
            | ExpressionKind::Field(part, _)
            | ExpressionKind::Convert(part)
            | ExpressionKind::Unary(_, part)
            | ExpressionKind::IsSet(part)
            | ExpressionKind::Length(part) => pending.push(part),
            ExpressionKind::Index(first, second)
            | ExpressionKind::Binary(_, first, second)
            | ExpressionKind::And(first, second)
            | ExpressionKind::Or(first, second)
            | ExpressionKind::Sequence(first, second) => pending.extend([&**first, second]),
            ExpressionKind::Conditional(condition, then, otherwise) => {
                pending.extend([&**condition, then, otherwise]);
            }
            ExpressionKind::Constant(_)
            | ExpressionKind::Local(_)
            | ExpressionKind::Member(_)
            | ExpressionKind::Textured(_)
            | ExpressionKind::Computed(..)
            | ExpressionKind::State(_) => {}
        }
    }
    false
}

fn is_own(target: &Expression, own: &[LocalId]) -> bool {
    matches!(root(target).kind, ExpressionKind::Local(id) if own.contains(&id))
}

/// True if a built-in function calls the host, takes a random number, or sets an argument.
fn builtin_has_effect(call: &BuiltinCall) -> bool {
    let Builtin { signatures, usable, lowering, .. } = call.builtin;
    let sets = signatures.iter().any(|it| it.contains("out "));
    sets || *usable != Usable::Anywhere || *lowering == Lowering::Special(Special::Rand)
}
