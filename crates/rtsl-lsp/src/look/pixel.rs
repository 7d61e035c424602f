//! The values of a pixel: the output of `rtsl render --pixel --trace=lines --json`.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::{Map, Value, json};

use super::{Fault, FaultCall, LineNote, Look, TextNotes, from_zero};

/// The greatest number of characters of a label.
const MAX_LABEL: usize = 80;
/// The greatest number of prints of a line in its explanation; earlier ones are counted.
const MAX_PRINTS: usize = 10;

/// A pixel.
#[derive(Debug, Deserialize)]
struct Pixel {
    color: Value,
    samples: Vec<Sample>,
}

/// A sample.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Sample {
    sample: u32,
    color: Value,
    entries: Vec<Entry>,
    dropped: u64,
    not_finite: Option<NotFinite>,
}

/// An event.
#[derive(Debug, Deserialize)]
struct Entry {
    kind: String,
    method: String,
    file: Option<String>,
    line: Option<u32>,
    text: Option<String>,
    #[serde(default)]
    values: BTreeMap<String, String>,
}

/// The first operation that made a number that is not finite.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct NotFinite {
    code: String,
    message: String,
    file: Option<String>,
    line: Option<u32>,
    column: Option<u32>,
    end_line: Option<u32>,
    end_column: Option<u32>,
    notes: Vec<String>,
}

/// The events of a line.
#[derive(Debug, Default)]
struct LineEvents {
    /// The variables that the line assigns, in the order of their first assignments.
    values: Vec<Assigned>,
    prints: Vec<String>,
}

/// A variable.
#[derive(Debug)]
struct Assigned {
    name: String,
    last: String,
    count: usize,
}

/// Reads the notes of lines from the output.
///
/// # Errors
/// If the output is none of this program's.
pub fn pixel(output: &[u8]) -> Result<Look, String> {
    let Pixel { color, samples } = serde_json::from_slice(output)
        .map_err(|error| format!("the pixel cannot be read: {error}"))?;
    let mut lines = BTreeMap::<&str, BTreeMap<u32, LineEvents>>::new();
    let mut prints = Vec::new();
    for sample in &samples {
        for entry in &sample.entries {
            if entry.kind == "print" {
                prints.push(json!({"sample": sample.sample, "text": entry.text}));
            }
            if let (Some(file), Some(line)) = (&entry.file, entry.line) {
                lines.entry(file).or_default().entry(from_zero(line)).or_default().add(entry);
            }
        }
    }
    let mut faults = faults(&samples);
    let mut texts = Vec::new();
    for (name, lines) in lines {
        let notes = lines.into_iter().filter_map(|(line, events)| events.note(line));
        let notes: Vec<LineNote> = notes.collect();
        let faults = faults.remove(name).unwrap_or_default();
        if !(notes.is_empty() && faults.is_empty()) {
            texts.push(TextNotes { name: name.to_owned(), notes, faults });
        }
    }
    texts.extend(faults.into_iter().map(|(name, faults)| TextNotes {
        name,
        notes: Vec::new(),
        faults,
    }));
    let not_finite = samples.iter().filter_map(|sample| {
        let message = &sample.not_finite.as_ref()?.message;
        Some(json!({"sample": sample.sample, "message": message}))
    });
    let not_finite: Vec<Value> = not_finite.collect();
    let dropped: u64 = samples.iter().map(|sample| sample.dropped).sum();
    let samples = samples.iter();
    let samples = samples.map(|it| json!({"sample": it.sample, "color": it.color}));
    let summary = Map::from_iter([
        ("color".to_owned(), color),
        ("samples".to_owned(), samples.collect()),
        ("prints".to_owned(), Value::Array(prints)),
        ("notFinite".to_owned(), Value::Array(not_finite)),
        ("dropped".to_owned(), json!(dropped)),
    ]);
    Ok(Look { texts, summary })
}

impl LineEvents {
    fn add(&mut self, entry: &Entry) {
        match entry.kind.as_str() {
            "print" => self.prints.extend(entry.text.clone()),
            "assignment" => {
                for (name, value) in &entry.values {
                    match self.values.iter_mut().find(|known| known.name == *name) {
                        Some(known) => {
                            known.last.clone_from(value);
                            known.count += 1;
                        }
                        None => self.values.push(Assigned {
                            name: name.clone(),
                            last: value.clone(),
                            count: 1,
                        }),
                    }
                }
            }
            _ => {}
        }
    }

    /// The note of the line; `None` if nothing is known about it.
    fn note(self, line: u32) -> Option<LineNote> {
        let mut shown: Vec<String> =
            self.values.iter().map(|it| format!("{} = {}", it.name, it.last)).collect();
        shown.extend(self.prints.last().map(|text| format!("print: {text}")));
        if shown.is_empty() {
            return None;
        }
        let values = self.values.iter().map(|it| (it.name.clone(), json!(it.last)));
        let data = Map::from_iter([
            ("values".to_owned(), Value::Object(values.collect())),
            ("prints".to_owned(), json!(self.prints)),
        ]);
        Some(LineNote { line, label: shortened(&shown.join(", ")), tooltip: self.tooltip(), data })
    }

    fn tooltip(&self) -> String {
        let values = self.values.iter().map(|Assigned { name, last, count }| match count {
            1 => format!("{name} = {last}"),
            count => format!("{name} = {last}, the last of {count} values"),
        });
        let mut lines: Vec<String> = values.collect();
        let earlier = self.prints.len().saturating_sub(MAX_PRINTS);
        if earlier > 0 {
            lines.push(format!("{earlier} earlier prints"));
        }
        lines.extend(self.prints[earlier..].iter().map(|text| format!("print: {text}")));
        lines.join("\n")
    }
}

/// The faults of all samples by the names of texts. Samples often have the same fault: the first one counts.
fn faults(samples: &[Sample]) -> BTreeMap<String, Vec<Fault>> {
    let mut faults = BTreeMap::<String, Vec<Fault>>::new();
    for sample in samples {
        let Some(NotFinite { file: Some(file), line: Some(line), .. }) = &sample.not_finite else {
            continue;
        };
        let known = faults.entry(file.clone()).or_default();
        let Some(fault) = fault(sample, from_zero(*line)) else { continue };
        let is_known = |it: &Fault| it.start == fault.start && it.end == fault.end;
        if !known.iter().any(is_known) {
            known.push(fault);
        }
    }
    faults
}

fn fault(sample: &Sample, line: u32) -> Option<Fault> {
    let found = sample.not_finite.as_ref()?;
    let start = (line, from_zero(found.column?));
    let end = (from_zero(found.end_line?), from_zero(found.end_column?)).max(start);
    let until = sample.entries.iter().position(|entry| entry.kind == "notFinite");
    let before = &sample.entries[..until.unwrap_or(0)];
    let mut message =
        format!("{}\nmade of finite numbers here, in sample {}", found.message, sample.sample);
    let mut calls = Vec::new();
    for note in &found.notes {
        match call(note, before) {
            Some(call) => calls.push(call),
            None => message += &format!("\nnote: {note}"),
        }
    }
    Some(Fault { code: found.code.clone(), message, start, end, calls })
}

/// The place of a note about a caller: the last line that it ran before the fault.
fn call(note: &str, before: &[Entry]) -> Option<FaultCall> {
    let method = note.strip_prefix("called by `")?.strip_suffix('`')?;
    let mut entries = before.iter().rev().filter(|entry| entry.method == method);
    let (name, line) = entries.find_map(|entry| Some((entry.file.clone()?, entry.line?)))?;
    Some(FaultCall { name, line: from_zero(line), message: format!("{note}, after this line") })
}

fn shortened(text: &str) -> String {
    let line: String = text.chars().map(|it| if it.is_control() { ' ' } else { it }).collect();
    match line.char_indices().nth(MAX_LABEL) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line,
    }
}
