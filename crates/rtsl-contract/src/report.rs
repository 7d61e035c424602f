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
        let promise = self.contract.promise();
        match &self.outcome {
            Outcome::Held(None) => writeln!(f, "  held    {promise}"),
            Outcome::Held(Some(note)) => writeln!(f, "  held    {promise}: {note}"),
            Outcome::NotApplicable(reason) => writeln!(f, "  -       {promise}: {reason}"),
            Outcome::Broken(failure) => {
                writeln!(f, "  BROKEN  {promise}")?;
                write!(f, "{failure}")?;
                writeln!(f, "          look at: {}", self.contract.hint())
            }
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "          {}", self.message)?;
        writeln!(f, "          ({} of {} tests)", self.broken, self.tested)?;
        match &self.inputs {
            Some(inputs) if !inputs.state.is_empty() => {
                writeln!(f, "          inputs of {}: {inputs}", inputs.method.name())
            }
            Some(_) | None => Ok(()),
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
