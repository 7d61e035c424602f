//! The memory that the files of a scene may take: one budget for all of them, held before it is allocated.
//!
//! A small file may stand for very much: compressed pixels, meshes that are placed again and again, texts that others
//! include. Readers therefore hold what a file takes by its header before they decode it, and what grows while they
//! read as it grows.

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
    /// The limit where nobody says another.
    pub const DEFAULT: Amount = Amount(4 << 30);

    /// A budget of which nothing is taken. Without a limit it is [`InputBudget::DEFAULT`], or what there is if that is
    /// less.
    pub fn new(limit: Option<Amount>) -> Self {
        let limit = limit.unwrap_or_else(|| {
            let available = Available::least().map(|available| available.left);
            available.map_or(InputBudget::DEFAULT, |left| left.min(InputBudget::DEFAULT))
        });
        InputBudget::with_taken(limit, Amount(0))
    }

    /// A budget of its own, of which as much is taken now as of this one.
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
    /// Less is left.
    pub fn hold(&self, amount: Amount) -> Result<Held, OverBudget> {
        let mut held = Held { budget: self.clone(), amount: Amount(0) };
        held.grow_to(amount)?;
        Ok(held)
    }

    /// What is held.
    pub fn taken(&self) -> Amount {
        Amount(self.0.taken.load(Ordering::Relaxed))
    }

    /// Whether anything was refused: then there is no use in reading on.
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

/// Memory of a budget, which is given back when this is dropped.
#[derive(Debug)]
pub struct Held {
    budget: InputBudget,
    amount: Amount,
}

impl Held {
    /// Holds so much in all, if that is more than now.
    ///
    /// # Errors
    /// Less is left.
    pub fn grow_to(&mut self, amount: Amount) -> Result<(), OverBudget> {
        if amount > self.amount {
            let more = amount.without(self.amount);
            // What it holds already is among what it would take, and is left for it.
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

    /// Gives back all but so much, which stays taken for as long as the budget lasts.
    pub fn keep(mut self, amount: Amount) {
        self.amount = self.amount.without(amount);
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.budget.0.taken.fetch_sub(self.amount.0, Ordering::Relaxed);
    }
}

/// More than is left of a budget.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OverBudget {
    /// What was asked for.
    pub needed: Amount,
    /// What is left.
    pub left: Amount,
    /// The whole budget.
    pub limit: Amount,
}

impl fmt::Display for OverBudget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let OverBudget { needed, left, limit } = self;
        write!(
            f,
            "takes about {needed} of memory, and of the {limit} for the scene's files {left} are left"
        )
    }
}

impl std::error::Error for OverBudget {}

impl OverBudget {
    /// The error as users read it, of what a file is called.
    pub fn diagnostic(&self, what: impl fmt::Display) -> Diagnostic {
        let message = format!("`{what}` {self}");
        // Whole GiB that are enough, for what was asked for comes on top of what is taken.
        let enough = (self.limit.without(self.left) + self.needed).0.div_ceil(1 << 30);
        Diagnostic::new(codes::INPUT_MEMORY, message)
            .help(format!("allow more with `--input-memory {enough}GiB`"))
    }

    /// What hides in an error of reading.
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
            error[E0642]: `sky.png` takes about 1.5 GiB of memory, and of the 4.0 GiB for the scene's files 1.0 GiB are left
             = help: allow more with `--input-memory 5GiB`

        "#]]
        .assert_eq(&rtsl_source::Messages::one(diagnostic).to_text(false));
    }
}
