//! Kernels that violate one invariant each.

use rtsl_abi::CallMode;
use rtsl_ir::{
    BinaryOp, Constant, Index, Scalar, Value, Values, Variable, VariableId, VariableKind,
};
use rtsl_packet::kernel::{Kernel, KernelOutput, KernelVariable, Op, OpKind, Region, Type};
use rtsl_packet::verify;

/// Loads a state variable, a member in the prologue, and adds them:
/// %0 mask, %1 = 1.0, %2 = radius, %3 = t, %4 = %3 + %2, %5 = any %0.
fn valid() -> Kernel {
    let variable = |kind, name: &str, scalar, len, varies| KernelVariable {
        variable: Variable { kind, name: name.to_owned(), scalar, len },
        varies,
        location: 0,
        of_objects: false,
    };
    let op = |first, count, kind| Op { results: Values { first, count }, kind };
    Kernel {
        name: "f".to_owned(),
        mode: CallMode::Packet,
        width: 8,
        interleave: None,
        object_words: None,
        object_blocks: None,
        variables: vec![
            variable(VariableKind::State, "rt_HitDistance", Scalar::F32, 1, true),
            variable(VariableKind::Member, "radius", Scalar::F32, 1, false),
            variable(VariableKind::Local, "table", Scalar::F32, 4, false),
        ],
        values: vec![
            Type::MASK,
            Type::uniform(Scalar::F32),
            Type::uniform(Scalar::F32),
            Type::lanes(Scalar::F32),
            Type::lanes(Scalar::F32),
            Type::CONDITION,
        ],
        prologue: Region {
            ops: vec![
                op(1, 1, OpKind::Constant(Constant::F32(1.0))),
                op(2, 1, OpKind::Load(VariableId(1), Index::Constant(0))),
            ],
            ..Region::default()
        },
        body: Region {
            params: vec![Value(0)],
            ops: vec![
                op(3, 1, OpKind::Load(VariableId(0), Index::Constant(0))),
                op(4, 1, OpKind::Binary(BinaryOp::Add, Value(3), Value(2))),
                op(5, 1, OpKind::Any(Value(0))),
            ],
            yields: vec![Value(4)],
        },
        outputs: vec![KernelOutput { variable: VariableId(0), component: 0 }],
        places: rtsl_ir::Places::default(),
    }
}

fn append(kernel: &mut Kernel, results: &[Type], kind: OpKind) {
    let first = kernel.values.len() as u32;
    kernel.values.extend_from_slice(results);
    let results = Values { first, count: results.len() as u32 };
    kernel.body.ops.push(Op { results, kind });
}

#[test]
fn the_valid_kernel_is_valid() {
    assert_eq!(verify(&valid()), Ok(()));
}

#[test]
fn every_violated_invariant_is_found() {
    let float = Type::uniform(Scalar::F32);
    let lanes = Type::lanes(Scalar::F32);
    let store = |value, mask| OpKind::Store {
        variable: VariableId(2),
        index: Index::Constant(0),
        value: Value(value),
        mask,
    };
    let branch = |condition, yields: Vec<Value>| OpKind::If {
        condition: Value(condition),
        then: Region { yields, ..Region::default() },
        otherwise: Region { yields: vec![Value(2)], ..Region::default() },
    };
    type Break<'a> = Box<dyn Fn(&mut Kernel) + 'a>;
    let broken: Vec<(&str, Break<'_>)> = vec![
        ("width 3", Box::new(|k| k.width = 3)),
        ("there are no blocks of them", Box::new(|k| k.mode = CallMode::Stream)),
        ("radius is not in the blocks of objects", Box::new(|k| k.variables[1].of_objects = true)),
        (
            "rt_HitDistance is not in the blocks of objects",
            Box::new(|k| {
                k.object_words = Some(9);
                k.variables[0].of_objects = true;
            }),
        ),
        ("%3 is used where it is not visible", Box::new(|k| k.body.ops.swap(0, 1))),
        ("%2 is used where it is not visible", Box::new(|k| k.prologue.ops.truncate(1))),
        (
            "%3 in the prologue is lanes",
            Box::new(|k| {
                let load = k.body.ops.remove(0);
                k.prologue.ops.push(load);
            }),
        ),
        ("the results have the wrong types", Box::new(|k| k.values[4] = float)),
        ("the results have the wrong types", Box::new(|k| k.values[4] = Type::lanes(Scalar::I32))),
        (
            "%0 is not f32",
            Box::new(|k| {
                append(k, &[lanes], OpKind::Binary(BinaryOp::Add, Value(3), Value(0)));
            }),
        ),
        (
            "the operation does not take the operand's type",
            Box::new(|k| {
                append(k, &[lanes], OpKind::Binary(BinaryOp::And, Value(3), Value(3)));
            }),
        ),
        ("%3 is not a mask", Box::new(|k| append(k, &[Type::CONDITION], OpKind::Any(Value(3))))),
        ("%0 is not a uniform bool", Box::new(|k| append(k, &[float], branch(0, vec![Value(2)])))),
        ("the number of values is wrong", Box::new(|k| append(k, &[float], branch(5, Vec::new())))),
        (
            "%3 is lanes, expected a uniform value",
            Box::new(|k| {
                append(k, &[float], branch(5, vec![Value(3)]));
            }),
        ),
        ("%5 is not a mask", Box::new(|k| append(k, &[lanes], OpKind::Rand(Value(5))))),
        (
            "index 4",
            Box::new(|k| {
                append(k, &[float], OpKind::Load(VariableId(2), Index::Constant(4)));
            }),
        ),
        (
            "no variable 9",
            Box::new(|k| {
                append(k, &[float], OpKind::Load(VariableId(9), Index::Constant(0)));
            }),
        ),
        (
            "the variable is not a buffer",
            Box::new(|k| {
                append(k, &[Type::uniform(Scalar::I32)], OpKind::Length(VariableId(1)));
            }),
        ),
        ("lanes are stored to a uniform local", Box::new(|k| append(k, &[], store(3, None)))),
        (
            "lanes are stored to a uniform local",
            Box::new(|k| append(k, &[], store(2, Some(Value(0))))),
        ),
        (
            "the prologue has an effect",
            Box::new(|k| {
                let results = Values { first: 6, count: 0 };
                k.prologue.ops.push(Op { results, kind: store(2, None) });
            }),
        ),
        ("the numbers of outputs and yields differ", Box::new(|k| k.body.yields.push(Value(3)))),
        ("radius[0] cannot be an output", Box::new(|k| k.outputs[0].variable = VariableId(1))),
        ("%1 is defined twice", Box::new(|k| k.prologue.ops.push(k.prologue.ops[0].clone()))),
        ("the body does not have one parameter", Box::new(|k| k.body.params.clear())),
        (
            "%6 has no type",
            Box::new(|k| {
                let results = Values { first: 6, count: 1 };
                k.body.ops.push(Op { results, kind: OpKind::Unspecified });
            }),
        ),
    ];
    for (what, break_rule) in broken {
        let mut kernel = valid();
        break_rule(&mut kernel);
        let error = verify(&kernel).expect_err(what).to_string();
        assert!(error.contains(what), "{error}\nis not: {what}");
    }
}
