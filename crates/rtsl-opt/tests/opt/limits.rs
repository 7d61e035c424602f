//! Large and deeply nested functions: bounded time, and no overflow of the stack of a small thread.

use rtsl_ir::verify::verify;
use rtsl_ir::{
    BinaryOp, Builder, CompareOp, Function, Interpreter, MAX_NESTING, Scalar, Variable, VariableId,
    VariableKind,
};
use rtsl_opt::{Options, optimize};
use rtsl_testing::functions::{Entropy, HashHost, Memory};

fn builder() -> (Builder, VariableId) {
    let mut builder = Builder::new("Large.method");
    let (kind, name) = (VariableKind::Scratch, "s".to_owned());
    let variable = builder.variable(Variable { kind, name, scalar: Scalar::F32, len: 4 });
    (builder, variable)
}

fn optimize_and_run(mut function: Function) {
    verify(&function).unwrap();
    let parsed: Function = function.to_string().parse().unwrap();
    assert_eq!(parsed.values.len(), function.values.len());
    optimize(&mut function, &Options { budget: Some(1000), ..Options::default() });
    let mut memory = Memory::new(&function, &mut Entropy::new(&[]));
    Interpreter::prepare(&function).unwrap().run(0, &mut memory, &mut HashHost::default());
}

/// The greatest depth that the verifier accepts, alternating between `if` and loops.
#[test]
fn the_deepest_nesting() {
    let (mut builder, variable) = builder();
    let zero = builder.f32(0.0);
    let x = builder.load(variable, 0);
    let condition = builder.compare(CompareOp::Less, x, zero);
    let local = builder.local("t", Scalar::F32, 2);
    let mut value = x;
    for depth in 0..MAX_NESTING {
        if depth % 2 == 0 {
            builder.begin_region();
        } else {
            value = builder.begin_loop(vec![value]).get(0);
        }
        value = builder.add(value, x);
        builder.store(local, 1, value);
    }
    for depth in (0..MAX_NESTING).rev() {
        if depth % 2 == 0 {
            let then = builder.end_region(vec![value]);
            builder.begin_region();
            let otherwise = builder.end_region(vec![x]);
            value = builder.if_regions(condition, then, otherwise).get(0);
        } else {
            value = builder.end_loop(condition, &[value]).get(0);
        }
    }
    let stored = builder.load(local, 1);
    builder.output(variable, 0, value);
    builder.output(variable, 1, stored);
    optimize_and_run(builder.finish());
}

/// A flat function with very many operations.
#[test]
fn very_many_operations() {
    let (mut builder, variable) = builder();
    let x = builder.load(variable, 0);
    let mut value = x;
    for round in 0..10_000 {
        let constant = builder.f32(round as f32);
        let product = builder.multiply(value, constant);
        let sum = builder.add(product, x);
        let condition = builder.compare(CompareOp::Less, sum, constant);
        value = builder.if_(condition, |_| vec![sum], |builder| vec![builder.add(sum, x)]).get(0);
    }
    builder.output(variable, 0, value);
    optimize_and_run(builder.finish());
}

/// Very many loops, each with the same small number of iterations.
#[test]
fn very_many_loops() {
    let (mut builder, variable) = builder();
    let (zero, one, four) = (builder.i32(0), builder.i32(1), builder.i32(4));
    let local = builder.local("t", Scalar::F32, 8);
    let mut value = builder.load(variable, 0);
    for _ in 0..1_500 {
        let results = builder.loop_(vec![zero, value], |builder, carried| {
            let counter = carried.get(0);
            builder.store_at(local, counter, carried.get(1));
            let sum = builder.binary(BinaryOp::Max, carried.get(1), value);
            let next = builder.add(counter, one);
            let again = builder.compare(CompareOp::Less, next, four);
            (again, vec![next, sum])
        });
        value = results.get(1);
    }
    let stored = builder.load(local, 3);
    builder.output(variable, 0, value);
    builder.output(variable, 1, stored);
    optimize_and_run(builder.finish());
}
