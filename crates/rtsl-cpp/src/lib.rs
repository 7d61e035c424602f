//! Generation of C++ from the single-ray representation, for reading and for hosts that have a compiler, and of C
//! headers for libraries compiled ahead of time.
//!
//! [`emit`] writes a self-contained header of C++17. A class becomes a struct whose fields are the words of its block,
//! and each of its methods a member function on the state of one ray. Names and comments of the shader are preserved if
//! possible. The text computes the same bits as the interpreter with any compiler, except with fast mathematics:
//! behaviour that C++ leaves open (overflow, conversions, contraction) is specified.
//!
//! | file | content |
//! |---|---|
//! | `class`, `state`, `support` | the code around methods |
//! | `export` | kernels and tables, for hosts that find classes by name |
//! | `method`, `operation`, `request`, `uses` | functions to statements |
//! | `statement`, `expression` | statements to lines |
//! | `kernel_header`, `library_header` | C headers of both kinds of libraries |
//! | `identifier`, `class_names`, `literal`, `comment` | valid identifiers, literals and comments |
//!
//! This crate depends on the single-ray representation and the layout of data, but not on packet code or syntax. Shader
//! text is untrusted: its names and comments cannot be interpreted as other code.

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
    /// The constructors of the referenced classes, then that of the class: they read parameters and members and store
    /// members, all under the names of the description's fields.
    pub constructors: Vec<&'a Function>,
    /// The methods.
    pub methods: Vec<(Method, &'a Function)>,
}

/// Returns the text of a library, with the code of each of its classes in order.
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
    // An include guard by name, since the file is also compiled by itself.
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
