//! Reports of checks.

use std::fmt;

use rtsl::Method;

use crate::contract::Contract;

/// The contracts of a class and their outcomes.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// The class.
    pub class: String,
    /// The outcome of each contract.
    pub findings: Vec<Finding>,
}

/// One contract.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The contract.
    pub contract: Contract,
    /// The outcome.
    pub outcome: Outcome,
}

/// The outcome of a contract.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// The contract held in all tests, perhaps with a note on assumptions or measurements.
    Held(Option<String>),
    /// The contract is broken.
    Broken(Failure),
    /// The contract does not apply to this class, for this reason.
    NotApplicable(String),
}

/// A case in which a contract is broken.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// The actual values and the expected ones.
    pub message: String,
    /// A call that shows the failure.
    pub inputs: Option<Inputs>,
    /// The number of tests of the same kind that failed.
    pub broken: u64,
    /// The number of tests.
    pub tested: u64,
}

/// The inputs of a call.
#[derive(Clone, Debug, PartialEq)]
pub struct Inputs {
    /// The method.
    pub method: Method,
    /// The state variables that it reads, and their components.
    pub state: Vec<(&'static str, Vec<f32>)>,
}

impl Report {
    /// True if no contract is broken.
    pub fn holds(&self) -> bool {
        self.broken().next().is_none()
    }

    /// Returns the contracts that are broken.
    pub fn broken(&self) -> impl Iterator<Item = (Contract, &Failure)> {
        self.findings.iter().filter_map(|finding| match &finding.outcome {
            Outcome::Broken(failure) => Some((finding.contract, failure)),
            Outcome::Held(_) | Outcome::NotApplicable(_) => None,
        })
    }
}

/// One line for each contract, and some more for each that is broken.
impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.findings.iter().try_for_each(|finding| write!(f, "{finding}"))
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(
            &self.to_text(&|inputs| format!("inputs of {}: {inputs}", inputs.method.name())),
        )
    }
}

impl Finding {
    /// Formats the report; `show` returns the command that repeats a failing call.
    pub fn to_text(&self, show: &dyn Fn(&Inputs) -> String) -> String {
        let promise = self.contract.promise();
        match &self.outcome {
            Outcome::Held(None) => format!("  held    {promise}\n"),
            Outcome::Held(Some(note)) => format!("  held    {promise}: {note}\n"),
            Outcome::NotApplicable(reason) => format!("  -       {promise}: {reason}\n"),
            Outcome::Broken(failure) => {
                let hint = self.contract.hint();
                let Failure { message, inputs, broken, tested } = failure;
                let inputs = inputs.as_ref().filter(|inputs| !inputs.state.is_empty());
                let inputs = inputs.map(|inputs| format!("          {}\n", show(inputs)));
                let inputs = inputs.unwrap_or_default();
                format!(
                    "  BROKEN  {promise}\n          {message}\n          ({broken} of {tested} tests)\n{inputs}          look at: {hint}\n"
                )
            }
        }
    }
}

/// In the syntax of `rtsl eval --state`: `rt_RayDirection=0,0,1 rt_Epsilon=0.1`.
impl fmt::Display for Inputs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (name, values)) in self.state.iter().enumerate() {
            let values: Vec<String> = values.iter().map(f32::to_string).collect();
            let space = if index == 0 { "" } else { " " };
            write!(f, "{space}{name}={}", values.join(","))?;
        }
        Ok(())
    }
}
