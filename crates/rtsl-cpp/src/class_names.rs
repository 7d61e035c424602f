//! What a class's data is called in C++.

use std::collections::BTreeMap;

use rtsl_abi::description::{ClassDescription, Field, FieldKind};
use rtsl_ir::{Variable, VariableKind};
use rtsl_spec::Method;

use crate::identifier::{Scope, identifier};
use crate::support::Helper;

/// Names that mean something within classes.
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

/// The names of a class's fields, and those that are taken beside them.
#[derive(Debug)]
pub(crate) struct ClassNames {
    fields: BTreeMap<(FieldKind, String), String>,
    scope: Scope,
}

impl ClassNames {
    /// Names for the fields of a class that is called `class` in C++.
    pub fn new(class: &str, description: &ClassDescription) -> ClassNames {
        let mut scope = reserved();
        scope.reserve([class]);
        scope.reserve(Method::ALL.iter().map(|method| method.name()));
        let mut names = ClassNames { fields: BTreeMap::new(), scope };
        for field in description.fields.iter().chain(&description.scratch) {
            let key = (field.kind, field.name.clone());
            let name = names.scope.name(&field.name);
            names.fields.insert(key, name);
        }
        names
    }

    /// The name of a field.
    pub fn of(&self, field: &Field) -> &str {
        &self.fields[&(field.kind, field.name.clone())]
    }

    /// The name of the field that a place is.
    ///
    /// # Panics
    /// If the class's description lacks the place.
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

    /// The name of a state variable.
    pub fn state(&self, name: &str) -> String {
        identifier(name)
    }

    /// The names that a method can't give to anything of its own.
    pub fn scope(&self) -> &Scope {
        &self.scope
    }
}

/// A scope with what stands around classes.
pub(crate) fn reserved() -> Scope {
    let mut scope = Scope::default();
    scope.reserve(RESERVED.iter().copied().chain(Helper::names()));
    scope
}
