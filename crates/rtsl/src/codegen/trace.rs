//! The record of what traced methods do.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rtsl_ir::{Event, EventKind, Function, Observer, OpKind, Spoilt};

use super::recording::{Entries, Recording, TraceKind, TracedValue};
use super::stepped_lines::SteppedLines;

/// The record of what methods do that run on the engine of these [options](crate::EngineOptions::trace). It records
/// between [`Trace::start`] and [`Trace::take`]; clones share it.
///
/// ```
/// use rtsl::{CallArguments, CallMode, Compiler, CompilerOptions, Engine, EngineOptions, Instance, Instances};
/// use rtsl::{Method, Trace, TraceDetail, host::NoHost};
///
/// let text = "class Half : rt_Texture;
/// void lookup() { print(\"u = {}\", rt_TextureUV.x); rt_FloatTextureValue = 0.5 * rt_TextureUV.x; }";
/// let compiler = Compiler::new(CompilerOptions { traced: true, ..CompilerOptions::default() });
/// let unit = compiler.compile("half.rtsl", text).unit.expect("it compiles");
/// let half = Instance::new(unit.class("Half")?, [])?;
///
/// let trace = Trace::new(TraceDetail::Prints);
/// let (engine, _) = Engine::new(EngineOptions { trace: Some(trace.clone()), ..EngineOptions::default() })?;
/// let program = engine.program(&half);
/// let kernel = program.kernel(Method::Lookup, CallMode::Packet)?;
/// trace.start();
/// kernel.call(CallArguments {
///     state: &mut rtsl::new_state(1),
///     scratch: &mut program.new_scratch(1),
///     count: 1,
///     mask: None,
///     accepted: None,
///     instances: Instances::One(&program.block(&half)),
///     host: &mut NoHost,
/// });
/// let lines: Vec<String> = trace.take().entries.iter().map(ToString::to_string).collect();
/// assert_eq!(lines, ["half.rtsl:2: Half.lookup: u = 0.0"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Trace(Arc<Shared>);

struct Shared {
    detail: TraceDetail,
    is_on: AtomicBool,
    entries: Mutex<Entries>,
    lines: Mutex<SteppedLines>,
}

/// The detail of a trace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum TraceDetail {
    /// Prints.
    #[default]
    Prints,
    /// Calls of methods too, and values that they give and that are not finite.
    Calls,
    /// Assignments to variables too.
    Lines,
    /// Each statement before it runs, conditions, calls of functions that are no methods, and the operations that make
    /// values that are not finite too: all that a debugger walks over.
    Steps,
}

/// The part of the entries that a trace keeps, in all its recordings together; others are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TraceLimits {
    /// The number of entries before those that are kept. Of these, a recording has what still holds when it begins: the
    /// calls that have not ended, and the values of their variables.
    pub skip: u64,
    /// The greatest number of entries that are kept. Each takes about 150 bytes.
    pub keep: usize,
}

impl Default for TraceLimits {
    fn default() -> TraceLimits {
        TraceLimits { skip: 0, keep: 1 << 18 }
    }
}

impl Trace {
    /// Creates a record of these things.
    pub fn new(detail: TraceDetail) -> Trace {
        Trace::with_limits(detail, TraceLimits::default())
    }

    /// Creates a record of a part of these things.
    pub fn with_limits(detail: TraceDetail, limits: TraceLimits) -> Trace {
        let (is_on, entries) = (AtomicBool::new(false), Mutex::new(Entries::new(limits)));
        Trace(Arc::new(Shared { detail, is_on, entries, lines: Mutex::default() }))
    }

    /// Begins to record.
    pub fn start(&self) {
        self.0.is_on.store(true, Ordering::Relaxed);
    }

    /// Stops recording and returns what is recorded.
    pub fn take(&self) -> Recording {
        self.0.is_on.store(false, Ordering::Relaxed);
        self.entries().take()
    }

    /// Records a remark of the host, if calls are recorded.
    pub fn note(&self, text: impl FnOnce() -> String) {
        if self.is_on() && self.has_calls() {
            self.entries().push(&"".into(), 0, None, TraceKind::Note(text()));
        }
    }

    /// Returns the lines with statements of all methods that were prepared with this trace, of
    /// [`TraceDetail::Steps`], whether or not they have run.
    pub fn stepped_lines(&self) -> SteppedLines {
        self.0.lines.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Adds the lines of a method that is prepared with this trace.
    pub(crate) fn prepare(&self, function: &Function) {
        if self.0.detail < TraceDetail::Steps {
            return;
        }
        let mut lines = self.0.lines.lock().unwrap_or_else(PoisonError::into_inner);
        function.body.for_each_op(&mut |op| {
            if let OpKind::Report(event, _) = &op.kind
                && let (EventKind::Statement, Some(place)) = (&event.kind, &event.place)
            {
                lines.add(place);
            }
        });
    }

    /// True between [`Trace::start`] and [`Trace::take`].
    pub(crate) fn is_on(&self) -> bool {
        self.0.is_on.load(Ordering::Relaxed)
    }

    /// True if calls are recorded.
    pub(crate) fn has_calls(&self) -> bool {
        self.0.detail >= TraceDetail::Calls
    }

    /// Records the start of a method that a host calls, with the state and the members that it reads.
    pub(crate) fn begin_call(
        &self,
        method: &Arc<str>,
        lane: u32,
        state: Vec<TracedValue>,
        members: Vec<TracedValue>,
    ) {
        if self.has_calls() {
            let mut entries = self.entries();
            entries.begin(method, lane, None, TraceKind::Call(None, state));
            if self.0.detail >= TraceDetail::Steps && !members.is_empty() {
                entries.push(method, lane, None, TraceKind::Known(members));
            }
        }
    }

    /// Records its end.
    pub(crate) fn end_call(&self, method: &Arc<str>, lane: u32, values: Vec<TracedValue>) {
        if self.has_calls() {
            self.entries().end(method, lane, None, TraceKind::Return(values));
        }
    }

    /// Returns the observer of a run of a method for a ray, or of a function that reports what methods it calls.
    pub(crate) fn observer<'a>(
        &'a self,
        method: Option<&Arc<str>>,
        ray: u32,
    ) -> impl Observer + 'a {
        let depth = u32::from(method.is_some());
        Observing { trace: self, called: method.cloned(), depth, ray }
    }

    fn entries(&self) -> MutexGuard<'_, Entries> {
        self.0.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The observer of a run.
struct Observing<'a> {
    trace: &'a Trace,
    /// The method that the host calls, or the function as a host would; `None` between such calls.
    called: Option<Arc<str>>,
    /// The number of calls that have not ended.
    depth: u32,
    /// The index of the ray.
    ray: u32,
}

impl Observer for Observing<'_> {
    fn event(&mut self, event: &Event, words: &[u32]) {
        if self.trace.0.detail < detail_of(&event.kind) {
            return;
        }
        let (method, lane) = (&event.method, self.ray);
        let place = event.place.clone();
        let mut values = event.reported(words);
        let mut entries = self.trace.entries();
        match &event.kind {
            EventKind::Print(_) => {
                let kind = TraceKind::Print(event.text(words), values.collect());
                entries.push(method, lane, place, kind);
            }
            EventKind::Assignment => {
                if let Some(part) = values.next() {
                    entries.push(method, lane, place, TraceKind::Assignment(part, values.next()));
                }
            }
            EventKind::Call(reference) => {
                self.depth += 1;
                self.called.get_or_insert_with(|| event.method.clone());
                let reference = (!reference.is_empty()).then(|| reference.clone());
                let kind = TraceKind::Call(reference, values.collect());
                entries.begin(method, lane, None, kind);
            }
            EventKind::Return => {
                self.depth -= 1;
                if self.depth == 0 {
                    self.called = None;
                }
                entries.end(method, lane, None, TraceKind::Return(values.collect()));
            }
            EventKind::Statement => entries.push(method, lane, place, TraceKind::Statement),
            EventKind::Condition => {
                let is_true = words.first().is_some_and(|word| *word != 0);
                entries.push(method, lane, place, TraceKind::Condition(is_true));
            }
            EventKind::Known => {
                entries.push(method, lane, place, TraceKind::Known(values.collect()));
            }
            EventKind::Enter(function) => {
                let kind = TraceKind::Enter(function.as_str().into(), values.collect());
                entries.begin(method, lane, place, kind);
            }
            EventKind::Leave => entries.end(method, lane, place, TraceKind::Leave(values.next())),
        }
    }

    fn made(&mut self, Spoilt { value, number, place }: Spoilt) {
        if let Some(method) = &self.called
            && self.trace.0.detail >= TraceDetail::Steps
        {
            let kind = TraceKind::Made(value, number);
            self.trace.entries().push(method, self.ray, place, kind);
        }
    }

    fn spoilt(&mut self, Spoilt { value, number, place }: Spoilt) {
        if let Some(method) = &self.called
            && self.trace.has_calls()
        {
            let kind = TraceKind::NotFinite(value, number);
            self.trace.entries().push(method, self.ray, place, kind);
        }
    }
}

/// The least detail of a trace that has events of a kind.
fn detail_of(kind: &EventKind) -> TraceDetail {
    match kind {
        EventKind::Print(_) => TraceDetail::Prints,
        EventKind::Call(_) | EventKind::Return => TraceDetail::Calls,
        EventKind::Assignment => TraceDetail::Lines,
        EventKind::Statement
        | EventKind::Condition
        | EventKind::Known
        | EventKind::Enter(_)
        | EventKind::Leave => TraceDetail::Steps,
    }
}

/// Two traces are equal if they are one.
impl PartialEq for Trace {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Eq for Trace {}

impl fmt::Debug for Trace {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "Trace({:?})", self.0.detail)
    }
}
