//! The spans of stages and passes, as lines on standard error and as a table of times.
//!
//! The crates below open a span for each stage of their work; passes and wavefronts are spans of level `TRACE`, all
//! others of level `DEBUG`. Nothing is recorded unless the command line asks for it.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt::{Debug, Write as _};
use std::io::Write as _;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::span::{Attributes, Id, Record};
use tracing::subscriber::Interest;
use tracing::{Event, Metadata, Subscriber};
use tracing_core::span::Current;

use crate::timings::{StageTree, Timings};

/// A recorder of spans.
pub struct Spans {
    state: Option<Arc<Mutex<State>>>,
    start: Instant,
}

impl Spans {
    /// Records from now on. Each `-v` shows one level more; a table of times needs all.
    pub fn record(verbosity: u8, wants_timings: bool) -> Spans {
        let shown = match verbosity {
            0 => LevelFilter::OFF,
            1 => LevelFilter::DEBUG,
            _ => LevelFilter::TRACE,
        };
        let recorded = if wants_timings { LevelFilter::TRACE } else { shown };
        let start = Instant::now();
        if recorded == LevelFilter::OFF {
            return Spans { state: None, start };
        }
        let state = Arc::new(Mutex::new(State::default()));
        let recorder = Recorder { state: state.clone(), shown, recorded };
        // Fails only if a recorder is installed already.
        let _ = tracing::subscriber::set_global_default(recorder);
        Spans { state: Some(state), start }
    }

    /// Returns the times of all spans that have ended.
    pub fn timings(&self) -> Timings {
        let total = self.start.elapsed();
        match &self.state {
            Some(state) => {
                let state = state.lock().unwrap_or_else(PoisonError::into_inner);
                Timings::new(&state.stages, total)
            }
            None => Timings::new(&StageTree::default(), total),
        }
    }
}

struct Recorder {
    state: Arc<Mutex<State>>,
    /// The spans that are written to standard error.
    shown: LevelFilter,
    recorded: LevelFilter,
}

#[derive(Default)]
struct State {
    /// The last id; ids start at 1.
    last: u64,
    open: BTreeMap<u64, Open>,
    stages: StageTree,
}

/// A span that has not ended.
struct Open {
    metadata: &'static Metadata<'static>,
    stage: usize,
    depth: usize,
    fields: Fields,
    start: Instant,
    handles: usize,
}

thread_local! {
    /// The ids of the spans that this thread has entered.
    static ENTERED: RefCell<Vec<u64>> = const { RefCell::new(Vec::new()) };
}

/// Does nothing on a thread that is ending.
fn with_entered<T>(work: impl FnOnce(&mut Vec<u64>) -> T) -> Option<T> {
    ENTERED.try_with(|entered| work(&mut entered.borrow_mut())).ok()
}

fn innermost() -> Option<u64> {
    with_entered(|entered| entered.last().copied()).flatten()
}

impl Recorder {
    fn with<T>(&self, work: impl FnOnce(&mut State) -> T) -> T {
        work(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Subscriber for Recorder {
    fn register_callsite(&self, metadata: &'static Metadata<'static>) -> Interest {
        if self.enabled(metadata) { Interest::always() } else { Interest::never() }
    }

    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.is_span()
            && metadata.target().starts_with("rtsl")
            && *metadata.level() <= self.recorded
    }

    fn max_level_hint(&self) -> Option<LevelFilter> {
        Some(self.recorded)
    }

    fn new_span(&self, attributes: &Attributes<'_>) -> Id {
        let parent = match attributes.parent() {
            Some(parent) => Some(parent.into_u64()),
            None if attributes.is_contextual() => innermost(),
            None => None,
        };
        let mut fields = Fields::default();
        attributes.record(&mut fields);
        let metadata = attributes.metadata();
        let label = fields.name.clone().unwrap_or_else(|| metadata.name().to_owned());
        self.with(|state| {
            let parent = parent.and_then(|parent| state.open.get(&parent));
            let depth = parent.map_or(0, |parent| parent.depth + 1);
            let stage = state.stages.stage(parent.map(|parent| parent.stage), &label);
            state.last += 1;
            let start = Instant::now();
            state
                .open
                .insert(state.last, Open { metadata, stage, depth, fields, start, handles: 1 });
            Id::from_u64(state.last)
        })
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, _: &Event<'_>) {}

    fn enter(&self, id: &Id) {
        with_entered(|entered| entered.push(id.into_u64()));
    }

    fn exit(&self, id: &Id) {
        with_entered(|entered| {
            if let Some(place) = entered.iter().rposition(|it| *it == id.into_u64()) {
                entered.remove(place);
            }
        });
    }

    fn clone_span(&self, id: &Id) -> Id {
        self.with(|state| {
            if let Some(open) = state.open.get_mut(&id.into_u64()) {
                open.handles += 1;
            }
        });
        id.clone()
    }

    fn try_close(&self, id: Id) -> bool {
        let ended = self.with(|state| {
            let open = state.open.get_mut(&id.into_u64())?;
            open.handles -= 1;
            if open.handles > 0 {
                return None;
            }
            let open = state.open.remove(&id.into_u64())?;
            let time = open.start.elapsed();
            state.stages.add(open.stage, time);
            Some((open, time))
        });
        let Some((open, time)) = ended else { return false };
        if *open.metadata.level() <= self.shown {
            // Lines that nobody can read are no reason to stop.
            let _ = writeln!(std::io::stderr(), "{}", open.line(time));
        }
        true
    }

    fn current_span(&self) -> Current {
        let Some(id) = innermost() else { return Current::none() };
        let metadata = self.with(|state| state.open.get(&id).map(|open| open.metadata));
        metadata.map_or_else(Current::none, |it| Current::new(Id::from_u64(id), it))
    }
}

impl Open {
    fn line(&self, time: Duration) -> String {
        let Fields { name, others } = &self.fields;
        let label = name.as_deref().unwrap_or(self.metadata.name());
        let indent = 2 * self.depth;
        format!("{:indent$}{label}{others}: {:.3} ms", "", time.as_secs_f64() * 1e3)
    }
}

/// The fields of a span.
#[derive(Default)]
struct Fields {
    /// The field `name`, which takes the place of the span's own name.
    name: Option<String>,
    /// The other fields, ` key=value` each.
    others: String,
}

impl Visit for Fields {
    fn record_str(&mut self, field: &Field, value: &str) {
        if field.name() == "name" {
            self.name = Some(value.to_owned());
        } else {
            self.record_debug(field, &format_args!("{value}"));
        }
    }

    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        // Writing to a string cannot fail.
        let _ = write!(self.others, " {}={value:?}", field.name());
    }
}
