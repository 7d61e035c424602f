//! `rtsl build`: a shader on its way to machine code.

use std::path::PathBuf;
use std::sync::Arc;

use clap::{Args, ValueEnum};
use rtsl::{Class, Emit, EmitRequest, EngineOptions, Method, OptLevel, Shape, Target, Unit};
use serde_json::Value as JsonValue;

use super::eval::parse_setting;
use super::{
    CommandResult, Failure, Outcome, choose_class, compile_file, compiler, engine, instance,
};
use crate::arguments::{EngineArguments, SearchPath, VariantArguments, parse_shape};
use crate::files::write_result;
use crate::names::find_method;
use crate::report::Reporter;

/// The command line of `rtsl build`.
#[derive(Debug, Args)]
pub struct BuildArguments {
    /// The shader.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The form to show or write.
    #[arg(long, value_enum)]
    emit: EmitName,
    /// Where to write it; standard output if not given.
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// The class, where the file has several.
    #[arg(long)]
    class: Option<String>,
    /// The method; all methods if not given, one after the other (an object file holds one).
    #[arg(long)]
    method: Option<String>,
    /// What the rays of a call have in common: `packet` one object, `common-origin` that and where they
    /// start, `stream` nothing; `leaf` is for one ray and many objects, `single` for one and one.
    #[arg(long, value_parser = parse_shape, default_value = "packet")]
    shape: Shape,
    #[command(flatten)]
    variant: VariantArguments,
    /// A parameter of the instance; may be repeated.
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = parse_setting,
          requires = "specialise")]
    params: Vec<(String, JsonValue)>,
    /// The machine: x86-64-v2, x86-64-v3, x86-64-v4 or aarch64; this one if not given.
    #[arg(long)]
    target: Option<String>,
    /// How much work goes into machine code.
    #[arg(short = 'O', long = "optimize", value_name = "LEVEL", default_value_t = 2,
          value_parser = clap::value_parser!(u8).range(0..=3))]
    optimization: u8,
    #[command(flatten)]
    engine: EngineArguments,
    #[command(flatten)]
    search_path: SearchPath,
}

/// The names of the forms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum EmitName {
    /// The syntax tree.
    Ast,
    /// The single-ray representation, linked and optimised.
    Ir,
    /// Packet code, masks explicit.
    Packet,
    /// LLVM text.
    Llvm,
    /// Assembly.
    Asm,
    /// An object file.
    Obj,
}

impl EmitName {
    /// The form after checking; `None` for the tree.
    fn form(self) -> Option<Emit> {
        match self {
            EmitName::Ast => None,
            EmitName::Ir => Some(Emit::Ir),
            EmitName::Packet => Some(Emit::Packet),
            EmitName::Llvm => Some(Emit::Llvm),
            EmitName::Asm => Some(Emit::Assembly),
            EmitName::Obj => Some(Emit::Object),
        }
    }
}

/// Prints or writes the form.
pub fn run(arguments: &BuildArguments, reporter: &Reporter) -> CommandResult {
    let compiler = compiler(&arguments.search_path);
    let contents = match arguments.emit.form() {
        None => {
            let (tree, compilation) = compiler.print_syntax_tree(&arguments.file);
            reporter.compilation(&compilation);
            if compilation.diagnostics.has_errors() {
                return Ok(Outcome::InputAtFault);
            }
            tree.into_bytes()
        }
        Some(form) => {
            let Some(unit) = compile_file(&compiler, &arguments.file, reporter) else {
                return Ok(Outcome::InputAtFault);
            };
            let class = choose_class(&unit, arguments.class.as_deref())?;
            emit_methods(arguments, form, class, &unit, reporter)?
        }
    };
    write_result(arguments.output.as_deref(), &contents)?;
    Ok(Outcome::Done)
}

fn emit_methods(
    arguments: &BuildArguments,
    form: Emit,
    class: &Arc<Class>,
    unit: &Unit,
    reporter: &Reporter,
) -> Result<Vec<u8>, Failure> {
    let methods = methods(arguments, class)?;
    if form == Emit::Object && methods.len() > 1 {
        let message = "an object file holds one method; choose it with `--method`";
        return Err(Failure::Usage(message.to_owned()));
    }
    let options =
        EngineOptions { optimization: level(arguments.optimization), ..arguments.engine.options() };
    let engine = engine(options, reporter)?;
    let mut program = engine.program_of_class(class);
    let mut variant = arguments.variant.reading(arguments.shape);
    if arguments.variant.specialise {
        let instance = instance(&arguments.params, class, unit)?;
        program = engine.program(&instance);
        variant = variant.knowing(program.known_members(&instance));
    }
    let mut contents = Vec::new();
    for method in methods {
        let request = EmitRequest {
            emit: form,
            method,
            variant: variant.clone(),
            target: target(arguments.target.as_deref())?,
        };
        contents.extend(program.emit(&request)?);
        if form != Emit::Object && contents.last().is_some_and(|last| *last != b'\n') {
            contents.push(b'\n');
        }
    }
    Ok(contents)
}

fn methods(arguments: &BuildArguments, class: &Class) -> Result<Vec<Method>, Failure> {
    match &arguments.method {
        Some(name) => Ok(vec![find_method(name).map_err(Failure::Usage)?]),
        None if class.methods.is_empty() => {
            Err(Failure::Usage(format!("class `{}` has no methods", class.name)))
        }
        None => Ok(class.methods.keys().copied().collect()),
    }
}

fn target(name: Option<&str>) -> Result<Option<Target>, Failure> {
    match name {
        None | Some("host") => Ok(None),
        Some(name) => Target::by_name(name).map(Some).ok_or_else(|| {
            let names = Target::NAMES.join(", ");
            Failure::Usage(format!("there is no target `{name}`: host, {names}"))
        }),
    }
}

fn level(number: u8) -> OptLevel {
    match number {
        0 => OptLevel::O0,
        1 => OptLevel::O1,
        2 => OptLevel::O2,
        _ => OptLevel::O3,
    }
}
