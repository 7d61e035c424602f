//! Large tables of constants: one copy serves all rays, whatever runs the code.

use std::fmt::Write;

use rtsl::{
    Backend, CallArguments, CallMode, Compiler, Engine, EngineOptions, Instance, Instances, Method,
    host, lookup_state, new_state,
};

/// Rays of a call.
const COUNT: usize = 37;
/// Together they are more than a table could once be, and the first is by itself.
const SIZES: [usize; 2] = [150_000, 50_000];

fn element(table: usize, index: usize) -> usize {
    index * [7, 13][table] % [1009, 1013][table]
}

fn text() -> String {
    let mut text = String::new();
    for (table, size) in SIZES.iter().enumerate() {
        let values: Vec<String> =
            (0..*size).map(|index| element(table, index).to_string()).collect();
        let _ = writeln!(text, "const int t{table}[] = int[{size}]({});", values.join(", "));
    }
    text + "class Tables : rt_Texture;
        void lookup() {
            int i = int(rt_TextureUV.x), j = int(rt_TextureUV.y);
            rt_FloatTextureValue = float(t0[i]) * 2048.0 + float(t1[j]);
        }"
}

#[test]
fn large_tables_are_read_by_all_backends() {
    let compilation = Compiler::default().compile("tables.rtsl", &text());
    let Some(unit) = &compilation.unit else { panic!("{}", compilation.report(false)) };
    let class = unit.class("Tables").expect("it is there");
    let instance = Instance::new(class, []).expect("it has no parameters");
    let first = |name| lookup_state(name).expect("it is there").first_component as usize;
    let indices = |lane: usize| SIZES.map(|size| (lane * 10_007 + size - 1) % size);
    for (backend, width) in [(Backend::Interpreter, 1), (Backend::Jit, 1), (Backend::Jit, 8)] {
        let options = EngineOptions { backend, width: Some(width), ..Default::default() };
        // Without LLVM there is the interpreter.
        let Ok((engine, _)) = Engine::new(options) else { continue };
        let program = engine.program(&instance);
        let kernel = program.kernel(Method::Lookup, CallMode::Packet).expect("it compiles");
        let mut state = new_state(COUNT);
        for component in 0..2 {
            let array = state.floats_mut(first("rt_TextureUV") + component);
            for (lane, value) in array.iter_mut().enumerate() {
                *value = indices(lane)[component] as f32;
            }
        }
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
        for (lane, found) in state.floats(first("rt_FloatTextureValue")).iter().enumerate() {
            let [i, j] = indices(lane);
            let expected = (element(0, i) * 2048 + element(1, j)) as f32;
            assert_eq!(*found, expected, "{backend:?} at width {width}, lane {lane}");
        }
    }
}
