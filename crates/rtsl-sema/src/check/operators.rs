//! Operators: their operand types and result types.

use rtsl_ir::Scalar;
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_syntax::ast;

use super::Checker;
use super::expressions::{at, convert, error_expression};
use super::types::{BOOL, FLOAT, converts, with_scalar};
use crate::hir::{BinaryOperator, Expression, ExpressionKind, Type, UnaryOperator};

/// The types that a binary operator works with once its operands are converted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct BinaryTypes {
    pub(super) left: Type,
    pub(super) right: Type,
    pub(super) result: Type,
}

impl BinaryTypes {
    fn new(left: Type, right: Type, result: Type) -> Option<BinaryTypes> {
        Some(BinaryTypes { left, right, result })
    }
}

/// The types for `operator` with operands of these types; `None` if it does not accept them.
pub(super) fn binary_types(
    operator: BinaryOperator,
    left: &Type,
    right: &Type,
) -> Option<BinaryTypes> {
    let booleans = *left == BOOL && *right == BOOL;
    match operator {
        BinaryOperator::Add
        | BinaryOperator::Subtract
        | BinaryOperator::Multiply
        | BinaryOperator::Divide => arithmetic_types(operator, left, right),
        BinaryOperator::Remainder
        | BinaryOperator::BitAnd
        | BinaryOperator::BitOr
        | BinaryOperator::BitXor => integer_types(left, right),
        BinaryOperator::ShiftLeft | BinaryOperator::ShiftRight => shift_types(left, right),
        BinaryOperator::Less
        | BinaryOperator::LessEqual
        | BinaryOperator::Greater
        | BinaryOperator::GreaterEqual => order_types(left, right),
        BinaryOperator::Equal | BinaryOperator::NotEqual => equality_types(left, right),
        BinaryOperator::And | BinaryOperator::Or | BinaryOperator::Xor => {
            booleans.then_some(BinaryTypes { left: BOOL, right: BOOL, result: BOOL })
        }
    }
}

fn arithmetic_types(operator: BinaryOperator, left: &Type, right: &Type) -> Option<BinaryTypes> {
    if *left == Type::Color || *right == Type::Color {
        return color_types(left, right);
    }
    match (left, right) {
        (Type::Matrix(..), _) | (_, Type::Matrix(..)) => matrix_types(operator, left, right),
        _ => componentwise_types(left, right),
    }
}

/// Color with color, or with a number, which counts as grey.
fn color_types(left: &Type, right: &Type) -> Option<BinaryTypes> {
    let operand = |ty: &Type| match ty {
        Type::Color => Some(Type::Color),
        Type::Scalar(Scalar::F32 | Scalar::I32 | Scalar::U32) => Some(FLOAT),
        _ => None,
    };
    BinaryTypes::new(operand(left)?, operand(right)?, Type::Color)
}

fn matrix_types(operator: BinaryOperator, left: &Type, right: &Type) -> Option<BinaryTypes> {
    let number = |ty: &Type| *ty == FLOAT || converts(ty, &FLOAT);
    match (left, right) {
        (Type::Matrix(..), ty) if number(ty) => BinaryTypes::new(left.clone(), FLOAT, left.clone()),
        (ty, Type::Matrix(..)) if number(ty) => {
            BinaryTypes::new(FLOAT, right.clone(), right.clone())
        }
        _ if operator != BinaryOperator::Multiply => (left == right).then(|| BinaryTypes {
            left: left.clone(),
            right: right.clone(),
            result: left.clone(),
        }),
        _ => product_types(left, right),
    }
}

/// GLSL's linear algebra: the inner dimensions must agree.
fn product_types(left: &Type, right: &Type) -> Option<BinaryTypes> {
    let floats = |size: u8| Type::Vector(Scalar::F32, size);
    match (left, right) {
        (Type::Matrix(columns, rows), Type::Matrix(other, inner)) if columns == inner => {
            BinaryTypes::new(left.clone(), right.clone(), Type::Matrix(*other, *rows))
        }
        (Type::Matrix(columns, rows), Type::Vector(scalar, size))
            if columns == size && *scalar != Scalar::Bool =>
        {
            BinaryTypes::new(left.clone(), floats(*size), floats(*rows))
        }
        (Type::Vector(scalar, size), Type::Matrix(columns, rows))
            if rows == size && *scalar != Scalar::Bool =>
        {
            BinaryTypes::new(floats(*size), right.clone(), floats(*columns))
        }
        _ => None,
    }
}

/// Scalars and vectors of numbers: a scalar combines with any vector, a vector with one of the same
/// size.
fn componentwise_types(left: &Type, right: &Type) -> Option<BinaryTypes> {
    let scalar = common_scalar(left, right)?;
    let (left, right) = (with_scalar(left, scalar)?, with_scalar(right, scalar)?);
    let result = match (&left, &right) {
        (Type::Vector(_, size), Type::Vector(_, other)) if size != other => return None,
        (Type::Scalar(_), _) => right.clone(),
        _ => left.clone(),
    };
    BinaryTypes::new(left, right, result)
}

/// The common type int, uint or float that both sides convert to.
fn common_scalar(left: &Type, right: &Type) -> Option<Scalar> {
    let rank = |ty: &Type| match ty {
        Type::Scalar(scalar) | Type::Vector(scalar, _) => match scalar {
            Scalar::I32 => Some(0),
            Scalar::U32 => Some(1),
            Scalar::F32 => Some(2),
            Scalar::Bool => None,
        },
        _ => None,
    };
    Some(match rank(left)?.max(rank(right)?) {
        0 => Scalar::I32,
        1 => Scalar::U32,
        _ => Scalar::F32,
    })
}

fn integer_types(left: &Type, right: &Type) -> Option<BinaryTypes> {
    match common_scalar(left, right)? {
        Scalar::I32 | Scalar::U32 => componentwise_types(left, right),
        Scalar::F32 | Scalar::Bool => None,
    }
}

/// Shifts: the right side may differ in signedness, and may be a scalar for all components of the
/// left.
fn shift_types(left: &Type, right: &Type) -> Option<BinaryTypes> {
    integer_types(left, right)?;
    match (left, right) {
        (Type::Scalar(_), Type::Vector(..)) => None,
        _ => BinaryTypes::new(left.clone(), right.clone(), left.clone()),
    }
}

fn order_types(left: &Type, right: &Type) -> Option<BinaryTypes> {
    match (left, right) {
        (Type::Scalar(_), Type::Scalar(_)) => {
            let types = componentwise_types(left, right)?;
            BinaryTypes::new(types.left, types.right, BOOL)
        }
        _ => None,
    }
}

fn equality_types(left: &Type, right: &Type) -> Option<BinaryTypes> {
    if left == right {
        let comparable =
            !matches!(left, Type::Void | Type::Buffer(_) | Type::Reference(_) | Type::Error);
        return comparable.then(|| BinaryTypes {
            left: left.clone(),
            right: right.clone(),
            result: BOOL,
        });
    }
    if converts(left, right) {
        return BinaryTypes::new(right.clone(), right.clone(), BOOL);
    }
    converts(right, left).then(|| BinaryTypes {
        left: left.clone(),
        right: left.clone(),
        result: BOOL,
    })
}

impl Checker<'_> {
    /// Checks `-a`, `!a`, `~a`, `+a`.
    pub(super) fn check_unary(
        &mut self,
        operator: UnaryOperator,
        operand: &ast::Expression,
        span: Span,
    ) -> Expression {
        let operand = self.check_expression(operand);
        if operand.ty == Type::Error {
            return error_expression(span);
        }
        if !takes_operand(operator, &operand.ty) {
            self.report_operand(operator, &operand);
            return error_expression(span);
        }
        let ty = operand.ty.clone();
        let kind = match operator {
            UnaryOperator::Plus => return at(operand, span),
            UnaryOperator::Negate | UnaryOperator::Not | UnaryOperator::BitNot => {
                ExpressionKind::Unary(operator, Box::new(operand))
            }
        };
        Expression { kind, ty, span }
    }

    fn report_operand(&mut self, operator: UnaryOperator, operand: &Expression) {
        let shown = self.show(&operand.ty);
        let mut diagnostic = Diagnostic::new(
            codes::BAD_OPERANDS,
            format!("`{}` does not apply to `{shown}`", operator.text()),
        )
        .at(operand.span, format!("this is `{shown}`"));
        if operator == UnaryOperator::Not && matches!(operand.ty, Type::Vector(Scalar::Bool, _)) {
            diagnostic = diagnostic.help("`not(v)` gives the opposite of each component");
        }
        self.report(diagnostic);
    }

    /// Checks `a + b`, `a && b` and so on; the left operand has been checked.
    pub(super) fn check_binary(
        &mut self,
        operator: BinaryOperator,
        left: Expression,
        right: &ast::Expression,
        span: Span,
    ) -> Expression {
        let left = Box::new(left);
        let lazy = matches!(operator, BinaryOperator::And | BinaryOperator::Or);
        let right = Box::new(if lazy {
            self.conditionally(|checker| checker.check_expression(right))
        } else {
            self.check_expression(right)
        });
        let checked = self.binary(operator, left, right, span);
        if operator == BinaryOperator::Divide {
            self.check_not_nan(&checked);
        }
        checked
    }

    fn binary(
        &mut self,
        operator: BinaryOperator,
        left: Box<Expression>,
        right: Box<Expression>,
        span: Span,
    ) -> Expression {
        if left.ty == Type::Error || right.ty == Type::Error {
            return error_expression(span);
        }
        let Some(types) = binary_types(operator, &left.ty, &right.ty) else {
            self.report_operands(operator, &left, &right, span);
            return error_expression(span);
        };
        let left = Box::new(convert(*left, &types.left));
        let right = Box::new(convert(*right, &types.right));
        let kind = match operator {
            BinaryOperator::And => ExpressionKind::And(left, right),
            BinaryOperator::Or => ExpressionKind::Or(left, right),
            _ => ExpressionKind::Binary(operator, left, right),
        };
        Expression { kind, ty: types.result, span }
    }

    /// Reports that `operator` does not accept these operands.
    pub(super) fn report_operands(
        &mut self,
        operator: BinaryOperator,
        left: &Expression,
        right: &Expression,
        span: Span,
    ) {
        let (first, second) = (self.show(&left.ty), self.show(&right.ty));
        let symbol = operator.text();
        let mut diagnostic = Diagnostic::new(
            codes::BAD_OPERANDS,
            format!("`{symbol}` does not apply to `{first}` and `{second}`"),
        )
        .at(span, "")
        .label(left.span, format!("this is `{first}`"))
        .label(right.span, format!("this is `{second}`"));
        if let Some(help) = operand_help(operator, &left.ty, &right.ty) {
            diagnostic = diagnostic.help(help);
        }
        self.report(diagnostic);
    }
}

fn operand_help(operator: BinaryOperator, left: &Type, right: &Type) -> Option<String> {
    let vectors = matches!(left, Type::Vector(..)) && matches!(right, Type::Vector(..));
    let color = *left == Type::Color || *right == Type::Color;
    let per_component = match operator {
        BinaryOperator::Less => "lessThan",
        BinaryOperator::LessEqual => "lessThanEqual",
        BinaryOperator::Greater => "greaterThan",
        BinaryOperator::GreaterEqual => "greaterThanEqual",
        BinaryOperator::Remainder if left != right || !color => {
            return Some("`mod()` is the remainder of floats".to_owned());
        }
        _ if color && (vectors_of_floats(left) || vectors_of_floats(right)) => {
            return Some(
                "`color(v)` makes a color of a `vec3`, `rgb(c)` a `vec3` of a color".to_owned(),
            );
        }
        _ => return None,
    };
    vectors.then(|| format!("`{per_component}()` compares component by component"))
}

fn vectors_of_floats(ty: &Type) -> bool {
    matches!(ty, Type::Vector(Scalar::F32, _))
}

fn takes_operand(operator: UnaryOperator, ty: &Type) -> bool {
    match operator {
        UnaryOperator::Not => *ty == BOOL,
        UnaryOperator::BitNot => matches!(
            ty,
            Type::Scalar(Scalar::I32 | Scalar::U32) | Type::Vector(Scalar::I32 | Scalar::U32, _)
        ),
        UnaryOperator::Negate | UnaryOperator::Plus => match ty {
            Type::Scalar(scalar) | Type::Vector(scalar, _) => *scalar != Scalar::Bool,
            Type::Matrix(..) | Type::Color => true,
            Type::Void
            | Type::Struct(_)
            | Type::Array(..)
            | Type::Buffer(_)
            | Type::Reference(_)
            | Type::Error => false,
        },
    }
}
