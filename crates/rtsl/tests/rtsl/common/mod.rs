//! The oracle against machine code, for shader texts.
//!
//! A text's class is a texture whose `lookup` computes scratch members from scratch members (which vary from
//! ray to ray) and public members (which do not).

use std::cell::Cell;
use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CallMode, CallStatus, Class, Compiler, CompilerOptions, Diagnostic,
    Engine, EngineOptions, Instance, Instances, LaneBlock, LaneMask, Method, Numbers, OptLevel,
    Program, Role, Scalar, Unit, Value, lookup_state, new_state,
};
use rtsl_ir::Function;
use rtsl_testing::functions::{Entropy, HashHost};
use rtsl_testing::turns::is_long_run;

/// Rays of a call: not a multiple of any width but 1.
pub const COUNT: usize = 37;

/// The interpreter, packet code, and machine code for several widths; no machine code where there is no LLVM.
pub struct Agreement {
    oracle: Engine,
    packets: Engine,
    /// The engine for the usual width, which runs every text.
    usual: Option<Engine>,
    /// Engines that ordinary runs take in turn.
    others: Vec<Engine>,
    /// The number of texts checked.
    checked: Cell<usize>,
    compiler: Compiler,
}

impl Agreement {
    /// Engines at this level of optimisation.
    pub fn new(optimization: OptLevel) -> Agreement {
        let engine = |backend, width, interleave| {
            let width = Some(width);
            let options =
                EngineOptions { backend, width, interleave, optimization, ..Default::default() };
            Engine::new(options).map(|(engine, _)| engine)
        };
        let others = [(1, None), (4, Some(4)), (8, Some(4)), (16, Some(2))];
        let others = others
            .iter()
            .filter_map(|(width, interleave)| engine(Backend::Jit, *width, *interleave).ok());
        let options = CompilerOptions { loop_budget: Some(10_000), ..Default::default() };
        Agreement {
            oracle: engine(Backend::Interpreter, 1, None).expect("the interpreter needs nothing"),
            packets: engine(Backend::Interpreter, 8, None).expect("the interpreter needs nothing"),
            usual: engine(Backend::Jit, 8, None).ok(),
            others: others.collect(),
            checked: Cell::new(0),
            compiler: Compiler::new(options),
        }
    }

    /// Compiles the text, which has no errors and one class, and compares engines on random values: all of them in long
    /// runs, else the usual one and one of the others.
    ///
    /// # Panics
    /// If they disagree in a bit, NaNs being all the same.
    pub fn check(&self, name: &str, text: &str, seed: u64) {
        let compilation = self.compiler.compile(name, text);
        let Some(unit) = &compilation.unit else {
            panic!("{name}: {}\n{text}", compilation.report(false))
        };
        let class = unit.classes().last().expect("a class");
        let bytes = Entropy::bytes(seed, 1 << 16);
        let mut entropy = Entropy::new(&bytes);
        let instance = instance(class, &mut entropy);
        let scratch = random_scratch(class, &mut entropy);
        let mask = entropy.chance(160).then(|| LaneMask::from_fn(COUNT, |_| entropy.chance(128)));
        let mask = mask.as_ref();
        let expected = call(&self.oracle, &instance, &scratch, mask);
        let packets = call_packets(&self.packets, &instance, &scratch, mask);
        if let Some(difference) = difference(class, &expected, &packets) {
            panic!("{name} in packet code: {difference}\n{text}");
        }
        for engine in self.engines() {
            let found = call(engine, &instance, &scratch, mask);
            if let Some(difference) = difference(class, &expected, &found) {
                panic!("{name} at width {}: {difference}\n{text}", engine.width());
            }
        }
    }

    /// Returns the engines for the next text.
    fn engines(&self) -> impl Iterator<Item = &Engine> {
        let (checked, count) = (self.checked.get(), self.others.len());
        self.checked.set(checked + 1);
        let is_due = move |index| is_long_run() || index == checked % count;
        let others = self.others.iter().enumerate().filter(move |(index, _)| is_due(*index));
        self.usual.iter().chain(others.map(|(_, engine)| engine))
    }
}

/// A class with nothing but one method, in the text form of the IR.
pub fn class(method: Method, text: &str) -> Arc<Class> {
    Arc::new(Class {
        name: "Test".to_owned(),
        roles: vec![Role::Material],
        documentation: None,
        parameters: Vec::new(),
        members: Vec::new(),
        buffers: Vec::new(),
        scratch: Vec::new(),
        scratch_types: Vec::new(),
        outputs: Vec::new(),
        method_documentation: Default::default(),
        is_traced: false,
        differentiable: Default::default(),
        attributes: Vec::new(),
        references: Vec::new(),
        initializer: Function::new("Test.initializer"),
        constructor: None,
        methods: [(method, text.parse().unwrap())].into(),
    })
}

fn words(entropy: &mut Entropy<'_>, scalar: Scalar, count: usize) -> Vec<u32> {
    (0..count).map(|_| entropy.constant(scalar).bits()).collect()
}

fn instance(class: &Arc<Class>, entropy: &mut Entropy<'_>) -> Arc<Instance> {
    let arguments = class.members.iter().map(|variable| {
        let words = words(entropy, variable.scalar, variable.len as usize);
        (variable.name.as_str(), Value::from(Numbers::from_words(variable.scalar, words)))
    });
    Instance::new(class, arguments.collect::<Vec<_>>()).expect("the members are its parameters")
}

fn random_scratch(class: &Class, entropy: &mut Entropy<'_>) -> LaneBlock {
    let scalars = scratch_scalars(class);
    let mut block = LaneBlock::new(scalars.len(), COUNT);
    for (array, scalar) in scalars.iter().enumerate() {
        let mut random = words(entropy, *scalar, COUNT);
        if *scalar == Scalar::Bool {
            random.iter_mut().for_each(|word| *word = word.wrapping_neg());
        }
        block.words_mut(array).copy_from_slice(&random);
    }
    block
}

fn scratch_scalars(class: &Class) -> Vec<Scalar> {
    let variables = class.scratch.iter();
    variables
        .flat_map(|variable| std::iter::repeat_n(variable.scalar, variable.len as usize))
        .collect()
}

fn call(
    engine: &Engine,
    instance: &Arc<Instance>,
    scratch: &LaneBlock,
    mask: Option<&LaneMask>,
) -> LaneBlock {
    let program = engine.program(instance);
    let kernel = program.kernel(Method::Lookup, CallMode::Packet).expect("it compiles");
    call_with(&program, instance, scratch, mask, |call| kernel.call(call))
}

/// The same on the interpreter of packet code.
fn call_packets(
    engine: &Engine,
    instance: &Arc<Instance>,
    scratch: &LaneBlock,
    mask: Option<&LaneMask>,
) -> LaneBlock {
    let program = engine.program(instance);
    let kernel = program.packet_kernel(Method::Lookup, CallMode::Packet).expect("it compiles");
    call_with(&program, instance, scratch, mask, |call| kernel.run(call, u64::MAX).status)
}

fn call_with(
    program: &Program,
    instance: &Arc<Instance>,
    scratch: &LaneBlock,
    mask: Option<&LaneMask>,
    call: impl FnOnce(CallArguments<'_>) -> CallStatus,
) -> LaneBlock {
    let block = program.block(instance);
    let mut scratch = scratch.clone();
    let _budget_may_end = call(CallArguments {
        state: &mut new_state(COUNT),
        scratch: &mut scratch,
        count: COUNT,
        mask,
        accepted: None,
        instances: Instances::One(&block),
        host: &mut HashHost::default(),
    });
    scratch
}

fn difference(class: &Class, expected: &LaneBlock, found: &LaneBlock) -> Option<String> {
    let names = class.scratch.iter().flat_map(|variable| {
        (0..variable.len)
            .map(move |component| (format!("{}[{component}]", variable.name), variable.scalar))
    });
    for (array, (name, scalar)) in names.enumerate() {
        for ray in 0..COUNT {
            let (a, b) = (expected.words(array)[ray], found.words(array)[ray]);
            let is_nan = |word| scalar == Scalar::F32 && f32::from_bits(word).is_nan();
            if a != b && !(is_nan(a) && is_nan(b)) {
                let show = |word| rtsl::Constant::from_bits(scalar, word);
                return Some(format!(
                    "{name} of ray {ray} is {:?} ({a:#x}), found {:?} ({b:#x})",
                    show(a),
                    show(b)
                ));
            }
        }
    }
    None
}

/// The interpreter, then machine code at every width.
pub fn engines() -> Vec<Engine> {
    let backends = Engine::WIDTHS.map(|width| (Backend::Jit, width));
    let all = [(Backend::Interpreter, 1)].into_iter().chain(backends);
    let engines = all.filter_map(|(backend, width)| {
        let options = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
        Engine::new(options).ok().map(|(engine, _)| engine)
    });
    engines.collect()
}

/// Compiles a text.
///
/// # Panics
/// If there is anything to tell about it.
pub fn unit(text: &str) -> Unit {
    // Classes here have only what a test is about.
    const IDLE: [&str; 4] = ["W0340", "W0343", "W0346", "W0347"];
    let compilation = Compiler::default().compile("test.rtsl", text);
    let is_idle = |it: &Diagnostic| IDLE.contains(&it.code.as_str());
    assert!(compilation.diagnostics.iter().all(is_idle), "{}", compilation.report(false));
    compilation.unit.unwrap()
}

/// An instance of one of the classes of a unit.
pub fn new(unit: &Unit, class: &str, arguments: Vec<(&str, Value)>) -> Arc<Instance> {
    Instance::new(unit.class(class).unwrap(), arguments).unwrap()
}

/// Calls a method for all rays of this state, which have one instance and no host.
pub fn call_packet(engine: &Engine, instance: &Instance, method: Method, state: &mut LaneBlock) {
    let program = engine.program(instance);
    let kernel = program.kernel(method, CallMode::Packet).unwrap();
    let count = state.lanes();
    let status = kernel.call(CallArguments {
        state,
        scratch: &mut program.new_scratch(count),
        count,
        mask: None,
        accepted: None,
        instances: Instances::One(&program.block(instance)),
        host: &mut NoHost,
    });
    assert!(!status.budget_exhausted);
}

/// The first component of a state variable.
pub fn component(name: &str) -> usize {
    lookup_state(name).unwrap().first_component as usize
}
