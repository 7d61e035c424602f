//! The first value of a recording that is not finite.

use rtsl::{
    Diagnostic, Place, Recording, SourceMap, Span, TraceEntry, TraceKind, diagnostic_codes as codes,
};

/// Returns a warning about the first value that is not finite, with the text at its place.
pub fn first_not_finite(recording: &Recording) -> Option<(SourceMap, Diagnostic)> {
    let found = recording.entries.iter().find_map(|entry| match entry.kind {
        TraceKind::NotFinite(value, _) => Some((entry, value)),
        _ => None,
    });
    let (entry, value) = found?;
    let message = format!("a value that leaves `{}` is not finite: {value:?}", entry.method);
    let mut sources = SourceMap::new();
    let diagnostic = Diagnostic::new(codes::NOT_FINITE, message);
    let diagnostic = match &entry.place {
        Some(Place { source, start, end }) => {
            let file = sources.add(source.name.clone(), source.text.clone());
            diagnostic.at(Span::new(file, *start, *end), "made of finite numbers here")
        }
        None => diagnostic,
    };
    let calls = open_calls(&recording.entries, entry);
    let diagnostic = calls.into_iter().fold(diagnostic, |diagnostic, call| diagnostic.note(call));
    Some((sources, diagnostic))
}

/// The calls around an entry, the innermost first.
fn open_calls(entries: &[TraceEntry], of: &TraceEntry) -> Vec<String> {
    let mut open = Vec::new();
    for entry in entries.iter().take_while(|entry| !std::ptr::eq(*entry, of)) {
        match &entry.kind {
            TraceKind::Call(..) => open.push(&*entry.method),
            TraceKind::Return(_) => {
                open.pop();
            }
            _ => {}
        }
    }
    if open.last() == Some(&&*of.method) {
        open.pop();
    }
    open.iter().rev().map(|method| format!("called by `{method}`")).collect()
}
