//! The oracle against packet code and machine code: random functions give the same bits on the
//! interpreter and at every width, in every shape, under random masks.

use std::sync::Arc;

use rtsl::{
    Backend, CallArguments, CallMode, CallStatus, Class, Engine, EngineOptions, Instance,
    Instances, LaneBlock, LaneIndices, LaneMask, Method, Numbers, OptLevel, Parameter,
    ParameterTarget, ParameterType, Program, Role, Scalar, Value, Variable, Variant, new_state,
};
use rtsl_ir::{Function, VariableKind};
use rtsl_testing::functions::{Entropy, HashHost, seeded_function};
use rtsl_testing::turns::is_long_run;

/// Rays of a call: not a multiple of any width but 1.
const COUNT: usize = 37;
/// The leaf shape takes as many as rays, from this one on.
const FIRST: u32 = 8;
const INSTANCES: usize = FIRST as usize + COUNT;

/// A class with the function as its `intersect`, and parameters for all members and buffers.
fn class_of(function: Function) -> Arc<Class> {
    class_with(Method::Intersect, function)
}

/// The same with another method.
fn class_with(method: Method, function: Function) -> Arc<Class> {
    let of_kind = |kind| -> Vec<Variable> {
        function.variables.iter().filter(|variable| variable.kind == kind).cloned().collect()
    };
    let (members, buffers) = (of_kind(VariableKind::Member), of_kind(VariableKind::Buffer));
    let parameter = |variable: &Variable, ty| Parameter {
        name: variable.name.clone(),
        ty,
        target: ParameterTarget::Member,
        required: true,
        annotations: Vec::new(),
    };
    let element = |variable: &Variable| {
        ParameterType::Array(Box::new(ParameterType::Scalar(variable.scalar)), variable.len)
    };
    let data = members.iter().map(|variable| parameter(variable, element(variable)));
    let shared = buffers
        .iter()
        .map(|variable| parameter(variable, ParameterType::Buffer(Box::new(element(variable)))));
    Arc::new(Class {
        name: "Random".to_owned(),
        roles: vec![Role::Primitive],
        documentation: None,
        parameters: data.chain(shared).collect(),
        scratch: of_kind(VariableKind::Scratch),
        scratch_types: Vec::new(),
        outputs: Vec::new(),
        method_documentation: Default::default(),
        is_traced: false,
        differentiable: Default::default(),
        attributes: Vec::new(),
        members,
        buffers,
        references: Vec::new(),
        initializer: Function::new("Random.initializer"),
        constructor: None,
        methods: [(method, function)].into(),
    })
}

fn words(entropy: &mut Entropy<'_>, scalar: Scalar, count: usize) -> Vec<u32> {
    (0..count).map(|_| entropy.constant(scalar).bits()).collect()
}

fn instance(class: &Arc<Class>, entropy: &mut Entropy<'_>) -> Arc<Instance> {
    let arguments = class.members.iter().chain(&class.buffers).map(|variable| {
        let elements = match variable.kind {
            VariableKind::Buffer => entropy.below(4),
            _ => 1,
        };
        let words = words(entropy, variable.scalar, elements * variable.len as usize);
        (variable.name.as_str(), Value::from(Numbers::from_words(variable.scalar, words)))
    });
    let arguments: Vec<_> = arguments.collect();
    Instance::new(class, arguments).unwrap()
}

/// The inputs of a call, the same for all backends.
struct Inputs {
    state: LaneBlock,
    scratch: LaneBlock,
    mask: Option<LaneMask>,
    instances: Vec<Arc<Instance>>,
    index: LaneIndices,
}

impl Inputs {
    fn random(class: &Arc<Class>, entropy: &mut Entropy<'_>) -> Inputs {
        let mut state = new_state(COUNT);
        for component in 0..state.components() {
            let random = words(entropy, Scalar::F32, COUNT);
            state.words_mut(component).copy_from_slice(&random);
        }
        let arrays = class.scratch.iter().map(|variable| variable.len).sum::<u32>() as usize;
        let mut scratch = LaneBlock::new(arrays, COUNT);
        let mut array = 0;
        for variable in &class.scratch {
            for _ in 0..variable.len {
                let mut random = words(entropy, variable.scalar, COUNT);
                if variable.scalar == Scalar::Bool {
                    random.iter_mut().for_each(|word| *word = word.wrapping_neg());
                }
                scratch.words_mut(array).copy_from_slice(&random);
                array += 1;
            }
        }
        let mask = match entropy.below(3) {
            0 => None,
            1 => Some(LaneMask::from_fn(COUNT, |_| entropy.chance(128))),
            _ => Some(LaneMask::from_fn(COUNT, |_| entropy.chance(20))),
        };
        let instances = (0..INSTANCES).map(|_| instance(class, entropy)).collect();
        let mut index = LaneIndices::new(COUNT);
        index.as_mut_slice().iter_mut().for_each(|it| *it = entropy.below(INSTANCES) as u32);
        Inputs { state, scratch, mask, instances, index }
    }
}

/// Everything that a call may change, NaNs made equal.
#[derive(PartialEq)]
struct Outputs {
    state: Vec<Vec<u32>>,
    scratch: Vec<Vec<u32>>,
    accepted: Vec<bool>,
    nearest: Option<u32>,
    budget_exhausted: bool,
}

fn call(engine: &Engine, variant: &Variant, inputs: &Inputs) -> Outputs {
    let program = engine.program(&inputs.instances[0]);
    let kernel = program.kernel(method_of(&program), variant.clone()).unwrap();
    call_with(&program, variant, inputs, |call| kernel.call(call))
}

/// The same on the interpreter of packet code.
fn call_packets(engine: &Engine, variant: &Variant, inputs: &Inputs) -> Outputs {
    let program = engine.program(&inputs.instances[0]);
    let kernel = program.packet_kernel(method_of(&program), variant.clone()).unwrap();
    call_with(&program, variant, inputs, |call| kernel.run(call, u64::MAX).status)
}

/// The one method of the class.
fn method_of(program: &Program) -> Method {
    *program.class().methods.keys().next().unwrap()
}

fn call_with(
    program: &Program,
    variant: &Variant,
    inputs: &Inputs,
    call: impl FnOnce(CallArguments<'_>) -> CallStatus,
) -> Outputs {
    let class = program.class();
    let block = program.block(&inputs.instances[0]);
    let objects = program.objects(inputs.instances.iter().map(|it| &**it));
    let (mut state, mut scratch) = (inputs.state.clone(), inputs.scratch.clone());
    let mut accepted = LaneMask::new(COUNT);
    let shape = variant.mode;
    let status = call(CallArguments {
        state: &mut state,
        scratch: &mut scratch,
        count: if shape == CallMode::Single { 1 } else { COUNT },
        mask: inputs.mask.as_ref().filter(|_| shape != CallMode::Single),
        accepted: Some(&mut accepted),
        instances: match shape {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => Instances::One(&block),
            CallMode::Stream => Instances::Many(&objects, &inputs.index),
            CallMode::Leaf => Instances::Range(&objects, FIRST),
        },
        host: &mut HashHost::default(),
    });
    let scratch_scalars =
        class.scratch.iter().flat_map(|variable| (0..variable.len).map(|_| variable.scalar));
    let floats = std::iter::repeat(Scalar::F32);
    let collect = |block: &LaneBlock, scalars: &mut dyn Iterator<Item = Scalar>| {
        let arrays = (0..block.components()).zip(scalars);
        arrays.map(|(it, scalar)| canonical(scalar, block.words(it))).collect()
    };
    Outputs {
        state: collect(&state, &mut floats.into_iter()),
        scratch: collect(&scratch, &mut scratch_scalars.into_iter()),
        accepted: (0..COUNT).map(|lane| accepted.get(lane)).collect(),
        nearest: status.nearest,
        budget_exhausted: status.budget_exhausted,
    }
}

fn canonical(scalar: Scalar, words: &[u32]) -> Vec<u32> {
    let is_nan = |word: u32| scalar == Scalar::F32 && f32::from_bits(word).is_nan();
    words.iter().map(|word| if is_nan(*word) { f32::NAN.to_bits() } else { *word }).collect()
}

fn difference(expected: &Outputs, found: &Outputs) -> String {
    for (name, a, b) in
        [("state", &expected.state, &found.state), ("scratch", &expected.scratch, &found.scratch)]
    {
        for (component, (a, b)) in a.iter().zip(b).enumerate() {
            if let Some(lane) = (0..COUNT).find(|lane| a[*lane] != b[*lane]) {
                let (a, b) = (a[lane], b[lane]);
                return format!("{name} {component}, ray {lane}: {a:#x} and {b:#x}");
            }
        }
    }
    "which rays hit, or the status".to_owned()
}

fn options(backend: Backend, width: u32, optimization: OptLevel) -> EngineOptions {
    EngineOptions { backend, width: Some(width), optimization, ..Default::default() }
}

fn engine(backend: Backend, width: u32, optimization: OptLevel) -> Option<Engine> {
    engine_of(options(backend, width, optimization))
}

fn engine_of(options: EngineOptions) -> Option<Engine> {
    match Engine::new(options) {
        Ok((engine, _)) => Some(engine),
        Err(error) => {
            println!("without LLVM there is nothing to compare: {}", error.message);
            None
        }
    }
}

/// The kinds of machine code that an ordinary run compares for one function; the next function has others.
const PACKINGS_OF_A_FUNCTION: usize = 3;

/// Compares functions of these seeds on all backends. Long runs compare all packings for each function.
fn compare(seeds: std::ops::Range<u64>, size: usize, optimization: OptLevel) {
    let oracle = engine(Backend::Interpreter, 1, optimization).unwrap();
    let engines = |backend, packings: &[(u32, Option<u32>)]| {
        let engines = packings.iter().map(|(width, interleave)| EngineOptions {
            interleave: *interleave,
            ..options(backend, *width, optimization)
        });
        engines.filter_map(engine_of).collect::<Vec<_>>()
    };
    let packets = engines(Backend::Interpreter, &Engine::WIDTHS.map(|width| (width, None)));
    let packings = [
        (1, None),
        (4, Some(4)),
        (8, None),
        (8, Some(2)),
        (8, Some(4)),
        (16, Some(1)),
        (16, Some(2)),
    ];
    let machine_code = engines(Backend::Jit, &packings);
    for seed in seeds {
        let class = class_of(seeded_function(seed, size));
        let bytes = Entropy::bytes(seed ^ 0x5eed, 1 << 16);
        let inputs = Inputs::random(&class, &mut Entropy::new(&bytes));
        for shape in CallMode::ALL {
            let variant = Variant::from(shape);
            let expected = call(&oracle, &variant, &inputs);
            let check = |engine: &Engine, code: &str, found: Outputs| {
                assert!(
                    expected == found,
                    "seed {seed}, size {size}, {code} for {} at width {}, interleaved {:?}: {}\n{}",
                    shape.name(),
                    engine.width(),
                    engine.options().interleave,
                    difference(&expected, &found),
                    class.methods[&Method::Intersect]
                );
            };
            for engine in &packets {
                check(engine, "packet code", call_packets(engine, &variant, &inputs));
            }
            for engine in packings_of(seed, &machine_code) {
                check(engine, "machine code", call(engine, &variant, &inputs));
            }
        }
    }
}

/// The engines whose packings are compared for a function.
fn packings_of(seed: u64, engines: &[Engine]) -> impl Iterator<Item = &Engine> {
    let count = if is_long_run() { engines.len() } else { PACKINGS_OF_A_FUNCTION };
    engines
        .iter()
        .cycle()
        .skip(seed as usize % engines.len().max(1) * PACKINGS_OF_A_FUNCTION)
        .take(count)
}

/// The oracle's results if it stores only the outputs that are read; all others keep their values from before the call.
fn only(outputs: rtsl::Outputs, expected: Outputs, inputs: &Inputs, class: &Class) -> Outputs {
    let floats: Vec<Scalar> = vec![Scalar::F32; inputs.state.components()];
    let scratch = class.scratch.iter().flat_map(|it| vec![it.scalar; it.len as usize]);
    let given = |block: &LaneBlock, scalars: Vec<Scalar>| -> Vec<Vec<u32>> {
        let arrays = scalars.into_iter().enumerate();
        arrays.map(|(array, scalar)| canonical(scalar, block.words(array))).collect()
    };
    let mut state = given(&inputs.state, floats);
    for variable in outputs.variables() {
        let first = variable.first_component as usize;
        let components = first..first + variable.ty.components() as usize;
        state[components.clone()].clone_from_slice(&expected.state[components]);
    }
    let scratch = match outputs.has_scratch() {
        true => expected.scratch,
        false => given(&inputs.scratch, scratch.collect()),
    };
    Outputs { state, scratch, ..expected }
}

/// Machine code and the interpreter at all levels of optimisation, for a method of the class.
fn engines_of_all_levels(budget: Option<u32>) -> Vec<Engine> {
    let engines = [
        (Backend::Interpreter, 1, OptLevel::O2),
        (Backend::Interpreter, 8, OptLevel::O0),
        (Backend::Jit, 16, OptLevel::O0),
        (Backend::Jit, 1, OptLevel::O1),
        (Backend::Jit, 8, OptLevel::O2),
        (Backend::Jit, 4, OptLevel::O3),
    ];
    let options = engines.map(|(backend, width, level)| EngineOptions {
        loop_budget: budget,
        ..options(backend, width, level)
    });
    options.into_iter().filter_map(engine_of).collect()
}

/// Checks that all engines give what the first gives, for the variants of every shape; gives that.
fn check_all(engines: &[Engine], inputs: &Inputs, context: &dyn std::fmt::Debug) -> Vec<Outputs> {
    let known = engines[0].program(&inputs.instances[0]).known_members(&inputs.instances[0]);
    let check = |shape: CallMode| {
        let general = Variant::new(shape);
        let variants = match shape {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => {
                vec![general.clone().knowing(known.clone()), general.clone()]
            }
            // Their instances differ.
            CallMode::Stream | CallMode::Leaf => vec![general.clone()],
        };
        let expected = call(&engines[0], &general, inputs);
        for variant in variants {
            for engine in engines {
                let (level, width) = (engine.options().optimization, engine.width());
                let what = || format!("{context:?}, {level:?}, width {width}, {variant:?}");
                let found = call(engine, &variant, inputs);
                let packets = call_packets(engine, &variant, inputs);
                for (code, found) in [("", found), (", packet code", packets)] {
                    let difference = || difference(&expected, &found);
                    assert!(expected == found, "{}{code}: {}", what(), difference());
                }
            }
        }
        expected
    };
    CallMode::ALL.map(check).into()
}

/// A method that accepts no hits, and sets scratch to what it is.
fn without_hits(mut function: Function) -> Function {
    let scratch: Vec<_> =
        function.variables.iter().filter(|it| it.kind == VariableKind::Scratch).collect();
    let scalars = scratch.into_iter().flat_map(|it| (0..it.len).map(|index| (it.clone(), index)));
    let all: Vec<_> = scalars.collect();
    let outputs = std::mem::take(&mut function.outputs);
    let yields = std::mem::take(&mut function.body.yields);
    for (output, value) in outputs.into_iter().zip(yields) {
        let is_set = match function.variable(output.variable).kind {
            VariableKind::Accepted => false,
            VariableKind::Scratch => output.component % 2 == 1,
            _ => true,
        };
        if is_set {
            function.outputs.push(output);
            function.body.yields.push(value);
        }
    }
    let set: Vec<_> = rtsl_opt::unchanged::outputs(&function).collect();
    rtsl_opt::unchanged::restore(&mut function, all.iter().filter(|it| !set.contains(it)));
    function
}

/// The optimisation level changes no result, also in lanes that store the value of another lane.
#[test]
fn results_do_not_depend_on_the_level() {
    let engines = engines_of_all_levels(None);
    for seed in 500..506 {
        let function = seeded_function(seed, 150);
        let classes =
            [class_of(function.clone()), class_with(Method::ComputeNormal, without_hits(function))];
        for class in classes {
            let bytes = Entropy::bytes(seed ^ 0x5eed, 1 << 16);
            let inputs = Inputs::random(&class, &mut Entropy::new(&bytes));
            check_all(&engines, &inputs, &seed);
        }
    }
}

/// All engines and variants end loops at the same iteration, and report it alike.
#[test]
fn budgets_run_out_for_all_alike() {
    let mut told = [0, 0];
    for budget in [0, 1, 4, 30] {
        let engines = engines_of_all_levels(Some(budget));
        let first = 600 + u64::from(budget) * 10;
        for seed in first..first + 4 {
            let class = class_of(seeded_function(seed, 200));
            let bytes = Entropy::bytes(seed ^ 0x5eed, 1 << 16);
            let inputs = Inputs::random(&class, &mut Entropy::new(&bytes));
            let outputs = check_all(&engines, &inputs, &(seed, budget));
            outputs.iter().for_each(|it| told[usize::from(it.budget_exhausted)] += 1);
        }
    }
    assert!(told[0] > 3 && told[1] > 3, "both are tested: {told:?}");
}

/// Callers that read a part, and objects of known members.
#[test]
fn variants_agree_in_what_is_read() {
    let oracle = engine(Backend::Interpreter, 1, OptLevel::O2).unwrap();
    let packets: Vec<_> = [1, 8]
        .into_iter()
        .filter_map(|it| engine(Backend::Interpreter, it, OptLevel::O2))
        .collect();
    let mut engines = vec![oracle.clone()];
    engines.extend([1, 8].into_iter().filter_map(|it| engine(Backend::Jit, it, OptLevel::O2)));
    for seed in 400..430 {
        let class = class_of(seeded_function(seed, 200));
        let bytes = Entropy::bytes(seed ^ 0x5eed, 1 << 16);
        let mut entropy = Entropy::new(&bytes);
        let inputs = Inputs::random(&class, &mut entropy);
        let program = oracle.program(&inputs.instances[0]);
        let writes = program.method(Method::Intersect).unwrap().writes.clone();
        let read = rtsl::Outputs::state(writes.into_iter().filter(|_| entropy.chance(128)));
        let outputs = match entropy.below(3) {
            0 => rtsl::Outputs::ALL,
            1 => read,
            _ => read.with_scratch(),
        };
        let known = program.known_members(&inputs.instances[0]);
        for shape in CallMode::ALL {
            let general = Variant::new(shape);
            // By the distance the leaf shape chooses.
            let distance = rtsl::lookup_state("rt_HitDistance").filter(|_| shape == CallMode::Leaf);
            let stored = rtsl::Outputs::state(outputs.variables().chain(distance));
            let stored = if outputs.has_scratch() { stored.with_scratch() } else { stored };
            let expected = only(stored, call(&oracle, &general, &inputs), &inputs, program.class());
            let known = match shape {
                CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => known.clone(),
                // Its instances differ.
                CallMode::Stream | CallMode::Leaf => rtsl::KnownMembers::default(),
            };
            let variant = general.reading(outputs).knowing(known);
            let compiled = engines.iter().map(|engine| (engine, call(engine, &variant, &inputs)));
            let packets = packets.iter();
            let packets = packets.map(|engine| (engine, call_packets(engine, &variant, &inputs)));
            for (engine, found) in compiled.chain(packets) {
                assert!(
                    expected == found,
                    "seed {seed}, {variant:?} at width {}: {}\n{}",
                    engine.width(),
                    difference(&expected, &found),
                    class.methods[&Method::Intersect]
                );
            }
        }
    }
}

#[test]
fn small_functions_agree() {
    compare(0..40, 60, OptLevel::O2);
}

#[test]
fn large_functions_agree() {
    compare(100..106, 1500, OptLevel::O2);
}

#[test]
fn functions_agree_at_other_levels() {
    compare(200..210, 300, OptLevel::O0);
    compare(200..210, 300, OptLevel::O1);
    compare(200..210, 300, OptLevel::O3);
}
