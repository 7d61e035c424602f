//! Mutated functions: those that the verifier accepts neither make a later stage panic nor change its results.

use rtsl_ir::verify::verify;
use rtsl_ir::{Constant, Function, Interpreter, Outcome};
use rtsl_opt::{Options, budget, optimize};
use rtsl_testing::functions::{Entropy, HashHost, Memory, seeded_function};

/// Prints a generated function with some uses of values exchanged for others, and occasionally a random word.
fn mutated_text(seed: u64) -> String {
    let text = seeded_function(seed, 150).to_string();
    let mut words: Vec<&str> = text.split_inclusive([' ', ',', '\n']).collect();
    let is_use = |word: &str| word.starts_with('%') && !word.contains(':');
    let uses: Vec<usize> = (0..words.len()).filter(|index| is_use(words[*index])).collect();
    let choices = Entropy::bytes(!seed, 64);
    let mut entropy = Entropy::new(&choices);
    for _ in 0..=entropy.below(2) {
        let [from, to] = std::array::from_fn(|_| entropy.bits() as usize % words.len());
        let any = entropy.chance(40) || uses.is_empty();
        let [from, to] = if any { [from, to] } else { [from, to].map(|it| uses[it % uses.len()]) };
        let end = |word: &str| word.trim_start_matches(|it: char| it != ',' && it != '\n').len();
        if any || end(words[from]) == end(words[to]) {
            words[to] = words[from];
        }
    }
    words.concat()
}

fn outcome(function: &Function) -> (Vec<Vec<Constant>>, Outcome) {
    let bytes = Entropy::bytes(1, 400);
    let mut memory = Memory::new(function, &mut Entropy::new(&bytes));
    let mut interpreter = Interpreter::prepare(function).unwrap();
    let outcome = interpreter.run(0, &mut memory, &mut HashHost::ignoring_weights());
    let mut snapshot = memory.snapshot();
    snapshot.retain(|variable| !variable.is_empty());
    (snapshot, outcome)
}

#[test]
fn verified_functions_can_be_optimized_and_run() {
    let mut verified = 0;
    for seed in 0..1500 {
        let Ok(mut function) = mutated_text(seed).parse::<Function>() else { continue };
        if verify(&function).is_err() {
            continue;
        }
        verified += 1;
        // A mutated loop may not end; the budget inserts an exit that passes preserve.
        budget::run(&mut function, 500);
        let expected = outcome(&function);
        let options = Options { contract: false, ..Options::default() };
        optimize(&mut function, &options);
        assert_eq!(outcome(&function), expected, "{seed}");
    }
    assert!(verified > 150, "{verified} mutations verify");
}
