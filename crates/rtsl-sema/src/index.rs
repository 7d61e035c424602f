//! The meaning of each name of a text, which the checker notes for editors on request.

use std::collections::HashMap;

use rtsl_source::Span;
use rtsl_spec::builtins::{Overload, ReferenceMethod};
use rtsl_spec::{RayType, Role, StateVariable};

use crate::hir::{Function, FunctionId, Module, Passing, StructId, Type};
use crate::print::type_name;

/// The name that stands for the word that is being typed: the checker notes what could stand in its place. Texts
/// cannot declare it.
pub const CURSOR: &str = "rt_Cursor";

/// The notes about a text and the modules that it uses. Text that is checked several times, such as an inherited
/// method, has several notes.
#[derive(Clone, Debug, Default)]
pub struct Index {
    /// The uses of names, except in declarations.
    pub uses: Vec<Use>,
    /// The calls of functions.
    pub calls: Vec<Call>,
    /// The names that could stand in the place of [`CURSOR`].
    pub completion: Option<Completion>,
    /// The names of fields in the declarations of their structs.
    pub(crate) fields: HashMap<(StructId, u32), Span>,
}

/// The use of a name.
#[derive(Clone, Debug)]
pub struct Use {
    /// The name.
    pub span: Span,
    /// Its meaning.
    pub symbol: Symbol,
    /// The type of the value, or the header of the function, as text.
    pub ty: Option<String>,
}

/// The meaning of a name.
#[derive(Clone, Debug)]
pub enum Symbol {
    /// A declaration in a text: the span of its name, or of the header of a function.
    Declared(Span),
    /// A state variable.
    State(&'static StateVariable),
    /// A built-in function, and the header of the prelude's function that implements it.
    Builtin(&'static str, Option<Span>),
    /// A method that is called through a reference.
    Method(&'static ReferenceMethod),
    /// A role.
    Role(Role),
    /// A type of the language.
    Type(String),
    /// A kind of ray.
    RayType(RayType),
}

/// The call of a function.
#[derive(Clone, Debug)]
pub struct Call {
    /// The name of the function.
    pub name: Span,
    /// The functions of this name that could be meant, the nearest first.
    pub candidates: Vec<Callee>,
}

/// A function that a call could mean.
#[derive(Clone, Copy, Debug)]
pub enum Callee {
    /// A function of the module.
    Function(FunctionId),
    /// A form of a built-in function.
    Builtin(&'static Overload),
}

/// The header of a function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signature {
    /// The header as text.
    pub text: String,
    /// The ranges of the parameters in the text.
    pub parameters: Vec<std::ops::Range<usize>>,
    /// The documentation.
    pub documentation: Option<String>,
}

impl Signature {
    /// The header of a function of this module, or of the language.
    pub fn of(module: &Module, callee: Callee) -> Signature {
        match callee {
            Callee::Function(id) => {
                Signature::of_function(module, &module.functions[id.0 as usize])
            }
            Callee::Builtin(overload) => Signature::of_builtin(overload),
        }
    }

    /// A header whose parts before the parenthesis and inside it are these.
    pub fn from_parts(
        before: &str,
        parts: impl Iterator<Item = String>,
        documentation: Option<&str>,
    ) -> Signature {
        let mut text = format!("{before}(");
        let mut parameters = Vec::new();
        for part in parts {
            if !parameters.is_empty() {
                text.push_str(", ");
            }
            parameters.push(text.len()..text.len() + part.len());
            text.push_str(&part);
        }
        text.push(')');
        Signature { text, parameters, documentation: documentation.map(str::to_owned) }
    }

    fn of_function(module: &Module, function: &Function) -> Signature {
        let locals = function.parameters.iter().zip(&function.locals);
        let parts = locals.map(|(passing, local)| {
            let passing = match passing {
                Passing::In => "",
                Passing::Out => "out ",
                Passing::InOut => "inout ",
            };
            let part = format!("{passing}{} {}", type_name(module, &local.ty), local.name);
            part.trim_end().to_owned()
        });
        let before = format!("{} {}", type_name(module, &function.result), function.name);
        Signature::from_parts(&before, parts, function.documentation.as_deref())
    }

    fn of_builtin(overload: &Overload) -> Signature {
        let shown = overload.to_string();
        let (before, rest) = shown.split_once('(').unwrap_or((&shown, ")"));
        let parts = rest.trim_end_matches(')').split(", ").filter(|part| !part.is_empty());
        Signature::from_parts(before, parts.map(str::to_owned), Some(overload.builtin.doc))
    }
}

/// The names that could stand at a place of a text.
#[derive(Clone, Debug)]
pub struct Completion {
    /// The place.
    pub place: CompletionPlace,
    /// The names that are visible there, the innermost first.
    pub names: Vec<VisibleName>,
    /// The roles of the class around it.
    pub roles: Vec<Role>,
}

/// A place at which a name is typed.
#[derive(Clone, Debug)]
pub enum CompletionPlace {
    /// A value, or the beginning of a statement.
    Value,
    /// A type, or the beginning of a declaration.
    Type,
    /// A base of a class.
    Base,
    /// A part of a value of this type, or a method of it, after a dot.
    Part {
        /// The type.
        ty: Type,
        /// The type as text.
        shown: String,
        /// The fields of a struct, with their types.
        fields: Vec<(String, String)>,
    },
    /// A name of this module, after a dot; the visible names have it before the dot.
    Module(String),
    /// A function of the classes above, after `super.`.
    Inherited(Vec<Signature>),
}

/// A visible name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VisibleName {
    /// The name.
    pub name: String,
    /// The kind of what it denotes, with an article: "a member".
    pub kind: &'static str,
    /// Its type, or the header of a function, as text.
    pub ty: Option<String>,
    /// Its declaration.
    pub span: Span,
}
