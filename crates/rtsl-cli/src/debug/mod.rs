//! The debugger's sources of recordings, and its faces: the terminal of `rtsl debug` and the adapter of `rtsl dap`.

mod adapter;
mod gate;
mod handles;
mod launch;
mod protocol;
mod script;
mod session;
mod sources;
mod target;
mod terminal;

pub use adapter::serve;
pub use gate::Gate;
pub use script::Commands;
pub use target::{DEFAULT_KEPT, MAX_KEPT, PixelTarget, Recorded, Target, record};
pub use terminal::Terminal;
