//! Elements of an instance against instances made one by one.

use std::sync::Arc;

use rtsl::{
    Backend, CallArguments, CallMode, Class, Compiler, CompilerOptions, Engine, EngineOptions,
    Instance, Instances, LaneMask, Method, Numbers, Objects, Outputs, Program, Value, Variant,
    host::NoHost, lookup_state, new_state,
};

/// A member that depends on the element, one that the constructor computes for all alike, a public member that
/// it changes, a bool, and a parameter that it reads.
const MESH: &str = r#"
class Mesh : rt_Primitive;
public vec3 positions[];
public int indices[];
public float scale = 2.0;
public float swelling = 0.5;
[[element "indices", stride 3]] public int face;
private vec3 corner;
private vec3 edges[2];
private float total;
private bool odd;
constructor() {
    scale *= 2.0;
    total = scale + swelling;
    corner = total * positions[indices[3 * face]];
    for (int i = 0; i < 2; i += 1)
        edges[i] = total * positions[indices[3 * face + 1 + i]] - corner;
    odd = face % 2 == 1;
}
void computeBounds() {
    rt_BoundMin = corner + min(vec3(0.0), min(edges[0], edges[1]));
    rt_BoundMax = corner + max(vec3(0.0), max(edges[0], edges[1])) + (odd ? float(face) : scale);
}
"#;

/// The element is a parameter of the constructor.
const STARS: &str = r#"
class Stars : rt_Primitive;
public vec3 centers[];
private vec3 center;
private float radius;
constructor([[element "centers"]] uint star, float base = 3.0) {
    center = centers[int(star)];
    radius = base + 0.25 * float(star);
}
void computeBounds() {
    rt_BoundMin = center - radius;
    rt_BoundMax = center + radius;
}
"#;

/// The constructor changes the number, and a class has no more to do.
const COUNTED: &str = r#"
class Counted : rt_Primitive;
public float data[];
[[element "data", stride 2]] public int number;
constructor() { number = 3 * number + data.length(); }
"#;
/// There is no constructor.
const PLAIN: &str = r#"
class Plain : rt_Primitive;
public float data[];
[[element "data"]] public uint number;
"#;

fn class(text: &str) -> Arc<Class> {
    let compilation = Compiler::new(CompilerOptions::default()).compile("elements.rtsl", text);
    let unit = compilation.unit.as_ref().unwrap_or_else(|| panic!("{}", compilation.report(false)));
    unit.classes()[0].clone()
}

fn engine(backend: Backend, width: u32) -> Engine {
    let options = EngineOptions { backend, width: Some(width), ..Default::default() };
    Engine::new(options).unwrap().0
}

/// Numbers without a pattern.
fn floats(count: usize) -> Value {
    let number = |index: usize| (index as u32).wrapping_mul(0x9e37_79b9) as f32 / 1e8 - 20.0;
    Value::Numbers(Numbers::floats((0..count).map(number)))
}

fn indices(count: usize, positions: usize) -> Value {
    let index = |it: usize| (it * 7919 % positions) as i32;
    Value::Numbers(Numbers::ints((0..count).map(index)))
}

/// Compares every word that kernels read of elements with that of instances with their numbers.
fn check(engine: &Engine, class: &Arc<Class>, arguments: &[(&str, Value)], count: usize) {
    let instance = Instance::new(class, arguments.to_vec()).unwrap();
    assert_eq!(instance.element_count(), Some(count as u32));
    let program = engine.program(&instance);
    let elements = program.elements(&instance).unwrap();
    assert_eq!(elements.len(), count);
    for number in (0..count).step_by(1 + count / 100) {
        let name = class.element().unwrap().parameter;
        let number_argument = (name, Value::Int(number as i32));
        let one = Instance::new(class, arguments.iter().cloned().chain([number_argument])).unwrap();
        for variable in &class.members {
            let first = program.layout().members[&variable.name];
            for (index, word) in one.member(&variable.name).unwrap().iter().enumerate() {
                let found = word_of(&elements, number, first + index as u32);
                assert_eq!(found, *word, "{}[{index}] of element {number}", variable.name);
            }
        }
    }
}

fn word_of(elements: &Objects, number: usize, word: u32) -> u32 {
    match elements.form().position(word, 1) {
        Some(position) => elements.word(number, position as usize),
        None => elements.shared().words()[word as usize],
    }
}

fn mesh_arguments(faces: usize) -> [(&'static str, Value); 3] {
    [
        ("positions", floats(3 * 50)),
        ("indices", indices(3 * faces + 2, 50)),
        ("swelling", Value::Float(0.125)),
    ]
}

#[test]
fn elements_are_what_single_instances_are() {
    let [mesh, stars, counted, plain] = [MESH, STARS, COUNTED, PLAIN].map(class);
    for (backend, width) in [
        (Backend::Interpreter, 1),
        (Backend::Jit, 1),
        (Backend::Jit, 4),
        (Backend::Jit, 8),
        (Backend::Jit, 16),
    ] {
        let engine = engine(backend, width);
        // Up to 1024 the interpreter makes them, whoever is asked.
        for faces in [0, 1, 533, 1024 + 533] {
            check(&engine, &mesh, &mesh_arguments(faces), faces);
        }
        check(&engine, &stars, &[("centers", floats(3 * 21))], 21);
        check(&engine, &counted, &[("data", floats(19))], 9);
        check(&engine, &plain, &[("data", floats(19))], 19);
    }
}

#[test]
fn what_does_not_depend_on_the_element_stands_once() {
    let class = class(MESH);
    let instance = Instance::new(&class, mesh_arguments(20)).unwrap();
    let program = engine(Backend::Jit, 8).program(&instance);
    let elements = program.elements(&instance).unwrap();
    let members = &program.layout().members;
    let varies = |name: &str| elements.form().overlaps(members[name], 1);
    assert_eq!(["corner", "edges", "odd", "face"].map(varies), [true; 4]);
    assert_eq!(["total", "scale", "swelling"].map(varies), [false; 3]);
    assert_eq!(elements.form().words().len(), 3 + 6 + 1 + 1);
    let error = engine(Backend::Jit, 8);
    let plain = self::class("class P : rt_Primitive;\nvoid intersect() { hit(1.0); }");
    let plain = Instance::new(&plain, []).unwrap();
    assert!(error.program(&plain).elements(&plain).is_err());
}

/// Bounds of elements in a row, in other orders, and of one of them, are those of single instances.
#[test]
fn kernels_take_elements() {
    let class = class(MESH);
    let instance = Instance::new(&class, mesh_arguments(43)).unwrap();
    for (backend, width) in [
        (Backend::Interpreter, 1),
        (Backend::Jit, 1),
        (Backend::Jit, 4),
        (Backend::Jit, 8),
        (Backend::Jit, 16),
    ] {
        let program = engine(backend, width).program(&instance);
        let elements = program.elements(&instance).unwrap();
        let order: Vec<u32> = (0..elements.len() as u32).rev().collect();
        let reversed = elements.in_order(&order);
        let made_so = program.elements_in_order(&instance, None, &order).unwrap();
        for (number, word) in (0..order.len()).flat_map(|it| (0..11).map(move |word| (it, word))) {
            assert_eq!(made_so.word(number, word), reversed.word(number, word));
        }
        let bounds = bounds(&program, CallMode::Leaf, Instances::Range(&reversed, 8), 35);
        for (lane, found) in bounds.iter().enumerate() {
            let number = order[8 + lane];
            let argument = ("face", Value::Int(number as i32));
            let one =
                Instance::new(&class, mesh_arguments(43).into_iter().chain([argument])).unwrap();
            let one = program.block(&one);
            let kernel = program.kernel(Method::ComputeBounds, CallMode::Single).unwrap();
            let expected = run(&kernel, Instances::One(&one), 1);
            assert_eq!(found, &expected[0], "element {number}");
            let single =
                self::bounds(&program, CallMode::Packet, Instances::Object(&elements, number), 1);
            assert_eq!(single, expected, "element {number} by itself");
        }
    }
}

fn bounds(
    program: &Program,
    shape: CallMode,
    instances: Instances<'_>,
    count: usize,
) -> Vec<[u32; 6]> {
    let form = instances.objects().unwrap().form().clone();
    let read = ["rt_BoundMin", "rt_BoundMax"].map(|name| lookup_state(name).unwrap());
    let variant = Variant::new(shape).of_objects(form).reading(Outputs::state(read));
    run(&program.kernel(Method::ComputeBounds, variant).unwrap(), instances, count)
}

fn run(kernel: &rtsl::Kernel, instances: Instances<'_>, count: usize) -> Vec<[u32; 6]> {
    let mut state = new_state(count);
    let status = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut rtsl::LaneBlock::new(0, count),
        count,
        mask: None,
        accepted: Some(&mut LaneMask::new(count)),
        instances,
        host: &mut NoHost,
    });
    assert!(!status.budget_exhausted);
    bounds_of(&state, count)
}

fn bounds_of(state: &rtsl::LaneBlock, count: usize) -> Vec<[u32; 6]> {
    let first = lookup_state("rt_BoundMin").unwrap().first_component as usize;
    let second = lookup_state("rt_BoundMax").unwrap().first_component as usize;
    let components = [first, first + 1, first + 2, second, second + 1, second + 2];
    (0..count).map(|lane| components.map(|it| state.words(it)[lane])).collect()
}
