//! Reasons for ending a check early.

use rtsl::Diagnostic;

/// A reason for ending a check early.
#[derive(Debug)]
pub enum Stop {
    /// A method cannot be compiled.
    NoCode(Box<Diagnostic>),
    /// A call exceeded its budget, which is recorded as a finding; further calls would take as long.
    Endless,
}

impl From<Diagnostic> for Stop {
    fn from(diagnostic: Diagnostic) -> Stop {
        Stop::NoCode(Box::new(diagnostic))
    }
}
