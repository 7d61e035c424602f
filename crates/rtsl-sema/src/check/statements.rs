//! Statements.

use std::collections::BTreeMap;

use rtsl_ir::{Constant, Scalar};
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_syntax::ast::{self, StatementKind as Ast};

use super::Checker;
use super::facts::UseKind;
use super::functions::Kind;
use super::types::{BOOL, FLOAT, VEC3};
use crate::hir::{
    Expression, Illuminance, LocalId, Loop, Statement, StatementKind, SwitchCase, Type,
};

/// A full turn in radians, with a margin for rounded constants.
const LARGEST_ANGLE: f32 = 6.3;

/// A checked statement: its tree, or `None` if it is empty, and whether control can continue after
/// it.
struct Checked {
    kind: Option<StatementKind>,
    falls_through: bool,
}

impl Checked {
    fn plain(kind: StatementKind) -> Checked {
        Checked { kind: Some(kind), falls_through: true }
    }

    fn jump(kind: StatementKind) -> Checked {
        Checked { kind: Some(kind), falls_through: false }
    }

    fn nothing() -> Checked {
        Checked { kind: None, falls_through: true }
    }
}

impl Checker<'_> {
    /// Checks the statements of a block in the innermost scope. The result is true if control
    /// reaches their end.
    pub(super) fn check_statements(
        &mut self,
        statements: &[ast::Statement],
    ) -> (Vec<Statement>, bool) {
        let mut checked = Vec::new();
        let mut jump: Option<Span> = None;
        let mut warned = false;
        self.check_stray_semicolons(statements);
        for statement in statements {
            if let Some(jump) = jump
                && !warned
                && !matches!(statement.kind, Ast::Empty)
            {
                self.report_unreachable(statement.span, jump);
                warned = true;
            }
            if !self.check_statement_into(statement, &mut checked) && jump.is_none() {
                jump = Some(statement.span);
            }
        }
        (checked, jump.is_none())
    }

    /// Checks `statement` and appends its tree. Returns true if control can continue after it.
    fn check_statement_into(
        &mut self,
        statement: &ast::Statement,
        statements: &mut Vec<Statement>,
    ) -> bool {
        match &statement.kind {
            Ast::Variables(variables) => {
                self.check_locals(variables, statements);
                return true;
            }
            Ast::Struct(declaration, variables) => {
                self.declare_struct(declaration);
                self.check_locals(variables, statements);
                return true;
            }
            _ => {}
        }
        let checked = self.check_statement(statement);
        if let Some(kind) = checked.kind {
            statements.push(Statement { kind, span: statement.span });
        }
        checked.falls_through
    }

    fn check_locals(&mut self, variables: &[ast::Variable], statements: &mut Vec<Statement>) {
        for variable in variables {
            if let Some(kind) = self.check_local(variable) {
                statements.push(Statement { kind, span: variable.span });
            }
        }
    }

    fn check_statement(&mut self, statement: &ast::Statement) -> Checked {
        match &statement.kind {
            Ast::Empty | Ast::Variables(_) | Ast::Struct(..) => Checked::nothing(),
            Ast::Assertion(assertion) => {
                self.check_assertion(assertion);
                Checked::nothing()
            }
            Ast::Print(print) => Checked { kind: self.check_print(print), falls_through: true },
            Ast::Expression(expression) => self.check_expression_statement(expression),
            Ast::Function(function) => self.check_nested_function(function),
            Ast::Block(block) => self.check_block(block),
            Ast::If { condition, then, otherwise } => {
                self.check_if(condition, then, otherwise.as_deref())
            }
            Ast::Switch { selector, cases } => self.check_switch(selector, cases),
            Ast::For { initializer, condition, step, body } => {
                self.check_for(initializer, condition.as_ref(), step.as_ref(), body)
            }
            Ast::While { condition, body } => self.check_while(condition, body),
            Ast::DoWhile { body, condition } => self.check_do_while(body, condition),
            Ast::Illuminance { arguments, body } => {
                self.check_illuminance(arguments, body, statement.span)
            }
            Ast::Return(value) => self.check_return(value.as_ref(), statement.span),
            Ast::Break => self.check_break(statement.span),
            Ast::Continue => self.check_continue(statement.span),
        }
    }

    fn check_expression_statement(&mut self, expression: &ast::Expression) -> Checked {
        let checked = self.check_expression(expression);
        self.check_statement_effect(expression, &checked);
        Checked::plain(StatementKind::Expression(checked))
    }

    fn check_nested_function(&mut self, function: &ast::Function) -> Checked {
        self.report(
            Diagnostic::new(
                codes::NESTED_FUNCTION,
                format!("`{}` is declared inside a function", function.name.name),
            )
            .at(function.span, "functions must be at file scope or in a class"),
        );
        Checked::nothing()
    }

    fn check_block(&mut self, block: &ast::Block) -> Checked {
        self.scopes.push();
        let (statements, falls_through) = self.check_statements(&block.statements);
        self.close_scope();
        Checked { kind: Some(StatementKind::Block(statements)), falls_through }
    }

    /// Checks a single statement in the position of a block, in a new scope.
    fn check_body(&mut self, body: &ast::Statement) -> (Vec<Statement>, bool) {
        self.scopes.push();
        self.check_body_in_scope(body)
    }

    /// Checks the body of a `for` or `while`, which cannot redeclare names of the loop's header.
    fn check_loop_body(&mut self, body: &ast::Statement) -> (Vec<Statement>, bool) {
        self.scopes.push_body();
        self.check_body_in_scope(body)
    }

    /// Checks a body in the innermost scope, and closes that scope.
    fn check_body_in_scope(&mut self, body: &ast::Statement) -> (Vec<Statement>, bool) {
        let mut statements = Vec::new();
        let falls_through = match &body.kind {
            Ast::Block(block) => {
                let (block, falls_through) = self.check_statements(&block.statements);
                statements = block;
                falls_through
            }
            _ => self.check_statement_into(body, &mut statements),
        };
        self.close_scope();
        (statements, falls_through)
    }

    /// Checks a condition, which must be a bool.
    pub(super) fn check_condition(&mut self, condition: &ast::Expression) -> Expression {
        let checked = self.check_expression(condition);
        if let ast::ExpressionKind::Assign { operator: None, .. } = condition.kind
            && !matches!(checked.ty, BOOL | Type::Error)
        {
            return self.report_assignment_as_condition(&checked);
        }
        self.expect_type(checked, &BOOL, "a condition")
    }

    fn check_if(
        &mut self,
        condition: &ast::Expression,
        then: &ast::Statement,
        otherwise: Option<&ast::Statement>,
    ) -> Checked {
        let condition = self.check_condition(condition);
        if otherwise.is_none() {
            self.check_if_body(&condition, then);
        }
        let (then, then_falls) = self.conditionally(|checker| checker.check_body(then));
        let (otherwise, otherwise_falls) = match otherwise {
            Some(body) => self.conditionally(|checker| checker.check_body(body)),
            None => (Vec::new(), true),
        };
        Checked {
            kind: Some(StatementKind::If { condition, then, otherwise }),
            falls_through: then_falls || otherwise_falls,
        }
    }

    fn check_switch(&mut self, selector: &ast::Expression, cases: &[ast::SwitchCase]) -> Checked {
        let selector = self.check_expression(selector);
        let selects = match selector.ty {
            Type::Scalar(scalar @ (Scalar::I32 | Scalar::U32)) => Some(scalar),
            Type::Error => None,
            _ => {
                self.report_mismatch("a selector", "`int` or `uint`", &selector);
                None
            }
        };
        self.scopes.push();
        self.function.switch_depth += 1;
        let mut labels = BTreeMap::new();
        let mut checked = Vec::new();
        let mut last_falls = true;
        for case in cases {
            let value = self.check_label(case, selects, &mut labels);
            let (body, falls) =
                self.conditionally(|checker| checker.check_statements(&case.statements));
            last_falls = falls;
            checked.push(SwitchCase { value, body });
        }
        self.function.switch_depth -= 1;
        self.close_scope();
        let has_default = cases.iter().any(|case| case.label.is_none());
        let leaves = checked.iter().any(|case| breaks(&case.body));
        Checked {
            kind: Some(StatementKind::Switch { selector, cases: checked }),
            falls_through: last_falls || !has_default || leaves,
        }
    }

    /// Checks the value of a label, which no other label of the switch may have.
    fn check_label(
        &mut self,
        case: &ast::SwitchCase,
        selects: Option<Scalar>,
        labels: &mut BTreeMap<Option<u32>, Span>,
    ) -> Option<Constant> {
        let value = match &case.label {
            Some(label) => Some(self.check_label_value(label, selects)?),
            None => None,
        };
        let key = value.map(Constant::bits);
        if let Some(&first) = labels.get(&key) {
            let what = match value {
                Some(Constant::I32(value)) => format!("`case {value}`"),
                Some(value) => format!("`case {}u`", value.bits()),
                None => "`default`".to_owned(),
            };
            self.report(
                Diagnostic::new(codes::DUPLICATE_LABEL, format!("{what} occurs twice"))
                    .at(case.span, "occurs again here")
                    .label(first, "occurs first here"),
            );
        } else {
            labels.insert(key, case.span);
        }
        value
    }

    fn check_label_value(
        &mut self,
        label: &ast::Expression,
        selects: Option<Scalar>,
    ) -> Option<Constant> {
        let checked = self.check_expression(label);
        let scalar = match checked.ty {
            Type::Scalar(scalar @ (Scalar::I32 | Scalar::U32)) => scalar,
            Type::Error => return None,
            _ => {
                self.report_mismatch("a label", "`int` or `uint`", &checked);
                return None;
            }
        };
        let value = self.evaluate_constant(&checked, "a label")?;
        let bits = value[0].bits();
        // GLSL converts the int side if the two differ; the bits remain.
        Some(Constant::from_bits(selects.unwrap_or(scalar), bits))
    }

    fn check_for(
        &mut self,
        initializer: &ast::Statement,
        condition: Option<&ast::Condition>,
        step: Option<&ast::Expression>,
        body: &ast::Statement,
    ) -> Checked {
        self.scopes.push();
        let mut statements = Vec::new();
        self.check_statement_into(initializer, &mut statements);
        let checked = self.repeatedly(|checker| {
            let (declaration, condition) = checker.check_loop_condition(condition);
            let (body, _) = checker.check_loop_body(body);
            let step = step.map(|step| {
                let checked = checker.check_expression(step);
                checker.check_statement_effect(step, &checked);
                checked
            });
            Loop { initializer: statements, declaration, condition, step, body, test_last: false }
        });
        self.close_scope();
        self.check_loop_effect(&checked, body);
        self.loop_statement(checked)
    }

    fn check_while(&mut self, condition: &ast::Condition, body: &ast::Statement) -> Checked {
        self.scopes.push();
        let checked = self.repeatedly(|checker| {
            let (declaration, condition) = checker.check_loop_condition(Some(condition));
            let (body, _) = checker.check_loop_body(body);
            let initializer = Vec::new();
            Loop { initializer, declaration, condition, step: None, body, test_last: false }
        });
        self.close_scope();
        self.check_loop_effect(&checked, body);
        self.loop_statement(checked)
    }

    fn check_do_while(&mut self, body: &ast::Statement, condition: &ast::Expression) -> Checked {
        let checked = self.repeatedly(|checker| {
            let (body, _) = checker.check_body(body);
            let condition = Some(checker.check_condition(condition));
            let initializer = Vec::new();
            Loop { initializer, declaration: None, condition, step: None, body, test_last: true }
        });
        self.loop_statement(checked)
    }

    /// Builds a loop. Control continues after an endless loop only through a `break`.
    fn loop_statement(&mut self, checked: Loop) -> Checked {
        let endless = match &checked.condition {
            None => true,
            Some(condition) => {
                checked.declaration.is_none()
                    && matches!(self.constant_scalar(condition), Some(Constant::Bool(true)))
            }
        };
        let falls_through = !endless || breaks(&checked.body);
        Checked { kind: Some(StatementKind::Loop(Box::new(checked))), falls_through }
    }

    fn check_loop_condition(
        &mut self,
        condition: Option<&ast::Condition>,
    ) -> (Option<LocalId>, Option<Expression>) {
        match condition {
            None => (None, None),
            Some(ast::Condition::Expression(condition)) => {
                (None, Some(self.check_condition(condition)))
            }
            Some(ast::Condition::Declaration(variable)) => self.check_condition_variable(variable),
        }
    }

    fn check_condition_variable(
        &mut self,
        variable: &ast::Variable,
    ) -> (Option<LocalId>, Option<Expression>) {
        match self.check_local(variable) {
            Some(StatementKind::Declare(id, Some(value))) => {
                // The loop tests the variable, so it counts as used.
                self.function.local_info[id.0 as usize].used = true;
                let value = self.expect_type(value, &BOOL, "a condition");
                (Some(id), Some(value))
            }
            Some(_) => {
                self.report(
                    Diagnostic::new(
                        codes::BAD_INITIALIZER,
                        format!("`{}` has no value to test", variable.name.name),
                    )
                    .at(variable.span, "expected `= ...`"),
                );
                (None, None)
            }
            None => (None, None),
        }
    }

    fn check_illuminance(
        &mut self,
        arguments: &[ast::Expression],
        body: &ast::Statement,
        span: Span,
    ) -> Checked {
        if self.function.kind == Kind::ClassFunction {
            self.note_use(UseKind::Illuminance, span);
        } else {
            self.report(
                Diagnostic::new(
                    codes::OUT_OF_PLACE,
                    "`illuminance` is allowed in methods of materials only",
                )
                .at(span, "not in a function at file scope")
                .help("make the function a member of the class"),
            );
        }
        let (point, cone) = self.check_illuminance_arguments(arguments, span);
        self.function.illuminance_depth += 1;
        let (body, _) = self.repeatedly(|checker| checker.check_body(body));
        self.function.illuminance_depth -= 1;
        Checked::plain(StatementKind::Illuminance(Box::new(Illuminance { point, cone, body })))
    }

    #[allow(clippy::type_complexity, reason = "the tree's own shape")]
    fn check_illuminance_arguments(
        &mut self,
        arguments: &[ast::Expression],
        span: Span,
    ) -> (Option<Expression>, Option<(Expression, Expression)>) {
        let types: &[Type] = match arguments.len() {
            0 => &[],
            1 => &[VEC3],
            3 => &[VEC3, VEC3, FLOAT],
            count => {
                self.report(
                    Diagnostic::new(
                        codes::ILLUMINANCE_ARGUMENTS,
                        format!("`illuminance` takes 0, 1 or 3 arguments, not {count}"),
                    )
                    .at(span, "")
                    .note("it is `illuminance`, `illuminance(P)` or `illuminance(P, N, angle)`"),
                );
                return (None, None);
            }
        };
        let mut checked = Vec::new();
        for (argument, ty) in arguments.iter().zip(types) {
            let argument = self.check_expression(argument);
            checked.push(self.expect_type(argument, ty, "an argument of `illuminance`"));
        }
        if let [_, _, angle] = checked.as_slice() {
            self.check_angle(angle);
        }
        let mut checked = checked.into_iter();
        (checked.next(), checked.next().zip(checked.next()))
    }

    /// Warns about a constant angle that cannot be in radians.
    fn check_angle(&mut self, angle: &Expression) {
        let value = match self.constant_scalar(angle) {
            Some(Constant::F32(value)) if value > LARGEST_ANGLE => value,
            _ => return,
        };
        self.report(
            Diagnostic::new(
                codes::ANGLE_IN_DEGREES,
                format!(
                    "`illuminance` takes an angle in radians, and {value} is more than a full turn"
                ),
            )
            .at(angle.span, "every light is within this angle")
            .suggest(
                "if the angle is in degrees",
                angle.span,
                format!("radians({value:?})"),
            ),
        );
    }

    fn check_return(&mut self, value: Option<&ast::Expression>, span: Span) -> Checked {
        let result = self.function.result.clone();
        let Some(value) = value else {
            if result != Type::Void {
                let shown = self.show_one(&result);
                self.report(
                    Diagnostic::new(codes::BAD_RETURN, "this `return` has no value")
                        .at(span, format!("expected {shown}")),
                );
                self.function.returns_value = true;
            }
            return Checked::jump(StatementKind::Return(None));
        };
        self.function.returns_value = true;
        let value = self.check_expression(value);
        if result == Type::Void {
            if value.ty != Type::Error {
                self.report(
                    Diagnostic::new(codes::BAD_RETURN, "this function returns no value")
                        .at(value.span, "expected `return;`"),
                );
            }
            return Checked::jump(StatementKind::Return(None));
        }
        let value = self.expect_type(value, &result, "the result");
        Checked::jump(StatementKind::Return(Some(value)))
    }

    fn check_break(&mut self, span: Span) -> Checked {
        if self.function.loop_depth == 0 && self.function.switch_depth == 0 {
            self.report_misplaced_jump("`break` is outside of any loop or switch", span);
        }
        Checked::jump(StatementKind::Break)
    }

    fn check_continue(&mut self, span: Span) -> Checked {
        if self.function.loop_depth == 0 {
            self.report_misplaced_jump("`continue` is outside of any loop", span);
        }
        Checked::jump(StatementKind::Continue)
    }

    fn report_misplaced_jump(&mut self, message: &str, span: Span) {
        self.report(Diagnostic::new(codes::MISPLACED_JUMP, message).at(span, "nothing to leave"));
    }
}

/// True if a `break` in these statements leaves the loop or switch whose body they are.
fn breaks(statements: &[Statement]) -> bool {
    statements.iter().any(|statement| match &statement.kind {
        StatementKind::Break => true,
        StatementKind::Block(body) => breaks(body),
        StatementKind::If { then, otherwise, .. } => breaks(then) || breaks(otherwise),
        StatementKind::Expression(_)
        | StatementKind::Declare(..)
        | StatementKind::Switch { .. }
        | StatementKind::Loop(_)
        | StatementKind::Illuminance(_)
        | StatementKind::Return(_)
        | StatementKind::Print { .. }
        | StatementKind::Continue => false,
    })
}
