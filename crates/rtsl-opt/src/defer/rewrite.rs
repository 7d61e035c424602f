//! The method without what is deferred: every value that depends on a deferred answer becomes its own part.

use rtsl_ir::{
    BinaryOp, Constant, Function, IndexVec, Op, OpKind, Query, Region, Scalar, UnaryOp, Value,
    Values,
};

use super::factors::constants;
use super::flow::Gap;
use super::plan::{Contribution, Edit, Plan};

/// The part of a value that does not depend on what is deferred.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Own {
    /// Nothing.
    Zero,
    Value(Value),
}

/// Changes a function as planned.
pub(super) fn rewrite(function: &mut Function, plan: Plan) {
    function.values.clone_from(&plan.types);
    let own = IndexVec::filled(function.values.len(), None);
    let mut body = std::mem::take(&mut function.body);
    let zeros = constants(&body, 0.0);
    let mut rewriting = Rewriting { function, plan, own, zeros, operations: 0, regions: 0 };
    rewriting.region(&mut body, None);
    rewriting.finish(&mut body);
    function.body = body;
}

struct Rewriting<'a> {
    function: &'a mut Function,
    plan: Plan,
    /// The own part of a value where it is another one.
    own: IndexVec<Value, Option<Own>>,
    /// The values that are the constant 0.
    zeros: Vec<Value>,
    /// The numbers of the next operation and region.
    operations: u32,
    regions: u32,
}

impl Rewriting<'_> {
    fn own(&self, value: Value) -> Own {
        self.own.get(value).copied().flatten().unwrap_or(Own::Value(value))
    }

    /// Returns the own part of a value that depends on what is deferred: nothing if that is the constant 0, as where a
    /// sum begins.
    fn part(&self, of: Value, own: Own) -> Own {
        let is_zero = matches!(own, Own::Value(own) if self.zeros.binary_search(&own).is_ok());
        let depends = self.plan.depends.get(of).copied().unwrap_or(false);
        if is_zero && depends { Own::Zero } else { own }
    }

    fn set(&mut self, value: Value, own: Own) {
        let own = self.part(value, own);
        if let Own::Value(new) = own {
            self.function.names.keep(value, new);
        }
        self.own.insert(value, Some(own), None);
    }

    /// Returns the own part as a value; an operation that it needs is appended to `ops`.
    fn value(&mut self, own: Own, ops: &mut Vec<Op>) -> Value {
        match own {
            Own::Value(value) => value,
            Own::Zero => {
                let kind = OpKind::Constant(Constant::F32(0.0));
                self.function.push(ops, Scalar::F32, kind)
            }
        }
    }

    /// Rewrites the operations of a region, and appends the contribution. The yields remain as they are.
    fn region(&mut self, region: &mut Region, contribution: Option<&Contribution>) {
        let number = self.regions;
        self.regions += 1;
        let mut ops = Vec::with_capacity(region.ops.len());
        let mut position = 0;
        for op in std::mem::take(&mut region.ops) {
            self.insert(Gap { region: number, position }, &mut ops);
            self.op(op, &mut ops);
            position += 1;
        }
        self.insert(Gap { region: number, position }, &mut ops);
        if let Some(contribution) = contribution {
            self.contribute(contribution, &region.yields, &mut ops);
        }
        region.ops = ops;
    }

    fn insert(&mut self, gap: Gap, ops: &mut Vec<Op>) {
        for mut op in self.plan.insertions.remove(&gap).into_iter().flatten() {
            self.substitute(&mut op.kind, ops);
            for region in op.kind.regions_mut() {
                // Nothing in them depends on what is deferred.
                region.for_each_use_mut(&mut |value| {
                    if let Own::Value(own) = self.own(*value) {
                        *value = own;
                    }
                });
            }
            ops.push(op);
        }
    }

    /// Replaces operands by their own parts.
    fn substitute(&mut self, kind: &mut OpKind, ops: &mut Vec<Op>) {
        kind.for_each_operand_mut(|value| *value = self.value(self.own(*value), ops));
    }

    /// Replaces yields by their own parts.
    fn finish(&mut self, region: &mut Region) {
        for value in &mut region.yields {
            *value = self.value(self.own(*value), &mut region.ops);
        }
    }

    fn op(&mut self, op: Op, ops: &mut Vec<Op>) {
        let number = self.operations;
        self.operations += 1;
        match self.plan.edits.remove(&number) {
            Some(Edit::Moved) => self.skip(&op),
            Some(Edit::Spawned) => op.results.iter().for_each(|it| self.set(it, Own::Zero)),
            Some(Edit::OwnShade(weights)) => self.own_shade(op, &weights, ops),
            Some(Edit::Unshadowed(results)) => self.unshadowed(op, results, ops),
            Some(Edit::Contributing(contribution)) => self.branch(op, Some(&contribution), ops),
            None => match op.kind {
                OpKind::If { .. } => self.branch(op, None, ops),
                OpKind::Loop { .. } => self.repeat(op, ops),
                _ => self.plain(op, ops),
            },
        }
    }

    /// Counts what is in an operation.
    fn skip(&mut self, op: &Op) {
        for region in op.kind.regions() {
            self.regions += 1;
            for op in &region.ops {
                self.operations += 1;
                self.skip(op);
            }
        }
    }

    fn own_shade(&mut self, mut op: Op, weights: &[Value], ops: &mut Vec<Op>) {
        if let OpKind::Query(query, operands) = &mut op.kind {
            *query = Query::OwnShade;
            operands.extend(weights);
        }
        self.substitute(&mut op.kind, ops);
        ops.push(op);
    }

    fn unshadowed(&mut self, op: Op, results: Values, ops: &mut Vec<Op>) {
        let mut operands = Vec::new();
        op.kind.for_each_operand(|value| operands.push(value));
        let mut kind = OpKind::Query(Query::UnshadowedLight, operands);
        self.substitute(&mut kind, ops);
        for (old, new) in op.results.iter().zip(results.iter()) {
            self.set(old, Own::Value(new));
        }
        ops.push(Op { results, precise: false, kind });
    }

    fn branch(&mut self, mut op: Op, contribution: Option<&Contribution>, ops: &mut Vec<Op>) {
        self.substitute(&mut op.kind, ops);
        let OpKind::If { condition: _, then, otherwise } = &mut op.kind else { return };
        let sums = contribution.map_or(&[][..], |contribution| &contribution.sums);
        let outside: Vec<Own> = sums.iter().map(|addend| self.own(addend.sum)).collect();
        sums.iter().for_each(|addend| self.set(addend.sum, Own::Zero));
        self.region(then, contribution);
        for (addend, own) in sums.iter().zip(&outside) {
            self.set(addend.sum, *own);
            then.yields[addend.position] = addend.sum;
        }
        self.region(otherwise, None);
        for (position, result) in op.results.iter().enumerate() {
            let [a, b] = [&*then, &*otherwise]
                .map(|region| self.part(result, self.own(region.yields[position])));
            if a == b {
                self.set(result, a);
            }
        }
        self.finish(then);
        self.finish(otherwise);
        ops.push(op);
    }

    fn repeat(&mut self, mut op: Op, ops: &mut Vec<Op>) {
        let OpKind::Loop { initial, body } = &mut op.kind else { return };
        let first: Vec<Own> = initial.iter().map(|value| self.own(*value)).collect();
        self.region(body, None);
        for (position, result) in op.results.iter().enumerate() {
            // Without what is deferred nothing is added.
            if self.own(body.yields[position + 1]) == Own::Value(body.params[position]) {
                self.set(result, first[position]);
            }
        }
        self.finish(body);
        self.substitute(&mut op.kind, ops);
        ops.push(op);
    }

    fn plain(&mut self, mut op: Op, ops: &mut Vec<Op>) {
        match self.without_zeros(&op.kind) {
            Some(Simpler::Own(own)) => self.set(op.results.get(0), own),
            Some(Simpler::Kind(kind)) => ops.push(Op { kind, ..op }),
            None => {
                self.substitute(&mut op.kind, ops);
                ops.push(op);
            }
        }
    }

    /// Returns the own part of an operation with an operand that has none; `None` if it has no such operand, or if only
    /// reports need it.
    fn without_zeros(&self, kind: &OpKind) -> Option<Simpler> {
        let own = |value: Value| self.own(value);
        let is_zero = |value: Value| self.own(value) == Own::Zero;
        Some(match *kind {
            OpKind::Binary(BinaryOp::Add, a, b) if is_zero(a) => Simpler::Own(own(b)),
            OpKind::Binary(BinaryOp::Add | BinaryOp::Subtract, a, b) if is_zero(b) => {
                Simpler::Own(own(a))
            }
            OpKind::Binary(BinaryOp::Subtract, a, b) if is_zero(a) => {
                let Own::Value(b) = own(b) else { return None };
                Simpler::Kind(OpKind::Unary(UnaryOp::Negate, b))
            }
            OpKind::Binary(BinaryOp::Multiply, a, b) if is_zero(a) || is_zero(b) => {
                Simpler::Own(Own::Zero)
            }
            OpKind::Fma(a, b, c) if is_zero(a) || is_zero(b) => Simpler::Own(own(c)),
            OpKind::Fma(a, b, c) if is_zero(c) => {
                let (Own::Value(a), Own::Value(b)) = (own(a), own(b)) else { return None };
                Simpler::Kind(OpKind::Binary(BinaryOp::Multiply, a, b))
            }
            OpKind::Unary(UnaryOp::Negate, a) | OpKind::Binary(BinaryOp::Divide, a, _)
                if is_zero(a) =>
            {
                Simpler::Own(Own::Zero)
            }
            OpKind::Select(_, a, b) if is_zero(a) && is_zero(b) => Simpler::Own(Own::Zero),
            _ => return None,
        })
    }

    /// Adds the contribution of a branch: for each component of the colour, the sum over the results that reach it, in
    /// their order, of the factor times what the branch adds.
    fn contribute(&mut self, contribution: &Contribution, yields: &[Value], ops: &mut Vec<Op>) {
        let mut colors = [Own::Zero; rtsl_spec::COLOR_COMPONENTS as usize];
        for addend in &contribution.sums {
            let Some((component, factor)) = addend.reached else { continue };
            let color = &mut colors[component as usize];
            let added = match (self.own(yields[addend.position]), factor) {
                (Own::Value(added), Some(factor)) => {
                    let Own::Value(factor) = self.own(factor) else { continue };
                    Own::Value(self.precise(BinaryOp::Multiply, factor, added, ops))
                }
                (added, _) => added,
            };
            *color = match (*color, added) {
                (Own::Zero, other) | (other, Own::Zero) => other,
                (Own::Value(a), Own::Value(b)) => {
                    Own::Value(self.precise(BinaryOp::Add, a, b, ops))
                }
            };
        }
        let ray = contribution.ray.map(|value| self.own(value));
        let operands = ray.into_iter().chain(colors);
        let operands: Vec<Value> = operands.map(|own| self.value(own, ops)).collect();
        let kind = OpKind::Query(Query::Contribute, operands);
        ops.push(Op { results: Values::default(), precise: false, kind });
    }

    fn precise(&mut self, op: BinaryOp, a: Value, b: Value, ops: &mut Vec<Op>) -> Value {
        let value = self.function.push(ops, Scalar::F32, OpKind::Binary(op, a, b));
        if let Some(op) = ops.last_mut() {
            op.precise = true;
        }
        value
    }
}

/// An operation without an operand.
enum Simpler {
    Own(Own),
    Kind(OpKind),
}
