//! Libraries that are compiled ahead of time, called from C: every method of every class of the standard library gives
//! the oracle's bits.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::aot::{AotLibrary, AotOptions, Bindings};
use rtsl::description::{ClassDescription, ParameterDescription};
use rtsl::host::{Host, LaneFloats, LaneSet};
use rtsl::{
    Backend, CallArguments, CallMode, Class, Compiler, Engine, EngineOptions, Instance, Instances,
    LaneMask, Numbers, Reference, ReferenceCount, Role, Scalar, Value, library, new_state,
    state_component_count,
};
use rtsl_testing::random::Random;
use rtsl_testing::turns::is_long_run;

use crate::compiler::{CProgram, has_compiler, shared_library};

const LANES: usize = 16;

/// The kind of files that a library is built from.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    /// An object file.
    Object,
    /// A shared library of the C++ text, whose kernels are of the single shape.
    Cpp,
}

#[test]
fn every_method_gives_the_bits_of_the_oracle() {
    let packets = if is_long_run() { vec![4, 8] } else { vec![8] };
    let packets = packets.into_iter().map(|width| (CallMode::Packet, width));
    check(Form::Object, [(CallMode::Single, 1)].into_iter().chain(packets).collect());
}

#[test]
fn every_method_of_exported_cpp_does_so_too() {
    check(Form::Cpp, vec![(CallMode::Single, 1)]);
}

fn check(form: Form, shapes: Vec<(CallMode, u32)>) {
    if !has_compiler() {
        return;
    }
    let classes = standard_classes();
    let bindings = bindings(&classes);
    let (engine, _) = Engine::new(EngineOptions::default()).unwrap();
    if form == Form::Object && engine.llvm().is_none() {
        eprintln!("left out: there is no LLVM");
        return;
    }
    let options = AotOptions { modes: shapes, bindings, ..AotOptions::default() };
    let library = engine.aot_library(&classes, &options).unwrap();
    let mut requests = Vec::new();
    let mut random = Random::new(1);
    for (number, description) in library.description().classes.iter().enumerate() {
        for kernel in 0..description.kernels.len() {
            requests.push(Request::random(number, kernel, description, &mut random));
        }
    }
    let answers = run(form, &library, &requests);
    let mut answers = answers.chunks_exact(4).map(|it| u32::from_le_bytes(it.try_into().unwrap()));
    for request in &requests {
        let description = &library.description().classes[request.class];
        let expected = expected(&classes, request, description);
        let found: Vec<u32> = answers.by_ref().take(expected.len()).collect();
        let name = &description.kernels[request.kernel].symbol;
        let same = |(a, b): (&u32, &u32)| {
            a == b || f32::from_bits(*a).is_nan() && f32::from_bits(*b).is_nan()
        };
        let first = expected.iter().zip(&found).position(|it| !same(it));
        assert_eq!(found.len(), expected.len(), "{name}");
        assert_eq!(first, None, "{form:?}: {name}: the first word that differs");
    }
    assert_eq!(answers.next(), None);
}

/// Compiles the driver with the library and hands it the requests.
fn run(form: Form, library: &AotLibrary, requests: &[Request]) -> Vec<u8> {
    let program = CProgram::new("aot").called(&format!("aot-{form:?}"));
    std::fs::write(program.folder().join("library.h"), library.header()).unwrap();
    let code = match form {
        Form::Object => {
            let object = program.folder().join("library.o");
            std::fs::write(&object, library.object(None).unwrap()).unwrap();
            object
        }
        Form::Cpp => shared_library(program.folder(), &library.cpp()),
    };
    let mut words = vec![requests.len() as u32];
    requests.iter().for_each(|request| request.write(&mut words));
    let input: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    program.sanitized().with(code).run_with(&input)
}

/// A call, as the driver reads it.
struct Request {
    class: usize,
    kernel: usize,
    /// By the names of parameters.
    values: BTreeMap<String, Vec<u32>>,
    words: Vec<(u32, u32)>,
    /// Offset, elements, words.
    buffers: Vec<(u32, u32, Vec<u32>)>,
    mask: Vec<bool>,
    state: Vec<u32>,
    scratch: Vec<u32>,
}

impl Request {
    fn random(
        class: usize,
        kernel: usize,
        description: &ClassDescription,
        random: &mut Random,
    ) -> Request {
        let mut request = Request {
            class,
            kernel,
            values: BTreeMap::new(),
            words: Vec::new(),
            buffers: Vec::new(),
            mask: (0..LANES).map(|_| random.below(4) > 0).collect(),
            state: (0..state_component_count() as usize * LANES).map(|_| float(random)).collect(),
            scratch: (0..description.scratch_arrays as usize * LANES)
                .map(|_| float(random))
                .collect(),
        };
        for parameter in &description.parameters {
            let count = if parameter.is_buffer { 6 * parameter.len } else { parameter.len };
            let words: Vec<u32> = (0..count).map(|_| word(random, parameter)).collect();
            if parameter.is_buffer {
                request.buffers.push((parameter.offset, 6, words.clone()));
            } else {
                request.words.extend((parameter.offset..).zip(words.iter().copied()));
            }
            request.values.insert(parameter.name.clone(), words);
        }
        request
    }

    fn write(&self, words: &mut Vec<u32>) {
        words.extend([self.class as u32, self.kernel as u32, self.words.len() as u32]);
        words.extend(self.words.iter().flat_map(|(offset, word)| [*offset, *word]));
        words.push(self.buffers.len() as u32);
        for (offset, elements, buffer) in &self.buffers {
            words.extend([*offset, *elements, buffer.len() as u32]);
            words.extend(buffer);
        }
        words.extend(self.mask.iter().map(|is_on| if *is_on { u32::MAX } else { 0 }));
        words.extend(&self.state);
        words.extend(&self.scratch);
    }
}

/// The results of the interpreter, as the driver writes them.
fn expected(classes: &[Arc<Class>], request: &Request, description: &ClassDescription) -> Vec<u32> {
    let options = EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() };
    let (engine, _) = Engine::new(options).unwrap();
    let instance = instance(classes, &classes[request.class], "", request, description);
    let program = engine.program(&instance);
    let kernel =
        program.kernel(description.kernels[request.kernel].method, CallMode::Packet).unwrap();
    let (mut state, mut scratch) = (new_state(LANES), program.new_scratch(LANES));
    for (component, words) in request.state.chunks(LANES).enumerate() {
        state.words_mut(component).copy_from_slice(words);
    }
    for (array, words) in request.scratch.chunks(LANES).enumerate() {
        scratch.words_mut(array).copy_from_slice(words);
    }
    let mask = LaneMask::from_fn(LANES, |lane| request.mask[lane]);
    let mut accepted = LaneMask::new(LANES);
    let status = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut scratch,
        count: LANES,
        mask: Some(&mask),
        accepted: Some(&mut accepted),
        instances: Instances::One(&program.block(&instance)),
        host: &mut Quarter,
    });
    let mut words = vec![u32::from(status.budget_exhausted)];
    words.extend(accepted.words());
    (0..state.components()).for_each(|component| words.extend(state.words(component)));
    (0..scratch.components()).for_each(|array| words.extend(scratch.words(array)));
    words
}

/// The instance with the request's values, and those behind it.
fn instance(
    classes: &[Arc<Class>],
    class: &Arc<Class>,
    prefix: &str,
    request: &Request,
    description: &ClassDescription,
) -> Arc<Instance> {
    let mut arguments = Vec::new();
    for parameter in &class.parameters {
        let name = format!("{prefix}{}", parameter.name);
        if let Some(words) = request.values.get(&name) {
            let scalar = description.parameters.iter().find(|it| it.name == name).unwrap().scalar;
            let numbers = Numbers::from_words(scalar, words.clone());
            arguments.push((parameter.name.as_str(), Value::Numbers(numbers)));
        }
    }
    for reference in class.references.iter().filter(|it| it.role == Role::Texture) {
        let constant = classes.iter().find(|class| class.name == "Constant").unwrap();
        let textures = elements_of(reference).into_iter().map(|element| {
            let prefix = format!("{prefix}{element}.");
            Value::Instance(instance(classes, constant, &prefix, request, description))
        });
        let mut textures: Vec<Value> = textures.collect();
        let value = match reference.count {
            ReferenceCount::Single => textures.remove(0),
            ReferenceCount::Open | ReferenceCount::Array(_) => Value::List(textures),
        };
        arguments.push((reference.name.as_str(), value));
    }
    Instance::new(class, arguments).unwrap_or_else(|problems| {
        panic!("{}: {:?}", class.name, problems.iter().map(|it| &it.message).collect::<Vec<_>>())
    })
}

/// All classes of the standard library but integrators, which ask the scene.
fn standard_classes() -> Vec<Arc<Class>> {
    let compiler = Compiler::default();
    let units = library::files().iter().map(|file| compiler.compile(file.path, file.text));
    let units = units.map(|it| it.unit.expect("the library compiles"));
    let classes = units.flat_map(|unit| unit.classes().to_vec());
    classes.filter(|class| !class.roles.contains(&Role::Integrator)).collect()
}

/// The paths of a reference's elements; those of open arrays are one.
fn elements_of(reference: &Reference) -> Vec<String> {
    let indexed = |count: u32| (0..count).map(|it| format!("{}[{it}]", reference.name)).collect();
    match reference.count {
        ReferenceCount::Single => vec![reference.name.clone()],
        ReferenceCount::Open => indexed(1),
        ReferenceCount::Array(count) => indexed(count),
    }
}

/// Every texture that a class refers to is a constant.
fn bindings(classes: &[Arc<Class>]) -> Bindings {
    let constant = classes.iter().find(|class| class.name == "Constant").unwrap();
    let mut bindings = Bindings::default();
    for class in classes {
        for reference in class.references.iter().filter(|it| it.role == Role::Texture) {
            for element in elements_of(reference) {
                bindings.bind(class, &element, constant).unwrap();
            }
        }
    }
    bindings
}

/// Returns the bits of a float: small ones, and now and then a special one.
fn float(random: &mut Random) -> u32 {
    const SPECIAL: [f32; 8] = [0.0, -0.0, 1.0, -1.0, f32::INFINITY, f32::NAN, 1e-40, f32::MAX];
    match random.below(24) {
        0 => SPECIAL[random.below(8) as usize].to_bits(),
        _ => ((random.below(4001) as f32 - 2000.0) / 1000.0).to_bits(),
    }
}

/// Returns a word that the parameter may have.
fn word(random: &mut Random, parameter: &ParameterDescription) -> u32 {
    let least = parameter.minimum.unwrap_or(-2.0);
    let greatest = parameter.maximum.unwrap_or(least.max(0.0) + 2.0);
    let part = random.below(1001) as f32 / 1000.0;
    let value = (least + (greatest - least) * part).clamp(least, greatest);
    match parameter.scalar {
        Scalar::F32 => value.to_bits(),
        Scalar::I32 => (value.ceil() as i32).cast_unsigned(),
        Scalar::U32 => value.ceil().max(0.0) as u32,
        Scalar::Bool => random.below(2),
    }
}

/// The driver's host: a quarter for every random number, and nothing else.
struct Quarter;

impl Host for Quarter {
    fn rand(&mut self, _: LaneSet, values: &mut LaneFloats) {
        *values = [0.25; 16];
    }
}
