//! The extension module `rtsl._rtsl` of the Python package.
//!
//! The classes here are plain handles of what the crates below have; the Python files of the package make of them what
//! users see. Long work releases the interpreter's lock.
//!
//! - `error`, `diagnostic`: exceptions and what they carry.
//! - `detached`: calls that release the lock, and children that were forked while one was in progress.
//! - `engine`: LLVM, options, and the programs that are kept.
//! - `unit`, `class`, `instance`, `value`: compiled texts, their classes, and instances with values of Python.
//! - `array_call`, `columns`, `array_host`: a method for whole arrays, on threads.
//! - `scene_text`, `composer`: scenes of files and of instances, prepared for renders.
//! - `partial_render`, `picture`: renders, part by part, and their pictures.
//! - `looking`: recordings of calls and pixels, and the costs of lines.

mod array_call;
mod array_host;
mod class;
mod columns;
mod composer;
mod detached;
mod diagnostic;
mod engine;
mod error;
mod instance;
mod looking;
mod method;
mod partial_render;
mod picture;
mod scene_text;
mod shown;
mod unit;
mod value;

use pyo3::prelude::*;
use rtsl_render::integrate::SAMPLES_IN_WAVEFRONT;

/// The extension module.
#[pymodule]
#[pyo3(name = "_rtsl")]
fn extension(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("WAVEFRONT_SAMPLES", SAMPLES_IN_WAVEFRONT)?;
    module.add_class::<engine::PyEngine>()?;
    module.add_class::<unit::PyUnit>()?;
    module.add_class::<class::PyClassHandle>()?;
    module.add_class::<instance::PyInstance>()?;
    module.add_function(wrap_pyfunction!(unit::compile_text, module)?)?;
    module.add_function(wrap_pyfunction!(unit::compile_file, module)?)?;
    module.add_function(wrap_pyfunction!(unit::library_unit, module)?)?;
    module.add_function(wrap_pyfunction!(unit::library_classes, module)?)?;
    module.add_function(wrap_pyfunction!(engine::suggest_llvm, module)?)?;
    module.add_function(wrap_pyfunction!(engine::llvm_info, module)?)?;
    module.add_function(wrap_pyfunction!(method::state_variables, module)?)?;
    module.add_function(wrap_pyfunction!(array_call::call, module)?)?;
    module.add_function(wrap_pyfunction!(scene_text::file_digest, module)?)?;
    module.add_class::<scene_text::PySceneText>()?;
    module.add_class::<composer::PyComposer>()?;
    module.add_class::<partial_render::PyPartialRender>()?;
    module.add_class::<picture::PyPicture>()?;
    Ok(())
}
