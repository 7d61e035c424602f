//! Instances: classes with values for their parameters.

mod builder;
pub(crate) mod defaults;
pub(crate) mod environment;
#[allow(clippy::module_inception, reason = "the noun of the folder is the noun of the file")]
pub(crate) mod instance;
pub(crate) mod parameters;
#[cfg(test)]
mod tests;
pub(crate) mod value;
pub(crate) mod wording;
pub(crate) mod words;
