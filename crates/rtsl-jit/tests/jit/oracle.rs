//! Compiled kernels against the interpreter: the same bits for every width and call mode, with and without masks.

use rtsl_ir::{
    BinaryOp, Builder, CompareOp, Function, Index, OpKind, Scalar, UnaryOp, Value, Variable,
    VariableKind, evaluate,
};
use rtsl_stages::Stages;
use rtsl_testing::functions::{Entropy, seeded_function, seeded_integrator};

use crate::oracle_support::Case;

/// Functions of about `size / 3` operations each, from these seeds.
fn check_generated(seeds: std::ops::Range<u64>, size: usize) {
    for seed in seeds {
        let function = seeded_function(seed, size);
        if let Err(difference) = Case::new(function.clone(), seed).check() {
            panic!("seed {seed}, size {size}: {difference}\n{function}");
        }
    }
}

/// `RTSL_ORACLE` multiplies the number of functions.
fn scaled(count: u64) -> u64 {
    let factor = std::env::var("RTSL_ORACLE").ok().and_then(|text| text.parse().ok());
    count * factor.unwrap_or(1_u64)
}

#[test]
fn short_functions() {
    check_generated(0..scaled(20), 60);
}

#[test]
fn long_functions() {
    check_generated(1000..1000 + scaled(4), 700);
}

/// Queries of integrators reach the host for whole vectors.
#[test]
fn functions_with_queries() {
    for seed in 3000..3000 + scaled(16) {
        let function = seeded_integrator(seed, 200);
        if let Err(difference) = Case::new(function.clone(), seed).check() {
            panic!("seed {seed}: {difference}\n{function}");
        }
    }
}

/// Generated functions that suspend, with their stages.
fn suspending() -> impl Iterator<Item = (u64, Function, Stages)> {
    let is_accepted = |it: &Variable| it.kind == VariableKind::Accepted;
    let functions = (2000..).map(|seed| (seed, seeded_function(seed, 300)));
    let functions = functions.filter(move |(_, it)| !it.variables.iter().any(is_accepted));
    let split = functions.map(|(seed, function)| {
        let stages = rtsl_stages::split(&function).unwrap();
        (seed, function, stages)
    });
    split.filter(|(_, _, stages)| stages.stages.len() > 2)
}

/// Stages are functions like others: whatever they find in the frame, they compute the same at every width.
#[test]
fn stages_of_functions() {
    for (seed, _, stages) in suspending().take(scaled(6) as usize) {
        for stage in stages.stages {
            if let Err(difference) = Case::new(stage.function.clone(), seed).check() {
                panic!("seed {seed}: {difference}\n{stage}");
            }
        }
    }
}

/// Paths that are in different stages, each called under the mask of its paths, come to what the function computes.
#[test]
fn waves_of_paths() {
    for (seed, function, stages) in suspending().take(scaled(12) as usize) {
        if let Err(difference) = Case::new(function.clone(), seed).check_stages(&stages) {
            panic!("seed {seed}: {difference}\n{function}\n{stages}");
        }
    }
}

/// Generates functions that execute every operation on a type with operands of every kind.
struct Operations {
    builder: Builder,
    /// By type: lanes, uniform, a constant; two of each, and a buffer and a local of them at an index of lanes.
    operands: Vec<Vec<Value>>,
    results: Vec<Value>,
}

impl Operations {
    fn new(seed: u64) -> Operations {
        let mut builder = Builder::new("Operations.method");
        let bytes = Entropy::bytes(seed, 64);
        let mut entropy = Entropy::new(&bytes);
        let mut operands = Vec::new();
        for scalar in Scalar::ALL {
            let mut variable = |kind, prefix: &str, len| {
                let name = format!("{prefix}_{}", scalar.name());
                builder.variable(Variable { kind, name, scalar, len })
            };
            let lanes = variable(VariableKind::Scratch, "lanes", 2);
            let shared = variable(VariableKind::Member, "shared", 2);
            let mut values = Vec::new();
            for index in 0..2 {
                values.push(builder.load(lanes, index));
                values.push(builder.load(shared, index));
                values.push(builder.constant(entropy.constant(scalar)));
            }
            operands.push(values);
        }
        Operations { builder, operands, results: Vec::new() }
    }

    fn operands(&self, scalar: Scalar) -> Vec<Value> {
        self.operands[Scalar::ALL.iter().position(|it| *it == scalar).unwrap()].clone()
    }

    /// Returns a first operand paired with second operands of every kind, and vice versa.
    fn pairs(&self, scalar: Scalar) -> Vec<(Value, Value)> {
        let operands = self.operands(scalar);
        let (first, second) = operands.split_at(3);
        let pairs = first.iter().flat_map(|a| second.iter().map(|b| (*a, *b)));
        pairs.chain([(operands[0], operands[0])]).collect()
    }

    fn push(&mut self, kind: OpKind) {
        let value = self.builder.push(kind).get(0);
        self.results.push(value);
    }

    fn unary(&mut self, scalar: Scalar) {
        for op in UnaryOp::EXACT {
            for a in self.operands(scalar) {
                if evaluate::unary(*op, scalar).is_some() {
                    self.push(OpKind::Unary(*op, a));
                }
            }
        }
    }

    fn binary(&mut self, scalar: Scalar) {
        for (a, b) in self.pairs(scalar) {
            for op in BinaryOp::ALL {
                if evaluate::binary(*op, scalar).is_some() {
                    self.push(OpKind::Binary(*op, a, b));
                }
            }
            for op in CompareOp::ALL {
                if evaluate::compare(*op, scalar).is_some() {
                    self.push(OpKind::Compare(*op, a, b));
                }
            }
        }
    }

    fn conversions(&mut self, scalar: Scalar) {
        for a in self.operands(scalar) {
            for to in Scalar::ALL {
                self.push(OpKind::Convert(to, a));
                if evaluate::bitcast(scalar, to).is_some() {
                    self.push(OpKind::Bitcast(to, a));
                }
            }
        }
    }

    fn ternary(&mut self, scalar: Scalar) {
        for (a, b) in self.pairs(scalar) {
            for condition in self.operands(Scalar::Bool) {
                self.push(OpKind::Select(condition, a, b));
            }
            if scalar == Scalar::F32 {
                for c in self.operands(scalar) {
                    self.push(OpKind::Fma(a, b, c));
                }
            }
        }
    }

    /// Accesses variables of every kind and several lengths, at indices of every kind.
    fn memory(&mut self, scalar: Scalar) {
        let kinds = [
            VariableKind::Scratch,
            VariableKind::Member,
            VariableKind::Buffer,
            VariableKind::Local,
        ];
        let values = self.operands(scalar);
        for kind in kinds {
            for len in [3, 9] {
                let name = format!("{}_{}_{len}", kind.name(), scalar.name());
                let variable = self.builder.variable(Variable { kind, name, scalar, len });
                for (index, value) in self.operands(Scalar::I32).into_iter().zip(&values).take(2) {
                    if kind == VariableKind::Local {
                        self.builder.push(OpKind::Store(variable, Index::Dynamic(index), *value));
                    }
                    self.push(OpKind::Load(variable, Index::Dynamic(index)));
                }
                self.push(OpKind::Load(variable, Index::Constant(len - 1)));
                if kind == VariableKind::Buffer {
                    self.push(OpKind::Length(variable));
                }
            }
        }
    }

    fn finish(mut self) -> Function {
        for scalar in Scalar::ALL {
            let results = self.results.iter().copied();
            let fitting: Vec<Value> =
                results.filter(|value| self.builder.scalar(*value) == scalar).collect();
            let variable = self.builder.variable(Variable {
                kind: VariableKind::Scratch,
                name: format!("results_{}", scalar.name()),
                scalar,
                len: fitting.len().max(1) as u32,
            });
            for (component, value) in fitting.into_iter().enumerate() {
                self.builder.output(variable, component as u32, value);
            }
        }
        self.builder.finish()
    }
}

fn check_operations(scalar: Scalar, add: fn(&mut Operations, Scalar)) {
    for seed in 0..scaled(1) {
        let mut operations = Operations::new(seed);
        add(&mut operations, scalar);
        let function = operations.finish();
        rtsl_ir::verify::verify(&function).unwrap();
        if let Err(difference) = Case::new(function, seed).check() {
            panic!("seed {seed}: {difference}");
        }
    }
}

#[test]
fn every_operation_on_f32() {
    check_operations(Scalar::F32, |operations, scalar| {
        operations.unary(scalar);
        operations.binary(scalar);
    });
    check_operations(Scalar::F32, Operations::ternary);
}

#[test]
fn every_operation_on_i32() {
    check_operations(Scalar::I32, |operations, scalar| {
        operations.unary(scalar);
        operations.binary(scalar);
    });
}

#[test]
fn every_operation_on_u32() {
    check_operations(Scalar::U32, |operations, scalar| {
        operations.unary(scalar);
        operations.binary(scalar);
        operations.ternary(scalar);
    });
}

#[test]
fn every_operation_on_bool() {
    check_operations(Scalar::Bool, |operations, scalar| {
        operations.unary(scalar);
        operations.binary(scalar);
        operations.ternary(scalar);
    });
}

#[test]
fn every_conversion() {
    for scalar in Scalar::ALL {
        check_operations(scalar, Operations::conversions);
    }
}

#[test]
fn every_kind_of_memory() {
    for scalar in [Scalar::F32, Scalar::I32, Scalar::Bool] {
        check_operations(scalar, Operations::memory);
    }
}

/// Accepts hits of some objects, at distances of which many are equal, infinite or NaN.
fn hits(gives_distance: bool) -> Function {
    let mut builder = Builder::new("Hits.intersect");
    let mut variable = |kind, name: &str, scalar, len| {
        builder.variable(Variable { kind, name: name.to_owned(), scalar, len })
    };
    let parts = variable(VariableKind::Member, "parts", Scalar::I32, 2);
    let flag = variable(VariableKind::Member, "flag", Scalar::Bool, 1);
    let distance = variable(VariableKind::State, "rt_HitDistance", Scalar::F32, 1);
    let seen = variable(VariableKind::Scratch, "seen", Scalar::I32, 2);
    let is_hit = variable(VariableKind::Scratch, "is_hit", Scalar::Bool, 1);
    let accepted = variable(VariableKind::Accepted, "accepted", Scalar::Bool, 1);
    let three = builder.constant(rtsl_ir::Constant::I32(3));
    let one = builder.constant(rtsl_ir::Constant::I32(1));
    let [numerator, denominator] = [0, 1].map(|index| {
        let part = builder.load(parts, index);
        let part = builder.binary(BinaryOp::And, part, three);
        let part = builder.binary(BinaryOp::Subtract, part, one);
        builder.convert(Scalar::F32, part)
    });
    let quotient = builder.binary(BinaryOp::Divide, numerator, denominator);
    let old = builder.load(distance, 0);
    let both = builder.load(seen, 0);
    let (first, flag) = (builder.load(parts, 0), builder.load(flag, 0));
    if gives_distance {
        builder.output(distance, 0, quotient);
    }
    let old = builder.push(OpKind::Bitcast(Scalar::I32, old)).get(0);
    let sum = builder.binary(BinaryOp::Add, both, old);
    builder.output(seen, 0, first);
    builder.output(seen, 1, sum);
    builder.output(is_hit, 0, flag);
    builder.output(accepted, 0, flag);
    builder.finish()
}

#[test]
fn the_leaf_mode_keeps_the_nearest_hit() {
    for seed in 0..scaled(12) {
        for gives_distance in [false, true] {
            let function = hits(gives_distance);
            rtsl_ir::verify::verify(&function).unwrap();
            if let Err(difference) = Case::new(function, seed).check() {
                panic!("seed {seed}: {difference}");
            }
        }
    }
}

/// Reads arrays of scratch at an index that depends on the object, and writes them.
#[test]
fn the_leaf_mode_reads_scratch_from_before_the_call() {
    for (scalar, is_member) in [(Scalar::F32, true), (Scalar::Bool, true), (Scalar::I32, false)] {
        let mut builder = Builder::new("Shift.lookup");
        let mut variable = |kind, name: &str, scalar, len| {
            builder.variable(Variable { kind, name: name.to_owned(), scalar, len })
        };
        let kind = if is_member { VariableKind::Member } else { VariableKind::Scratch };
        let index = variable(kind, "index", Scalar::I32, 1);
        let kept = variable(VariableKind::Scratch, "kept", scalar, 9);
        let local = variable(VariableKind::Local, "local", Scalar::I32, 2);
        let index = builder.load(index, 0);
        let three = builder.constant(rtsl_ir::Constant::I32(3));
        let shifted = builder.binary(BinaryOp::ShiftRight, index, three);
        // A value loaded from a local is unknown before the first chunk.
        builder.push(OpKind::Store(local, Index::Constant(0), shifted));
        let shifted = builder.load(local, 0);
        let masked = builder.constant(rtsl_ir::Constant::I32(7));
        let masked = builder.binary(BinaryOp::And, shifted, masked);
        for component in 0..9 {
            let offset = builder.constant(rtsl_ir::Constant::I32(component));
            let at = builder.binary(BinaryOp::Add, masked, offset);
            let value = builder.push(OpKind::Load(kept, Index::Dynamic(at))).get(0);
            builder.output(kept, component as u32, value);
        }
        let function = builder.finish();
        rtsl_ir::verify::verify(&function).unwrap();
        if let Err(difference) = Case::new(function, 7).check() {
            panic!("{scalar:?}: {difference}");
        }
    }
}
