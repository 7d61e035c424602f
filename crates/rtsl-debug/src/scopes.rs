//! The values of variables at a position.

use rtsl::{TraceKind, TracedValue, ValueScope};

use crate::frame::Frame;
use crate::lines::result_of;
use crate::path::{is_of_name, renamed};
use crate::timeline::{CallId, Timeline};

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

    /// Returns the values of the variables that a line names, in its order, and the result of a function at its end.
    pub(crate) fn named_in(&self, line: &str) -> String {
        let code = line.split("//").next().unwrap_or_default();
        let mut shown: Vec<String> = Vec::new();
        for word in code.split(|letter| !is_of_name(letter)) {
            if let Some(value) = self.find(word) {
                let text = format!("{word} = {value}");
                if !shown.contains(&text) {
                    shown.push(text);
                }
            }
        }
        shown.extend(self.result.iter().map(|value| format!("returns {value}")));
        shown.join(", ")
    }

    /// Collects the variables of a call.
    pub(crate) fn of(timeline: &Timeline, frame: &Frame) -> Scopes {
        let mut walk = ScopeWalk::new(timeline, timeline.method_of(frame.call));
        walk.advance(timeline, frame.entry);
        walk.scopes(timeline, frame)
    }
}

/// A walk over the entries of a method that collects variables. It goes on from where it is, so that the variables at
/// all statements of a method cost no more than those at its end.
pub(crate) struct ScopeWalk {
    method: CallId,
    /// The entry that is next.
    index: usize,
    /// The calls from the method to the one whose entries are next, with their locals.
    open: Vec<(CallId, Vec<TracedValue>)>,
    /// The variables of the whole method.
    shared: Scopes,
}

impl ScopeWalk {
    pub fn new(timeline: &Timeline, method: CallId) -> ScopeWalk {
        let index = timeline.call(method).begin;
        ScopeWalk { method, index, open: Vec::new(), shared: Scopes::default() }
    }

    /// Returns true if the walk is part of a method, and not past an entry.
    pub fn can_reach(&self, method: CallId, entry: usize) -> bool {
        self.method == method && self.index <= entry
    }

    /// Goes on to an entry of the method.
    pub fn advance(&mut self, timeline: &Timeline, entry: usize) {
        while self.index < entry {
            self.add(timeline);
            self.index += 1;
        }
    }

    fn add(&mut self, timeline: &Timeline) {
        match &timeline.entries[self.index].kind {
            TraceKind::Call(_, state) if self.open.is_empty() => {
                self.open.push((self.method, Vec::new()));
                state.iter().for_each(|value| set(&mut self.shared.state_read, value.clone()));
            }
            // What other methods do is theirs.
            TraceKind::Call(..) => {
                let end = timeline.call_at(self.index).map(|call| timeline.call(call).end);
                self.index = end.map_or(self.index, |end| end.max(self.index));
            }
            TraceKind::Enter(_, parameters) => {
                let call = timeline.call_at(self.index).unwrap_or(self.method);
                self.open.push((call, parameters.clone()));
            }
            TraceKind::Leave(_) => {
                self.open.pop();
            }
            TraceKind::Known(values) => {
                for value in values {
                    let state = &mut self.shared.state_read;
                    keep(&mut self.open, &mut self.shared.members, state, value);
                }
            }
            TraceKind::Assignment(part, whole) => {
                let value = match whole {
                    Some(whole) => whole.clone(),
                    None => part_of_large(part),
                };
                let state = &mut self.shared.state_set;
                keep(&mut self.open, &mut self.shared.members, state, &value);
            }
            _ => {}
        }
    }

    /// Returns the variables that a call sees at the entry of the walk.
    pub fn scopes(&self, timeline: &Timeline, frame: &Frame) -> Scopes {
        let mut scopes = self.shared.clone();
        let own = self.open.iter().find(|(call, _)| *call == frame.call);
        scopes.locals = own.map_or_else(Vec::new, |(_, locals)| locals.clone());
        if let Some(place) = &frame.place {
            scopes.locals.retain(|value| value.variable.extent.contains(&place.start));
            keep_innermost(&mut scopes.locals);
        }
        scopes.results = results(timeline, frame);
        let stop = timeline.stops.binary_search_by_key(&frame.entry, |stop| stop.entry);
        scopes.result = stop.ok().and_then(|stop| result_of(timeline, timeline.stops[stop]));
        scopes
    }
}

/// Names a part of a variable that is too large to be recorded by what it is: the value of `table[i]` at its
/// assignment, which `table[i]` need not have any more.
fn part_of_large(part: &TracedValue) -> TracedValue {
    match part.name().chars().all(is_of_name) {
        true => part.clone(),
        false => renamed(part, format!("{}, as set last", part.name())),
    }
}

/// Keeps a value where its variable belongs.
fn keep(
    open: &mut [(CallId, Vec<TracedValue>)],
    members: &mut Vec<TracedValue>,
    state: &mut Vec<TracedValue>,
    value: &TracedValue,
) {
    match value.variable.scope {
        ValueScope::Local => {
            if let Some((_, locals)) = open.last_mut() {
                set(locals, value.clone());
            }
        }
        ValueScope::Member => set(members, value.clone()),
        ValueScope::State => set(state, value.clone()),
        ValueScope::Expression => {}
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
