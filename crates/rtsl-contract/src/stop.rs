//! Why a check ends early.

use rtsl::Diagnostic;

/// Why a check ends early.
#[derive(Debug)]
pub enum Stop {
    /// A method has no code.
    NoCode(Box<Diagnostic>),
    /// A call ran past its budget, which is a finding already; further ones would take as long.
    Endless,
}

impl From<Diagnostic> for Stop {
    fn from(diagnostic: Diagnostic) -> Stop {
        Stop::NoCode(Box::new(diagnostic))
    }
}
