//! Engines and LLVM.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use rtsl::{Backend, Engine, EngineOptions, Instance, Llvm, Math, Program};

use crate::error::Exception;

/// The number of programs that an engine keeps: an instance whose parameter changed finds that of its predecessor.
const KEPT_PROGRAMS: usize = 64;

/// An engine with the programs that were used last.
#[pyclass(name = "Engine", module = "rtsl._rtsl", frozen)]
pub struct PyEngine {
    pub engine: Engine,
    pub math: Math,
    recent: Mutex<VecDeque<Arc<Program>>>,
    warnings: Vec<String>,
}

#[pymethods]
impl PyEngine {
    #[new]
    #[pyo3(signature = (backend="auto", width=None, math="contract", loop_budget=None))]
    fn new(
        py: Python<'_>,
        backend: &str,
        width: Option<u32>,
        math: &str,
        loop_budget: Option<u32>,
    ) -> PyResult<PyEngine> {
        let math = math_of_name(math)?;
        let options = EngineOptions {
            backend: backend_of_name(backend)?,
            width,
            math,
            loop_budget: loop_budget.or(Some(rtsl::DEFAULT_LOOP_BUDGET)),
            ..EngineOptions::default()
        };
        let made = py.detach(|| Engine::new(options));
        let (engine, warnings) = made.map_err(|it| Exception::Error.of_diagnostic(&it))?;
        let warnings = warnings.iter().map(ToString::to_string).collect();
        Ok(PyEngine { engine, math, recent: Mutex::default(), warnings })
    }

    /// Rays at a time in its kernels.
    #[getter]
    fn width(&self) -> u32 {
        self.engine.width()
    }

    /// True if kernels are machine code.
    #[getter]
    fn is_compiled(&self) -> bool {
        self.engine.llvm().is_some()
    }

    /// The warnings of its creation.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }
}

impl PyEngine {
    /// Returns the program of an instance, and keeps it.
    pub fn program(&self, instance: &Instance) -> Arc<Program> {
        let program = self.engine.program(instance);
        let mut recent = self.recent.lock().unwrap_or_else(PoisonError::into_inner);
        match recent.iter().position(|it| Arc::ptr_eq(it, &program)) {
            Some(place) => {
                recent.remove(place);
            }
            None if recent.len() == KEPT_PROGRAMS => {
                recent.pop_front();
            }
            None => {}
        }
        recent.push_back(program.clone());
        program
    }
}

fn backend_of_name(name: &str) -> PyResult<Backend> {
    match name {
        "auto" => Ok(Backend::Auto),
        "jit" => Ok(Backend::Jit),
        "interpreter" => Ok(Backend::Interpreter),
        other => {
            let message = format!("there is no backend `{other}`: auto, jit, interpreter");
            Err(Exception::Error.with_text(&message))
        }
    }
}

fn math_of_name(name: &str) -> PyResult<Math> {
    let message = || format!("there is no math `{name}`: contract, strict, fast");
    Math::from_name(name).ok_or_else(|| Exception::Error.with_text(&message()))
}

/// Names libraries of LLVM that the search tries before those of the system, unless `RTSL_LLVM` names one.
#[pyfunction]
pub fn suggest_llvm(paths: Vec<PathBuf>) {
    Llvm::suggest(paths);
}

/// Returns the LLVM of this process, or the error of loading it.
#[pyfunction]
pub fn llvm_info(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let info = PyDict::new(py);
    match py.detach(Llvm::load) {
        Ok(llvm) => {
            info.set_item("version", llvm.version().to_string())?;
            info.set_item("path", llvm.path())?;
            info.set_item("processor", llvm.host().cpu())?;
            info.set_item("target", llvm.host().triple())?;
        }
        Err(error) => info.set_item("error", error.to_string())?,
    }
    Ok(info)
}
