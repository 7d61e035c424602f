//! A report of a value that is not finite, and of the line that has made it.

use rtsl::Recording;

/// A value that is not finite.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Report {
    /// The place of the operation that has made it of finite values.
    pub place: Option<ReportPlace>,
    /// The message.
    pub message: String,
    /// The calls around the operation, the innermost first.
    pub notes: Vec<String>,
}

/// A line of a text.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ReportPlace {
    /// The name of the text.
    pub text: String,
    /// The line, from 1.
    pub line: usize,
    /// The operation.
    pub code: String,
    /// The whole text.
    pub content: String,
}

impl Report {
    /// Returns the report of the first value of a recording that is not finite.
    pub fn of(recording: &Recording) -> Option<Report> {
        let (sources, found) = recording.not_finite()?;
        let place = found.primary.as_ref().map(|label| {
            let file = sources.file(label.span.file);
            let (start, end) = (label.span.start as usize, label.span.end as usize);
            ReportPlace {
                text: file.name.clone(),
                line: file.text[..start].matches('\n').count() + 1,
                code: file.text[start..end].to_owned(),
                content: file.text.clone(),
            }
        });
        let message = format!("{}: {}", found.code.as_str(), found.message);
        Some(Report { place, message, notes: found.notes.clone() })
    }
}
