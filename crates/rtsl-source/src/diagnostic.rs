//! Diagnostics as data.

use crate::{Code, Span};

/// The severity of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The text compiles, but probably does not mean what its author thinks.
    Warning,
    /// The text does not compile.
    Error,
}

impl Severity {
    /// `"error"` or `"warning"`.
    pub fn name(self) -> &'static str {
        match self {
            Severity::Warning => "warning",
            Severity::Error => "error",
        }
    }
}

/// A span with a message about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The span that the label marks.
    pub span: Span,
    /// The message about the span; may be empty.
    pub message: String,
}

/// An edit that would fix the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Suggestion {
    /// A description of the edit: "did you mean `rt_HitPoint`?".
    pub message: String,
    /// The text to replace; empty for an insertion.
    pub span: Span,
    /// The new text.
    pub replacement: String,
}

/// One error or warning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// The stable code.
    pub code: Code,
    /// Error or warning.
    pub severity: Severity,
    /// A statement of what was found and what was expected: one line, no capital, no full stop.
    pub message: String,
    /// The span of the error; `None` if it has none in a text (a missing file, a missing
    /// parameter).
    pub primary: Option<Label>,
    /// Further spans that explain the message.
    pub labels: Vec<Label>,
    /// Facts that explain the message.
    pub notes: Vec<String>,
    /// Advice on how to fix it.
    pub help: Vec<String>,
    /// Edits that tools can apply.
    pub suggestions: Vec<Suggestion>,
}

impl Diagnostic {
    /// A diagnostic with the severity that its code has in the list of codes.
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Diagnostic {
            code,
            severity: code.severity(),
            message: message.into(),
            primary: None,
            labels: Vec::new(),
            notes: Vec::new(),
            help: Vec::new(),
            suggestions: Vec::new(),
        }
    }

    /// Sets the primary span and its label.
    pub fn at(mut self, span: Span, message: impl Into<String>) -> Self {
        self.primary = Some(Label { span, message: message.into() });
        self
    }

    /// Adds a label for another span.
    pub fn label(mut self, span: Span, message: impl Into<String>) -> Self {
        self.labels.push(Label { span, message: message.into() });
        self
    }

    /// Adds a note: a fact that explains the message.
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// Adds a help text: advice on how to fix it.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help.push(help.into());
        self
    }

    /// Adds a suggested edit, which is also shown as help.
    pub fn suggest(
        mut self,
        message: impl Into<String>,
        span: Span,
        replacement: impl Into<String>,
    ) -> Self {
        self.suggestions.push(Suggestion {
            message: message.into(),
            span,
            replacement: replacement.into(),
        });
        self
    }

    /// True if the diagnostic is an error.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

/// Diagnostics in the order they were found, limited in number: past [`Diagnostics::LIMIT`] further
/// ones are counted and dropped, so that the output stays short for any input.
#[derive(Clone, Debug, Default)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
    dropped: usize,
    has_errors: bool,
}

/// Formats severity, code and message in one line, for callers that have no [`crate::SourceMap`].
impl std::fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}[{}]: {}", self.severity.name(), self.code, self.message)
    }
}

impl std::error::Error for Diagnostic {}

/// Formats one diagnostic a line.
impl std::fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut diagnostics = self.list.iter();
        if let Some(first) = diagnostics.next() {
            write!(f, "{first}")?;
        }
        diagnostics.try_for_each(|diagnostic| write!(f, "\n{diagnostic}"))
    }
}

impl std::error::Error for Diagnostics {}

impl Diagnostics {
    /// The number of diagnostics that are kept.
    pub const LIMIT: usize = 200;

    /// An empty list.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a diagnostic.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        self.has_errors |= diagnostic.is_error();
        if self.list.len() < Self::LIMIT {
            self.list.push(diagnostic);
        } else {
            self.dropped += 1;
        }
    }

    /// Adds all of `other`.
    pub fn extend(&mut self, other: impl IntoIterator<Item = Diagnostic>) {
        for diagnostic in other {
            self.push(diagnostic);
        }
    }

    /// True if any error was added, kept or not.
    pub fn has_errors(&self) -> bool {
        self.has_errors
    }

    /// The number of diagnostics dropped past the limit.
    pub fn dropped(&self) -> usize {
        self.dropped
    }

    /// The diagnostics that were kept.
    pub fn iter(&self) -> impl Iterator<Item = &Diagnostic> {
        self.list.iter()
    }

    /// The diagnostics that were kept.
    pub fn into_vec(self) -> Vec<Diagnostic> {
        self.list
    }

    /// True if no diagnostic was added.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }
}
