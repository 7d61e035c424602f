//! Tests of the debugger's model: what it shows is compared with what the texts of the tests do.

mod common;
mod expressions;
mod limits;
mod not_finite;
mod runs;
mod steps;
mod values;
