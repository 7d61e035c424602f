//! The accuracy of the mathematical functions: promised bounds and measured errors.
//!
//! Errors are in units in the last place (ulp) of the exact result. The manual is generated from
//! this table, and the tests of the prelude read their bounds from it.

/// The error of one function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accuracy {
    /// The function.
    pub name: &'static str,
    /// The number of arguments of the form that the entry is about.
    pub arguments: usize,
    /// The greatest error that is promised, in ulp.
    pub bound: f64,
    /// The arguments for which the bound holds.
    pub domain: AccuracyDomain,
    /// The greatest error over all arguments, found by an exhaustive test; `None` where there was
    /// none.
    pub greatest: Option<GreatestError>,
}

/// The arguments that a bound holds for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AccuracyDomain {
    /// All floats.
    Everywhere,
    /// |x| at most this, and no infinity.
    UpTo(f32),
    /// x > 0.
    Positive,
}

/// The argument with the greatest error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GreatestError {
    /// The error in ulp, rounded up.
    pub ulp: f64,
    /// The argument.
    pub at: f32,
}

/// Every function that has a bound.
pub static ACCURACY: &[Accuracy] = &[
    tried("sin", 2.0, AccuracyDomain::UpTo(1_048_576.0), 1.67, 931_878.1),
    tried("cos", 2.0, AccuracyDomain::UpTo(1_048_576.0), 1.81, 993_335.5),
    tried("tan", 2.0, AccuracyDomain::UpTo(1_048_576.0), 1.64, 656_623.5),
    tried("asin", 3.0, AccuracyDomain::Everywhere, 2.36, 0.5002491),
    tried("acos", 3.0, AccuracyDomain::Everywhere, 1.27, -0.50042796),
    tried("atan", 3.0, AccuracyDomain::Everywhere, 2.0, 1.1543363),
    untried("atan", 2, 3.0, AccuracyDomain::Everywhere),
    tried("sinh", 4.0, AccuracyDomain::Everywhere, 3.88, 23.558243),
    tried("cosh", 4.0, AccuracyDomain::Everywhere, 3.88, 23.558243),
    tried("tanh", 4.0, AccuracyDomain::Everywhere, 1.52, 0.6539013),
    tried("asinh", 4.0, AccuracyDomain::Everywhere, 2.3, 0.06106479),
    tried("acosh", 4.0, AccuracyDomain::Everywhere, 2.69, 1.0075651),
    tried("atanh", 4.0, AccuracyDomain::Everywhere, 2.7, 0.030688852),
    untried("pow", 2, 4.0, AccuracyDomain::Positive),
    tried("exp", 2.0, AccuracyDomain::Everywhere, 1.78, -0.017543346),
    tried("log", 2.0, AccuracyDomain::Everywhere, 1.16, 1.4135828),
    tried("exp2", 2.0, AccuracyDomain::Everywhere, 1.4, -0.0015677513),
    tried("log2", 2.0, AccuracyDomain::Everywhere, 1.9, 1.4140085),
    tried("inversesqrt", 2.0, AccuracyDomain::Everywhere, 1.5, 1.1827658e-38),
];

/// The bound for the function `name` with this many arguments.
pub fn accuracy(name: &str, arguments: usize) -> Option<&'static Accuracy> {
    ACCURACY.iter().find(|each| each.name == name && each.arguments == arguments)
}

impl AccuracyDomain {
    /// True if the bound holds for this argument. NaN belongs to every domain but `Positive`.
    pub fn contains(self, x: f32) -> bool {
        match self {
            AccuracyDomain::Everywhere => true,
            AccuracyDomain::UpTo(largest) => x.is_nan() || x.abs() <= largest,
            AccuracyDomain::Positive => x > 0.0,
        }
    }
}

/// An entry for a function of one argument, whose greatest error is `ulp`, at the argument `at`.
const fn tried(
    name: &'static str,
    bound: f64,
    domain: AccuracyDomain,
    ulp: f64,
    at: f32,
) -> Accuracy {
    Accuracy { name, arguments: 1, bound, domain, greatest: Some(GreatestError { ulp, at }) }
}

const fn untried(
    name: &'static str,
    arguments: usize,
    bound: f64,
    domain: AccuracyDomain,
) -> Accuracy {
    Accuracy { name, arguments, bound, domain, greatest: None }
}
