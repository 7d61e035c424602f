//! Checks a text's class and compares what its report says of broken contracts.

use expect_test::Expect;
use rtsl::{Compiler, Engine, Instance};
use rtsl_contract::{Options, check, engine_options};

/// Compares what the report on the text's last class says of contracts that are broken.
#[track_caller]
pub fn finds(text: &str, expected: Expect) {
    let compilation = Compiler::default().compile("wrong.rtsl", text);
    let Some(unit) = &compilation.unit else { panic!("{}", compilation.report(false)) };
    let class = unit.classes().last().expect("a class");
    let instance = Instance::new(class, []).expect("it needs no parameters");
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
}
