//! Recordings of traces.

use std::fmt;
use std::sync::Arc;

use rtsl_ir::Place;

use super::trace::TraceLimits;

pub use rtsl_ir::ReportedValue as TracedValue;

/// The entries of a trace, in the order of their execution.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// The entries.
    pub entries: Vec<TraceEntry>,
    /// The number of entries that were skipped before. The first entries then are what still holds of them.
    pub skipped: u64,
    /// The number of further entries, which are not kept.
    pub dropped: u64,
}

/// An entry of a trace.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceEntry {
    /// The number of calls around it.
    pub depth: u32,
    /// The index of the ray within the call.
    pub lane: u32,
    /// The method, as `Class.method`.
    pub method: Arc<str>,
    /// The place in the text, if it has one.
    pub place: Option<Place>,
    /// The occasion.
    pub kind: TraceKind,
}

/// The occasions of entries.
#[derive(Clone, Debug, PartialEq)]
pub enum TraceKind {
    /// A `print`, with its text and its values.
    Print(String, Vec<TracedValue>),
    /// An assignment: the value of the variable or of a part of it, and that of the whole variable if this is a part.
    Assignment(TracedValue, Option<TracedValue>),
    /// The start of a method: the reference through which it is called, if the renderer does not call it, and the state
    /// that it reads.
    Call(Option<String>, Vec<TracedValue>),
    /// The end of a method, with the state that it sets.
    Return(Vec<TracedValue>),
    /// A value that leaves a method and is not finite, made at the place of the entry; with its number, as [`Made`]
    /// has it.
    ///
    /// [`Made`]: TraceKind::Made
    NotFinite(f32, u32),
    /// A remark of the host.
    Note(String),
    /// A statement, a condition or a step of a loop, which runs next; or the closing brace of a function.
    Statement,
    /// The value of a condition.
    Condition(bool),
    /// Values of variables that no assignment sets: of members, and of what a loop over lights sets.
    Known(Vec<TracedValue>),
    /// The start of a function that is no method, with its parameters.
    Enter(Arc<str>, Vec<TracedValue>),
    /// The end of such a function, with its result.
    Leave(Option<TracedValue>),
    /// A value that is not finite is made of finite ones at the place of the entry; with its number among those of the
    /// run of the method that the renderer has called.
    Made(f32, u32),
}

/// The entries of a trace that is being recorded.
#[derive(Debug)]
pub(super) struct Entries {
    limits: TraceLimits,
    recording: Recording,
    depth: u32,
    /// The number of entries of all recordings so far, kept or not.
    count: u64,
    /// The number of entries kept by earlier recordings.
    kept_before: usize,
    /// The entries skipped so far that still hold.
    present: Vec<TraceEntry>,
}

impl Entries {
    pub fn new(limits: TraceLimits) -> Entries {
        let recording = Recording::default();
        Entries { limits, recording, depth: 0, count: 0, kept_before: 0, present: Vec::new() }
    }

    /// Ends the recording and returns it.
    pub fn take(&mut self) -> Recording {
        self.kept_before += self.recording.entries.len();
        self.depth = 0;
        self.present.clear();
        std::mem::take(&mut self.recording)
    }

    /// Adds the start of a call.
    pub fn begin(&mut self, method: &Arc<str>, lane: u32, place: Option<Place>, kind: TraceKind) {
        self.push(method, lane, place, kind);
        self.depth += 1;
    }

    /// Adds the end of a call.
    pub fn end(&mut self, method: &Arc<str>, lane: u32, place: Option<Place>, kind: TraceKind) {
        self.depth = self.depth.saturating_sub(1);
        self.push(method, lane, place, kind);
    }

    pub fn push(&mut self, method: &Arc<str>, lane: u32, place: Option<Place>, kind: TraceKind) {
        self.count += 1;
        let is_kept = self.kept_before + self.recording.entries.len() < self.limits.keep;
        if self.count > self.limits.skip && !is_kept {
            self.recording.dropped += 1;
            return;
        }
        let entry = TraceEntry { depth: self.depth, lane, method: method.clone(), place, kind };
        if self.count > self.limits.skip {
            self.recording.entries.append(&mut self.present);
            self.recording.entries.push(entry);
        } else {
            self.recording.skipped += 1;
            self.hold(entry);
        }
    }

    /// Makes an entry part of what holds, in place of those that it makes obsolete.
    fn hold(&mut self, entry: TraceEntry) {
        let is_end = matches!(entry.kind, TraceKind::Return(_) | TraceKind::Leave(_));
        // An entry of a call is one deeper than those that begin and end it.
        let depth = if is_end { entry.depth } else { entry.depth.wrapping_sub(1) };
        let is_begin = |held: &TraceEntry| {
            held.depth == depth && matches!(held.kind, TraceKind::Call(..) | TraceKind::Enter(..))
        };
        let begin = self.present.iter().rposition(is_begin);
        match &entry.kind {
            TraceKind::Return(_) | TraceKind::Leave(_) => {
                self.present.truncate(begin.unwrap_or(0));
            }
            TraceKind::Statement | TraceKind::Assignment(..) | TraceKind::Known(_) => {
                let first = begin.map_or(0, |begin| begin + 1);
                let known = self.present[first..].iter().position(|held| entry.replaces(held));
                if let Some(known) = known {
                    self.present.remove(first + known);
                }
                self.present.push(entry);
            }
            TraceKind::Call(..) | TraceKind::Enter(..) => self.present.push(entry),
            _ => {}
        }
    }
}

impl TraceEntry {
    /// True if an earlier entry of the same call says nothing that holds after this one.
    fn replaces(&self, earlier: &TraceEntry) -> bool {
        match (&self.kind, &earlier.kind) {
            (TraceKind::Statement, TraceKind::Statement) => true,
            (TraceKind::Assignment(part, whole), TraceKind::Assignment(old, old_whole)) => {
                part.variable == old.variable && whole.is_none() == old_whole.is_none()
            }
            (TraceKind::Known(values), TraceKind::Known(old)) => {
                values.iter().map(TracedValue::name).eq(old.iter().map(TracedValue::name))
            }
            _ => false,
        }
    }
}

/// Formats an entry in one line, without its depth.
impl fmt::Display for TraceEntry {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(out, "{}:{}: ", place.source.name, place.line())?;
        }
        let method = &self.method;
        match &self.kind {
            TraceKind::Print(text, _) => write!(out, "{method}: {text}"),
            TraceKind::Assignment(part, _) => write!(out, "{} = {part}", part.name()),
            TraceKind::Call(None, values) => write!(out, "{method}({})", listed(values)),
            TraceKind::Call(Some(reference), values) => {
                write!(out, "{method}({}) of `{reference}`", listed(values))
            }
            TraceKind::Return(values) if values.is_empty() => write!(out, "{method} returns"),
            TraceKind::Return(values) => write!(out, "{method} returns {}", listed(values)),
            TraceKind::Note(text) => out.write_str(text),
            TraceKind::NotFinite(value, _) | TraceKind::Made(value, _) => {
                write!(out, "{method}: {value:?} is made here")
            }
            TraceKind::Statement => write!(out, "{method}"),
            TraceKind::Condition(value) => write!(out, "condition = {value}"),
            TraceKind::Known(values) => write!(out, "{}", listed(values)),
            TraceKind::Enter(function, values) => write!(out, "{function}({})", listed(values)),
            TraceKind::Leave(None) => write!(out, "returns"),
            TraceKind::Leave(Some(value)) => write!(out, "returns {value}"),
        }
    }
}

fn listed(values: &[TracedValue]) -> String {
    let each = values.iter().map(|value| format!("{} = {value}", value.name()));
    each.collect::<Vec<_>>().join(", ")
}
