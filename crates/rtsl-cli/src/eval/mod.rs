//! Runs one method on given values: what `rtsl eval` does, for people and for programs.

mod host;
mod lines;
mod request;
mod run;
mod session;
mod values;

pub use lines::answer_lines;
pub use request::{Answer, Request};
pub use run::role_of;
pub use session::{Evaluation, Session};
pub use values::{Lanes, ValueError, make_instance, parse_state, parse_value};
