//! Compiled texts.

use std::path::PathBuf;

use pyo3::prelude::*;
use rtsl::{Compilation, Compiler, CompilerOptions, FileLoader, Unit, library};

use crate::class::PyClassHandle;
use crate::detached::detached;
use crate::diagnostic::diagnostics_of;
use crate::error::{Exception, compile_error};

/// The classes of a text, with the warnings about it.
#[pyclass(name = "Unit", module = "rtsl._rtsl", frozen)]
pub struct PyUnit {
    unit: Unit,
    #[pyo3(get)]
    warnings: Vec<Py<PyAny>>,
}

#[pymethods]
impl PyUnit {
    /// The classes, in the order of the text.
    fn classes(&self) -> Vec<PyClassHandle> {
        self.unit.classes().iter().map(|class| PyClassHandle { class: class.clone() }).collect()
    }
}

impl PyUnit {
    fn of(py: Python<'_>, compilation: &Compilation) -> PyResult<PyUnit> {
        match &compilation.unit {
            Some(unit) => {
                Ok(PyUnit { unit: unit.clone(), warnings: diagnostics_of(py, compilation)? })
            }
            None => Err(compile_error(py, compilation)),
        }
    }
}

fn compiler(search_path: Vec<PathBuf>) -> Compiler {
    Compiler::new(CompilerOptions {
        loop_budget: Some(rtsl::DEFAULT_LOOP_BUDGET),
        search_path,
        // Prints and places of operations, which engines leave out that look at neither.
        traced: true,
    })
}

/// Compiles a text; diagnostics call it `name`.
#[pyfunction]
pub fn compile_text(
    py: Python<'_>,
    text: &str,
    name: &str,
    search_path: Vec<PathBuf>,
) -> PyResult<PyUnit> {
    let compilation = detached(py, || compiler(search_path).compile(name, text))?;
    PyUnit::of(py, &compilation)
}

/// Compiles a file.
#[pyfunction]
pub fn compile_file(py: Python<'_>, path: PathBuf, search_path: Vec<PathBuf>) -> PyResult<PyUnit> {
    let compilation = detached(py, || compiler(search_path).compile_file(&path))?;
    PyUnit::of(py, &compilation)
}

/// Compiles the file of the standard library that has a class.
#[pyfunction]
pub fn library_unit(py: Python<'_>, class: &str) -> PyResult<PyUnit> {
    let unit = detached(py, || library::unit_of_class(&compiler(Vec::new()), class))?;
    let unit = unit.map_err(|problem| Exception::Error.of_diagnostic(&problem))?;
    Ok(PyUnit { unit, warnings: Vec::new() })
}

/// Returns the names of the classes of the standard library, with their files. The texts are parsed, since comments
/// have the word `class`, too.
#[pyfunction]
pub fn library_classes(py: Python<'_>) -> PyResult<Vec<(String, &'static str)>> {
    detached(py, || {
        let compiler = Compiler::default();
        let classes = library::files().iter().flat_map(|file| {
            let outline = compiler.outline(file.path, file.text, &mut FileLoader::default());
            outline.classes.into_iter().map(|class| (class.name, file.path))
        });
        classes.collect()
    })
}
