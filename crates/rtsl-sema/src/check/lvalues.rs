//! Assignable expressions, and the effect of assignments on variables, members and state.

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_syntax::ast;

use super::Checker;
use super::access::Access;
use super::expressions::{convert, error_expression};
use super::facts::UseKind;
use super::types::holds_reference;
use crate::hir::{
    BinaryOperator, Expression, ExpressionKind, LocalId, StepOperator, Storage, Type,
};

impl Checker<'_> {
    /// Notes an access to the variable, member or state variable that a place is part of.
    pub(super) fn note_access(&mut self, place: &Expression, access: Access) {
        let root = root(place);
        match root.kind {
            ExpressionKind::Local(id) => {
                if access.reads() {
                    self.note_local_read(id, place.span);
                }
                if access.writes() {
                    self.note_local_write(id);
                }
            }
            ExpressionKind::State(id) => {
                if access.reads() {
                    self.note_use(UseKind::ReadState(id), root.span);
                }
                if access.writes() {
                    self.note_use(UseKind::WriteState(id), root.span);
                }
            }
            ExpressionKind::Member(id) => {
                let class = self.class.as_ref();
                let storage = class.map(|class| class.members[id.0 as usize].storage);
                let use_kind = match storage {
                    _ if access.writes() => Some(UseKind::WriteMember(id)),
                    Some(Storage::Attribute) => Some(UseKind::ReadAttribute(id)),
                    Some(Storage::Scratch | Storage::Output) => Some(UseKind::ReadScratch(id)),
                    Some(Storage::Public | Storage::Private) | None => None,
                };
                if let Some(kind) = use_kind {
                    self.note_use(kind, root.span);
                }
            }
            ExpressionKind::Textured(id) => {
                self.note_use(UseKind::ReadTextured(id), root.span);
            }
            ExpressionKind::Computed(id, function) => {
                self.note_use(UseKind::ReadTextured(id), root.span);
                self.note_computation(function, root.span);
            }
            _ => {}
        }
    }

    /// True if `place` may be assigned; reports the reason otherwise.
    pub(super) fn require_assignable(&mut self, place: &Expression) -> bool {
        match self.obstacle(place) {
            None => true,
            Some(diagnostic) => {
                if let Some(diagnostic) = *diagnostic {
                    self.report(diagnostic);
                }
                false
            }
        }
    }

    /// The reason why `place` may not be assigned; the inner `None` if it was reported already.
    fn obstacle(&self, place: &Expression) -> Option<Box<Option<Diagnostic>>> {
        let refuse = |diagnostic: Diagnostic| Some(Box::new(Some(diagnostic)));
        if place.ty == Type::Error {
            return Some(Box::new(None));
        }
        let mut part = place;
        loop {
            match &part.ty {
                ty if holds_reference(ty) => return refuse(reference_obstacle(place.span)),
                Type::Buffer(_) => return refuse(buffer_obstacle(place.span)),
                _ => {}
            }
            part = match &part.kind {
                ExpressionKind::Local(id) => return self.local_obstacle(*id, place.span),
                ExpressionKind::Member(_) | ExpressionKind::State(_) => return None,
                ExpressionKind::Field(base, _) | ExpressionKind::Index(base, _) => base,
                ExpressionKind::Swizzle(base, components) => {
                    if repeats(components) {
                        return refuse(
                            Diagnostic::new(
                                codes::NOT_ASSIGNABLE,
                                "a component occurs twice in this target",
                            )
                            .at(part.span, "each component can be assigned once"),
                        );
                    }
                    base
                }
                ExpressionKind::Textured(_) | ExpressionKind::Computed(..) => {
                    return refuse(textured_obstacle(place.span));
                }
                ExpressionKind::Error => return Some(Box::new(None)),
                _ => return refuse(value_obstacle(part, place.span)),
            };
        }
    }

    fn local_obstacle(&self, id: LocalId, span: Span) -> Option<Box<Option<Diagnostic>>> {
        let info = self.function.local_info[id.0 as usize];
        let name = &self.function.locals[id.0 as usize].name;
        info.read_only.then(|| {
            Box::new(Some(
                Diagnostic::new(codes::NOT_ASSIGNABLE, format!("`{name}` is `const`"))
                    .at(span, "cannot be assigned")
                    .label(info.span, "declared `const` here"),
            ))
        })
    }

    /// Checks `a = b` and `a op= b`.
    pub(super) fn check_assign(
        &mut self,
        target: &ast::Expression,
        operator: Option<BinaryOperator>,
        value: &ast::Expression,
        span: Span,
    ) -> Expression {
        let target = self.check_place(target);
        if !self.require_assignable(&target) {
            return error_expression(span);
        }
        let value = self.check_expression(value);
        let access = if operator.is_some() { Access::ReadWrite } else { Access::Write };
        self.note_access(&target, access);
        let value = match operator {
            None => {
                let ty = target.ty.clone();
                self.expect_type(value, &ty, "the target")
            }
            Some(operator) => self.check_compound_value(operator, &target, value, span),
        };
        if value.ty == Type::Error {
            return error_expression(span);
        }
        let ty = target.ty.clone();
        let kind =
            ExpressionKind::Assign { target: Box::new(target), operator, value: Box::new(value) };
        Expression { kind, ty, span }
    }

    /// Checks the right side of `a op= b`, converted as `a op b` requires. The result must have the
    /// target's type.
    fn check_compound_value(
        &mut self,
        operator: BinaryOperator,
        target: &Expression,
        value: Expression,
        span: Span,
    ) -> Expression {
        if value.ty == Type::Error {
            return value;
        }
        let Some(types) = super::operators::binary_types(operator, &target.ty, &value.ty) else {
            self.report_operands(operator, target, &value, span);
            return error_expression(span);
        };
        if types.result != target.ty || types.left != target.ty {
            let (result, expected) = (self.show(&types.result), self.show(&target.ty));
            self.report(
                Diagnostic::new(
                    codes::MISMATCHED_TYPES,
                    format!("the target is `{expected}`, but the result is `{result}`"),
                )
                .at(span, format!("expected `{expected}`, found `{result}`"))
                .label(value.span, format!("this is `{}`", self.show(&value.ty))),
            );
            return error_expression(span);
        }
        convert(value, &types.right)
    }

    /// Checks `++a`, `a--` and so on.
    pub(super) fn check_step(
        &mut self,
        target: &ast::Expression,
        by: StepOperator,
        prefix: bool,
        span: Span,
    ) -> Expression {
        let target = self.check_place(target);
        if !self.require_assignable(&target) {
            return error_expression(span);
        }
        self.note_access(&target, Access::ReadWrite);
        let steps = match &target.ty {
            Type::Scalar(scalar) | Type::Vector(scalar, _) => *scalar != rtsl_ir::Scalar::Bool,
            Type::Matrix(..) => true,
            _ => false,
        };
        if !steps {
            let name = match by {
                StepOperator::Increment => "++",
                StepOperator::Decrement => "--",
            };
            let shown = self.show(&target.ty);
            self.report(
                Diagnostic::new(
                    codes::BAD_OPERANDS,
                    format!("`{name}` does not apply to `{shown}`"),
                )
                .at(target.span, format!("this is `{shown}`")),
            );
            return error_expression(span);
        }
        let ty = target.ty.clone();
        Expression { kind: ExpressionKind::Step { target: Box::new(target), by, prefix }, ty, span }
    }
}

/// The variable, member, state variable or value that a place is part of.
pub(super) fn root(place: &Expression) -> &Expression {
    let mut part = place;
    while let ExpressionKind::Field(base, _)
    | ExpressionKind::Index(base, _)
    | ExpressionKind::Swizzle(base, _) = &part.kind
    {
        part = base;
    }
    part
}

fn repeats(components: &[u8]) -> bool {
    components.iter().enumerate().any(|(index, each)| components[..index].contains(each))
}

fn buffer_obstacle(span: Span) -> Diagnostic {
    Diagnostic::new(codes::BUFFER_READ_ONLY, "buffers cannot be written")
        .at(span, "read-only")
        .note("a buffer is data that the host binds, and that many instances may share")
}

fn reference_obstacle(span: Span) -> Diagnostic {
    Diagnostic::new(codes::REFERENCE_ASSIGNED, "only the host can set references")
        .at(span, "cannot be assigned")
}

fn textured_obstacle(span: Span) -> Diagnostic {
    Diagnostic::new(
        codes::NOT_ASSIGNABLE,
        "only the host can set a parameter that may be a texture",
    )
    .at(span, "cannot be assigned")
    .help("compute with it in a variable")
}

fn value_obstacle(part: &Expression, span: Span) -> Diagnostic {
    let what = match part.kind {
        ExpressionKind::Constant(_) => "a constant cannot be assigned",
        _ => "only variables, members and their parts can be assigned",
    };
    Diagnostic::new(codes::NOT_ASSIGNABLE, what).at(span, "not a variable")
}
