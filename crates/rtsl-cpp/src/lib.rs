//! C++ text from the single-ray representation: for people to read, and for hosts that have a compiler of their own; and C
//! headers of what is compiled ahead of time.
//!
//! [`emit`] writes a header of C++17 that stands alone. A class becomes a struct whose fields are the words of its
//! block, and each of its methods a member function on the state of one ray. Names and comments of the shader are
//! kept where they can be. The text computes the same bits as the interpreter, whatever compiler builds it, as long as
//! nobody asks that compiler for fast mathematics: what C++ leaves open (overflow, conversions, contraction) is said.
//!
//! | file | what it does |
//! |---|---|
//! | `class`, `state`, `support` | what stands around methods |
//! | `export` | kernels and tables, for hosts that find classes by name |
//! | `method`, `operation`, `request`, `uses` | functions to statements |
//! | `statement`, `expression` | statements to lines |
//! | `kernel_header`, `library_header` | C headers of libraries of either kind |
//! | `identifier`, `class_names`, `literal`, `comment` | what may stand in them |
//!
//! This crate knows the single-ray representation and how data is laid out, no packet code and no syntax. Shader text
//! is not trusted: none of its names or comments can become anything else.

mod class;
mod class_names;
mod comment;
mod export;
mod expression;
mod identifier;
mod kernel_header;
mod library_header;
mod literal;
mod method;
mod operation;
mod request;
mod state;
mod statement;
mod support;
mod uses;
mod while_loop;

use std::collections::BTreeSet;

use rtsl_abi::description::LibraryDescription;
use rtsl_ir::Function;
use rtsl_spec::{COLOR_COMPONENTS, Method};

use crate::class_names::reserved;

pub use kernel_header::kernel_header;
pub use library_header::library_header;

/// The functions of a class, linked and optimised.
#[derive(Clone, Debug, Default)]
pub struct ClassCode<'a> {
    /// The constructors of the classes behind it, then its own: they read parameters and members and give members, all
    /// under the names of the description's fields.
    pub constructors: Vec<&'a Function>,
    /// Its methods.
    pub methods: Vec<(Method, &'a Function)>,
}

/// The text of a library, with the code of each of its classes in their order.
///
/// # Panics
/// If a function has not been linked, or has data that its class's description lacks.
pub fn emit(library: &LibraryDescription, classes: &[ClassCode<'_>]) -> String {
    let mut scope = reserved();
    let mut helpers = BTreeSet::new();
    let mut structs = String::new();
    let mut exported = Vec::new();
    for (description, code) in library.classes.iter().zip(classes) {
        let name = scope.name(&description.name);
        exported.push(class::write_class(&name, description, code, &mut helpers, &mut structs));
    }
    // Guarded by name, since the file is compiled by itself, too.
    let guard = format!("{}_CLASSES_H", library.prefix.to_uppercase());
    let mut text = format!(
        "// Made by rtsl of shaders. Changes will be lost when it is made again.\n#ifndef {guard}\n#define {guard}\n"
    );
    text.push_str(support::PREAMBLE);
    let namespace = identifier::identifier(&library.prefix);
    text.push_str(&format!("\nnamespace {namespace} {{\n"));
    support::write_helpers(&helpers, &mut text);
    state::write_state(library, classes, &mut text);
    if state::asks_host(classes) {
        text.push_str(&request::HOST.replace("COLORS", &COLOR_COMPONENTS.to_string()));
    }
    text.push_str(&structs);
    text.push_str(&format!("\n}} // namespace {namespace}\n"));
    export::write_export(library, &exported, state::has_budget(classes), &mut text);
    text.push_str(support::END);
    text.push_str(&format!("\n#endif // {guard}\n"));
    text
}
