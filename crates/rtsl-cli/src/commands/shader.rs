//! The shader of a command line: its classes, an instance, an engine for its code.

use std::path::Path;
use std::sync::Arc;

use rtsl::{
    Class, Compilation, Compiler, CompilerOptions, DEFAULT_LOOP_BUDGET, Engine, EngineOptions,
    Instance, Unit, library,
};
use serde_json::Value as JsonValue;

use crate::arguments::SearchPath;
use crate::eval::{ValueError, make_instance, range_warnings};
use crate::outcome::Failure;
use crate::report::Reporter;

/// Returns a compiler of a source, a file or a class of the standard library, with the folders of the command line and
/// of the project file beside it. Constructors of its classes have a loop budget.
pub fn compiler_of(
    source: &Path,
    search_path: &SearchPath,
    reporter: &Reporter,
) -> Result<Compiler, Failure> {
    match is_file_name(source) {
        true => Ok(compiler(&search_path.beside(source, reporter)?)),
        false => Ok(compiler(search_path)),
    }
}

/// Returns a compiler with these folders. Constructors of its classes have a loop budget.
pub fn compiler(search_path: &SearchPath) -> Compiler {
    let search_path = search_path.folders();
    Compiler::new(CompilerOptions {
        search_path,
        loop_budget: Some(DEFAULT_LOOP_BUDGET),
        ..CompilerOptions::default()
    })
}

/// Like [`compiler`], for classes whose values have places in the text.
pub fn traced_compiler(search_path: &SearchPath) -> Compiler {
    Compiler::new(CompilerOptions { traced: true, ..compiler(search_path).options().clone() })
}

/// Compiles a file and reports its diagnostics; `None` if there are errors.
pub fn compile_file(compiler: &Compiler, path: &Path, reporter: &Reporter) -> Option<Unit> {
    let compilation: Compilation = compiler.compile_file(path);
    reporter.compilation(&compilation);
    compilation.unit
}

/// True if a word of the command line is the name of a file rather than of a class.
pub fn is_file_name(path: &Path) -> bool {
    path.extension().is_some() || path.exists()
}

/// Returns the classes of a file, or of the file of the standard library that contains this class. Diagnostics are
/// reported; `None` if there are errors.
pub fn unit_of(
    compiler: &Compiler,
    source: &Path,
    reporter: &Reporter,
) -> Result<Option<Unit>, Failure> {
    if is_file_name(source) {
        return Ok(compile_file(compiler, source, reporter));
    }
    Ok(Some(library::unit_of_class(compiler, &source.to_string_lossy())?))
}

/// Returns the class of this name, or the only one.
pub fn choose_class<'a>(unit: &'a Unit, name: Option<&str>) -> Result<&'a Arc<Class>, Failure> {
    match (name, unit.classes()) {
        (Some(name), _) => Ok(unit.class(name)?),
        (None, [class]) => Ok(class),
        (None, []) => Err(Failure::Usage("the file has no class".to_owned())),
        (None, classes) => {
            let names: Vec<&str> = classes.iter().map(|class| class.name.as_str()).collect();
            let names = names.join("`, `");
            Err(Failure::Usage(format!("choose a class with `--class`; the file has `{names}`")))
        }
    }
}

/// Creates an engine and reports its warnings.
pub fn engine(options: EngineOptions, reporter: &Reporter) -> Result<Engine, Failure> {
    let (engine, warnings) = Engine::new(options)?;
    warnings.iter().for_each(|warning| reporter.diagnostic(warning));
    Ok(engine)
}

/// Creates an instance with the parameters of a command line, and reports its warnings.
pub fn instance(
    params: &[(String, JsonValue)],
    class: &Arc<Class>,
    unit: &Unit,
    reporter: &Reporter,
) -> Result<Arc<Instance>, Failure> {
    let params = params.iter().map(|(name, value)| (name, value));
    let instance = make_instance(class, unit, params).map_err(value_failure)?;
    range_warnings(&instance).iter().for_each(|warning| reporter.diagnostic(warning));
    Ok(instance)
}

/// The failure for an invalid value.
pub fn value_failure(error: ValueError) -> Failure {
    match error {
        ValueError::Malformed(message) => Failure::Usage(message),
        ValueError::Instance(diagnostics) => Failure::Diagnostics(diagnostics),
    }
}
