//! Engines and LLVM.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use rtsl::{
    Backend, Engine, EngineOptions, Instance, LineCosts, Llvm, Math, Program, Trace, TraceDetail,
};

use crate::detached::detached;
use crate::error::Exception;
use crate::looking::{RecordingParts, recording_parts};

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
    #[pyo3(signature = (
        backend="auto", width=None, math="contract", loop_budget=None, *, trace=None, costs=false,
        **others
    ))]
    #[allow(clippy::too_many_arguments, reason = "the keywords of one call of Python")]
    fn new(
        py: Python<'_>,
        backend: &str,
        width: Option<u32>,
        math: &str,
        loop_budget: Option<u32>,
        trace: Option<&str>,
        costs: bool,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<PyEngine> {
        if let Some(others) = others {
            refuse_keywords(others)?;
        }
        let math = math_of_name(math)?;
        let options = EngineOptions {
            backend: backend_of_name(backend)?,
            width,
            math,
            loop_budget: loop_budget.or(Some(rtsl::DEFAULT_LOOP_BUDGET)),
            trace: trace.map(detail_of_name).transpose()?.map(Trace::new),
            costs: costs.then(LineCosts::default),
            ..EngineOptions::default()
        };
        let kept = Engine::keep_code();
        let made = detached(py, || Engine::new(options))?;
        let (engine, warnings) = made.map_err(|it| Exception::Error.of_diagnostic(&it))?;
        let mut warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        // A folder that can't be used is worth a warning if the user named it.
        if let Err(error) = kept
            && std::env::var_os("RTSL_CACHE").is_some()
        {
            warnings.push(format!("machine code is not kept: {error}"));
        }
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

    /// Begins to record what methods do, if the engine has a trace.
    fn start(&self) {
        if let Some(trace) = &self.engine.options().trace {
            trace.start();
        }
    }

    /// Stops recording, and returns what is recorded: lines, prints, the number of entries that are not kept, and the
    /// diagnostic about the first value that is not finite with its text.
    fn take(&self, py: Python<'_>) -> PyResult<RecordingParts> {
        let trace = &self.engine.options().trace;
        let recording = trace.as_ref().map(Trace::take).unwrap_or_default();
        recording_parts(py, &recording)
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

/// The keywords that users give. `trace` and `costs` are those of this package.
const KEYWORDS: [&str; 4] = ["backend", "width", "math", "loop_budget"];

/// Refuses keywords that an engine has not, in the words of the package's functions.
fn refuse_keywords(others: &Bound<'_, PyDict>) -> PyResult<()> {
    let package = others.py().import("rtsl._arguments")?;
    package.call_method1("refuse", (others, KEYWORDS, "Engine() has")).map(drop)
}

fn detail_of_name(name: &str) -> PyResult<TraceDetail> {
    match name {
        "prints" => Ok(TraceDetail::Prints),
        "calls" => Ok(TraceDetail::Calls),
        "lines" => Ok(TraceDetail::Lines),
        _ => {
            let message = format!("there is no detail `{name}`: prints, calls, lines");
            Err(Exception::Error.with_text(&message))
        }
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
    match detached(py, Llvm::load)? {
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
