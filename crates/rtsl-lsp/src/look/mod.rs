//! Looks at running shaders: notes beside the lines of texts, from the output of a run of the program.

mod costs;
mod pixel;
mod placed;
mod unchanged;

pub use costs::costs;
pub use pixel::pixel;
pub use placed::{Looks, PlacedNote, path_of_name};
pub use unchanged::has_same_lines;

use serde_json::{Map, Value};

/// The kind of a look. One of each kind is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LookKind {
    /// The costs of lines.
    Costs,
    /// The values of one pixel.
    Pixel,
}

/// The notes of a run.
#[derive(Debug, Default)]
pub struct Look {
    /// The texts that have notes.
    pub texts: Vec<TextNotes>,
    /// The members of the answer that concern no line.
    pub summary: Map<String, Value>,
}

/// The notes of a text.
#[derive(Debug, Default)]
pub struct TextNotes {
    /// The text, as the compiler calls it: a path, or the name of a file of the library.
    pub name: String,
    /// The notes, sorted by lines.
    pub notes: Vec<LineNote>,
    /// The faults that the run found.
    pub faults: Vec<Fault>,
}

/// A note beside a line.
#[derive(Debug)]
pub struct LineNote {
    /// The line, from 0.
    pub line: u32,
    /// The text at the end of the line.
    pub label: String,
    /// The explanation.
    pub tooltip: String,
    /// The figures, for the answer.
    pub data: Map<String, Value>,
}

/// A fault: an operation that made a number that is not finite.
#[derive(Debug)]
pub struct Fault {
    /// The code of the diagnostic.
    pub code: String,
    /// The message.
    pub message: String,
    /// The start: line and column in characters, from 0.
    pub start: (u32, u32),
    /// The end, likewise.
    pub end: (u32, u32),
    /// The calls around it, the innermost first.
    pub calls: Vec<FaultCall>,
}

/// A call around a fault.
#[derive(Debug)]
pub struct FaultCall {
    /// The name of the text, and the last line that ran in it before, from 0.
    pub name: String,
    /// The line, from 0.
    pub line: u32,
    /// The caller.
    pub message: String,
}

/// Converts a line of the compiler, which counts from 1.
fn from_zero(line: u32) -> u32 {
    line.saturating_sub(1)
}
