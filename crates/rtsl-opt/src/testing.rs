//! Helpers shared by the tests of passes.

use rtsl_ir::{Constant, Function, Interpreter, Outcome, verify::verify};
use rtsl_testing::functions::{Entropy, HashHost, Memory, function};

/// The variables that the bodies of tests may use.
const VARIABLES: &str = "
    scratch f: f32[4] scratch i: i32[4] scratch u: u32[4] scratch b: bool[4]
    member m: f32[3] member n: i32[3] buffer t: f32[3] local s: f32[4] local q: f32[4] local r: i32[4]
    accepted hit: bool[1]";

/// Parses a function with these variables and this body.
pub(crate) fn function_of(body: &str) -> Function {
    let function: Function = match format!("function f {VARIABLES} {{ {body} }}").parse() {
        Ok(function) => function,
        Err(error) => panic!("{error}\n{body}"),
    };
    verify(&function).unwrap_or_else(|error| panic!("{error}"));
    function
}

/// Returns the renumbered body after a pass, without the loads from scratch that tests start with.
pub(crate) fn transformed(body: &str, pass: impl FnOnce(&mut Function)) -> String {
    let mut function = function_of(body);
    pass(&mut function);
    function.renumber();
    verify(&function).unwrap_or_else(|error| panic!("{error}\n{function}"));
    let text = function.to_string();
    let (_, body) = text.split_once("\n{\n").expect("a body");
    let lines = body.lines().filter(|line| !line.contains("= load scratch:") && *line != "}");
    lines.map(|line| format!("{}\n", line.strip_prefix("  ").unwrap_or(line))).collect()
}

/// Checks on generated functions that a pass keeps functions valid and preserves results to the bit.
pub(crate) fn check_preserves(pass: impl Fn(&mut Function)) {
    for seed in 0..300 {
        let size = 40 + seed as usize * 3;
        let before = function(&Entropy::bytes(seed, size));
        let mut after = before.clone();
        pass(&mut after);
        verify(&after).unwrap_or_else(|error| panic!("seed {seed}: {error}\n{after}"));
        for run in 0..3 {
            let inputs = Entropy::bytes(seed ^ (run << 40), 600);
            let (expected, found) = (outcome(&before, &inputs), outcome(&after, &inputs));
            assert!(expected == found, "seed {seed}\n{before}\n{after}\n{expected:?}\n{found:?}");
        }
    }
}

/// Returns the content of a function's variables, except locals, after a run, ignoring the weights of its rays.
pub(crate) fn outcome(function: &Function, inputs: &[u8]) -> (Vec<Vec<Constant>>, Outcome) {
    outcome_with(HashHost::ignoring_weights(), function, inputs)
}

/// Like [`outcome`], with this host.
pub(crate) fn outcome_with(
    mut host: HashHost,
    function: &Function,
    inputs: &[u8],
) -> (Vec<Vec<Constant>>, Outcome) {
    let mut memory = Memory::new(function, &mut Entropy::new(inputs));
    let mut interpreter = Interpreter::prepare(function).expect("linked");
    let outcome = interpreter.run(3, &mut memory, &mut host);
    let mut snapshot = memory.snapshot();
    snapshot.retain(|variable| !variable.is_empty());
    (snapshot, outcome)
}
