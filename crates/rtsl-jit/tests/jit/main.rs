//! The integration tests of `rtsl-jit`, as one program: linking is most of the work of building tests.

mod approximation;
mod compile;
mod full_chunks;
mod oracle;
mod oracle_support;
mod refusals;
mod stacks;
mod targets;
