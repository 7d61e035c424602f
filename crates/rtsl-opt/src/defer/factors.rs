//! Factors by which requests reach values: expressions of the function's values.

use std::collections::HashMap;

use rtsl_ir::{Constant, Function, OpKind, Region, Value};

/// A factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Factor {
    Zero,
    One,
    /// The expression with this number.
    Of(u32),
}

impl Factor {
    /// Returns the number of the expression.
    pub fn number(self) -> Option<u32> {
        match self {
            Factor::Of(number) => Some(number),
            Factor::Zero | Factor::One => None,
        }
    }
}

/// An expression. Equal ones have one number; operands have lower numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Expression {
    Value(Value),
    Negated(Factor),
    Product(Factor, Value),
    Quotient(Factor, Value),
    Sum(Factor, Factor),
    /// One of two factors by a bool.
    Choice(Value, Factor, Factor),
}

/// The expressions of a function.
pub(super) struct Factors {
    expressions: Vec<Expression>,
    numbers: HashMap<Expression, u32>,
    /// Values that are the constant 1.
    ones: Vec<Value>,
}

impl Factors {
    pub fn of(function: &Function) -> Self {
        let ones = constants(&function.body, 1.0);
        Factors { expressions: Vec::new(), numbers: HashMap::new(), ones }
    }

    pub fn expression(&self, number: u32) -> Expression {
        self.expressions[number as usize]
    }

    fn number(&mut self, expression: Expression) -> Factor {
        let next = self.expressions.len() as u32;
        let number = *self.numbers.entry(expression).or_insert(next);
        if number == next {
            self.expressions.push(expression);
        }
        Factor::Of(number)
    }

    fn negated_of(&self, factor: Factor) -> Option<Factor> {
        let Factor::Of(number) = factor else { return None };
        match self.expression(number) {
            Expression::Negated(of) => Some(of),
            _ => None,
        }
    }

    pub fn negated(&mut self, factor: Factor) -> Factor {
        match (factor, self.negated_of(factor)) {
            (Factor::Zero, _) => Factor::Zero,
            (_, Some(of)) => of,
            _ => self.number(Expression::Negated(factor)),
        }
    }

    /// Returns the factor times a value.
    pub fn product(&mut self, factor: Factor, by: Value) -> Factor {
        match (factor, self.negated_of(factor)) {
            (Factor::Zero, _) => Factor::Zero,
            _ if self.ones.binary_search(&by).is_ok() => factor,
            (Factor::One, _) => self.number(Expression::Value(by)),
            (_, Some(of)) => {
                let product = self.product(of, by);
                self.negated(product)
            }
            _ => self.number(Expression::Product(factor, by)),
        }
    }

    /// Returns the factor divided by a value.
    pub fn quotient(&mut self, factor: Factor, by: Value) -> Factor {
        match factor {
            Factor::Zero => Factor::Zero,
            _ if self.ones.binary_search(&by).is_ok() => factor,
            _ => self.number(Expression::Quotient(factor, by)),
        }
    }

    pub fn sum(&mut self, a: Factor, b: Factor) -> Factor {
        match (a, b) {
            (Factor::Zero, _) => b,
            (_, Factor::Zero) => a,
            _ => self.number(Expression::Sum(a, b)),
        }
    }

    /// Returns `then` where the bool is true, else `otherwise`.
    pub fn choice(&mut self, condition: Value, then: Factor, otherwise: Factor) -> Factor {
        match then == otherwise {
            true => then,
            false => self.number(Expression::Choice(condition, then, otherwise)),
        }
    }
}

/// Returns the values that are this constant, in order.
pub(super) fn constants(region: &Region, number: f32) -> Vec<Value> {
    let mut found = Vec::new();
    region.for_each_op(&mut |op| {
        if op.kind == OpKind::Constant(Constant::F32(number)) {
            found.push(op.results.get(0));
        }
    });
    found.sort_unstable();
    found
}
