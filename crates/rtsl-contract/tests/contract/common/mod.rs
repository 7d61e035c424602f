//! Checks a text's class and compares what its report says of broken contracts.

pub mod seeds;

use std::sync::Arc;

use expect_test::Expect;
use rtsl::{Class, Compiler, Engine, Instance};
use rtsl_contract::{Contract, Options, Report, check, engine_options, settings};

use self::seeds::seeds;

/// The report on the text's last class.
pub fn report(text: &str, options: &Options) -> Report {
    let compilation = Compiler::default().compile("class.rtsl", text);
    let Some(unit) = &compilation.unit else { panic!("{}", compilation.report(false)) };
    let instance = with_references(unit.classes().last().expect("a class"));
    let (engine, _) = Engine::new(engine_options()).expect("an engine");
    check(&engine, &instance, options).expect("it has code")
}

/// An instance with the defaults, whose references have shapes and textures of the library, as in `rtsl test`.
fn with_references(class: &Arc<Class>) -> Arc<Instance> {
    let defaults = settings(class, &[]).into_iter().next().expect("the defaults");
    let made = defaults.instance(class, &[]);
    made.unwrap_or_else(|problems| panic!("it needs parameters: {:?}", problems.into_vec()))
}

/// Compares what the report on the text's last class says of contracts that are broken. With other seeds the same
/// contracts are broken, or as many are kept.
#[track_caller]
pub fn finds(text: &str, expected: Expect) {
    let compilation = Compiler::default().compile("wrong.rtsl", text);
    let Some(unit) = &compilation.unit else { panic!("{}", compilation.report(false)) };
    let instance = with_references(unit.classes().last().expect("a class"));
    let (engine, _) = Engine::new(engine_options()).expect("an engine");
    let report = check(&engine, &instance, &Options::default()).expect("it has code");
    let broken: String = report
        .findings
        .iter()
        .filter(|finding| report.broken().any(|(contract, _)| contract == finding.contract))
        .map(ToString::to_string)
        .collect();
    let header = if broken.is_empty() { "keeps all" } else { "breaks" };
    expected.assert_eq(&format!("{header}\n{broken}"));
    // Kernels are kept while somebody has the program.
    let _program = engine.program(&instance);
    let contracts = |report: &Report| -> Vec<Contract> {
        report.broken().map(|(contract, _)| contract).collect()
    };
    let expected = contracts(&report);
    for seed in seeds().skip(1) {
        let options = Options { seed, compare_bits: false, ..Options::default() };
        let report = check(&engine, &instance, &options).expect("it has code");
        let found = contracts(&report);
        let is_missed = expected.iter().any(|it| !found.contains(it));
        let is_alarm = expected.is_empty() && !found.is_empty();
        assert!(!is_missed && !is_alarm, "seed {seed}, not as {expected:?}:\n{report}");
    }
}
