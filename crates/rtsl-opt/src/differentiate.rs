//! Derivatives: replaces [`OpKind::Derivative`] by operations that compute it.
//!
//! Forward mode (Wengert, "A Simple Automatic Derivative Evaluation Program", CACM 1964): beside each f32 that
//! depends on a seed, its derivative with respect to that seed is computed, its *tangent*. Tangents follow the
//! operations as they are executed, through branches, loops and locals. Comparisons, roundings, integers, loads of
//! data and answers of the host have none. [`OpKind::ChainRule`] states the derivative of functions whose
//! operations do not show it, such as those that compute with the bits of their arguments.
//!
//! The pass runs when functions are linked, so that the derivative of a texture's value is that of the texture's code.

mod dependence;
mod rules;

use std::collections::BTreeMap;

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Function, Index, Op, OpKind, Region, Scalar, Value, Variable,
    VariableId, VariableKind,
};

use dependence::Dependence;

/// The greatest length of a local whose tangents are zeroed without a loop.
const UNROLLED_ZEROS: u32 = 16;

/// Runs the pass.
pub fn run(function: &mut Function) {
    let mut seeds = Vec::new();
    let mut has_rules = false;
    function.body.for_each_op(&mut |op| match op.kind {
        OpKind::Seed(_) => seeds.push(op.results.get(0)),
        OpKind::ChainRule(..) => has_rules = true,
        _ => {}
    });
    if seeds.is_empty() && !has_rules {
        return;
    }
    // Inner derivatives begin after outer ones, which differentiate them.
    for seed in seeds.into_iter().rev() {
        let mut body = std::mem::take(&mut function.body);
        differentiate(function, &mut body, seed);
        function.body = body;
    }
    drop_markers(function);
    crate::dce::run(function);
    function.renumber();
}

/// Computes the derivatives with respect to a seed in the region that has it. True if it is this region, or one in it.
fn differentiate(function: &mut Function, region: &mut Region, seed: Value) -> bool {
    let is_seed = |op: &Op| matches!(op.kind, OpKind::Seed(_)) && op.results.get(0) == seed;
    let Some(first) = region.ops.iter().position(is_seed) else {
        let mut regions = region.ops.iter_mut().flat_map(|op| op.kind.regions_mut());
        return regions.any(|region| differentiate(function, region, seed));
    };
    let mut wanted = Vec::new();
    let mut end = first;
    for (index, op) in region.ops.iter().enumerate().skip(first) {
        let before = wanted.len();
        add_wanted(op, seed, &mut wanted);
        if wanted.len() > before {
            end = index + 1;
        }
    }
    if wanted.is_empty() {
        return true;
    }
    let rest = region.ops.split_off(end);
    let range = region.ops.split_off(first);
    let dependence = Dependence::new(function, &range, seed, &wanted);
    let mut tangents = Tangents {
        function,
        dependence,
        seed,
        of: BTreeMap::new(),
        locals: BTreeMap::new(),
        renamed: BTreeMap::new(),
    };
    let ops = tangents.range(range);
    let renamed = tangents.renamed;
    region.ops.extend(ops);
    region.ops.extend(rest);
    region.for_each_use_mut(&mut |value| {
        if let Some(new) = renamed.get(value) {
            *value = *new;
        }
    });
    true
}

/// Adds the values whose derivatives with respect to a seed an operation takes, or one in its regions.
fn add_wanted(op: &Op, seed: Value, wanted: &mut Vec<Value>) {
    match &op.kind {
        OpKind::Derivative(of, by) if *by == seed => wanted.push(*of),
        kind => kind.regions().for_each(|region| {
            region.ops.iter().for_each(|op| add_wanted(op, seed, wanted));
        }),
    }
}

/// Replaces seeds and values with chain rules by the values themselves.
fn drop_markers(function: &mut Function) {
    let mut values: BTreeMap<Value, Value> = BTreeMap::new();
    function.body.for_each_op(&mut |op| {
        if let OpKind::Seed(value) | OpKind::ChainRule(value, _) = op.kind {
            values.insert(op.results.get(0), value);
        }
    });
    drop_ops(&mut function.body);
    function.body.for_each_use_mut(&mut |value| {
        while let Some(original) = values.get(value) {
            *value = *original;
        }
    });
}

fn drop_ops(region: &mut Region) {
    region.ops.retain(|op| !matches!(op.kind, OpKind::Seed(_) | OpKind::ChainRule(..)));
    for op in &mut region.ops {
        op.kind.regions_mut().for_each(drop_ops);
    }
}

/// The tangents with respect to a seed.
struct Tangents<'a> {
    function: &'a mut Function,
    dependence: Dependence,
    seed: Value,
    /// The tangents so far. Values without have none: it is zero.
    of: BTreeMap<Value, Value>,
    /// The locals with the tangents of what locals hold.
    locals: BTreeMap<VariableId, VariableId>,
    /// The results of operations that were replaced.
    renamed: BTreeMap<Value, Value>,
}

impl Tangents<'_> {
    /// Adds tangents to the operations from the seed to the last derivative.
    fn range(&mut self, range: Vec<Op>) -> Vec<Op> {
        let mut ops = Vec::new();
        for local in self.dependence.locals().collect::<Vec<VariableId>>() {
            self.add_local(local, &mut ops);
        }
        self.ops(range, &mut ops);
        ops
    }

    fn ops(&mut self, from: Vec<Op>, to: &mut Vec<Op>) {
        from.into_iter().for_each(|op| self.op(op, to));
    }

    fn op(&mut self, op: Op, to: &mut Vec<Op>) {
        let results = op.results;
        match op.kind {
            OpKind::If { condition, then, otherwise } => {
                let wanted = |index: &u32| self.dependence.has(results.get(*index));
                let wanted: Vec<u32> = (0..results.count).filter(wanted).collect();
                let (then, otherwise) =
                    (self.branch(then, &wanted), self.branch(otherwise, &wanted));
                let kind = OpKind::If { condition, then, otherwise };
                self.replace(Op { kind, ..op_without_kind(results, op.precise) }, &wanted, to);
            }
            OpKind::Loop { initial, body } => self.repeat(results, initial, body, to),
            OpKind::Store(local, index, value) => {
                let kind = OpKind::Store(local, index, value);
                to.push(Op { kind, ..op_without_kind(results, op.precise) });
                if let Some(tangents) = self.locals.get(&local).copied() {
                    let tangent = self.tangent(value, to);
                    self.store(tangents, index, tangent, to);
                }
            }
            OpKind::Derivative(of, by) if by == self.seed => {
                let tangent = self.tangent(of, to);
                self.renamed.insert(results.get(0), tangent);
            }
            kind => {
                let has = results.count == 1 && self.dependence.has(results.get(0));
                let op = Op { kind, ..op_without_kind(results, op.precise) };
                let tangent_of = has.then(|| op.clone());
                to.push(op);
                if let Some(op) = tangent_of {
                    let tangent = self.tangent_of_op(&op, to);
                    self.of.insert(results.get(0), tangent);
                }
            }
        }
    }

    /// Adds an operation with a tangent for each of these results, whose values are new.
    fn replace(&mut self, op: Op, wanted: &[u32], to: &mut Vec<Op>) {
        let mut scalars: Vec<Scalar> =
            op.results.iter().map(|value| self.function.scalar(value)).collect();
        scalars.extend(wanted.iter().map(|_| Scalar::F32));
        let results = self.function.new_values(&scalars);
        for (old, new) in op.results.iter().zip(results.iter()) {
            self.renamed.insert(old, new);
        }
        for (index, tangent) in wanted.iter().zip(op.results.count..) {
            self.of.insert(op.results.get(*index), results.get(tangent));
        }
        to.push(Op { results, ..op });
    }

    /// Adds the tangents of these yields to a branch.
    fn branch(&mut self, mut region: Region, wanted: &[u32]) -> Region {
        let mut ops = Vec::new();
        self.ops(std::mem::take(&mut region.ops), &mut ops);
        for index in wanted {
            let tangent = self.tangent(region.yields[*index as usize], &mut ops);
            region.yields.push(tangent);
        }
        region.ops = ops;
        region
    }

    fn repeat(
        &mut self,
        results: rtsl_ir::Values,
        mut initial: Vec<Value>,
        mut body: Region,
        to: &mut Vec<Op>,
    ) {
        let wanted = |index: &u32| self.dependence.has(body.params[*index as usize]);
        let wanted: Vec<u32> = (0..results.count).filter(wanted).collect();
        for index in &wanted {
            let tangent = self.tangent(initial[*index as usize], to);
            initial.push(tangent);
            let param = self.function.new_values(&[Scalar::F32]).get(0);
            self.of.insert(body.params[*index as usize], param);
            body.params.push(param);
        }
        // The first yield says whether the loop goes on.
        let yields: Vec<u32> = wanted.iter().map(|index| index + 1).collect();
        let body = self.branch(body, &yields);
        let op = Op { kind: OpKind::Loop { initial, body }, ..op_without_kind(results, false) };
        self.replace(op, &wanted, to);
    }

    /// Returns the tangent of a value.
    fn tangent(&mut self, value: Value, to: &mut Vec<Op>) -> Value {
        match self.of.get(&value) {
            Some(tangent) => *tangent,
            None => self.float(0.0, to),
        }
    }

    /// Declares the local with the tangents of another, which are zero at first.
    fn add_local(&mut self, local: VariableId, to: &mut Vec<Op>) {
        let Variable { name, len, .. } = self.function.variable(local).clone();
        let seed = self.seed.0;
        let name = format!("{name}.d{seed}");
        let variable = Variable { kind: VariableKind::Local, name, scalar: Scalar::F32, len };
        let tangents = self.function.intern_variable(variable);
        self.locals.insert(local, tangents);
        let zero = self.float(0.0, to);
        if len <= UNROLLED_ZEROS {
            for index in 0..len {
                self.store(tangents, Index::Constant(index), zero, to);
            }
        } else {
            self.zero_by_loop(tangents, len, to);
        }
    }

    fn zero_by_loop(&mut self, local: VariableId, len: u32, to: &mut Vec<Op>) {
        let integer = |tangents: &mut Self, value: u32, to: &mut Vec<Op>| {
            let constant = Constant::I32(i32::try_from(value).unwrap_or(i32::MAX));
            tangents.function.push(to, Scalar::I32, OpKind::Constant(constant))
        };
        let (zero, first) = (self.float(0.0, to), integer(self, 0, to));
        let (one, end) = (integer(self, 1, to), integer(self, len, to));
        let index = self.function.new_values(&[Scalar::I32]).get(0);
        let mut body = Region { params: vec![index], ..Region::default() };
        self.store(local, Index::Dynamic(index), zero, &mut body.ops);
        let next = OpKind::Binary(BinaryOp::Add, index, one);
        let next = self.function.push(&mut body.ops, Scalar::I32, next);
        let again = OpKind::Compare(CompareOp::Less, next, end);
        let again = self.function.push(&mut body.ops, Scalar::Bool, again);
        body.yields = vec![again, next];
        let kind = OpKind::Loop { initial: vec![first], body };
        self.function.push(to, Scalar::I32, kind);
    }

    fn store(&mut self, local: VariableId, index: Index, value: Value, to: &mut Vec<Op>) {
        let results = self.function.new_values(&[]);
        to.push(Op { results, precise: false, kind: OpKind::Store(local, index, value) });
    }

    fn float(&mut self, value: f32, to: &mut Vec<Op>) -> Value {
        self.emit(OpKind::Constant(Constant::F32(value)), to)
    }

    fn emit(&mut self, kind: OpKind, to: &mut Vec<Op>) -> Value {
        self.function.push(to, Scalar::F32, kind)
    }
}

fn op_without_kind(results: rtsl_ir::Values, precise: bool) -> Op {
    Op { results, precise, kind: OpKind::ReportBudget }
}
