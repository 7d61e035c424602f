//! The diagnostics of this crate, one function each.

use rtsl_ir::class::{Class, Parameter};
use rtsl_jit::{JitError, LlvmError, MAX_FRAME_BYTES};
use rtsl_link::errors::unset_reference_of;
use rtsl_packet::{LowerError, MAX_WORK};
use rtsl_source::{Diagnostic, diagnostic_codes as codes, most_similar, with_article};
use rtsl_spec::Method;

use crate::instance::wording::Wording;
use crate::type_name::type_name;

/// The greatest number of names in a message.
const LISTED: usize = 12;

pub(crate) fn missing_parameters(wording: &Wording, missing: &[&Parameter]) -> Diagnostic {
    let names: Vec<&str> =
        missing.iter().map(|parameter| wording.parameter(&parameter.name)).collect();
    let plural = if names.len() == 1 { "the parameter" } else { "the parameters" };
    let mut diagnostic = Diagnostic::new(
        codes::MISSING_PARAMETER,
        format!("{plural} {} of {} must be set", list(&names), wording.subject),
    );
    for (parameter, name) in missing.iter().zip(&names).take(LISTED) {
        diagnostic =
            diagnostic.note(format!("`{name}` is {}", with_article(&type_name(&parameter.ty))));
    }
    diagnostic
}

pub(crate) fn unknown_parameter(class: &Class, name: &str, wording: &Wording) -> Diagnostic {
    let names: Vec<&str> = class.parameters.iter().map(|it| wording.parameter(&it.name)).collect();
    let subject = &wording.subject;
    let diagnostic =
        Diagnostic::new(codes::NO_SUCH_PARAMETER, format!("{subject} has no parameter `{name}`"));
    match most_similar(name, names.iter().copied()) {
        Some(similar) => diagnostic.help(format!("did you mean `{similar}`?")),
        None if names.is_empty() => diagnostic.note(format!("{subject} has no parameters")),
        None => diagnostic.note(format!("it has {}", list(&names))),
    }
}

/// An instance whose class has no element parameter.
pub(crate) fn no_elements(class: &Class) -> Diagnostic {
    Diagnostic::new(
        codes::NO_SUCH_PARAMETER,
        format!("`{}` has no parameter that tells elements apart", class.name),
    )
    .help("annotate it with `[[element \"buffer\"]]`")
}

/// The reason why a value does not fit a parameter.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Mismatch {
    /// The value has another type than `expected`.
    Type { expected: String, found: String },
    /// A number is none of the choices, or outside the annotated range and not finite.
    Range(String),
    /// An instance lacks the role that a reference asks for.
    Role { class: String, role: &'static str },
}

pub(crate) fn mismatch(wording: &Wording, parameter: &Parameter, mismatch: Mismatch) -> Diagnostic {
    let name = wording.parameter(&parameter.name);
    let name = format!("the parameter `{name}` of {}", wording.subject);
    match mismatch {
        Mismatch::Type { expected, found } => Diagnostic::new(
            codes::PARAMETER_TYPE,
            format!("{name} is {}, found {found}", with_article(&expected)),
        ),
        Mismatch::Range(reason) => {
            Diagnostic::new(codes::PARAMETER_RANGE, format!("{name} is out of range: {reason}"))
        }
        Mismatch::Role { class, role } => Diagnostic::new(
            codes::REFERENCE_ROLE,
            format!("{name} is {}, and `{class}` is none", with_article(role)),
        ),
    }
}

/// A finite number outside the annotated range.
pub(crate) fn outside_range(wording: &Wording, parameter: &Parameter, reason: &str) -> Diagnostic {
    let (name, subject) = (wording.parameter(&parameter.name), &wording.subject);
    let message = format!("the parameter `{name}` of {subject} is outside of its range: {reason}");
    Diagnostic::new(codes::OUTSIDE_RANGE, message)
}

pub(crate) fn too_many_references(class: &Class) -> Diagnostic {
    Diagnostic::new(
        codes::LINK_LIMIT,
        format!("an instance of `{}` refers to too many others", class.name),
    )
    .note("an instance may reach 4096 others, through 64 references one behind the other")
}

/// The name of a class that does not exist.
pub fn unknown_class<'a>(name: &str, classes: impl IntoIterator<Item = &'a str>) -> Diagnostic {
    let names: Vec<&str> = classes.into_iter().collect();
    let diagnostic = Diagnostic::new(codes::NO_SUCH_CLASS, format!("there is no class `{name}`"));
    match most_similar(name, names.iter().copied()) {
        Some(similar) => diagnostic.help(format!("did you mean `{similar}`?")),
        None if names.is_empty() => diagnostic,
        None => diagnostic.note(format!("there are {}", list(&names))),
    }
}

pub(crate) fn missing_method(class: &Class, method: Method) -> Diagnostic {
    let diagnostic = Diagnostic::new(
        codes::NO_SUCH_METHOD,
        format!("`{}` has no method `{}`", class.name, method.name()),
    );
    let names: Vec<&str> = class.methods.keys().map(|method| method.name()).collect();
    if names.is_empty() {
        diagnostic.note(format!("`{}` has no methods", class.name))
    } else {
        diagnostic.note(format!("it has {}", list(&names)))
    }
}

/// A callback of an engine without machine code.
pub(crate) fn no_machine_code(class: &Class) -> Diagnostic {
    let problem =
        format!("callbacks of `{}` are machine code, and this engine makes none", class.name);
    Diagnostic::new(codes::NO_LLVM, problem).help("make an engine with the backend `jit`")
}

/// A method without code, for a reason that its author can't mend.
pub(crate) fn code_generation(name: &str, reason: &dyn std::fmt::Display) -> Diagnostic {
    Diagnostic::new(codes::CODE_GENERATION, format!("`{name}` can't be compiled: {reason}"))
}

/// A method of which LLVM made no code. `width` is the number of rays that its kernel does at a time.
pub(crate) fn machine_code(name: &str, width: u32, error: &JitError) -> Diagnostic {
    let diagnostic = |code| Diagnostic::new(code, format!("`{name}` can't be compiled: {error}"));
    match error {
        JitError::Frame { function: _, bytes } => too_large_frame(name, width, *bytes),
        JitError::Forked => {
            diagnostic(codes::FORKED).help("fork before compiling, or while no thread compiles")
        }
        JitError::Ending => diagnostic(codes::PROCESS_ENDING),
        JitError::InvalidKernel(_)
        | JitError::Record(_)
        | JitError::InvalidModule(_)
        | JitError::UnknownTarget { .. }
        | JitError::CodeGeneration(_)
        | JitError::UndefinedSymbol(_)
        | JitError::Object(_)
        | JitError::MissingFunction(_)
        | JitError::ForeignTarget(_)
        | JitError::Memory(_) => code_generation(name, error),
    }
}

/// An integrator that is not split into stages.
pub(crate) fn splitting(name: &str, error: &dyn std::fmt::Display) -> Diagnostic {
    let problem = format!("`{name}` can't be split into stages: {error}");
    Diagnostic::new(codes::SPLIT_LIMIT, problem)
}

/// A method that asks the scene, for hosts that can't answer.
pub(crate) fn asks_scene(name: &str, hosts: &str) -> Diagnostic {
    let problem = format!("`{name}` asks the scene, which {hosts} can't answer");
    Diagnostic::new(codes::ASKS_SCENE, problem)
        .help("`rtsl render --integrator Whitted`, or another integrator, answers `shade` of materials")
        .help("`rtsl render` and `rtsl eval --scene` run integrators")
}

/// A method without packet code.
pub(crate) fn lowering(name: &str, error: &LowerError) -> Diagnostic {
    match error {
        LowerError::TooMuchCode(work) => too_much_code(name, *work),
        LowerError::TooMuchMemory(_) => {
            let problem = format!("`{name}` can't be compiled: {error}");
            Diagnostic::new(codes::TOO_MUCH_STACK, problem)
                .help("index fewer or smaller local arrays with what is computed, or keep them in scratch")
        }
        other => code_generation(name, other),
    }
}

fn too_much_code(name: &str, work: u64) -> Diagnostic {
    let problem = format!(
        "`{name}` has {work} operations with all the functions that it calls, where {MAX_WORK} are allowed"
    );
    Diagnostic::new(codes::TOO_MUCH_MACHINE_CODE, problem)
        .note("an access by an index that is computed, and a division of integers, count 16 times")
        .help("repeat work in loops instead of writing it out, by macros or by calls of functions")
}

fn too_large_frame(name: &str, width: u32, bytes: usize) -> Diagnostic {
    let (needed, allowed) = (bytes.div_ceil(1 << 10), MAX_FRAME_BYTES >> 10);
    let rays = if width == 1 { "one ray".to_owned() } else { format!("{width} rays") };
    let problem = format!(
        "`{name}` needs {needed} KiB of stack for {rays} at a time, where {allowed} KiB are allowed"
    );
    let diagnostic = Diagnostic::new(codes::TOO_MUCH_STACK, problem)
        .note("values that are used later wait on the stack, one for each ray: there are too many at a time")
        .help("use values where they are computed, in a loop for example, or keep them in scratch");
    if width == 1 {
        return diagnostic;
    }
    diagnostic.help("kernels for fewer rays at a time need less: `--width 1` needs the least")
}

/// A constructor that used up its budget.
pub(crate) fn endless_constructor(name: &str) -> Diagnostic {
    Diagnostic::new(
        codes::BUDGET_EXHAUSTED,
        format!("`{name}` ran past its budget of loop iterations"),
    )
}

/// A reference that no instance is set for, in the words of a file format, whose users have no text of the class in
/// which a test could be.
pub(crate) fn unset_reference_of_format(wording: &Wording, path: &str) -> Diagnostic {
    let path = wording.parameter(path);
    unset_reference_of(&wording.subject, path).help(format!("set `{path}`"))
}

pub(crate) fn no_llvm(error: &LlvmError) -> Diagnostic {
    let diagnostic = Diagnostic::new(codes::NO_LLVM, error.to_string());
    diagnostic.help("the interpreter needs no LLVM: `--backend interp`")
}

pub(crate) fn interpreter_instead(error: &LlvmError) -> Diagnostic {
    Diagnostic::new(codes::INTERPRETER_INSTEAD, error.to_string())
        .note("everything runs on the interpreter, which is slower by far")
}

pub(crate) fn unknown_interleave(factor: u32) -> Diagnostic {
    Diagnostic::new(
        codes::UNKNOWN_WIDTH,
        format!("there are no kernels for {factor} vectors of rays at a time"),
    )
    .help("they do 1, 2 or 4")
}

pub(crate) fn unknown_width(width: u32) -> Diagnostic {
    Diagnostic::new(
        codes::UNKNOWN_WIDTH,
        format!("there are no kernels for {width} rays at a time"),
    )
    .help("the widths are 1, 4, 8 and 16")
}

fn list(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().take(LISTED).map(|name| format!("`{name}`")).collect();
    match (quoted.as_slice(), names.len() > LISTED) {
        (all, true) => format!("{} and {} more", all.join(", "), names.len() - LISTED),
        ([], false) => String::new(),
        ([only], false) => only.clone(),
        ([all @ .., last], false) => format!("{} and {last}", all.join(", ")),
    }
}
