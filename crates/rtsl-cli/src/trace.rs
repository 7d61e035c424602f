//! Recordings of traced methods, as text and as JSON.

use std::collections::BTreeMap;

use clap::ValueEnum;
use rtsl::{Place, Recording, TraceDetail, TraceEntry, TraceKind};
use rtsl_debug::first_not_finite;
use serde::{Deserialize, Serialize};

use crate::report::JsonDiagnostic;

/// The detail of a trace, on command lines and in requests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TraceName {
    /// The calls of methods with their state.
    #[default]
    Calls,
    /// The values of variables too, line by line.
    Lines,
}

impl From<TraceName> for TraceDetail {
    fn from(name: TraceName) -> TraceDetail {
        match name {
            TraceName::Calls => TraceDetail::Calls,
            TraceName::Lines => TraceDetail::Lines,
        }
    }
}

/// Returns the lines of a recording, indented by their calls.
pub fn lines(recording: &Recording) -> String {
    let mut text = String::new();
    for entry in &recording.entries {
        text += &"  ".repeat(entry.depth as usize);
        text += &entry.to_string();
        text.push('\n');
    }
    if recording.dropped > 0 {
        text += &format!("{} further lines are not kept\n", recording.dropped);
    }
    text
}

/// An entry as JSON.
#[derive(Clone, Debug, Serialize)]
pub struct JsonEntry {
    kind: &'static str,
    depth: u32,
    lane: u32,
    method: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    line: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reference: Option<String>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    values: BTreeMap<String, String>,
}

impl JsonEntry {
    /// Converts an entry.
    pub fn new(entry: &TraceEntry) -> JsonEntry {
        let TraceEntry { depth, lane, method, place, kind } = entry.clone();
        let (name, text, reference, values) = match kind {
            TraceKind::Print(text, _) => ("print", Some(text), None, Vec::new()),
            TraceKind::Assignment(part, _) => ("assignment", None, None, vec![part]),
            TraceKind::Call(reference, values) => ("call", None, reference, values),
            TraceKind::Return(values) => ("return", None, None, values),
            TraceKind::Note(text) => ("note", Some(text), None, Vec::new()),
            TraceKind::NotFinite(value, _) => {
                ("notFinite", Some(format!("{value:?}")), None, Vec::new())
            }
            TraceKind::Statement => ("statement", None, None, Vec::new()),
            TraceKind::Condition(value) => ("condition", Some(value.to_string()), None, Vec::new()),
            TraceKind::Known(values) => ("known", None, None, values),
            TraceKind::Enter(name, values) => ("enter", Some(name.to_string()), None, values),
            TraceKind::Leave(result) => ("leave", None, None, result.into_iter().collect()),
            TraceKind::Made(value, _) => ("made", Some(format!("{value:?}")), None, Vec::new()),
        };
        let values = values.iter().map(|value| (value.name().to_owned(), value.to_string()));
        JsonEntry {
            kind: name,
            depth,
            lane,
            method: method.to_string(),
            file: place.as_ref().map(|place| place.source.name.clone()),
            line: place.as_ref().map(Place::line),
            text,
            reference,
            values: values.collect(),
        }
    }
}

/// A recording as JSON.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct JsonRecording {
    /// The entries.
    pub entries: Vec<JsonEntry>,
    /// The number of entries that are not kept.
    pub dropped: u64,
    /// The first value that is not finite.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_finite: Option<JsonDiagnostic>,
}

impl JsonRecording {
    /// Converts a recording.
    pub fn new(recording: &Recording) -> JsonRecording {
        let not_finite = first_not_finite(recording);
        JsonRecording {
            entries: recording.entries.iter().map(JsonEntry::new).collect(),
            dropped: recording.dropped,
            not_finite: not_finite.map(|(sources, it)| JsonDiagnostic::new(&sources, &it)),
        }
    }
}
