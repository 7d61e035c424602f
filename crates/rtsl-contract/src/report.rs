//! What a check found.

use std::fmt;

use rtsl::Method;

use crate::Contract;

/// What a class promises and whether it keeps it.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// The class.
    pub class: String,
    /// Its contracts.
    pub findings: Vec<Finding>,
}

/// One contract.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What is promised.
    pub contract: Contract,
    /// Whether it holds.
    pub outcome: Outcome,
}

/// Whether a contract holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// As far as was tested; perhaps with what was assumed or measured.
    Held(Option<String>),
    /// There is a case in which it does not.
    Broken(Failure),
    /// It says nothing of this class, for this reason.
    NotApplicable(String),
}

/// A case in which a contract does not hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// What was found, with numbers, and what was expected.
    pub message: String,
    /// A call that shows it.
    pub inputs: Option<Inputs>,
    /// How many tests of the same kind failed.
    pub broken: u64,
    /// How many there were.
    pub tested: u64,
}

/// What a method was called with.
#[derive(Clone, Debug, PartialEq)]
pub struct Inputs {
    /// The method.
    pub method: Method,
    /// The state variables that it reads, and their components.
    pub state: Vec<(&'static str, Vec<f32>)>,
}

impl Report {
    /// Whether no contract is broken.
    pub fn holds(&self) -> bool {
        self.broken().next().is_none()
    }

    /// The contracts that are broken.
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
    /// The lines of a report; `show` says how to repeat a call that shows a failure.
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

/// As `rtsl eval` takes them after its `--state`: `rt_RayDirection=0,0,1 rt_Epsilon=0.1`.
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
