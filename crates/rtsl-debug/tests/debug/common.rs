//! Recordings of textures.

use rtsl::host::NoHost;
use rtsl::{
    CallArguments, CallMode, Compiler, CompilerOptions, Engine, EngineOptions, Instance, Instances,
    Method, Trace, TraceDetail, TraceLimits, Value, lookup_state, new_state,
};
use rtsl_debug::{Frame, Reason, Replay, Scopes, Stopped};

/// A texture that calls a function in a loop.
pub const SUMMED: &str = "struct Hit { float t; vec3 n; };
class Summed : rt_Texture;
public int count = 3;
float square(float x) {
    if (x < 0.0)
        return 0.0;
    return x * x;
}
void lookup() {
    float sum = 0.0;
    Hit best;
    best.n = vec3(0.0, 0.0, 1.0);
    for (int i = 0; i < count; i++) {
        float term = square(float(i) - 1.0);
        if (term == 0.0)
            continue;
        best.t = term;
        sum += term;
    }
    print(\"sum {}\", sum);
    rt_TextureColor = color(sum);
}
";

/// Records `lookup` of the only class of a text, with this texture coordinate.
pub fn replay_with(text: &str, u: f32, limits: TraceLimits) -> Replay {
    let options = CompilerOptions { traced: true, ..CompilerOptions::default() };
    let compilation = Compiler::new(options).compile("test.rtsl", text);
    let unit = compilation.unit.as_ref().unwrap_or_else(|| panic!("{}", compilation.report(false)));
    let class = &unit.classes()[unit.classes().len() - 1];
    let instance = Instance::new(class, std::iter::empty::<(&str, Value)>()).unwrap();
    let trace = Trace::with_limits(TraceDetail::Steps, limits);
    let options = EngineOptions { trace: Some(trace.clone()), ..EngineOptions::default() };
    let (engine, _) = Engine::new(options).unwrap();
    let program = engine.program(&instance);
    let kernel = program.kernel(Method::Lookup, CallMode::Packet).unwrap();
    let mut state = new_state(1);
    let variable = lookup_state("rt_TextureUV").unwrap();
    state.floats_mut(variable.first_component as usize)[0] = u;
    trace.start();
    let status = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut program.new_scratch(1),
        count: 1,
        mask: None,
        accepted: None,
        instances: Instances::One(&program.block(&instance)),
        host: &mut NoHost,
    });
    assert!(!status.budget_exhausted);
    Replay::new(trace.take(), trace.stepped_lines()).unwrap()
}

/// Records all of `lookup`.
pub fn replay(text: &str) -> Replay {
    replay_with(text, 0.25, TraceLimits::default())
}

/// The innermost call.
pub fn frame(replay: &Replay) -> Frame {
    replay.frames().swap_remove(0)
}

/// The calls with their lines, the innermost first: `square:5 Summed.lookup:14`.
pub fn place(replay: &Replay) -> String {
    let frames = replay.frames();
    let frames = frames.iter().map(|it| format!("{}:{}", it.name, it.line().unwrap_or_default()));
    frames.collect::<Vec<_>>().join(" ")
}

/// The calls after a movement, and the reason of its end if it is not that it is done.
pub fn after(replay: &Replay, stopped: &Stopped) -> String {
    match &stopped.reason {
        Reason::Step => place(replay),
        Reason::NotFinite(found) => format!("{}: {found}", place(replay)),
        other => format!("{}: {other:?}", place(replay)),
    }
}

/// The places after movements, line by line.
pub fn walk(
    replay: &mut Replay,
    count: usize,
    movement: impl Fn(&mut Replay) -> Stopped,
) -> String {
    let mut text = String::new();
    for _ in 0..count {
        let stopped = movement(replay);
        text += &after(replay, &stopped);
        text.push('\n');
    }
    text
}

/// The variables of the innermost call.
pub fn variables(replay: &Replay) -> String {
    let scopes = replay.scopes(&frame(replay));
    let Scopes { locals, members, state_read, state_set, result, results } = scopes;
    let mut text = String::new();
    for (title, values) in [
        ("local", locals),
        ("member", members),
        ("state read", state_read),
        ("state set", state_set),
    ] {
        for value in values {
            text += &format!("{title} {} = {value}\n", value.name());
        }
    }
    if let Some(value) = result {
        text += &format!("returns {value}\n");
    }
    for (function, value) in results {
        text += &format!("result of {function}: {value}\n");
    }
    text
}
