//! Random programs: what the compiler makes of them agrees with running them as the language says.
//!
//! The evaluator walks the program itself. Against it run the interpreter and machine code at every
//! width, both without contraction, to the last bit. With contraction, and with functions that only
//! the prelude defines, machine code runs against the interpreter.

mod evaluate;
mod generate;
mod print;
mod tree;

use std::sync::Arc;

use proptest::prelude::*;
use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CallMode, Class, Compiler, Diagnostics, Engine, EngineOptions, FileId,
    Instance, Instances, LaneBlock, Math, Method, NoIncludes, Scalar, SourceMap, new_state,
};
use rtsl_testing::functions::Entropy;

use generate::Builtins;
use tree::Program;

/// Rays of a call.
const COUNT: usize = 19;

/// The inputs of the rays: members in order, and `rt_TextureUVW`.
struct Rays {
    members: Vec<Vec<Vec<u32>>>,
    inputs: Vec<[f32; 3]>,
}

impl Rays {
    fn random(program: &Program, seed: u64) -> Rays {
        let bytes = Entropy::bytes(seed, 1 << 14);
        let mut entropy = Entropy::new(&bytes);
        let mut members = Vec::new();
        let mut inputs = Vec::new();
        for _ in 0..COUNT {
            let of_ray = program.members.iter().map(|member| {
                (0..member.scalars()).map(|_| entropy.constant(member.ty.scalar).bits()).collect()
            });
            members.push(of_ray.collect());
            inputs.push(std::array::from_fn(|_| {
                f32::from_bits(entropy.constant(Scalar::F32).bits())
            }));
        }
        Rays { members, inputs }
    }
}

fn canonical(scalar: Scalar, bits: u32) -> u32 {
    match scalar {
        Scalar::F32 if f32::from_bits(bits).is_nan() => f32::NAN.to_bits(),
        Scalar::Bool => u32::from(bits != 0),
        Scalar::F32 | Scalar::I32 | Scalar::U32 => bits,
    }
}

/// All members of all rays after the call, as the language says; `None` where that takes too long.
fn expected(program: &Program, rays: &Rays) -> Option<Vec<Vec<u32>>> {
    let run = |(members, input): (&Vec<Vec<u32>>, &[f32; 3])| {
        let mut members = members.clone();
        evaluate::run(program, &mut members, *input).ok()?;
        let scalars = program.members.iter().map(|member| member.ty.scalar);
        let flat = members.into_iter().zip(scalars);
        Some(
            flat.flat_map(|(bits, scalar)| bits.into_iter().map(move |it| canonical(scalar, it)))
                .collect(),
        )
    };
    rays.members.iter().zip(&rays.inputs).map(run).collect()
}

/// The same from the compiler.
fn found(engine: &Engine, class: &Arc<Class>, rays: &Rays) -> Vec<Vec<u32>> {
    let instance = Instance::new(class, []).unwrap();
    let linked = engine.program(&instance);
    let kernel = linked.kernel(Method::Lookup, CallMode::Packet).unwrap();
    let mut state = new_state(COUNT);
    let first = rtsl_spec::lookup_state("rt_TextureUVW").unwrap().first_component as usize;
    let mut scratch = linked.new_scratch(COUNT);
    let scalars: Vec<Scalar> = class
        .scratch
        .iter()
        .flat_map(|place| std::iter::repeat_n(place.scalar, place.len as usize))
        .collect();
    for lane in 0..COUNT {
        for component in 0..3 {
            state.floats_mut(first + component)[lane] = rays.inputs[lane][component];
        }
        let bits = rays.members[lane].iter().flatten();
        for (array, (bits, scalar)) in bits.zip(&scalars).enumerate() {
            let word = if *scalar == Scalar::Bool { bits.wrapping_neg() } else { *bits };
            scratch.words_mut(array)[lane] = word;
        }
    }
    let block = Arc::new(linked.block(&instance));
    let _ = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut scratch,
        count: COUNT,
        mask: None,
        accepted: None,
        instances: Instances::One(&block),
        host: &mut NoHost,
    });
    let of_lane = |lane: usize, scratch: &LaneBlock| -> Vec<u32> {
        let words = scalars.iter().enumerate();
        words.map(|(array, scalar)| canonical(*scalar, scratch.words(array)[lane])).collect()
    };
    (0..COUNT).map(|lane| of_lane(lane, &scratch)).collect()
}

fn engine(backend: Backend, width: u32, math: Math) -> Option<Engine> {
    let options = EngineOptions { backend, width: Some(width), math, ..EngineOptions::default() };
    Engine::new(options).ok().map(|(engine, _)| engine)
}

fn compile(text: &str) -> Arc<Class> {
    let compilation = Compiler::default().compile("generated.rtsl", text);
    let report = compilation.report(false);
    let unit = compilation.unit.unwrap_or_else(|| panic!("{report}\n{text}"));
    unit.classes()[0].clone()
}

/// Compares the program of these bytes on the engines with the language.
fn check(bytes: &[u8], seed: u64, engines: &[Engine]) {
    let program = generate::program(bytes, Builtins::Exact);
    let rays = Rays::random(&program, seed);
    let Some(expected) = expected(&program, &rays) else { return };
    compare(&program, seed, &rays, &expected, engines);
}

fn compare(program: &Program, seed: u64, rays: &Rays, expected: &[Vec<u32>], engines: &[Engine]) {
    let text = program.to_string();
    let class = compile(&text);
    for engine in engines {
        let found = found(engine, &class, rays);
        if let Some(lane) = (0..COUNT).find(|lane| expected[*lane] != found[*lane]) {
            panic!(
                "seed {seed}, width {}: ray {lane} with {:?} and {:?}\nshall be {:?}\nbut is   {:?}\n{text}",
                engine.width(),
                rays.members[lane],
                rays.inputs[lane],
                expected[lane],
                found[lane]
            );
        }
    }
}

fn interpreter(math: Math) -> Engine {
    engine(Backend::Interpreter, 1, math).unwrap()
}

/// None where there is no LLVM.
fn machine_code(math: Math) -> Vec<Engine> {
    Engine::WIDTHS.iter().filter_map(|width| engine(Backend::Jit, *width, math)).collect()
}

#[test]
fn the_interpreter_runs_programs_as_the_language_says() {
    let engines = [interpreter(Math::Strict)];
    for seed in 0..150 {
        check(&Entropy::bytes(seed, 2000), seed, &engines);
    }
}

#[test]
fn machine_code_runs_programs_as_the_language_says() {
    let engines = machine_code(Math::Strict);
    for seed in 1000..1012 {
        check(&Entropy::bytes(seed, 1200), seed, &engines);
    }
}

#[test]
fn machine_code_agrees_with_the_interpreter_on_contracted_programs() {
    let oracle = interpreter(Math::Contract);
    let engines = machine_code(Math::Contract);
    for seed in 2000..2010 {
        let program = generate::program(&Entropy::bytes(seed, 1000), Builtins::All);
        let rays = Rays::random(&program, seed);
        let expected = found(&oracle, &compile(&program.to_string()), &rays);
        compare(&program, seed, &rays, &expected, &engines);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, max_shrink_iters: 3000, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_are_a_program_that_runs(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        check(&bytes, 7, &[interpreter(Math::Strict)]);
    }
}

#[test]
fn formatting_keeps_the_trees_of_random_programs() {
    let tree = |text: &str| {
        let mut sources = SourceMap::new();
        let file = sources.add("random.rtsl", text);
        let mut diagnostics = Diagnostics::default();
        let unit = rtsl_syntax::parse(&mut sources, file, &mut NoIncludes, &mut diagnostics);
        assert!(!diagnostics.has_errors(), "{text}");
        rtsl_syntax::print::print(&unit)
    };
    for seed in 0..40 {
        let text = generate::program(&Entropy::bytes(seed, 1500), Builtins::All).to_string();
        let formatted = rtsl_format::format(FileId(0), &text).expect("it has no errors");
        assert_eq!(tree(&formatted), tree(&text), "{text}");
        assert_eq!(rtsl_format::format(FileId(0), &formatted).as_deref(), Ok(formatted.as_str()));
    }
}
