//! Exceptions: the classes of `rtsl._errors` with what the crates below report.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use rtsl::{Compilation, Diagnostic, Diagnostics, Messages, SourceMap, render};

use crate::diagnostic::{diagnostics_of, dictionary};

/// An exception class of the package.
#[derive(Clone, Copy, Debug)]
pub enum Exception {
    /// The base of all: calls that are not possible, the machine.
    Error,
    /// A text with errors.
    Compile,
    /// Values that an instance does not take.
    Parameter,
    /// A scene that cannot be loaded or rendered.
    Scene,
}

impl Exception {
    fn class(self, py: Python<'_>) -> PyResult<Bound<'_, PyType>> {
        static CLASSES: [PyOnceLock<Py<PyType>>; 4] = [const { PyOnceLock::new() }; 4];
        let (index, name) = match self {
            Exception::Error => (0, "Error"),
            Exception::Compile => (1, "CompileError"),
            Exception::Parameter => (2, "ParameterError"),
            Exception::Scene => (3, "SceneError"),
        };
        CLASSES[index].import(py, "rtsl._errors", name).cloned()
    }

    /// Returns the exception with this text and these diagnostics.
    fn with(self, py: Python<'_>, text: &str, list: Vec<Py<PyAny>>) -> PyErr {
        match self.class(py).and_then(|class| class.call1((text.trim_end(), list))) {
            Ok(exception) => PyErr::from_value(exception),
            Err(error) => error,
        }
    }

    /// Returns the exception with this text alone.
    pub fn with_text(self, text: &str) -> PyErr {
        Python::attach(|py| self.with(py, text, Vec::new()))
    }

    /// Returns the exception of a diagnostic that refers to no text.
    pub fn of_diagnostic(self, diagnostic: &Diagnostic) -> PyErr {
        self.of_diagnostics(&SourceMap::new(), [diagnostic])
    }

    /// Returns the exception of several diagnostics that refer to these texts.
    pub fn of_diagnostics<'a>(
        self,
        sources: &SourceMap,
        diagnostics: impl IntoIterator<Item = &'a Diagnostic>,
    ) -> PyErr {
        Python::attach(|py| {
            let diagnostics: Vec<&Diagnostic> = diagnostics.into_iter().collect();
            let text = render::all_to_text(sources, diagnostics.iter().copied(), false);
            let list = diagnostics.iter().map(|it| dictionary(py, sources, it)).collect();
            match list {
                Ok(list) => self.with(py, &text, list),
                Err(error) => error,
            }
        })
    }

    /// Returns the exception of the errors of values.
    pub fn of_values(self, problems: &Diagnostics) -> PyErr {
        self.of_diagnostics(&SourceMap::new(), problems.iter())
    }

    /// Returns the exception of messages about several texts.
    pub fn of_messages(self, messages: &Messages) -> PyErr {
        Python::attach(|py| {
            let list = messages.iter().map(|(sources, it)| dictionary(py, sources, it)).collect();
            match list {
                Ok(list) => self.with(py, &messages.to_text(false), list),
                Err(error) => error,
            }
        })
    }
}

/// Returns the exception of a text with errors.
pub fn compile_error(py: Python<'_>, compilation: &Compilation) -> PyErr {
    match diagnostics_of(py, compilation) {
        Ok(list) => Exception::Compile.with(py, &compilation.report(false), list),
        Err(error) => error,
    }
}
