//! The calls around a position.

use std::sync::Arc;

use rtsl::{Place, TraceKind};

use crate::timeline::{CallId, Timeline};

/// A call that has not ended at a position.
#[derive(Clone, Debug)]
pub struct Frame {
    pub(crate) call: CallId,
    /// The entry at which the call is: those before it have happened.
    pub(crate) entry: usize,
    /// `Class.method`, or the name of a function that is no method.
    pub name: Arc<str>,
    /// The reference through which the method is called; none if the renderer calls it, and for other functions.
    pub reference: Option<String>,
    /// True for methods.
    pub is_method: bool,
    /// The statement that is about to run, or that has made the call above. Methods of the prelude have none.
    pub place: Option<Place>,
}

impl Frame {
    /// Returns the calls around a stop, the innermost first.
    pub(crate) fn all(timeline: &Timeline, stop: usize) -> Vec<Frame> {
        let (mut entry, mut at) = (timeline.stops[stop].entry, Some(stop));
        let mut frames = Vec::new();
        for call in timeline.chain(timeline.stops[stop].call) {
            let known = timeline.call(call);
            let is_own = at.filter(|stop| timeline.stops[*stop].call == call);
            frames.push(Frame {
                call,
                entry,
                name: timeline.name_of(call).clone(),
                reference: match &timeline.entries[known.begin].kind {
                    TraceKind::Call(reference, _) => reference.clone(),
                    _ => None,
                },
                is_method: known.is_method,
                place: is_own.and_then(|stop| timeline.place_of(stop)).cloned(),
            });
            (entry, at) = (known.begin, known.caller_stop);
        }
        frames
    }

    /// Returns the line of the statement, from 1.
    pub fn line(&self) -> Option<u32> {
        self.place.as_ref().map(Place::line)
    }

    /// Returns the name of the text.
    pub fn source(&self) -> Option<&str> {
        self.place.as_ref().map(|place| place.source.name.as_str())
    }
}
