//! The run over a folder, and what it prints.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::case::Case;
use crate::judge::{Outcome, judge};
use crate::rules::Rule;
use crate::run::Runner;
use crate::translate::translate;
use crate::{deqp, piglit};

/// The cases of a suite.
#[derive(Default)]
pub struct Suite {
    agree: usize,
    excluded: BTreeMap<Rule, usize>,
    /// Names with reasons.
    differ: Vec<(String, String)>,
    unreadable: Vec<String>,
}

impl Suite {
    /// The part of the applicable cases that agree.
    pub fn agreeing(&self) -> f64 {
        self.agree as f64 / (self.agree + self.differ.len()).max(1) as f64
    }

    fn print(&self, name: &str) {
        let excluded: usize = self.excluded.values().sum();
        let applicable = self.agree + self.differ.len();
        println!("\n{name}: {} cases", excluded + applicable);
        for (rule, count) in &self.excluded {
            println!("  {count:6}  left out: {rule}");
        }
        println!("  {excluded:6}  left out");
        println!("  {applicable:6}  applicable");
        println!("  {:6}  agree: {:.2} %", self.agree, 100.0 * self.agreeing());
        println!("  {:6}  differ", self.differ.len());
        for (name, reason) in &self.differ {
            println!("    {name}: {reason}");
        }
        for problem in &self.unreadable {
            println!("  unreadable: {problem}");
        }
    }
}

/// Runs every case below a folder and prints a table for each suite. Outcome and translations of cases whose
/// names contain `shown` are printed, too.
pub fn run(folder: &Path, shown: Option<&str>) -> BTreeMap<&'static str, Suite> {
    let mut files = Vec::new();
    collect(folder, &mut files);
    files.sort();
    let runner = Runner::new();
    let mut suites: BTreeMap<&'static str, Suite> = BTreeMap::new();
    for file in files {
        let path = file.strip_prefix(folder).unwrap_or(&file).display().to_string();
        let (name, cases) = read(&file, &path);
        let cases = match cases {
            Ok(cases) if cases.is_empty() => continue,
            Ok(cases) => cases,
            Err(problem) => {
                suites.entry(name).or_default().unreadable.push(problem);
                continue;
            }
        };
        let suite = suites.entry(name).or_default();
        for case in cases {
            let outcome = judge(&case, &runner);
            if shown.is_some_and(|it| case.path.contains(it)) {
                show(&case, &outcome);
            }
            match outcome {
                Outcome::Excluded(rule) => *suite.excluded.entry(rule).or_default() += 1,
                Outcome::Agrees => suite.agree += 1,
                Outcome::Differs(reason) => suite.differ.push((case.path, reason)),
            }
        }
    }
    suites.iter().for_each(|(name, suite)| suite.print(name));
    suites
}

/// The cases of a file, and the name of their suite.
fn read(file: &Path, path: &str) -> (&'static str, Result<Vec<Case>, String>) {
    if file.extension().is_some_and(|it| it == "test") {
        return ("dEQP", deqp::read(file, path.trim_end_matches(".test")));
    }
    ("piglit", piglit::read(file, path).map(|case| case.into_iter().collect()))
}

fn show(case: &Case, outcome: &Outcome) {
    println!("// {}: {outcome:?}", case.path);
    let outputs = case.values.outputs.iter().map(|it| it.name.as_str()).collect();
    for shader in &case.shaders {
        let text = translate(shader, case.version, &outputs).text;
        println!("// {:?}\n{text}", shader.stage);
    }
}

/// Adds the files below a folder. Links are followed, but not in circles of folders.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    const DEPTH: usize = 40;
    if folder.components().count() > DEPTH {
        return;
    }
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.is_dir() { collect(&path, files) } else { files.push(path) }
    }
}
