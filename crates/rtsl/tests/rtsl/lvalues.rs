//! The target of an assignment is found once, before the value: every form of lvalue, on every backend and width.

use rtsl::{
    Backend, CallArguments, CallMode, Compiler, Engine, EngineOptions, Instance, Instances, Method,
    OptLevel, host, lookup_state, new_state,
};

/// The class counts by itself what went wrong.
const TEXT: &str = include_str!("common/lvalues.rtsl");
/// Rays of a call: not a multiple of any width but 1.
const COUNT: usize = 21;

fn engines() -> Vec<Engine> {
    let engine = |backend, width, optimization| {
        let options =
            EngineOptions { backend, width: Some(width), optimization, ..Default::default() };
        Engine::new(options).map(|(engine, _)| engine)
    };
    let oracle = engine(Backend::Interpreter, 1, OptLevel::O1).expect("it needs nothing");
    let compiled = [
        (1, OptLevel::O0),
        (1, OptLevel::O1),
        (4, OptLevel::O1),
        (8, OptLevel::O0),
        (16, OptLevel::O1),
    ];
    let compiled = compiled
        .into_iter()
        .filter_map(|(width, optimization)| engine(Backend::Jit, width, optimization).ok());
    std::iter::once(oracle).chain(compiled).collect()
}

#[test]
fn places_are_found_once_and_before_the_value() {
    let compilation = Compiler::default().compile("lvalues.rtsl", TEXT);
    let Some(unit) = &compilation.unit else { panic!("{}", compilation.report(false)) };
    let class = unit.class("Lvalues").expect("it is there");
    let instance = Instance::new(class, []).expect("it has no parameters");
    let component = |name| lookup_state(name).expect("it is there").first_component as usize;
    for engine in engines() {
        let program = engine.program(&instance);
        let kernel = program.kernel(Method::Lookup, CallMode::Packet).expect("it compiles");
        let mut state = new_state(COUNT);
        state.floats_mut(component("rt_TextureUV")).fill(1.0);
        let status = kernel.call(CallArguments {
            state: &mut state,
            scratch: &mut program.new_scratch(COUNT),
            count: COUNT,
            mask: None,
            accepted: None,
            instances: Instances::One(&program.block(&instance)),
            host: &mut host::NoHost,
        });
        assert!(!status.budget_exhausted);
        let failures = state.floats(component("rt_FloatTextureValue"));
        let none = failures.iter().all(|count| *count == 0.0);
        assert!(none, "{:?}, width {}: {failures:?}", engine.options().backend, engine.width());
    }
}
