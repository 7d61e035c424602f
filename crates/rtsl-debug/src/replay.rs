//! The position in a recording, and what moves it.

use std::fmt;
use std::sync::Arc;

use rtsl::{Recording, Source, SteppedLines, SteppedText, TraceKind, TracedValue};

use crate::breakpoint::{Breakpoint, BreakpointId, Location, Pauses, SetBreakpoint};
use crate::expression::Evaluator;
use crate::frame::Frame;
use crate::lines::{self, Effect, LineEffects, LineValues};
use crate::scopes::{ScopeWalk, Scopes};
use crate::timeline::{CallId, NotFinite, Stop, Timeline};

/// A walk over a recording.
pub struct Replay {
    timeline: Timeline,
    lines: SteppedLines,
    skipped: u64,
    dropped: u64,
    position: usize,
    breakpoints: Vec<SetBreakpoint>,
    next_breakpoint: u32,
    pauses: Pauses,
    evaluator: Evaluator,
}

/// The error of a recording without statements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NothingRecorded {
    /// The number of entries that were skipped.
    pub skipped: u64,
}

/// The end of a movement.
#[derive(Clone, Debug, PartialEq)]
pub struct Stopped {
    /// The reason.
    pub reason: Reason,
    /// The prints of the statements that a movement forwards has passed, with their places.
    pub prints: Vec<String>,
}

/// The reasons to stop.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// The movement is done.
    Step,
    /// A breakpoint, and the error of its condition if it can't be evaluated.
    Breakpoint(BreakpointId, Option<String>),
    /// The statement makes a value that is not finite.
    NotFinite(NotFinite),
    /// The statement prints this.
    Print(String),
    /// There is nothing before.
    Start,
    /// There is nothing after.
    End,
}

/// The sizes of steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Granularity {
    /// A statement, a condition or the step of a loop.
    Statement,
    /// All of a line.
    Line,
}

/// A direction of movements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Forwards,
    Backwards,
}

impl Replay {
    /// Creates a replay at the first statement of a recording of [`TraceDetail::Steps`](rtsl::TraceDetail::Steps).
    /// `lines` are those of the trace.
    ///
    /// # Errors
    /// If no statement has been recorded.
    pub fn new(recording: Recording, lines: SteppedLines) -> Result<Replay, NothingRecorded> {
        let Recording { skipped, dropped, .. } = recording;
        let timeline = Timeline::new(recording);
        if timeline.stops.is_empty() {
            return Err(NothingRecorded { skipped });
        }
        Ok(Replay {
            timeline,
            lines,
            skipped,
            dropped,
            position: 0,
            breakpoints: Vec::new(),
            next_breakpoint: 1,
            pauses: Pauses::default(),
            evaluator: Evaluator::default(),
        })
    }

    // The position.

    /// Returns the number of the statement that is about to run, from 0.
    pub fn position(&self) -> usize {
        self.position
    }

    /// Returns the number of statements.
    pub fn len(&self) -> usize {
        self.timeline.stops.len()
    }

    /// Returns false: a recording has a statement.
    pub fn is_empty(&self) -> bool {
        self.timeline.stops.is_empty()
    }

    /// Returns the number of entries of the recording that were skipped before its start.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Returns the number of entries that the recording does not have at its end, because of its limit.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Returns the calls around the position, the innermost first.
    pub fn frames(&self) -> Vec<Frame> {
        Frame::all(&self.timeline, self.position)
    }

    /// Returns the variables that a call sees at the position.
    pub fn scopes(&self, frame: &Frame) -> Scopes {
        Scopes::of(&self.timeline, frame)
    }

    /// Returns what the lines of a call have done when they ran last before the position.
    pub fn line_effects(&self, frame: &Frame) -> LineEffects {
        lines::line_effects(&self.timeline, frame)
    }

    /// Returns the values beside the lines of a call's text: what the lines have set when they ran last, and for the
    /// current line the variables that it names, in its order, and the result of a function at its end.
    pub fn beside_lines(&self, frame: &Frame) -> LineValues {
        let listed = |effects: Vec<Effect>| {
            effects.iter().map(Effect::to_string).collect::<Vec<_>>().join(", ")
        };
        let effects = self.line_effects(frame).into_iter();
        let mut beside: LineValues =
            effects.map(|(line, effects)| (line, listed(effects))).collect();
        if let (Some(source), Some(line)) = (frame.source(), frame.line()) {
            let text = self.source(source).map_or("", |source| source.text.as_str());
            let text = text.lines().nth(line.saturating_sub(1) as usize).unwrap_or_default();
            beside.insert(line, self.scopes(frame).named_in(text));
        }
        beside
    }

    /// Returns what the statement at the position does when it runs.
    pub fn effects(&self) -> Vec<Effect> {
        lines::statement_effects(&self.timeline, self.position)
    }

    /// Returns the line that has run before the position in the same call.
    pub fn previous_line(&self) -> Option<u32> {
        let previous = self.timeline.stops[self.position].previous?;
        Some(self.timeline.stops[previous].line)
    }

    /// Returns the value that is not finite that the statement at the position makes.
    pub fn not_finite(&self) -> Option<&NotFinite> {
        self.timeline.not_finite(self.position)
    }

    /// Returns the remarks of the renderer before the position, such as the nearest hits of rays.
    pub fn notes(&self) -> impl Iterator<Item = &str> {
        let entry = self.timeline.stops[self.position].entry;
        self.timeline.entries[..entry].iter().filter_map(|entry| match &entry.kind {
            TraceKind::Note(text) => Some(text.as_str()),
            _ => None,
        })
    }

    /// Returns the texts that take part, with the lines of their statements.
    pub fn texts(&self) -> impl Iterator<Item = &SteppedText> {
        self.lines.texts()
    }

    /// Returns a text by its name.
    pub fn source(&self, name: &str) -> Option<&Arc<Source>> {
        self.texts().map(|text| &text.source).find(|source| source.name == name)
    }

    /// Evaluates an expression of the variables that a call sees at the position.
    ///
    /// # Errors
    /// If the compiler refuses it.
    pub fn evaluate(&mut self, text: &str, frame: &Frame) -> Result<TracedValue, String> {
        let scopes = self.scopes(frame);
        self.evaluator.evaluate(text, &scopes)
    }

    // What ends runs.

    /// Returns the breakpoints.
    pub fn breakpoints(&self) -> impl Iterator<Item = &Breakpoint> {
        self.breakpoints.iter().map(|set| &set.breakpoint)
    }

    /// Adds a breakpoint at the first line from `line` on that has a statement. `source` is the name of a text.
    ///
    /// # Errors
    /// If there is no such text, or no such line.
    pub fn add_breakpoint(
        &mut self,
        source: &str,
        line: u32,
        condition: Option<String>,
    ) -> Result<&Breakpoint, String> {
        let Some(text) = self.texts().find(|text| text.source.name == source) else {
            return Err(format!("no statement of `{source}` takes part"));
        };
        let Some(line) = text.lines.iter().copied().find(|known| *known >= line) else {
            return Err(format!("`{source}` has no statement from line {line} on"));
        };
        let source = source.to_owned();
        Ok(self.add(Location::Line { source, line }, condition))
    }

    /// Adds a breakpoint at the start of a method, `Class.method`, or of a function that is no method.
    pub fn add_function_breakpoint(
        &mut self,
        name: &str,
        condition: Option<String>,
    ) -> &Breakpoint {
        self.add(Location::Function(name.to_owned()), condition)
    }

    fn add(&mut self, location: Location, condition: Option<String>) -> &Breakpoint {
        let at: Vec<usize> = (0..self.len()).filter(|stop| self.is_at(*stop, &location)).collect();
        let is_reached = !at.is_empty();
        let (stops, error) = match &condition {
            None => (at, None),
            Some(condition) => self.where_true(condition, at),
        };
        let id = BreakpointId(self.next_breakpoint);
        self.next_breakpoint += 1;
        let breakpoint = Breakpoint { id, location, condition, is_reached };
        self.breakpoints.push(SetBreakpoint { breakpoint, stops, error });
        &self.breakpoints[self.breakpoints.len() - 1].breakpoint
    }

    /// Returns the stops at which a condition is true, up to one at which it can't be evaluated, with that error.
    fn where_true(&mut self, condition: &str, at: Vec<usize>) -> (Vec<usize>, Option<String>) {
        let mut stops = Vec::new();
        let mut walk: Option<ScopeWalk> = None;
        for stop in at {
            let frame = Frame::all(&self.timeline, stop).swap_remove(0);
            let method = self.timeline.method_of(frame.call);
            let mut going = match walk.take().filter(|it| it.can_reach(method, frame.entry)) {
                Some(going) => going,
                None => ScopeWalk::new(&self.timeline, method),
            };
            going.advance(&self.timeline, frame.entry);
            let scopes = going.scopes(&self.timeline, &frame);
            walk = Some(going);
            match self.evaluator.is_true(condition, &scopes) {
                Ok(true) => stops.push(stop),
                Ok(false) => {}
                Err(error) => {
                    stops.push(stop);
                    return (stops, Some(error));
                }
            }
        }
        (stops, None)
    }

    /// Removes the breakpoints that are not wanted.
    pub fn retain_breakpoints(&mut self, mut is_wanted: impl FnMut(&Breakpoint) -> bool) {
        self.breakpoints.retain(|set| is_wanted(&set.breakpoint));
    }

    /// Returns the further occasions that end runs.
    pub fn pauses(&self) -> Pauses {
        self.pauses
    }

    /// Sets the further occasions that end runs.
    pub fn set_pauses(&mut self, pauses: Pauses) {
        self.pauses = pauses;
    }

    // Movements.

    /// Moves to the next statement or line, into the functions that the current one calls.
    pub fn step_in(&mut self, size: Granularity) -> Stopped {
        let target = (self.position + 1..self.len()).find(|stop| self.is_next(*stop, size));
        self.go(Way::Forwards, target)
    }

    /// Moves to the next statement or line of the same call, or that of its caller if it ends.
    pub fn step_over(&mut self, size: Granularity) -> Stopped {
        let target = (self.position + 1..self.len())
            .find(|stop| !self.is_inner(*stop) && self.is_next(*stop, size));
        self.go(Way::Forwards, target)
    }

    /// Moves to the next statement of the caller.
    pub fn step_out(&mut self) -> Stopped {
        let call = self.timeline.stops[self.position].call;
        let is_outside =
            |stop: &usize| !self.is_inner(*stop) && self.timeline.stops[*stop].call != call;
        let target = (self.position + 1..self.len()).find(is_outside);
        self.go(Way::Forwards, target)
    }

    /// Moves to the next occasion that ends a run.
    pub fn run(&mut self) -> Stopped {
        self.go(Way::Forwards, None)
    }

    /// Moves to the first occasion that ends a run, which can be the first statement.
    pub fn run_from_start(&mut self) -> Stopped {
        self.position = 0;
        match self.reason_here() {
            Some(reason) => Stopped { reason, prints: Vec::new() },
            None => self.run(),
        }
    }

    /// Moves back to the statement or line before in the same call, or to the call in its caller.
    pub fn step_back(&mut self, size: Granularity) -> Stopped {
        let first = self.first_of_step(self.position, size);
        let target = match first < self.position {
            true => Some(first),
            false => self.previous_outside_inner(first).map(|it| self.first_of_step(it, size)),
        };
        self.go(Way::Backwards, target)
    }

    /// Moves back to the statement or line that ran before, which may be in a function that this line comes after.
    pub fn step_back_in(&mut self, size: Granularity) -> Stopped {
        let first = self.first_of_step(self.position, size);
        let target = match first < self.position {
            true => Some(first),
            false => first.checked_sub(1).map(|stop| self.first_of_step(stop, size)),
        };
        self.go(Way::Backwards, target)
    }

    /// Moves back to the statement of the caller that makes the current call; to the first one of a call that the
    /// renderer makes.
    pub fn step_back_out(&mut self) -> Stopped {
        let Stop { call, .. } = self.timeline.stops[self.position];
        let target = self.timeline.call(call).caller_stop.unwrap_or_else(|| self.first_of(call));
        self.go(Way::Backwards, Some(target))
    }

    /// Moves back to the last occasion that ends a run.
    pub fn run_back(&mut self) -> Stopped {
        self.go(Way::Backwards, None)
    }

    /// Moves to a statement by its number; to the last one if there are fewer.
    pub fn jump(&mut self, position: usize) -> Stopped {
        self.position = position.min(self.len() - 1);
        Stopped { reason: Reason::Step, prints: Vec::new() }
    }

    /// Moves to the first statement of a call.
    pub fn jump_to_start_of(&mut self, frame: &Frame) -> Stopped {
        self.jump(self.first_of(frame.call))
    }

    fn first_of(&self, call: CallId) -> usize {
        let begin = self.timeline.call(call).begin;
        self.timeline.stops.partition_point(|stop| stop.entry < begin)
    }

    /// Moves back to the statement that has given a variable of a call the value that it has now.
    ///
    /// # Errors
    /// If no statement has set it.
    pub fn jump_to_origin(&mut self, name: &str, frame: &Frame) -> Result<Stopped, String> {
        let stops = &self.timeline.stops;
        let method = self.timeline.method_of(frame.call);
        let first = self.timeline.call(method).begin;
        let visible = self.scopes(frame).find(name).map(|value| value.variable.extent.clone());
        let Some(extent) = visible else {
            return Err(format!("there is no variable `{name}` here"));
        };
        let is_set = |kind: &TraceKind| match kind {
            TraceKind::Assignment(part, whole) => {
                let value = whole.as_ref().unwrap_or(part);
                value.name() == name && value.variable.extent == extent
            }
            _ => false,
        };
        let found = (first..frame.entry).rev().find(|entry| {
            is_set(&self.timeline.entries[*entry].kind)
                && self
                    .call_of_entry(*entry)
                    .is_some_and(|call| self.timeline.method_of(call) == method)
        });
        let Some(entry) = found else {
            return Err(format!("no statement of `{}` sets `{name}`", frame.name));
        };
        let call = self.call_of_entry(entry);
        let before = stops.partition_point(|stop| stop.entry < entry);
        match (0..before).rev().find(|stop| Some(stops[*stop].call) == call) {
            Some(stop) => Ok(self.jump(stop)),
            None => Err(format!("the statement that sets `{name}` is not recorded")),
        }
    }

    /// The innermost call around an entry.
    fn call_of_entry(&self, entry: usize) -> Option<CallId> {
        let before = self.timeline.stops.partition_point(|stop| stop.entry < entry);
        let stop = before.checked_sub(1)?;
        let mut chain = self.timeline.chain(self.timeline.stops[stop].call);
        chain.find(|call| self.timeline.call(*call).end > entry)
    }

    /// Moves to a target, or to an occasion that ends a run on the way; without a target to the end of the way.
    fn go(&mut self, way: Way, target: Option<usize>) -> Stopped {
        let from = self.position;
        let (last, end) = match way {
            Way::Forwards => (self.len() - 1, Reason::End),
            Way::Backwards => (0, Reason::Start),
        };
        let reason = match target {
            Some(target) if target != from => self.travel(way, target).unwrap_or(Reason::Step),
            Some(_) if from != last => Reason::Step,
            _ if from == last => end,
            _ => self.travel(way, last).unwrap_or(end),
        };
        let passed = match way {
            Way::Forwards => from..self.position,
            Way::Backwards => 0..0,
        };
        let prints = self.timeline.prints_between(passed.start, passed.end);
        Stopped { reason, prints: prints.map(ToString::to_string).collect() }
    }

    /// Moves towards a target, up to an occasion that ends a run; returns that occasion.
    fn travel(&mut self, way: Way, target: usize) -> Option<Reason> {
        let (range, is_last) = match way {
            Way::Forwards => (self.position + 1..target + 1, false),
            Way::Backwards => (target..self.position, true),
        };
        let stops = [
            self.timeline.not_finite_in(range.clone(), is_last).filter(|_| self.pauses.not_finite),
            self.timeline.print_in(range.clone(), is_last).filter(|_| self.pauses.print),
        ];
        let stops = stops.into_iter().flatten();
        let breakpoints = self.breakpoints.iter();
        let all = stops.chain(breakpoints.filter_map(|it| it.stop_in(range.clone(), is_last)));
        let nearest = if is_last { all.max() } else { all.min() };
        self.position = nearest.unwrap_or(target);
        self.reason_here()
    }

    /// The occasion at the position that ends a run.
    fn reason_here(&self) -> Option<Reason> {
        let at = self.position;
        if let Some(found) = self.timeline.not_finite(at).filter(|_| self.pauses.not_finite) {
            return Some(Reason::NotFinite(found.clone()));
        }
        if let Some(text) = self.timeline.print(at).filter(|_| self.pauses.print) {
            return Some(Reason::Print(text.to_owned()));
        }
        let here = self.breakpoints.iter().find(|it| it.stops.binary_search(&at).is_ok())?;
        Some(Reason::Breakpoint(here.breakpoint.id, here.error_at(at).cloned()))
    }

    /// True if a stop is the first one at a location.
    fn is_at(&self, stop: usize, location: &Location) -> bool {
        match location {
            Location::Line { source, line } => {
                self.timeline.stops[stop].line == *line
                    && self.timeline.begins_line(stop)
                    && self.timeline.place_of(stop).is_some_and(|it| it.source.name == *source)
            }
            Location::Function(name) => {
                let Stop { call, previous, .. } = self.timeline.stops[stop];
                previous.is_none() && **self.timeline.name_of(call) == **name
            }
        }
    }

    /// True if a stop is not part of the current step.
    fn is_next(&self, stop: usize, size: Granularity) -> bool {
        let (at, other) = (self.timeline.stops[self.position], self.timeline.stops[stop]);
        size == Granularity::Statement || at.call != other.call || at.line != other.line
    }

    /// True if a stop is in a call that the current one makes.
    fn is_inner(&self, stop: usize) -> bool {
        self.is_inside(stop, self.timeline.stops[self.position].call)
    }

    fn is_inside(&self, stop: usize, call: CallId) -> bool {
        let of = self.timeline.stops[stop].call;
        let known = self.timeline.call(call);
        let begin = self.timeline.call(of).begin;
        of != call && known.begin < begin && begin < known.end
    }

    /// The first stop of the step of a stop: that of its line in the same call, or itself.
    fn first_of_step(&self, mut stop: usize, size: Granularity) -> usize {
        while size == Granularity::Line && !self.timeline.begins_line(stop) {
            stop = self.timeline.stops[stop].previous.unwrap_or(stop);
        }
        stop
    }

    /// The stop before one in the same call, or in those around it, or in another call of the renderer.
    fn previous_outside_inner(&self, stop: usize) -> Option<usize> {
        let at = self.timeline.stops[stop];
        at.previous.or(self.timeline.call(at.call).caller_stop).or_else(|| stop.checked_sub(1))
    }
}

impl fmt::Debug for Replay {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "Replay(statement {} of {})", self.position, self.len())
    }
}

impl fmt::Display for NothingRecorded {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.skipped {
            0 => write!(out, "no statement of a shader has run"),
            count => write!(out, "no statement has run after the {count} entries that are skipped"),
        }
    }
}

impl std::error::Error for NothingRecorded {}
