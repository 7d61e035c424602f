//! The effects of the statements of a call, line by line.

use std::collections::BTreeMap;

use rtsl::{TraceKind, TracedValue};

use crate::frame::Frame;
use crate::timeline::{CallId, Stop, Timeline};

/// An effect of a statement.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// It has set a variable, or a part of one.
    Set(TracedValue),
    /// Its condition had this value.
    Condition(bool),
    /// It has printed this.
    Print(String),
    /// It has ended its function with this result.
    Returns(TracedValue),
}

/// The effects of the lines of a text when they ran last, in one call.
pub type LineEffects = BTreeMap<u32, Vec<Effect>>;

/// The values beside the lines of a text, by the lines, from 1.
pub type LineValues = BTreeMap<u32, String>;

/// Formats what it does: `t = 3.25`, `true`.
impl std::fmt::Display for Effect {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Effect::Set(value) => write!(out, "{} = {value}", value.name()),
            Effect::Condition(value) => write!(out, "{value}"),
            Effect::Print(text) => write!(out, "prints \"{text}\""),
            Effect::Returns(value) => write!(out, "returns {value}"),
        }
    }
}

/// Returns what the lines of a call have done up to its position.
pub(crate) fn line_effects(timeline: &Timeline, frame: &Frame) -> LineEffects {
    let mut lines = LineEffects::new();
    let mut current = None;
    for index in own_entries(timeline, frame.call, timeline.call(frame.call).begin + 1) {
        if index >= frame.entry {
            break;
        }
        let entry = &timeline.entries[index];
        if let (TraceKind::Statement, Some(place)) = (&entry.kind, &entry.place) {
            let line = place.line();
            if current.replace(line) != Some(line) {
                lines.remove(&line);
            }
        }
        if let (Some(effect), Some(line)) = (effect(&entry.kind), current) {
            lines.entry(line).or_default().push(effect);
        }
    }
    lines
}

/// Returns what the statement of a stop does.
pub(crate) fn statement_effects(timeline: &Timeline, stop: usize) -> Vec<Effect> {
    let stop = timeline.stops[stop];
    let entries = own_entries(timeline, stop.call, stop.entry + 1);
    let kinds = entries.map(|index| &timeline.entries[index].kind);
    let own = kinds.take_while(|kind| !matches!(kind, TraceKind::Statement));
    let mut effects: Vec<Effect> = own.filter_map(effect).collect();
    effects.extend(result_of(timeline, stop).map(Effect::Returns));
    effects
}

/// Returns the result of the call, if the stop is its last.
pub(crate) fn result_of(timeline: &Timeline, stop: Stop) -> Option<TracedValue> {
    let end = timeline.call(stop.call).end;
    let is_last = own_entries(timeline, stop.call, stop.entry + 1)
        .all(|index| !matches!(timeline.entries[index].kind, TraceKind::Statement));
    match &timeline.entries.get(end).filter(|_| is_last)?.kind {
        TraceKind::Leave(result) => result.clone(),
        _ => None,
    }
}

/// The entries of a call from one on, without those of the calls that it makes.
fn own_entries(timeline: &Timeline, call: CallId, first: usize) -> impl Iterator<Item = usize> {
    let end = timeline.call(call).end;
    let mut next = first;
    std::iter::from_fn(move || {
        while let Some(inner) = timeline.call_at(next) {
            next = timeline.call(inner).end + 1;
        }
        let index = next;
        next += 1;
        (index < end).then_some(index)
    })
}

fn effect(kind: &TraceKind) -> Option<Effect> {
    match kind {
        TraceKind::Assignment(part, _) => Some(Effect::Set(part.clone())),
        TraceKind::Condition(value) => Some(Effect::Condition(*value)),
        TraceKind::Print(text, _) => Some(Effect::Print(text.clone())),
        _ => None,
    }
}
