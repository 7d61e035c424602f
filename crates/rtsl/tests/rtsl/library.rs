//! Every shader of the standard library compiles without a word, and its methods give the same
//! bits on the interpreter and at every width.

use std::sync::Arc;

use rtsl::host::{Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, RayLanes};
use rtsl::{
    Backend, CallArguments, CallMode, Class, Compiler, CompilerOptions, Emit, EmitRequest, Engine,
    EngineOptions, Instance, Instances, KernelRequest, LaneBlock, LaneIndices, LaneMask, Method,
    ParameterType, Scalar, Trace, TraceDetail, Value, Variant, library, new_state,
};
use rtsl_testing::turns::{is_long_run, ways};

const COUNT: usize = 37;
/// The first object in the leaf shape.
const FIRST: u32 = 8;

/// Numbers in no order, the same in every run.
struct Noise(u32);

impl Noise {
    fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((self.0 >> ((self.0 >> 28) + 4)) ^ self.0).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    }

    /// In [0,1).
    fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / (1 << 24) as f32
    }

    /// Mostly of the sizes that scenes have; sometimes an edge.
    fn number(&mut self) -> f32 {
        const EDGES: [f32; 8] =
            [0.0, -0.0, 1.0, -1.0, f32::INFINITY, f32::NAN, 1e-30, f32::NEG_INFINITY];
        match self.bits() % 16 {
            0 => EDGES[(self.bits() % 8) as usize],
            1..=5 => self.unit(),
            _ => self.unit() * 4.0 - 2.0,
        }
    }
}

/// The bits, those of all NaNs alike: which NaN arithmetic makes is not defined.
fn canonical(value: f32) -> u32 {
    if value.is_nan() { f32::NAN.to_bits() } else { value.to_bits() }
}

/// A host whose answers depend on the ray and the request alone.
struct Answers;

fn answer(lanes: LaneSet, lane: usize, seed: f32) -> f32 {
    let ray = lanes.base + lane as u32;
    Noise(ray.wrapping_mul(77_771) ^ canonical(seed)).unit()
}

impl Host for Answers {
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        for lane in lanes.iter() {
            for (component, color) in radiance.iter_mut().enumerate() {
                let seed = rays.direction[component % 3][lane] + rays.weight[lane];
                color[lane] = answer(lanes, lane, seed);
            }
        }
    }

    fn occluded(&mut self, lanes: LaneSet, rays: &RayLanes) -> u32 {
        let hit = |lane: &usize| answer(lanes, *lane, rays.limit[*lane]) < 0.5;
        lanes.iter().filter(hit).fold(0, |bits, lane| bits | 1 << lane)
    }

    fn light_count(&mut self) -> u32 {
        3
    }

    fn light_sample(
        &mut self,
        lanes: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        let mut reached = 0;
        for lane in lanes.iter() {
            // The number of the ray, not of the lane, decides.
            let ray = lanes.base + lane as u32;
            let mut next = Noise(canonical(query.point[0][lane]) ^ index ^ ray << 8);
            light.direction.iter_mut().for_each(|it| it[lane] = next.unit() * 2.0 - 1.0);
            light.color.iter_mut().for_each(|it| it[lane] = next.unit());
            light.distance[lane] = next.unit();
            light.pdf[lane] = next.unit();
            reached |= u32::from(next.unit() < 0.8) << lane;
        }
        reached
    }

    fn ambient(&mut self) -> [f32; 3] {
        [0.1, 0.2, 0.3]
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        lanes.iter().for_each(|lane| values[lane] = answer(lanes, lane, 0.5));
    }
}

/// A value for a parameter that has no default.
fn some_value(ty: &ParameterType) -> Value {
    let scalar = |scalar: &Scalar| match scalar {
        Scalar::F32 => Value::Float(0.75),
        Scalar::I32 => Value::Int(2),
        Scalar::U32 => Value::Uint(2),
        Scalar::Bool => Value::Bool(true),
    };
    match ty {
        ParameterType::Scalar(it) => scalar(it),
        ParameterType::Vector(it, count) => Value::List((0..*count).map(|_| scalar(it)).collect()),
        ParameterType::Color => Value::Float(0.75),
        ParameterType::Matrix(columns, rows) => {
            let identity = |at: u8| if at / rows == at % rows { 1.0 } else { 0.0 };
            Value::List((0..columns * rows).map(|at| Value::Float(identity(at))).collect())
        }
        ParameterType::Struct(_, fields) => {
            let each = fields.iter().map(|(name, ty)| (name.clone(), some_value(ty)));
            Value::Struct(each.collect())
        }
        ParameterType::Array(element, count) => {
            Value::List((0..*count).map(|_| some_value(element)).collect())
        }
        ParameterType::Buffer(element) => Value::List(vec![some_value(element); 5]),
        ParameterType::Textured(value) => some_value(value),
        ParameterType::Reference(_) => unreachable!("references are not required"),
    }
}

fn instance(class: &Arc<Class>) -> Arc<Instance> {
    let required = class.parameters.iter().filter(|it| it.required);
    let arguments = required.map(|it| (it.name.as_str(), some_value(&it.ty)));
    Instance::new(class, arguments).unwrap_or_else(|problems| {
        panic!("{}: {:?}", class.name, problems.into_vec());
    })
}

/// The code that runs a method.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Code {
    /// The engine's kernel.
    Kernel,
    /// The same, with the instance's members known.
    Specialised,
    /// Packet code on its interpreter.
    Packets,
}

/// The bits that a call leaves, NaNs made equal; rays are left out if `masked`.
fn call(
    engine: &Engine,
    class: &Arc<Class>,
    method: Method,
    shape: CallMode,
    code: Code,
    masked: bool,
) -> Vec<u32> {
    let instance = instance(class);
    let program = engine.program(&instance);
    let mut noise = Noise(method as u32);
    let mut fill = |block: &mut LaneBlock| {
        for component in 0..block.components() {
            block.floats_mut(component).fill_with(|| noise.number());
        }
    };
    let (mut state, mut scratch) = (new_state(COUNT), program.new_scratch(COUNT));
    fill(&mut state);
    fill(&mut scratch);
    let mask = LaneMask::from_fn(COUNT, |_| noise.unit() < 0.7);
    let mut accepted = LaneMask::new(COUNT);
    let block = program.block(&instance);
    let index = LaneIndices::new(COUNT);
    let objects = program.objects(std::iter::repeat_n(&*instance, FIRST as usize + COUNT));
    let arguments = CallArguments {
        state: &mut state,
        scratch: &mut scratch,
        count: if shape == CallMode::Single { 1 } else { COUNT },
        mask: (masked && shape != CallMode::Single).then_some(&mask),
        accepted: Some(&mut accepted),
        instances: match shape {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => Instances::One(&block),
            CallMode::Stream => Instances::Many(&objects, &index),
            CallMode::Leaf => Instances::Range(&objects, FIRST),
        },
        host: &mut Answers,
    };
    let status = match code {
        Code::Kernel => program.kernel(method, shape).map(|it| it.call(arguments)),
        Code::Specialised => {
            let variant = Variant::new(shape).knowing(program.known_members(&instance));
            program.kernel(method, variant).map(|it| it.call(arguments))
        }
        Code::Packets => {
            program.packet_kernel(method, shape).map(|it| it.run(arguments, u64::MAX).status)
        }
    };
    let _ = status.unwrap_or_else(|error| panic!("{}.{}: {error:?}", class.name, method.name()));
    let words = |block: &LaneBlock| -> Vec<u32> {
        let all = (0..block.components()).flat_map(|it| block.floats(it));
        all.map(|value| canonical(*value)).collect()
    };
    let mut all = words(&state);
    all.extend(words(&scratch));
    all.extend((0..COUNT).map(|lane| u32::from(accepted.get(lane))));
    all
}

fn engine(backend: Backend, width: u32) -> Option<Engine> {
    let options = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
    Engine::new(options).ok().map(|(engine, _)| engine)
}

#[test]
fn the_prelude_and_every_file_compile_without_a_word() {
    let compiler = Compiler::default();
    for file in library::files() {
        let compilation = compiler.compile(file.path, file.text);
        assert_eq!(compilation.report(false), "", "{}", file.path);
        let name = file.path.rsplit('/').next().unwrap();
        let include = format!("#include \"{name}\"");
        let is_included = library::files().iter().any(|other| other.text.contains(&include));
        // Texts of translated documents import these.
        let is_module = file.path.starts_with("shaders/materialx/");
        let unit = compilation.unit.unwrap();
        let classes: Vec<&str> = unit.classes().iter().map(|class| class.name.as_str()).collect();
        assert!(is_included || is_module || !classes.is_empty(), "{}", file.path);
        // Names are found without parsing.
        let declared: Vec<&str> = library::declared_classes(file.text).collect();
        assert_eq!(declared, classes, "{}", file.path);
    }
}

/// The results of all methods of the classes, made together.
fn call_all(
    engine: &Engine,
    classes: &[Arc<Class>],
    shape: CallMode,
    code: Code,
) -> Vec<(String, Vec<u32>)> {
    let programs: Vec<_> = classes.iter().map(|it| engine.program(&instance(it))).collect();
    let requests = classes.iter().zip(&programs).flat_map(|(class, program)| {
        kernels(class).map(|method| KernelRequest::new(program, method, shape))
    });
    if let Code::Kernel = code {
        let kernels = engine.compile_all(&requests.collect::<Vec<_>>());
        assert!(kernels.iter().all(Result::is_ok));
    }
    let each = classes.iter().flat_map(|class| {
        let calls = kernels(class).flat_map(|it| [(it, false), (it, true)]);
        calls.map(move |(method, masked)| {
            let (shape_name, mask) = (shape.name(), if masked { ", masked" } else { "" });
            let name = format!("{}.{} {shape_name}{mask}", class.name, method.name());
            (name, call(engine, class, method, shape, code, masked))
        })
    });
    each.collect()
}

/// The methods that have kernels: those of integrators ask the scene, and only the interpreter calls them.
fn kernels(class: &Class) -> impl Iterator<Item = Method> {
    class.methods.keys().copied().filter(|method| *method != Method::Radiance)
}

/// All classes of the library.
fn classes() -> Vec<Arc<Class>> {
    classes_of(&Compiler::default())
}

fn classes_of(compiler: &Compiler) -> Vec<Arc<Class>> {
    let units = library::files().iter().filter_map(|it| compiler.compile(it.path, it.text).unit);
    units.flat_map(|unit| unit.classes().to_vec()).collect()
}

/// Compares the methods of the classes with the oracle.
fn check(classes: &[Arc<Class>], shape: CallMode, runs: &[(u32, Code)]) {
    let oracle = engine(Backend::Interpreter, 1).unwrap();
    let expected = call_all(&oracle, classes, shape, Code::Kernel);
    for (width, code) in runs {
        let backend = match code {
            Code::Kernel | Code::Specialised => Backend::Jit,
            Code::Packets => Backend::Interpreter,
        };
        let Some(engine) = engine(backend, *width) else { continue };
        let found = call_all(&engine, classes, shape, *code);
        for ((name, expected), (_, found)) in expected.iter().zip(&found) {
            if let Some(at) = (0..expected.len()).find(|at| expected[*at] != found[*at]) {
                panic!(
                    "{name}, {code:?} at width {width}: component {}, ray {}: {:#x}, {:#x}",
                    at / COUNT,
                    at % COUNT,
                    expected[at],
                    found[at],
                );
            }
        }
    }
}

/// The classes with each of the ways to run methods: in long runs all, in ordinary runs those whose turn it is.
fn taking_turns<T: Clone + PartialEq>(all: &[T]) -> Vec<(T, Vec<Arc<Class>>)> {
    let classes = classes();
    let those_of = |way: &T| {
        let due = classes.iter().enumerate().filter(|(index, _)| ways(all, *index).contains(way));
        due.map(|(_, class)| class.clone()).collect()
    };
    all.iter().map(|way| (way.clone(), those_of(way))).collect()
}

#[test]
fn every_method_gives_the_oracles_bits_for_packets() {
    check(&classes(), CallMode::Packet, &[(8, Code::Packets), (8, Code::Kernel)]);
}

#[test]
fn every_method_gives_the_oracles_bits_at_other_widths() {
    for (width, classes) in taking_turns(&[1, 4, 16]) {
        let runs = [(width, Code::Packets), (width, Code::Kernel)];
        check(&classes, CallMode::Packet, &runs);
    }
}

#[test]
fn every_method_gives_the_oracles_bits_in_other_call_modes_and_with_known_members() {
    let all: &[Code] = &[Code::Packets, Code::Kernel, Code::Specialised];
    let code = if is_long_run() { all } else { &all[..2] };
    let ways = [
        (CallMode::Leaf, 8, code),
        (CallMode::Stream, 8, code),
        (CallMode::CommonOrigin, 8, code),
        (CallMode::Single, 1, code),
        (CallMode::Packet, 8, &all[2..]),
    ];
    for ((mode, width, code), classes) in taking_turns(&ways) {
        let runs: Vec<(u32, Code)> = code.iter().map(|code| (width, *code)).collect();
        check(&classes, mode, &runs);
    }
}

/// On an engine without a trace, traced classes have the operations of others, so that a host may trace all of them.
#[test]
fn traces_leave_nothing_in_code() {
    let traced = Compiler::new(CompilerOptions { traced: true, ..CompilerOptions::default() });
    let engine = engine(Backend::Interpreter, 1).unwrap();
    let operations = |class: &Arc<Class>, method: Method| {
        let variant = CallMode::Packet.into();
        let request = EmitRequest { emit: Emit::Packet, method, variant, target: None };
        let text = engine.program(&instance(class)).emit(&request).expect("it has packet code");
        String::from_utf8(text).expect("it is text").lines().count()
    };
    for (plain, traced) in classes().iter().zip(&classes_of(&traced)) {
        for method in kernels(plain) {
            let name = format!("{}.{}", plain.name, method.name());
            assert_eq!(operations(traced, method), operations(plain, method), "{name}");
        }
    }
}

/// Traced classes, which report assignments and calls, give the bits of others, on an engine that
/// records a trace and on one without.
#[test]
fn traces_change_no_bits() {
    let traced = Compiler::new(CompilerOptions { traced: true, ..CompilerOptions::default() });
    let traced = classes_of(&traced);
    let shape = CallMode::Packet;
    let oracle = engine(Backend::Interpreter, 1).unwrap();
    let expected = call_all(&oracle, &classes(), shape, Code::Kernel);
    let trace = Trace::new(TraceDetail::Lines);
    let options = EngineOptions { trace: Some(trace.clone()), ..EngineOptions::default() };
    let recording = Engine::new(options).unwrap().0;
    for (name, engine) in [("recording", &recording), ("without a trace", &oracle)] {
        trace.start();
        let found = call_all(engine, &traced, shape, Code::Kernel);
        assert_eq!(trace.take().entries.is_empty(), name != "recording");
        for ((method, expected), (_, found)) in expected.iter().zip(&found) {
            assert!(expected == found, "{method}, {name}");
        }
    }
}
