//! The calls and the stops of a recording.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use rtsl::{Place, Recording, TraceEntry, TraceKind};

/// The index of a call in a timeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct CallId(pub u32);

/// A call of a method, or of a function that is no method.
#[derive(Clone, Debug)]
pub(crate) struct Call {
    pub parent: Option<CallId>,
    /// The entry that begins it.
    pub begin: usize,
    /// The entry that ends it, or the number of all entries if it does not end.
    pub end: usize,
    pub is_method: bool,
    /// The stop at which the caller is.
    pub caller_stop: Option<usize>,
    last_stop: Option<usize>,
}

/// An entry at which the debugger can stop: a statement that is about to run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stop {
    pub entry: usize,
    pub call: CallId,
    pub line: u32,
    /// The stop before it in the same call.
    pub previous: Option<usize>,
}

/// A value that is not finite, leaves its method, and is made of finite values by a statement.
#[derive(Clone, Debug, PartialEq)]
pub struct NotFinite {
    /// The value.
    pub value: f32,
    /// The operation.
    pub place: Option<Place>,
}

/// Formats it as a sentence.
impl fmt::Display for NotFinite {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "this statement makes {:?} of finite numbers", self.value)?;
        let operation = self
            .place
            .as_ref()
            .and_then(|place| place.source.text.get(place.start as usize..place.end as usize));
        match operation {
            Some(operation) => write!(out, ": {operation}"),
            None => Ok(()),
        }
    }
}

/// A recording with its calls and stops.
#[derive(Clone, Debug)]
pub(crate) struct Timeline {
    pub entries: Vec<TraceEntry>,
    pub stops: Vec<Stop>,
    calls: Vec<Call>,
    /// The values that are not finite, by the stops whose statements make them.
    not_finite: BTreeMap<usize, NotFinite>,
    /// The entries of prints, by their stops.
    prints: BTreeMap<usize, usize>,
}

impl Timeline {
    pub fn new(recording: Recording) -> Timeline {
        let entries = recording.entries;
        let mut builder = Builder::new(entries.len());
        for (index, entry) in entries.iter().enumerate() {
            builder.add(index, entry);
        }
        let Builder { calls, stops, not_finite, prints, .. } = builder;
        Timeline { entries, stops, calls, not_finite, prints }
    }

    pub fn call(&self, id: CallId) -> &Call {
        &self.calls[id.0 as usize]
    }

    /// Returns the call that an entry begins.
    pub fn call_at(&self, entry: usize) -> Option<CallId> {
        let found = self.calls.binary_search_by_key(&entry, |call| call.begin);
        found.ok().map(|index| CallId(index as u32))
    }

    /// Returns the name of the function that is called.
    pub fn name_of(&self, id: CallId) -> &Arc<str> {
        let entry = &self.entries[self.call(id).begin];
        match &entry.kind {
            TraceKind::Enter(name, _) => name,
            _ => &entry.method,
        }
    }

    /// Returns a call and those around it, the innermost first.
    pub fn chain(&self, id: CallId) -> impl Iterator<Item = CallId> {
        std::iter::successors(Some(id), |id| self.call(*id).parent)
    }

    /// Returns the call of a method that a call is, or is part of.
    pub fn method_of(&self, id: CallId) -> CallId {
        self.chain(id).find(|id| self.call(*id).is_method).unwrap_or(id)
    }

    pub fn place_of(&self, stop: usize) -> Option<&Place> {
        self.entries[self.stops[stop].entry].place.as_ref()
    }

    /// Returns true if the stop begins its line: the one before it in its call is on another line.
    pub fn begins_line(&self, index: usize) -> bool {
        let stop = self.stops[index];
        stop.previous.is_none_or(|previous| self.stops[previous].line != stop.line)
    }

    /// Returns the value that is not finite that the statement of a stop makes.
    pub fn not_finite(&self, stop: usize) -> Option<&NotFinite> {
        self.not_finite.get(&stop)
    }

    /// Returns the stop of the first value that is not finite in a range, or of the last one.
    pub fn not_finite_in(&self, range: Range<usize>, is_last: bool) -> Option<usize> {
        let mut stops = self.not_finite.range(range).map(|(stop, _)| *stop);
        if is_last { stops.next_back() } else { stops.next() }
    }

    /// Returns the stop of the first print in a range, or of the last one.
    pub fn print_in(&self, range: Range<usize>, is_last: bool) -> Option<usize> {
        let mut stops = self.prints.range(range).map(|(stop, _)| *stop);
        if is_last { stops.next_back() } else { stops.next() }
    }

    /// Returns the text that the statement of a stop prints.
    pub fn print(&self, stop: usize) -> Option<&str> {
        match &self.entries[*self.prints.get(&stop)?].kind {
            TraceKind::Print(text, _) => Some(text),
            _ => None,
        }
    }

    /// Returns the prints of the statements from a stop up to another.
    pub fn prints_between(&self, from: usize, to: usize) -> impl Iterator<Item = &TraceEntry> {
        self.prints.range(from..to.max(from)).map(|(_, entry)| &self.entries[*entry])
    }
}

struct Builder {
    calls: Vec<Call>,
    stops: Vec<Stop>,
    open: Vec<CallId>,
    not_finite: BTreeMap<usize, NotFinite>,
    prints: BTreeMap<usize, usize>,
    /// The open calls that the renderer has made.
    runs: Vec<CallId>,
    /// The stops whose statements have made values that are not finite, by their runs and numbers.
    made: BTreeMap<(CallId, u32), usize>,
    entries: usize,
}

impl Builder {
    fn new(entries: usize) -> Builder {
        Builder {
            calls: Vec::new(),
            stops: Vec::new(),
            open: Vec::new(),
            not_finite: BTreeMap::new(),
            prints: BTreeMap::new(),
            runs: Vec::new(),
            made: BTreeMap::new(),
            entries,
        }
    }

    fn add(&mut self, index: usize, entry: &TraceEntry) {
        match &entry.kind {
            TraceKind::Call(reference, _) => {
                self.begin(index, true);
                if reference.is_none() {
                    self.runs.extend(self.open.last());
                }
            }
            TraceKind::Enter(..) => self.begin(index, false),
            TraceKind::Return(_) | TraceKind::Leave(_) => {
                if let Some(call) = self.open.pop() {
                    self.calls[call.0 as usize].end = index;
                    self.runs.pop_if(|run| *run == call);
                }
            }
            TraceKind::Statement => self.stop(index, entry),
            TraceKind::Print(..) => {
                if let Some(stop) = self.current_stop() {
                    self.prints.insert(stop, index);
                }
            }
            TraceKind::Made(_, number) => {
                if let (Some(stop), Some(run)) = (self.current_stop(), self.runs.last()) {
                    self.made.insert((*run, *number), stop);
                }
            }
            TraceKind::NotFinite(value, number) => {
                let run = self.runs.last();
                let made = run.and_then(|run| self.made.get(&(*run, *number)).copied());
                if let Some(stop) = made.or_else(|| self.current_stop()) {
                    let found = NotFinite { value: *value, place: entry.place.clone() };
                    self.not_finite.entry(stop).or_insert(found);
                }
            }
            TraceKind::Assignment(..)
            | TraceKind::Condition(_)
            | TraceKind::Known(_)
            | TraceKind::Note(_) => {}
        }
    }

    fn begin(&mut self, begin: usize, is_method: bool) {
        let parent = self.open.last().copied();
        let caller_stop = self.current_stop();
        let id = CallId(self.calls.len() as u32);
        let end = self.entries;
        self.calls.push(Call { parent, begin, end, is_method, caller_stop, last_stop: None });
        self.open.push(id);
    }

    fn stop(&mut self, index: usize, entry: &TraceEntry) {
        if let (Some(call), Some(place)) = (self.open.last().copied(), &entry.place) {
            let last = &mut self.calls[call.0 as usize].last_stop;
            let previous = last.replace(self.stops.len());
            self.stops.push(Stop { entry: index, call, line: place.line(), previous });
        }
    }

    /// The stop at which the innermost call with one is.
    fn current_stop(&self) -> Option<usize> {
        self.open.iter().rev().find_map(|call| self.calls[call.0 as usize].last_stop)
    }
}
