use std::collections::BTreeMap;
use std::sync::Arc;

use expect_test::{Expect, expect};
use rtsl_ir::class::{
    Annotation, AnnotationValue, Class, Parameter, ParameterTarget, ParameterType, Reference,
    ReferenceCount,
};
use rtsl_ir::{Constant, Function, Scalar, Variable, VariableKind};
use rtsl_spec::Role;

use super::instance::Instance;
use super::value::{Numbers, Value};

fn variable(kind: VariableKind, name: &str, scalar: Scalar, len: u32) -> Variable {
    Variable { kind, name: name.to_owned(), scalar, len }
}

fn parameter(name: &str, ty: ParameterType, target: ParameterTarget, required: bool) -> Parameter {
    Parameter { name: name.to_owned(), ty, target, required, annotations: Vec::new() }
}

/// A class with a parameter of every kind. Its constructor sets `area = radius * radius * k` from its
/// parameter `k`, 2 where it is not given, and the first element of `table`.
fn class() -> Arc<Class> {
    use ParameterType::{Array, Buffer, Color, Matrix, Scalar as One, Struct, Vector};
    let spot = Struct(
        "Spot".to_owned(),
        vec![("at".to_owned(), Vector(Scalar::F32, 2)), ("on".to_owned(), One(Scalar::Bool))],
    );
    let member = |name, ty| parameter(name, ty, ParameterTarget::Member, false);
    let range = |key: &str, value| Annotation {
        key: key.to_owned(),
        value: AnnotationValue::Constant(Constant::F32(value)),
    };
    let mut radius = parameter("radius", One(Scalar::F32), ParameterTarget::Member, true);
    radius.annotations = vec![range("min", 0.0), range("max", 10.0)];
    let reference = ParameterType::Reference(Role::Texture);
    Arc::new(Class {
        name: "Ball".to_owned(),
        roles: vec![Role::Primitive],
        documentation: None,
        parameters: vec![
            parameter("k", One(Scalar::F32), ParameterTarget::Constructor, false),
            radius,
            member("count", One(Scalar::U32)),
            member("flags", Vector(Scalar::Bool, 2)),
            member("center", Vector(Scalar::F32, 3)),
            member("frame", Matrix(2, 2)),
            member("tint", Color),
            member("spots", Array(Box::new(spot), 2)),
            member("table", Buffer(Box::new(Vector(Scalar::F32, 2)))),
            member("skin", reference.clone()),
            member("layers", Array(Box::new(reference), 2)),
        ],
        members: vec![
            variable(VariableKind::Member, "radius", Scalar::F32, 1),
            variable(VariableKind::Member, "count", Scalar::U32, 1),
            variable(VariableKind::Member, "flags", Scalar::Bool, 2),
            variable(VariableKind::Member, "center", Scalar::F32, 3),
            variable(VariableKind::Member, "frame", Scalar::F32, 4),
            variable(VariableKind::Member, "tint", Scalar::F32, 3),
            variable(VariableKind::Member, "spots.at", Scalar::F32, 4),
            variable(VariableKind::Member, "spots.on", Scalar::Bool, 2),
            variable(VariableKind::Member, "area", Scalar::F32, 1),
        ],
        buffers: vec![variable(VariableKind::Buffer, "table", Scalar::F32, 2)],
        scratch: Vec::new(),
        scratch_types: Vec::new(),
        outputs: Vec::new(),
        method_documentation: Default::default(),
        is_traced: false,
        differentiable: Default::default(),
        attributes: Vec::new(),
        references: vec![
            Reference {
                name: "skin".to_owned(),
                role: Role::Texture,
                count: ReferenceCount::Single,
                tested: false,
            },
            Reference {
                name: "layers".to_owned(),
                role: Role::Texture,
                count: ReferenceCount::Array(2),
                tested: false,
            },
        ],
        initializer: INITIALIZER.parse().unwrap(),
        constructor: Some(CONSTRUCTOR.parse().unwrap()),
        methods: BTreeMap::new(),
    })
}

const INITIALIZER: &str = "
function Ball.initializer
parameter k: f32[1]
member center: f32[3]
{
  %two: f32 = constant 2.0
  %seven: f32 = constant 7.0
  return parameter:k@0 = %two, member:center@1 = %seven
}";

const CONSTRUCTOR: &str = "
function Ball.constructor
parameter k: f32[1]
member radius: f32[1]
member area: f32[1]
buffer table: f32[2]
{
  %k: f32 = load parameter:k@0
  %r: f32 = load member:radius@0
  %t: f32 = load buffer:table@0
  %n: i32 = length buffer:table
  %f: f32 = convert %n
  %a: f32 = multiply %r, %r
  %b: f32 = multiply %a, %k
  %c: f32 = add %b, %t
  %d: f32 = add %c, %f
  return member:area@0 = %d
}";

fn floats(instance: &Instance, member: &str) -> Vec<f32> {
    instance.member(member).unwrap().iter().copied().map(f32::from_bits).collect()
}

fn texture() -> Arc<Instance> {
    let class = Class { name: "Paint".to_owned(), roles: vec![Role::Texture], ..plain() };
    Instance::new(&Arc::new(class), []).unwrap()
}

fn plain() -> Class {
    Class {
        parameters: Vec::new(),
        members: Vec::new(),
        buffers: Vec::new(),
        references: Vec::new(),
        initializer: Function::new("Plain.initializer"),
        constructor: None,
        ..(*class()).clone()
    }
}

#[test]
fn initializers_arguments_and_constructor_work_in_this_order() {
    let ball = Instance::new(&class(), [("radius", 3.0.into())]).unwrap();
    assert_eq!(floats(&ball, "area"), [18.0]);
    assert_eq!(floats(&ball, "center"), [0.0, 7.0, 0.0]);
    let table = Numbers::floats([100.0, 0.0, 0.0, 0.0]);
    let arguments = [("radius", 3.into()), ("k", 10.0.into()), ("table", table.into())];
    let ball = Instance::new(&class(), arguments).unwrap();
    assert_eq!(floats(&ball, "area"), [192.0]);
}

#[test]
fn values_of_every_type_reach_their_places() {
    let spot = |x: f32, on: bool| {
        let at = Value::from([x, x + 1.0]);
        Value::Struct(vec![("on".to_owned(), on.into()), ("at".to_owned(), at)])
    };
    let ball = Instance::new(
        &class(),
        [
            ("radius", 1.0.into()),
            ("count", 7.into()),
            ("flags", [true, false].into()),
            ("center", [1, 2, 3].into()),
            ("frame", [[1.0, 2.0], [3.0, 4.0]].into()),
            ("tint", 0.5.into()),
            ("spots", vec![spot(1.0, true), spot(3.0, false)].into()),
            ("table", [1.0, 2.0, 3.0, 4.0].into()),
            ("skin", texture().into()),
            ("layers", [texture(), texture()].into()),
        ],
    )
    .unwrap();
    assert_eq!(ball.member("count").unwrap(), [7]);
    assert_eq!(ball.member("flags").unwrap(), [1, 0]);
    assert_eq!(floats(&ball, "center"), [1.0, 2.0, 3.0]);
    assert_eq!(floats(&ball, "frame"), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(floats(&ball, "tint"), [0.5, 0.5, 0.5]);
    assert_eq!(floats(&ball, "spots.at"), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(ball.member("spots.on").unwrap(), [1, 0]);
    assert_eq!(ball.reference("layers[1]").unwrap().class().name, "Paint");
    assert!(ball.reference("layers[2]").is_none());

    let layout = ball.tree().variables().layout();
    let block = ball.block(&layout);
    assert_eq!(block.words()[layout.members["count"] as usize], 7);
    assert_eq!(block.buffers()[0].elements(), 2);
}

fn check_errors(arguments: Vec<(&str, Value)>, expected: Expect) {
    let problems = Instance::new(&class(), arguments).unwrap_err();
    let text: String = problems
        .iter()
        .map(|problem| {
            let more = problem.notes.iter().chain(&problem.help);
            let more: String = more.map(|line| format!("  {line}\n")).collect();
            format!("{}: {}\n{more}", problem.code, problem.message)
        })
        .collect();
    expected.assert_eq(&text);
}

#[test]
fn every_problem_is_told() {
    check_errors(
        vec![
            ("raduis", 1.0.into()),
            ("colour_of_the_hull", 1.0.into()),
            ("k", [1.0, 2.0].into()),
            ("count", Value::Int(-1)),
            ("flags", [1, 0].into()),
            ("center", 1.0.into()),
            ("tint", texture().into()),
            ("spots", vec![Value::Struct(Vec::new()), Value::Bool(true)].into()),
            ("table", [1.0, 2.0, 3.0].into()),
            ("layers", texture().into()),
        ],
        expect![[r#"
            E0502: `Ball` has no parameter `raduis`
              did you mean `radius`?
            E0502: `Ball` has no parameter `colour_of_the_hull`
              it has `k`, `radius`, `count`, `flags`, `center`, `frame`, `tint`, `spots`, `table`, `skin` and `layers`
            E0503: the parameter `k` of `Ball` is a float, found a list of 2 values
            E0503: the parameter `count` of `Ball` is a uint, found an int
            E0503: the parameter `flags` of `Ball` is a bvec2, found a list of 2 values
            E0503: the parameter `center` of `Ball` is a vec3, found a float
            E0503: the parameter `tint` of `Ball` is a color, found an instance of `Paint`
            E0503: the parameter `spots` of `Ball` is a Spot, found a struct without `at`
            E0503: the parameter `table` of `Ball` is a vec2[], found a list of 3 values
            E0503: the parameter `layers` of `Ball` is a rt_Texture[2], found an instance of `Paint`
            E0501: the parameter `radius` of `Ball` must be set
              `radius` is a float
        "#]],
    );
    check_errors(
        vec![("radius", Value::Float(f32::INFINITY))],
        expect![[r#"
        E0504: the parameter `radius` of `Ball` is out of range: inf is not between 0 and 10
    "#]],
    );
    check_errors(
        vec![("radius", Value::Float(f32::NAN))],
        expect![[r#"
        E0504: the parameter `radius` of `Ball` is out of range: NaN is not between 0 and 10
    "#]],
    );
    let other = Class { name: "Glow".to_owned(), roles: vec![Role::Light], ..plain() };
    let other = Instance::new(&Arc::new(other), []).unwrap();
    check_errors(
        vec![("radius", 1.into()), ("skin", other.into())],
        expect![[r#"
        E0506: the parameter `skin` of `Ball` is a texture, and `Glow` is none
    "#]],
    );
}

#[test]
fn values_outside_of_their_ranges_are_taken_and_told() {
    let told = |radius: f32| {
        let ball = Instance::new(&class(), [("radius", radius.into())]).unwrap();
        assert_eq!(floats(&ball, "radius"), [radius]);
        let told = ball.outside_range().iter();
        told.map(|it| format!("{} {}", it.parameter, it.warning.message)).collect::<Vec<_>>()
    };
    assert_eq!(told(10.0), [""; 0]);
    let warning = "radius the parameter `radius` of `Ball` is outside of its range: ";
    assert_eq!(told(10.5), [format!("{warning}10.5 is not between 0 and 10")]);
    assert_eq!(told(-0.1), [format!("{warning}-0.1 is not between 0 and 10")]);
}

#[test]
fn chains_and_trees_of_references_are_bounded() {
    let class = Class {
        name: "Twice".to_owned(),
        roles: vec![Role::Texture],
        parameters: ["a", "b"]
            .map(|name| {
                let ty = ParameterType::Reference(Role::Texture);
                parameter(name, ty, ParameterTarget::Member, false)
            })
            .into(),
        references: ["a", "b"]
            .map(|name| Reference {
                name: name.to_owned(),
                role: Role::Texture,
                count: ReferenceCount::Single,
                tested: true,
            })
            .into(),
        ..plain()
    };
    let class = Arc::new(class);
    let grow = |names: &[&'static str]| {
        let mut instance = Instance::new(&class, []).unwrap();
        for step in 1..100 {
            let arguments = names.iter().map(|name| (*name, instance.clone().into()));
            match Instance::new(&class, arguments.collect::<Vec<_>>()) {
                Ok(next) => instance = next,
                Err(problems) => {
                    let codes: Vec<_> = problems.iter().map(|it| it.code.as_str()).collect();
                    assert_eq!(codes, ["E0509"]);
                    return step;
                }
            }
        }
        100
    };
    assert_eq!((grow(&["a"]), grow(&["a", "b"])), (64, 12));
}
