//! The values of variables at a position.

use rtsl::{TraceKind, TracedValue, ValueScope};

use crate::frame::Frame;
use crate::lines::result_of;
use crate::timeline::Timeline;

/// The variables that a call sees, with the values that they have had last.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scopes {
    /// The parameters and variables of the function that are visible at the statement.
    pub locals: Vec<TracedValue>,
    /// The members of the class that the method reads or has set.
    pub members: Vec<TracedValue>,
    /// The state variables that the method reads, with the values that it has received.
    pub state_read: Vec<TracedValue>,
    /// The state variables that the method has set.
    pub state_set: Vec<TracedValue>,
    /// The result of the function, at its closing brace.
    pub result: Option<TracedValue>,
    /// The results of the calls that the statement before has made, by their functions.
    pub results: Vec<(String, TracedValue)>,
}

impl Scopes {
    /// Returns the value of a variable by its name: a local hides a member, and state that is set hides what it was.
    pub fn find(&self, name: &str) -> Option<&TracedValue> {
        let lists = [&self.locals, &self.members, &self.state_set, &self.state_read];
        lists.into_iter().flatten().find(|value| value.name() == name)
    }

    /// Returns all variables, the nearest first.
    pub fn iter(&self) -> impl Iterator<Item = &TracedValue> {
        [&self.locals, &self.members, &self.state_set, &self.state_read].into_iter().flatten()
    }

    /// Collects the variables of a call.
    pub(crate) fn of(timeline: &Timeline, frame: &Frame) -> Scopes {
        let mut scopes = Scopes::default();
        let method = timeline.method_of(frame.call);
        // The calls from the method to the one whose entry is read.
        let mut open = vec![method];
        let mut index = timeline.call(method).begin;
        while index < frame.entry {
            let is_own = open.last() == Some(&frame.call);
            match &timeline.entries[index].kind {
                TraceKind::Call(_, state)
                    if open.len() == 1 && timeline.call(method).begin == index =>
                {
                    state.iter().for_each(|value| set(&mut scopes.state_read, value.clone()));
                }
                // What other methods do is theirs.
                TraceKind::Call(..) => {
                    let end = timeline.call_at(index).map_or(index, |it| timeline.call(it).end);
                    index = end.max(index);
                }
                TraceKind::Enter(_, parameters) => {
                    open.extend(timeline.call_at(index));
                    if open.last() == Some(&frame.call) {
                        parameters.iter().for_each(|value| set(&mut scopes.locals, value.clone()));
                    }
                }
                TraceKind::Leave(_) => {
                    open.pop();
                }
                TraceKind::Known(values) => {
                    values.iter().for_each(|value| scopes.know(value, is_own));
                }
                TraceKind::Assignment(part, whole) => scopes.assign(part, whole.as_ref(), is_own),
                _ => {}
            }
            index += 1;
        }
        if let Some(place) = &frame.place {
            scopes.locals.retain(|value| value.variable.extent.contains(&place.start));
            keep_innermost(&mut scopes.locals);
        }
        scopes.results = results(timeline, frame);
        let stop = timeline.stops.binary_search_by_key(&frame.entry, |stop| stop.entry);
        scopes.result = stop.ok().and_then(|stop| result_of(timeline, timeline.stops[stop]));
        scopes
    }

    fn know(&mut self, value: &TracedValue, is_own: bool) {
        match value.variable.scope {
            ValueScope::Local if is_own => set(&mut self.locals, value.clone()),
            ValueScope::Local | ValueScope::Expression => {}
            ValueScope::Member => set(&mut self.members, value.clone()),
            ValueScope::State => set(&mut self.state_read, value.clone()),
        }
    }

    fn assign(&mut self, part: &TracedValue, whole: Option<&TracedValue>, is_own: bool) {
        let value = whole.unwrap_or(part).clone();
        match value.variable.scope {
            ValueScope::Local if is_own => set(&mut self.locals, value),
            ValueScope::Local | ValueScope::Expression => {}
            ValueScope::Member => set(&mut self.members, value),
            ValueScope::State => set(&mut self.state_set, value),
        }
    }
}

/// Sets the value of a variable.
fn set(values: &mut Vec<TracedValue>, value: TracedValue) {
    let (name, extent) = (value.name(), &value.variable.extent);
    let is_same =
        |known: &&mut TracedValue| known.name() == name && known.variable.extent == *extent;
    match values.iter_mut().find(is_same) {
        Some(known) => *known = value,
        None => values.push(value),
    }
}

/// Of variables of one name, keeps the one that is declared last.
fn keep_innermost(values: &mut Vec<TracedValue>) {
    let all = values.clone();
    values.retain(|value| {
        let others = all.iter().filter(|other| other.name() == value.name());
        others.map(|other| other.variable.extent.start).max() == Some(value.variable.extent.start)
    });
}

/// The results of the calls that a call has made since its last stop.
fn results(timeline: &Timeline, frame: &Frame) -> Vec<(String, TracedValue)> {
    let stops = &timeline.stops;
    let known = stops.binary_search_by_key(&frame.entry, |stop| stop.entry).ok();
    let Some(previous) = known.and_then(|index| stops[index].previous) else { return Vec::new() };
    let mut results = Vec::new();
    let mut index = stops[previous].entry + 1;
    while index < frame.entry {
        if let Some(call) = timeline.call_at(index) {
            index = timeline.call(call).end;
            let name = timeline.name_of(call).to_string();
            match timeline.entries.get(index).map(|entry| &entry.kind) {
                Some(TraceKind::Leave(Some(value))) => results.push((name, value.clone())),
                Some(TraceKind::Return(values)) => {
                    results.extend(values.iter().map(|value| (name.clone(), value.clone())));
                }
                _ => {}
            }
        }
        index += 1;
    }
    results
}
