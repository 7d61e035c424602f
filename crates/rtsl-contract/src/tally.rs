//! The tally of a contract's tests, with the first failure.

use crate::contract::Contract;
use crate::neighbours::Verdict;
use crate::report::{Failure, Finding, Inputs, Outcome};

/// The results of one contract's tests so far.
#[derive(Clone, Debug)]
pub struct Tally {
    contract: Contract,
    tested: u64,
    broken: u64,
    first: Option<(String, Option<Inputs>)>,
    note: Option<String>,
    /// The fraction of tests that may fail.
    allowed: f64,
    /// The number of tests decided by rounding, and the message of the first.
    rounded: u64,
    first_rounded: Option<String>,
}

/// The greatest fraction of tests that rounding may decide: edges are not wider.
const ROUNDED_PART: f64 = 0.01;

impl Tally {
    pub fn new(contract: Contract) -> Tally {
        Tally {
            contract,
            tested: 0,
            broken: 0,
            first: None,
            note: None,
            allowed: 0.0,
            rounded: 0,
            first_rounded: None,
        }
    }

    /// Permits a fraction of the tests to fail because of rounding.
    pub fn allow(&mut self, part: f64) {
        self.allowed = part;
    }

    /// Counts a test. If it is the first to fail, `message` describes the failure. Returns true for the first failure,
    /// whose inputs should then be set.
    pub fn test(&mut self, holds: bool, message: impl FnOnce() -> String) -> bool {
        self.tested += 1;
        if holds {
            return false;
        }
        self.broken += 1;
        let is_first = self.first.is_none();
        if is_first {
            self.first = Some((message(), None));
        }
        is_first
    }

    /// The same for a test that rounding may have decided. A few of these do not count.
    pub fn judge(&mut self, verdict: Verdict, message: impl FnOnce() -> String) -> bool {
        if verdict == Verdict::Rounded {
            self.tested += 1;
            self.rounded += 1;
            self.first_rounded.get_or_insert_with(message);
            return false;
        }
        self.test(verdict == Verdict::Agree, message)
    }

    /// Sets the inputs of the first failing test.
    pub fn set_inputs(&mut self, given: Inputs) {
        if let Some((_, inputs)) = &mut self.first {
            inputs.get_or_insert(given);
        }
    }

    /// Records a measurement or an assumption, for reports of contracts that hold.
    pub fn note(&mut self, note: String) {
        self.note = Some(note);
    }

    /// Returns the finding; if nothing was tested, `reason` explains it.
    pub fn finish(self, reason: &str) -> Finding {
        let Tally { contract, tested, mut broken, mut first, note, allowed, .. } = self;
        if self.rounded as f64 > ROUNDED_PART * tested as f64 {
            broken += self.rounded;
            first = first.or(self.first_rounded.map(|message| (message, None)));
        }
        let first = first.filter(|_| broken as f64 > allowed * tested as f64);
        let outcome = match first {
            Some((message, inputs)) => Outcome::Broken(Failure { message, inputs, broken, tested }),
            None if tested == 0 => Outcome::NotApplicable(reason.to_owned()),
            None => Outcome::Held(note),
        };
        Finding { contract, outcome }
    }
}
