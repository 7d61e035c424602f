//! Breakpoints, and further occasions that end a run of the debugger.

use std::ops::Range;

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

/// A breakpoint with the times at which it ends runs. A recording does not change, so they are found once.
#[derive(Clone, Debug)]
pub(crate) struct SetBreakpoint {
    pub breakpoint: Breakpoint,
    /// The stops, in order.
    pub stops: Vec<usize>,
    /// The error of the condition at the last of them, after which it is not evaluated.
    pub error: Option<String>,
}

impl SetBreakpoint {
    /// Returns the first stop of a range, or the last one.
    pub fn stop_in(&self, range: Range<usize>, is_last: bool) -> Option<usize> {
        let first = self.stops.partition_point(|stop| *stop < range.start);
        let end = self.stops.partition_point(|stop| *stop < range.end);
        let stops = self.stops.get(first..end)?;
        if is_last { stops.last().copied() } else { stops.first().copied() }
    }

    /// Returns the error of the condition at a stop.
    pub fn error_at(&self, stop: usize) -> Option<&String> {
        self.error.as_ref().filter(|_| self.stops.last() == Some(&stop))
    }
}
