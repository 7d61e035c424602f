//! The C++ names of a class's data.

use std::collections::BTreeMap;

use rtsl_abi::description::{ClassDescription, Field, FieldKind};
use rtsl_ir::{Variable, VariableKind};
use rtsl_spec::Method;

use crate::identifier::{Scope, identifier};
use crate::support::Helper;

/// Names with a meaning within classes.
const RESERVED: &[&str] = &[
    "State",
    "Host",
    "LightSample",
    "Scratch",
    "Parameters",
    "construct",
    "state",
    "scratch",
    "host",
    "parameters",
    "budget_exceeded",
    "std",
    "math",
    "memcpy",
];

/// The names of a class's fields, and other names that are used in its scope.
#[derive(Debug)]
pub(crate) struct ClassNames {
    fields: BTreeMap<(FieldKind, String), String>,
    scope: Scope,
}

impl ClassNames {
    /// Assigns names to the fields of a class that is named `class` in C++.
    pub fn new(class: &str, description: &ClassDescription) -> ClassNames {
        let mut scope = reserved();
        scope.reserve([class]);
        // Integrators have no class in C++ (E0707), so a local variable may be named `radiance`.
        let methods = Method::ALL.iter().filter(|method| **method != Method::Radiance);
        scope.reserve(methods.map(|method| method.name()));
        let mut names = ClassNames { fields: BTreeMap::new(), scope };
        for field in description.fields.iter().chain(&description.scratch) {
            let key = (field.kind, field.name.clone());
            let name = names.scope.name(&field.name);
            names.fields.insert(key, name);
        }
        names
    }

    /// Returns the name of a field.
    pub fn of(&self, field: &Field) -> &str {
        &self.fields[&(field.kind, field.name.clone())]
    }

    /// Returns the name of the field of a variable.
    ///
    /// # Panics
    /// If the class's description lacks the variable.
    pub fn field(&self, variable: &Variable) -> &str {
        let kind = match variable.kind {
            VariableKind::Member => FieldKind::Member,
            VariableKind::Buffer => FieldKind::Buffer,
            VariableKind::Parameter => FieldKind::Parameter,
            VariableKind::Scratch => FieldKind::Scratch,
            VariableKind::State | VariableKind::Local | VariableKind::Accepted => {
                unreachable!("only data of the class has fields")
            }
        };
        let name = self.fields.get(&(kind, variable.name.clone()));
        name.unwrap_or_else(|| panic!("the description has {}", variable.name))
    }

    /// Returns the name of a state variable.
    pub fn state(&self, name: &str) -> String {
        identifier(name)
    }

    /// Returns the scope of a method.
    pub fn scope(&self) -> &Scope {
        &self.scope
    }
}

/// Returns a scope with the names around classes.
pub(crate) fn reserved() -> Scope {
    let mut scope = Scope::default();
    scope.reserve(RESERVED.iter().copied().chain(Helper::names()));
    scope
}
