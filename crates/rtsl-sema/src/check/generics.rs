//! Generic functions: `genType f(genType a, float b)`.
//!
//! The types `genType`, `genIType`, `genUType` and `genBType` stand for a scalar and for vectors of 2 to 4
//! components, as in the GLSL specification: all of them in one function have the same size. Such a function is
//! four overloads, its instances. The body of an instance is checked if the text calls it, after the function that
//! contains the call.

use rtsl_ir::Scalar;
use rtsl_source::{Diagnostic, diagnostic_codes as codes};
use rtsl_syntax::ast;

use super::Checker;
use crate::hir::{ClassId, FunctionId, Type};

/// The greatest number of components.
const MAX_SIZE: u8 = 4;

/// A generic function.
#[derive(Debug)]
pub(super) struct Generic<'a> {
    /// The declaration with the body, if there is one.
    ast: &'a ast::Function,
    generation: usize,
    class: Option<ClassId>,
    /// The module that declares it.
    home: Option<usize>,
    /// The header as the text has it.
    written: String,
}

/// The data of an instance of a generic function.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instance {
    /// The index of the generic function in the checker.
    generic: usize,
    /// The number of components.
    size: u8,
    /// True if its body is checked, or will be.
    pub(super) wanted: bool,
}

/// The scalar of a generic type.
fn scalar_of(name: &str) -> Option<Scalar> {
    match name {
        "genType" => Some(Scalar::F32),
        "genIType" => Some(Scalar::I32),
        "genUType" => Some(Scalar::U32),
        "genBType" => Some(Scalar::Bool),
        _ => None,
    }
}

/// True for the names of generic types.
pub(super) fn is_generic_name(name: &str) -> bool {
    scalar_of(name).is_some()
}

impl<'a> Checker<'a> {
    /// The type that the name of a generic type has in the instance being checked.
    pub(super) fn generic_type(&self, name: &str) -> Option<Type> {
        let (scalar, size) = (scalar_of(name)?, self.generic_size?);
        Some(if size == 1 { Type::Scalar(scalar) } else { Type::Vector(scalar, size) })
    }

    /// True if a type in the function's header is generic.
    pub(super) fn is_generic(&self, function: &ast::Function) -> bool {
        let parameters = function.parameters.iter().map(|parameter| &parameter.ty);
        parameters.chain(&function.result).any(|ty| self.is_generic_type(ty))
    }

    fn is_generic_type(&self, ty: &ast::TypeName) -> bool {
        is_generic_name(&ty.name.name) && self.find(&ty.name.name).is_none()
    }

    /// Declares the instances of a generic function.
    pub(super) fn declare_generic(&mut self, function: &'a ast::Function, generation: usize) {
        if !function.parameters.iter().any(|parameter| self.is_generic_type(&parameter.ty)) {
            let span = function.result.as_ref().map_or(function.span, |result| result.span);
            self.report(
                Diagnostic::new(
                    codes::BAD_GENERIC,
                    format!(
                        "the arguments of `{}` do not determine its result",
                        function.name.name
                    ),
                )
                .at(span, "no parameter has a generic type")
                .help("give a parameter a generic type, or overload the function for each type"),
            );
            self.declare_poisoned(&function.name);
            return;
        }
        let generic = self.generics.len();
        self.generics.push(Generic {
            ast: function,
            generation,
            class: self.class.as_ref().map(|class| class.id),
            home: self.modules.home(),
            written: written(function),
        });
        for size in 1..=MAX_SIZE {
            self.generic_size = Some(size);
            if let Some(id) = self.declare_function(function, None, generation) {
                let earlier = self.function_info[id.0 as usize].instance;
                let wanted = earlier.is_some_and(|instance| instance.wanted);
                self.function_info[id.0 as usize].instance =
                    Some(Instance { generic, size, wanted });
                // A call of the prototype has wanted the body, which is here.
                if wanted && function.body.is_some() {
                    self.wanted_instances.push(id);
                }
            }
            self.generic_size = None;
        }
    }

    /// The header of the generic function of which a function is an instance.
    pub(super) fn written_generic(&self, id: FunctionId) -> Option<&str> {
        let instance = self.function_info[id.0 as usize].instance?;
        Some(&self.generics[instance.generic].written)
    }

    /// Notes that the body of an instance is to be checked.
    pub(super) fn want_instance(&mut self, id: FunctionId) {
        if let Some(instance) = &mut self.function_info[id.0 as usize].instance
            && !std::mem::replace(&mut instance.wanted, true)
        {
            self.wanted_instances.push(id);
        }
    }

    /// Checks the bodies of wanted instances that belong to this place: the class being checked, or the file.
    pub(super) fn check_instances(&mut self) {
        let place = self.class.as_ref().map(|class| class.id);
        let mut others = Vec::new();
        while let Some(id) = self.wanted_instances.pop() {
            let instance = self.function_info[id.0 as usize].instance;
            let Some(Instance { generic, size, .. }) = instance else { continue };
            let Generic { ast, generation, class, home, .. } = self.generics[generic];
            if class != place {
                others.push(id);
                continue;
            }
            let outer = std::mem::replace(&mut self.silent, generation > 0);
            self.generic_size = Some(size);
            self.instance_shown = Some(self.show_function(id));
            self.with_names_of(home, |checker| checker.check_function_body(ast, id));
            (self.silent, self.generic_size, self.instance_shown) = (outer, None, None);
        }
        self.wanted_instances = others;
    }
}

/// Formats the header as the text has it.
fn written(function: &ast::Function) -> String {
    let ty = |ty: &ast::TypeName| format!("{}{}", ty.name.name, "[]".repeat(ty.sizes.len()));
    let parameters: Vec<String> = (function.parameters.iter())
        .map(|parameter| match &parameter.name {
            Some(name) => format!("{} {}", ty(&parameter.ty), name.name),
            None => ty(&parameter.ty),
        })
        .collect();
    let result = function.result.as_ref().map_or("void".to_owned(), ty);
    format!("`{result} {}({})`", function.name.name, parameters.join(", "))
}
