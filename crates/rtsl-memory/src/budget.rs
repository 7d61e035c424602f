//! The memory budget for the files of a scene, shared by all of them; memory is held before it is allocated.
//!
//! A small file may need much memory: compressed pixels, meshes that are instantiated repeatedly, texts that other
//! texts include. Readers therefore hold the memory that a file's header implies before they decode it, and the memory
//! of growing structures as they grow.

use std::fmt;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rtsl_source::{Diagnostic, diagnostic_codes as codes};

use super::{Amount, Available};

/// A budget. Clones share it.
#[derive(Clone, Debug)]
pub struct InputBudget(Arc<Account>);

#[derive(Debug)]
struct Account {
    limit: Amount,
    taken: AtomicU64,
    is_exceeded: AtomicBool,
}

impl Default for InputBudget {
    fn default() -> Self {
        InputBudget::new(None)
    }
}

impl InputBudget {
    /// The limit where the system reports no available memory.
    pub const DEFAULT: Amount = Amount(4 << 30);

    /// Creates an unused budget. The default limit is three quarters of the available memory, or
    /// [`InputBudget::DEFAULT`] where that is unknown.
    pub fn new(limit: Option<Amount>) -> Self {
        let limit = limit.unwrap_or_else(|| {
            let available = Available::least().map(|available| available.left);
            available.map_or(InputBudget::DEFAULT, |Amount(left)| Amount(left / 4 * 3))
        });
        InputBudget::with_taken(limit, Amount(0))
    }

    /// Creates an independent budget with the same limit and the same use.
    pub fn branch(&self) -> Self {
        InputBudget::with_taken(self.0.limit, self.taken())
    }

    fn with_taken(limit: Amount, Amount(taken): Amount) -> Self {
        let is_exceeded = AtomicBool::new(false);
        InputBudget(Arc::new(Account { limit, taken: AtomicU64::new(taken), is_exceeded }))
    }

    /// Holds memory until the result is dropped.
    ///
    /// # Errors
    /// If less is left.
    pub fn hold(&self, amount: Amount) -> Result<Held, OverBudget> {
        let mut held = Held { budget: self.clone(), amount: Amount(0) };
        held.grow_to(amount)?;
        Ok(held)
    }

    /// Returns the greatest amount that can be in use.
    pub fn limit(&self) -> Amount {
        self.0.limit
    }

    /// Returns the amount in use.
    pub fn taken(&self) -> Amount {
        Amount(self.0.taken.load(Ordering::Relaxed))
    }

    /// True if a request was refused: reading can then be aborted.
    pub fn is_exceeded(&self) -> bool {
        self.0.is_exceeded.load(Ordering::Relaxed)
    }

    fn take(&self, amount: Amount) -> Result<(), OverBudget> {
        let limit = self.0.limit;
        let taken = self.0.taken.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |taken| {
            let sum = Amount(taken) + amount;
            (sum <= limit).then_some(sum.0)
        });
        taken.map(drop).map_err(|taken| {
            self.0.is_exceeded.store(true, Ordering::Relaxed);
            OverBudget { needed: amount, left: limit.without(Amount(taken)), limit }
        })
    }
}

/// Memory held in a budget; dropping it returns the memory.
#[derive(Debug)]
pub struct Held {
    budget: InputBudget,
    amount: Amount,
}

impl Held {
    /// Increases the amount held to `amount`; a smaller one changes nothing.
    ///
    /// # Errors
    /// If less is left.
    pub fn grow_to(&mut self, amount: Amount) -> Result<(), OverBudget> {
        if amount > self.amount {
            let more = amount.without(self.amount);
            // The present amount is counted as available.
            let held = self.amount;
            self.budget.take(more).map_err(|OverBudget { left, limit, .. }| OverBudget {
                needed: amount,
                left: left + held,
                limit,
            })?;
            self.amount = amount;
        }
        Ok(())
    }

    /// Returns all but `amount`, which remains in use for as long as the budget lives.
    pub fn keep(mut self, amount: Amount) {
        self.amount = self.amount.without(amount);
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.budget.0.taken.fetch_sub(self.amount.0, Ordering::Relaxed);
    }
}

/// The error of a request that exceeds a budget.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OverBudget {
    /// The amount requested.
    pub needed: Amount,
    /// The amount left.
    pub left: Amount,
    /// The limit of the budget.
    pub limit: Amount,
}

impl fmt::Display for OverBudget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let OverBudget { needed, left, limit } = self;
        write!(
            f,
            "takes about {needed} of memory, but only {left} of the {limit} for the scene's files are left"
        )
    }
}

impl std::error::Error for OverBudget {}

impl OverBudget {
    /// The diagnostic for the file, or part of the scene, named `what`.
    pub fn diagnostic(&self, what: impl fmt::Display) -> Diagnostic {
        let message = format!("`{what}` {self}");
        // The least number of GiB that suffices: the request comes on top of the memory in use.
        let enough = (self.limit.without(self.left) + self.needed).0.div_ceil(1 << 30);
        Diagnostic::new(codes::INPUT_MEMORY, message)
            .help(format!("allow more with `--input-memory {enough}GiB`"))
    }

    /// Returns the error if it is the cause of an I/O error.
    pub fn of(error: &io::Error) -> Option<&OverBudget> {
        error.get_ref()?.downcast_ref()
    }
}

impl From<OverBudget> for io::Error {
    fn from(error: OverBudget) -> Self {
        io::Error::new(io::ErrorKind::OutOfMemory, error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_comes_back_and_what_is_kept_stays() {
        let budget = InputBudget::new(Some(Amount(100)));
        let mut first = budget.hold(Amount(60)).unwrap();
        let error = budget.hold(Amount(50)).unwrap_err();
        assert_eq!(error, OverBudget { needed: Amount(50), left: Amount(40), limit: Amount(100) });
        assert!(budget.is_exceeded() && budget.taken() == Amount(60));
        first.grow_to(Amount(80)).unwrap();
        first.grow_to(Amount(10)).unwrap();
        let error = first.grow_to(Amount(101)).unwrap_err();
        assert_eq!(
            error,
            OverBudget { needed: Amount(101), left: Amount(100), limit: Amount(100) }
        );
        assert_eq!(budget.taken(), Amount(80));
        first.keep(Amount(30));
        assert_eq!((budget.taken(), budget.branch().taken()), (Amount(30), Amount(30)));
        drop(budget.branch().hold(Amount(70)).unwrap());
        assert!(budget.hold(Amount(u64::MAX)).is_err() && !budget.branch().is_exceeded());
    }

    #[test]
    fn the_error_names_file_need_and_flag() {
        let budget = InputBudget::new(Some(Amount(4 << 30)));
        let kept = budget.hold(Amount(3 << 30)).unwrap();
        let error = io::Error::from(budget.hold(Amount(3 << 29)).unwrap_err());
        let diagnostic = OverBudget::of(&error).unwrap().diagnostic("sky.png");
        drop(kept);
        expect_test::expect![[r#"
            error[E0642]: `sky.png` takes about 1.5 GiB of memory, but only 1.0 GiB of the 4.0 GiB for the scene's files are left
             = help: allow more with `--input-memory 5GiB`

        "#]]
        .assert_eq(&rtsl_source::Messages::one(diagnostic).to_text(false));
    }
}
