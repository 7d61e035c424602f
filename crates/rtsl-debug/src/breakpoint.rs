//! What ends a run of the debugger.

/// Distinguishes the breakpoints of a replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BreakpointId(pub u32);

/// The places at which a run can end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Location {
    /// A line of a text.
    Line {
        /// The name of the text.
        source: String,
        /// The line, from 1, which has a statement.
        line: u32,
    },
    /// The start of a method, `Class.method`, or of a function that is no method.
    Function(String),
}

/// A place at which a run ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Breakpoint {
    /// The id.
    pub id: BreakpointId,
    /// The place.
    pub location: Location,
    /// The condition, an expression of the variables there; none for every time.
    pub condition: Option<String>,
    /// True if the recording has a statement at the place.
    pub is_reached: bool,
}

/// Further occasions that end a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pauses {
    /// A statement makes a value that is not finite and that leaves its method.
    pub not_finite: bool,
    /// A statement prints.
    pub print: bool,
}
