//! The derivative of each operation.

use rtsl_ir::{BinaryOp, CompareOp, Op, OpKind, Scalar, UnaryOp, Value};

use super::Tangents;

impl Tangents<'_> {
    /// Adds the operations that compute the tangent of the result of an operation that depends on the seed.
    pub fn tangent_of_op(&mut self, op: &Op, to: &mut Vec<Op>) -> Value {
        let result = op.results.get(0);
        match &op.kind {
            OpKind::Seed(_) if result == self.seed => self.float(1.0, to),
            OpKind::Seed(a) => self.tangent(*a, to),
            OpKind::ChainRule(_, factors) => self.chain(factors, to),
            OpKind::Unary(op, a) => self.unary(*op, *a, result, to),
            OpKind::Binary(op, a, b) => self.binary(*op, *a, *b, result, to),
            OpKind::Select(condition, a, b) => {
                let (a, b) = (self.tangent(*a, to), self.tangent(*b, to));
                self.emit(OpKind::Select(*condition, a, b), to)
            }
            OpKind::Fma(a, b, c) => {
                let product = self.product_rule(*a, *b, to);
                self.sum(product, self.of.get(c).copied(), to)
            }
            OpKind::Load(local, index) => match self.locals.get(local) {
                Some(tangents) => self.emit(OpKind::Load(*tangents, *index), to),
                None => self.float(0.0, to),
            },
            _ => self.float(0.0, to),
        }
    }

    fn unary(&mut self, op: UnaryOp, a: Value, result: Value, to: &mut Vec<Op>) -> Value {
        let tangent = self.tangent(a, to);
        match op {
            UnaryOp::Negate => self.emit(OpKind::Unary(UnaryOp::Negate, tangent), to),
            UnaryOp::Abs => {
                let zero = self.float(0.0, to);
                let is_negative = OpKind::Compare(CompareOp::Less, a, zero);
                let is_negative = self.function.push(to, Scalar::Bool, is_negative);
                let turned = self.emit(OpKind::Unary(UnaryOp::Negate, tangent), to);
                self.emit(OpKind::Select(is_negative, turned, tangent), to)
            }
            UnaryOp::Sqrt => {
                let twice = self.emit(OpKind::Binary(BinaryOp::Add, result, result), to);
                self.emit(OpKind::Binary(BinaryOp::Divide, tangent, twice), to)
            }
            _ => self.float(0.0, to),
        }
    }

    fn binary(
        &mut self,
        op: BinaryOp,
        a: Value,
        b: Value,
        result: Value,
        to: &mut Vec<Op>,
    ) -> Value {
        match op {
            BinaryOp::Add | BinaryOp::Subtract => {
                match (self.of.get(&a).copied(), self.of.get(&b).copied()) {
                    (Some(a), None) => a,
                    (None, Some(b)) if op == BinaryOp::Add => b,
                    (None, Some(b)) => self.emit(OpKind::Unary(UnaryOp::Negate, b), to),
                    (Some(a), Some(b)) => self.emit(OpKind::Binary(op, a, b), to),
                    (None, None) => self.float(0.0, to),
                }
            }
            BinaryOp::Multiply => match self.product_rule(a, b, to) {
                Some(sum) => sum,
                None => self.float(0.0, to),
            },
            BinaryOp::Divide => {
                // (a / b)' = (a' - (a / b) b') / b
                let mut upper = self.tangent(a, to);
                if let Some(lower) = self.of.get(&b).copied() {
                    let product = self.emit(OpKind::Binary(BinaryOp::Multiply, result, lower), to);
                    upper = self.emit(OpKind::Binary(BinaryOp::Subtract, upper, product), to);
                }
                self.emit(OpKind::Binary(BinaryOp::Divide, upper, b), to)
            }
            BinaryOp::Min | BinaryOp::Max => {
                let (less, than) = if op == BinaryOp::Min { (b, a) } else { (a, b) };
                let is_second = OpKind::Compare(CompareOp::Less, less, than);
                let is_second = self.function.push(to, Scalar::Bool, is_second);
                let (a, b) = (self.tangent(a, to), self.tangent(b, to));
                self.emit(OpKind::Select(is_second, b, a), to)
            }
            _ => self.float(0.0, to),
        }
    }

    /// The tangent of a product; `None` if it is zero.
    fn product_rule(&mut self, a: Value, b: Value, to: &mut Vec<Op>) -> Option<Value> {
        let of_a = self.of.get(&a).copied();
        let of_a = of_a.map(|it| self.emit(OpKind::Binary(BinaryOp::Multiply, it, b), to));
        let of_b = self.of.get(&b).copied();
        let of_b = of_b.map(|it| self.emit(OpKind::Binary(BinaryOp::Multiply, a, it), to));
        (of_a.is_some() || of_b.is_some()).then(|| self.sum(of_a, of_b, to))
    }

    fn chain(&mut self, factors: &[(Value, Value)], to: &mut Vec<Op>) -> Value {
        let mut sum = None;
        for (of, factor) in factors {
            if let Some(tangent) = self.of.get(of).copied() {
                let term = self.emit(OpKind::Binary(BinaryOp::Multiply, *factor, tangent), to);
                sum = Some(self.sum(sum, Some(term), to));
            }
        }
        sum.unwrap_or_else(|| self.float(0.0, to))
    }

    fn sum(&mut self, a: Option<Value>, b: Option<Value>, to: &mut Vec<Op>) -> Value {
        match (a, b) {
            (Some(a), Some(b)) => self.emit(OpKind::Binary(BinaryOp::Add, a, b), to),
            (Some(only), None) | (None, Some(only)) => only,
            (None, None) => self.float(0.0, to),
        }
    }
}
