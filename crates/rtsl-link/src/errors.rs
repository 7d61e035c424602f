//! The diagnostics of linking, one function each.

use rtsl_ir::class::Class;
use rtsl_source::{Diagnostic, diagnostic_codes as codes};
use rtsl_spec::{COLOR_COMPONENTS, MAX_ATTRIBUTE_SCALARS};

/// A reference that a method of a class calls through and that no instance is set for.
pub fn unset_reference(class: &str, path: &str) -> Diagnostic {
    let help = format!("set `{path}`, or test it with `isSet({path})`");
    unset_reference_of(&format!("`{class}`"), path).help(help)
}

/// The same of something that a message calls `subject`, without a remedy.
pub fn unset_reference_of(subject: &str, path: &str) -> Diagnostic {
    Diagnostic::new(
        codes::UNSET_REFERENCE,
        format!("the reference `{path}` of {subject} is used but not set"),
    )
    .note("a call through it gives the defaults of its role: black, zero")
}

/// A function that passes a limit of linking.
pub(crate) fn link_limit(name: &str, problem: &str) -> Diagnostic {
    Diagnostic::new(
        codes::LINK_LIMIT,
        format!("`{name}`, linked with the methods it calls, {problem}"),
    )
    .help("shorten the method, or refer to fewer or simpler instances")
}

/// A scene whose objects have attributes of so many scalars.
pub(crate) fn too_many_attributes(scalars: u32) -> Diagnostic {
    let problem = format!("the attributes of the scene's objects have {scalars} numbers in all");
    Diagnostic::new(codes::TOO_MANY_ATTRIBUTES, problem)
        .note(format!(
            "the limit is {MAX_ATTRIBUTE_SCALARS}; a colour counts as {COLOR_COMPONENTS}"
        ))
        .help("give attributes of the same meaning the same name and default value in all shaders")
}

/// A state variable that no method sets at hits.
pub(crate) fn unset_at_hits(class: &Class, variable: &str) -> Diagnostic {
    Diagnostic::new(
        codes::NO_SUCH_METHOD,
        format!("`{}` has no method that sets `{variable}` where a ray has hit", class.name),
    )
}
