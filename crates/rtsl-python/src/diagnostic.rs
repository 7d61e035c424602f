//! Diagnostics as the class `rtsl.Diagnostic`.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyType};
use rtsl::{Compilation, Diagnostic, SourceMap};

/// Returns all diagnostics of a compilation.
pub fn diagnostics_of(py: Python<'_>, compilation: &Compilation) -> PyResult<Vec<Py<PyAny>>> {
    let all = compilation.diagnostics.iter();
    all.map(|it| dictionary(py, &compilation.sources, it)).collect()
}

/// Returns a diagnostic whose spans refer to `sources`.
pub fn dictionary(
    py: Python<'_>,
    sources: &SourceMap,
    diagnostic: &Diagnostic,
) -> PyResult<Py<PyAny>> {
    static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    let values = PyDict::new(py);
    values.set_item("code", diagnostic.code.as_str())?;
    values.set_item("severity", diagnostic.severity.name())?;
    values.set_item("message", &diagnostic.message)?;
    if let Some(label) = &diagnostic.primary {
        let start = sources.position(label.span.file, label.span.start);
        let end = sources.position(label.span.file, label.span.end);
        values.set_item("file", &sources.file(label.span.file).name)?;
        values.set_item("line", start.line)?;
        values.set_item("column", start.column)?;
        values.set_item("end_line", end.line)?;
        values.set_item("end_column", end.column)?;
    }
    values.set_item("notes", &diagnostic.notes)?;
    values.set_item("help", &diagnostic.help)?;
    let suggestions = diagnostic.suggestions.iter().map(|it| (&it.message, &it.replacement));
    values.set_item("suggestions", suggestions.collect::<Vec<_>>())?;
    let class = CLASS.import(py, "rtsl._errors", "Diagnostic")?;
    Ok(class.call((), Some(&values))?.unbind())
}
