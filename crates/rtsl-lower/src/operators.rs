//! Operators: componentwise, or GLSL's linear algebra.

use rtsl_ir::{BinaryOp, CompareOp, Constant, Scalar, Value};
use rtsl_sema::hir::{BinaryOperator, StepOperator, Type};

use crate::Lowering;

/// A value with its type.
#[derive(Clone, Copy)]
pub struct Operand<'a> {
    pub ty: &'a Type,
    pub values: &'a [Value],
}

/// The scalar operation that a binary operator applies to each pair of components.
enum Scalars {
    Compute(BinaryOp),
    Compare(CompareOp),
    /// A shift, whose second operand is converted to the type of the first.
    Shift(BinaryOp),
    /// A comparison of whole values: true if all components are equal.
    Equal,
    NotEqual,
}

impl Lowering<'_> {
    /// Lowers `a operator b`.
    pub fn binary(
        &mut self,
        operator: BinaryOperator,
        a: Operand<'_>,
        b: Operand<'_>,
    ) -> Vec<Value> {
        if operator == BinaryOperator::Multiply
            && let Some(product) = self.linear_product(a, b)
        {
            return product;
        }
        match scalars_of(operator) {
            Scalars::Compute(op) => self.componentwise(a.values, b.values, |lowering, a, b| {
                lowering.builder.binary(op, a, b)
            }),
            Scalars::Compare(op) => self.componentwise(a.values, b.values, |lowering, a, b| {
                lowering.builder.compare(op, a, b)
            }),
            Scalars::Shift(op) => self.componentwise(a.values, b.values, |lowering, a, b| {
                let b = lowering.builder.convert(lowering.builder.scalar(a), b);
                lowering.builder.binary(op, a, b)
            }),
            Scalars::Equal => vec![self.equal(a.values, b.values)],
            Scalars::NotEqual => {
                let equal = self.equal(a.values, b.values);
                vec![self.builder.not(equal)]
            }
        }
    }

    /// Applies an operation to each component; a single scalar is used for all components.
    pub fn componentwise(
        &mut self,
        a: &[Value],
        b: &[Value],
        mut operation: impl FnMut(&mut Self, Value, Value) -> Value,
    ) -> Vec<Value> {
        let count = a.len().max(b.len());
        (0..count).map(|index| operation(self, a[index % a.len()], b[index % b.len()])).collect()
    }

    /// True if all scalars are equal; false with a NaN.
    fn equal(&mut self, a: &[Value], b: &[Value]) -> Value {
        let mut all = self.builder.bool(true);
        for (a, b) in a.iter().zip(b) {
            let equal = self.builder.compare(CompareOp::Equal, *a, *b);
            all = self.both(all, equal);
        }
        all
    }

    /// A product of matrices and vectors; `None` for componentwise products.
    fn linear_product(&mut self, a: Operand<'_>, b: Operand<'_>) -> Option<Vec<Value>> {
        match (a.ty, b.ty) {
            (Type::Matrix(inner, rows), Type::Matrix(columns, _)) => {
                let (inner, rows) = (usize::from(*inner), usize::from(*rows));
                let mut product = Vec::new();
                for column in 0..usize::from(*columns) {
                    let column = &b.values[column * inner..(column + 1) * inner];
                    product.extend(self.matrix_times_column(a.values, rows, column));
                }
                Some(product)
            }
            (Type::Matrix(_, rows), Type::Vector(..)) => {
                Some(self.matrix_times_column(a.values, usize::from(*rows), b.values))
            }
            (Type::Vector(..), Type::Matrix(_, rows)) => {
                let columns = b.values.chunks(usize::from(*rows));
                Some(columns.map(|column| self.sum_of_products(a.values, column)).collect())
            }
            _ => None,
        }
    }

    fn matrix_times_column(
        &mut self,
        matrix: &[Value],
        rows: usize,
        column: &[Value],
    ) -> Vec<Value> {
        (0..rows)
            .map(|row| {
                let row: Vec<Value> = matrix.iter().skip(row).step_by(rows).copied().collect();
                self.sum_of_products(&row, column)
            })
            .collect()
    }

    /// `a0 * b0 + a1 * b1 + ...` from the left: the order is fixed, so that contraction gives the
    /// same bits everywhere.
    fn sum_of_products(&mut self, a: &[Value], b: &[Value]) -> Value {
        let mut sum = None;
        for (a, b) in a.iter().zip(b) {
            let product = self.builder.multiply(*a, *b);
            sum = Some(match sum {
                None => product,
                Some(sum) => self.builder.add(sum, product),
            });
        }
        sum.unwrap_or_else(|| self.builder.f32(0.0))
    }

    /// Adds or subtracts one.
    pub fn step(&mut self, by: StepOperator, value: Value) -> Value {
        let one = match self.builder.scalar(value) {
            Scalar::F32 => Constant::F32(1.0),
            Scalar::I32 => Constant::I32(1),
            Scalar::U32 => Constant::U32(1),
            Scalar::Bool => Constant::Bool(true),
        };
        let one = self.builder.constant(one);
        match by {
            StepOperator::Increment => self.builder.add(value, one),
            StepOperator::Decrement => self.builder.subtract(value, one),
        }
    }
}

fn scalars_of(operator: BinaryOperator) -> Scalars {
    match operator {
        BinaryOperator::Add => Scalars::Compute(BinaryOp::Add),
        BinaryOperator::Subtract => Scalars::Compute(BinaryOp::Subtract),
        BinaryOperator::Multiply => Scalars::Compute(BinaryOp::Multiply),
        BinaryOperator::Divide => Scalars::Compute(BinaryOp::Divide),
        BinaryOperator::Remainder => Scalars::Compute(BinaryOp::Remainder),
        BinaryOperator::BitAnd | BinaryOperator::And => Scalars::Compute(BinaryOp::And),
        BinaryOperator::BitOr | BinaryOperator::Or => Scalars::Compute(BinaryOp::Or),
        BinaryOperator::BitXor | BinaryOperator::Xor => Scalars::Compute(BinaryOp::Xor),
        BinaryOperator::ShiftLeft => Scalars::Shift(BinaryOp::ShiftLeft),
        BinaryOperator::ShiftRight => Scalars::Shift(BinaryOp::ShiftRight),
        BinaryOperator::Less => Scalars::Compare(CompareOp::Less),
        BinaryOperator::LessEqual => Scalars::Compare(CompareOp::LessEqual),
        BinaryOperator::Greater => Scalars::Compare(CompareOp::Greater),
        BinaryOperator::GreaterEqual => Scalars::Compare(CompareOp::GreaterEqual),
        BinaryOperator::Equal => Scalars::Equal,
        BinaryOperator::NotEqual => Scalars::NotEqual,
    }
}
