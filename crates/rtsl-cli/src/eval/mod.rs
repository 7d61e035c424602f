//! Calls one method on given values: the implementation of `rtsl eval`, from the command line and as a server.

mod function;
mod lines;
mod request;
mod run;
mod session;
mod values;

pub use lines::answer_lines;
pub use request::{Answer, Evaluation, Request};
pub use session::Session;
pub use values::{
    Lanes, ValueError, make_instance, parse_setting, parse_state, parse_value, range_warnings,
};
