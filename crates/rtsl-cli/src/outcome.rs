//! The end of a command.

use rtsl::Diagnostic;

/// The exit code of a command whose input has errors.
pub const INPUT_AT_FAULT: u8 = 1;
/// The exit code of a wrong command line.
pub const WRONG_USAGE: u8 = 2;

/// The end of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The command succeeded.
    Done,
    /// The input has errors; diagnostics are written.
    InputAtFault,
}

/// An error that ends a command.
#[derive(Debug)]
pub enum Failure {
    /// The command line is wrong.
    Usage(String),
    /// The input has errors; diagnostics are not written yet.
    Diagnostics(Vec<Diagnostic>),
    /// The input has errors; diagnostics are written.
    Reported,
    /// The result cannot be written.
    Output(std::io::Error),
}

impl From<Diagnostic> for Failure {
    fn from(diagnostic: Diagnostic) -> Failure {
        Failure::Diagnostics(vec![diagnostic])
    }
}

/// The result of a command.
pub type CommandResult = Result<Outcome, Failure>;
