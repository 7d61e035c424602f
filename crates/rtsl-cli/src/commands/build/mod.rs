//! `rtsl build`: the stages of compiling a shader, or a library of shaders for other programs.

mod arguments;
mod library;

use std::path::Path;
use std::sync::Arc;

use rtsl::{CallMode, Class, Emit, EmitRequest, Method, Unit};

pub use self::arguments::BuildArguments;
use self::arguments::{EmitName, standard_class};
use self::library::LibraryForm;
use super::shader::{choose_class, compiler_of, instance, unit_of};
use crate::files::write_result;
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;
use crate::spans::Spans;

/// The meaning of a form's name.
enum Form {
    Tree,
    Method(Emit),
    Library(LibraryForm),
}

impl Form {
    fn new(name: EmitName) -> Form {
        match name {
            EmitName::Ast => Form::Tree,
            EmitName::Ir => Form::Method(Emit::Ir),
            EmitName::Stages => Form::Method(Emit::Stages),
            EmitName::Packet => Form::Method(Emit::Packet),
            EmitName::Llvm => Form::Method(Emit::Llvm),
            EmitName::Asm => Form::Method(Emit::Assembly),
            EmitName::Obj => Form::Library(LibraryForm::Object),
            EmitName::Header => Form::Library(LibraryForm::Header),
            EmitName::Layout => Form::Library(LibraryForm::Layout),
            EmitName::Cpp => Form::Library(LibraryForm::Cpp),
        }
    }
}

/// Prints or writes the form, and the times of the stages if they are wanted.
pub fn run(arguments: &BuildArguments, reporter: &Reporter, spans: &Spans) -> CommandResult {
    let contents = match Form::new(arguments.emit) {
        Form::Tree => syntax_tree(arguments, reporter)?,
        Form::Method(form) => emit_methods(arguments, form, reporter)?,
        Form::Library(form) => library::emit(arguments, form, reporter)?,
    };
    let Some(contents) = contents else { return Ok(Outcome::InputAtFault) };
    if arguments.output.is_some() || !arguments.timings {
        write_result(arguments.output.as_deref(), &contents)?;
    }
    if arguments.timings {
        let timings = spans.timings();
        let text = if arguments.json { timings.to_json() } else { timings.to_text() };
        write_result(None, text.as_bytes())?;
    }
    Ok(Outcome::Done)
}

/// Returns the source of a form that has only one.
fn source_of(arguments: &BuildArguments) -> Result<&Path, Failure> {
    only("source", &arguments.sources)?;
    Ok(&arguments.sources[0])
}

/// Rejects several values for a form that takes one.
fn only<T>(what: &str, given: &[T]) -> Result<(), Failure> {
    if given.len() > 1 {
        let message = format!(
            "this form is of one {what}; libraries (`obj`, `header`, `layout`, `cpp`) take several"
        );
        return Err(Failure::Usage(message));
    }
    Ok(())
}

fn syntax_tree(
    arguments: &BuildArguments,
    reporter: &Reporter,
) -> Result<Option<Vec<u8>>, Failure> {
    let source = source_of(arguments)?;
    let compiler = compiler_of(source, &arguments.search_path, reporter)?;
    let (tree, compilation) = compiler.print_syntax_tree(source);
    reporter.compilation(&compilation);
    Ok((!compilation.diagnostics.has_errors()).then(|| tree.into_bytes()))
}

fn emit_methods(
    arguments: &BuildArguments,
    form: Emit,
    reporter: &Reporter,
) -> Result<Option<Vec<u8>>, Failure> {
    let source = source_of(arguments)?;
    only("class", &arguments.class)?;
    only("call mode", &arguments.mode)?;
    only("width", &arguments.width)?;
    if arguments.library.is_given() {
        let message = "`--bind` and `--prefix` are for libraries: `obj`, `header`, `layout`, `cpp`";
        return Err(Failure::Usage(message.to_owned()));
    }
    let compiler = compiler_of(source, &arguments.search_path, reporter)?;
    let Some(unit) = unit_of(&compiler, source, reporter)? else { return Ok(None) };
    let name = arguments.class.first().map(String::as_str);
    let class = choose_class(&unit, name.or_else(|| standard_class(source)))?;
    emit_class(arguments, form, class, &unit, reporter).map(Some)
}

fn emit_class(
    arguments: &BuildArguments,
    form: Emit,
    class: &Arc<Class>,
    unit: &Unit,
    reporter: &Reporter,
) -> Result<Vec<u8>, Failure> {
    let methods: Vec<Method> = match arguments.methods()? {
        Some(methods) => methods,
        None if class.methods.is_empty() => {
            return Err(Failure::Usage(format!("class `{}` has no methods", class.name)));
        }
        None => class.methods.keys().copied().collect(),
    };
    let engine = arguments.engine(reporter)?;
    let mut program = engine.program_of_class(class);
    let mode = arguments.mode.first().copied().unwrap_or(CallMode::Packet);
    let mut variant = arguments.variant.reading(mode);
    if arguments.variant.specialise {
        let instance = instance(&arguments.params, class, unit, reporter)?;
        program = engine.program(&instance);
        variant = variant.knowing(program.known_members(&instance));
    }
    let mut contents = Vec::new();
    for method in methods {
        let request = EmitRequest {
            emit: form,
            method,
            variant: variant.clone(),
            target: arguments.target()?,
        };
        contents.extend(program.emit(&request)?);
        if contents.last().is_some_and(|last| *last != b'\n') {
            contents.push(b'\n');
        }
    }
    Ok(contents)
}
