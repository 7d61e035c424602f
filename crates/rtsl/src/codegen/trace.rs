//! The record of what traced methods do.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rtsl_ir::{Event, EventKind, Observer, Place, Spoilt};

/// The greatest number of entries that a trace keeps in all its recordings together; further ones are counted.
const MAX_ENTRIES: usize = 1 << 18;

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
    recording: Mutex<Recording>,
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
}

/// The entries of a trace, in the order of their execution.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// The entries.
    pub entries: Vec<TraceEntry>,
    /// The number of further entries, which are not kept.
    pub dropped: u64,
    depth: u32,
    /// The number of entries of earlier recordings.
    before: usize,
}

/// An entry of a trace.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceEntry {
    /// The number of calls around it.
    pub depth: u32,
    /// The index of the ray within the call.
    pub lane: u32,
    /// The method, as `Class.method`.
    pub method: String,
    /// The place in the text, if it has one.
    pub place: Option<Place>,
    /// The occasion.
    pub kind: TraceKind,
}

/// The occasions of entries.
#[derive(Clone, Debug, PartialEq)]
pub enum TraceKind {
    /// A `print`, with its text.
    Print(String),
    /// An assignment: the variable and its value as text.
    Assignment(String, String),
    /// The start of a method: the reference through which it is called, if the renderer does not call it, and the state
    /// that it reads with values as text.
    Call(Option<String>, Vec<(String, String)>),
    /// The end of a method, with the state that it sets.
    Return(Vec<(String, String)>),
    /// A value that leaves a method and is not finite, made at the place of the entry.
    NotFinite(f32),
    /// A remark of the host.
    Note(String),
}

impl Trace {
    /// Creates a record of these things.
    pub fn new(detail: TraceDetail) -> Trace {
        let (is_on, recording) = (AtomicBool::new(false), Mutex::default());
        Trace(Arc::new(Shared { detail, is_on, recording }))
    }

    /// Begins to record.
    pub fn start(&self) {
        self.0.is_on.store(true, Ordering::Relaxed);
    }

    /// Stops recording and returns what is recorded.
    pub fn take(&self) -> Recording {
        self.0.is_on.store(false, Ordering::Relaxed);
        let mut recording = self.recording();
        let before = recording.before + recording.entries.len();
        std::mem::replace(&mut recording, Recording { before, ..Recording::default() })
    }

    /// Records a remark of the host, if calls are recorded.
    pub fn note(&self, text: impl FnOnce() -> String) {
        if self.is_on() && self.has_calls() {
            self.recording().push(("", 0), None, TraceKind::Note(text()));
        }
    }

    /// True between [`Trace::start`] and [`Trace::take`].
    pub(crate) fn is_on(&self) -> bool {
        self.0.is_on.load(Ordering::Relaxed)
    }

    /// True if calls are recorded.
    pub(crate) fn has_calls(&self) -> bool {
        self.0.detail >= TraceDetail::Calls
    }

    /// Records the start of a method that a host calls.
    pub(crate) fn begin_call(&self, method: &str, lane: u32, values: Vec<(String, String)>) {
        if self.has_calls() {
            self.recording().begin_call((method, lane), None, values);
        }
    }

    /// Records its end.
    pub(crate) fn end_call(&self, method: &str, lane: u32, values: Vec<(String, String)>) {
        if self.has_calls() {
            self.recording().end_call((method, lane), values);
        }
    }

    /// Returns the observer of a run of a method for a ray.
    pub(crate) fn observer<'a>(&'a self, method: &'a str, lane: u32) -> impl Observer + 'a {
        Observing { trace: self, method, lane }
    }

    fn recording(&self) -> MutexGuard<'_, Recording> {
        self.0.recording.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Recording {
    fn begin_call(
        &mut self,
        of: (&str, u32),
        reference: Option<String>,
        values: Vec<(String, String)>,
    ) {
        self.push(of, None, TraceKind::Call(reference, values));
        self.depth += 1;
    }

    fn end_call(&mut self, of: (&str, u32), values: Vec<(String, String)>) {
        self.depth = self.depth.saturating_sub(1);
        self.push(of, None, TraceKind::Return(values));
    }

    fn push(&mut self, (method, lane): (&str, u32), place: Option<Place>, kind: TraceKind) {
        if self.before + self.entries.len() < MAX_ENTRIES {
            let (depth, method) = (self.depth, method.to_owned());
            self.entries.push(TraceEntry { depth, lane, method, place, kind });
        } else {
            self.dropped += 1;
        }
    }
}

/// The observer of a run.
struct Observing<'a> {
    trace: &'a Trace,
    method: &'a str,
    lane: u32,
}

impl Observer for Observing<'_> {
    fn event(&mut self, event: &Event, words: &[u32]) {
        let Event { kind, method, place, .. } = event;
        let of = (method.as_str(), self.lane);
        let values = || {
            let shown = event.shown(words).map(|(name, value)| (name.to_owned(), value));
            shown.collect::<Vec<_>>()
        };
        let detail = self.trace.0.detail;
        let mut recording = self.trace.recording();
        match kind {
            EventKind::Print(_) => {
                recording.push(of, place.clone(), TraceKind::Print(event.text(words)));
            }
            EventKind::Assignment if detail >= TraceDetail::Lines => {
                for (name, value) in values() {
                    recording.push(of, place.clone(), TraceKind::Assignment(name, value));
                }
            }
            EventKind::Call(reference) if detail >= TraceDetail::Calls => {
                recording.begin_call(of, Some(reference.clone()), values());
            }
            EventKind::Return if detail >= TraceDetail::Calls => recording.end_call(of, values()),
            EventKind::Assignment | EventKind::Call(_) | EventKind::Return => {}
        }
    }

    fn spoilt(&mut self, Spoilt { value, place }: Spoilt) {
        if self.trace.has_calls() {
            let of = (self.method, self.lane);
            self.trace.recording().push(of, place, TraceKind::NotFinite(value));
        }
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

/// Formats an entry in one line, without its depth.
impl fmt::Display for TraceEntry {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(out, "{}:{}: ", place.source.name, place.line())?;
        }
        let method = &self.method;
        match &self.kind {
            TraceKind::Print(text) => write!(out, "{method}: {text}"),
            TraceKind::Assignment(name, value) => write!(out, "{name} = {value}"),
            TraceKind::Call(None, values) => write!(out, "{method}({})", listed(values)),
            TraceKind::Call(Some(reference), values) => {
                write!(out, "{method}({}) of `{reference}`", listed(values))
            }
            TraceKind::Return(values) if values.is_empty() => write!(out, "{method} returns"),
            TraceKind::Return(values) => write!(out, "{method} returns {}", listed(values)),
            TraceKind::Note(text) => out.write_str(text),
            TraceKind::NotFinite(value) => write!(out, "{method}: {value:?} is made here"),
        }
    }
}

fn listed(values: &[(String, String)]) -> String {
    let each = values.iter().map(|(name, value)| format!("{name} = {value}"));
    each.collect::<Vec<_>>().join(", ")
}
