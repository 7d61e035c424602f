//! A function body that is being copied.

use rtsl_ir::class::Class;
use rtsl_ir::{Function, Index, IndexVec, StateComponent, Value, Variable, VariableId};

use crate::class_tree::ClassTree;

/// A function body that is being copied into a [draft](crate::Draft).
pub struct Site<'a> {
    /// The class of the function, with the classes that it refers to; `None` for a method that is linked already.
    pub tree: Option<&'a ClassTree>,
    /// The function.
    pub function: &'a Function,
    /// The path to the instance: `""`, or `kd.`.
    pub prefix: String,
    /// True for the function that is linked itself.
    pub is_root: bool,
    /// State that differs from that of the call; of several values of a component the last counts.
    pub overrides: Vec<(StateComponent, Value)>,
    pub(crate) values: IndexVec<Value, Option<Value>>,
    pub(crate) variables: IndexVec<VariableId, Option<VariableId>>,
    /// The index of the function's first name in the draft.
    pub(crate) first_text: u32,
}

impl<'a> Site<'a> {
    /// Begins to copy a function into `out`. The names of its variables with storage of their own begin with `prefix`.
    pub fn new(
        tree: Option<&'a ClassTree>,
        function: &'a Function,
        prefix: String,
        out: &mut Function,
    ) -> Site<'a> {
        Site {
            first_text: out.names.add_texts(&function.names),
            tree,
            function,
            is_root: prefix.is_empty(),
            prefix,
            overrides: Vec::new(),
            values: IndexVec::filled(function.values.len(), None),
            variables: IndexVec::filled(function.variables.len(), None),
        }
    }

    /// Returns the name in the draft of a variable with storage of its own.
    pub fn name_of(&self, variable: &Variable) -> String {
        format!("{}{}", self.prefix, variable.name)
    }

    /// Returns the copy of a value.
    ///
    /// # Panics
    /// If the operation that defines it has not been copied.
    pub fn value(&self, value: Value) -> Value {
        self.values[value].expect("the verifier saw values defined before their use")
    }

    /// Returns the copy of an index.
    pub fn index(&self, index: Index) -> Index {
        match index {
            Index::Constant(index) => Index::Constant(index),
            Index::Dynamic(index) => Index::Dynamic(self.value(index)),
        }
    }

    /// The class of a function that is not linked yet.
    pub(crate) fn class(&self) -> &'a Class {
        &self.tree.expect("linked methods have no references").class
    }

    pub(crate) fn define(&mut self, value: Value, new: Value) {
        self.values[value] = Some(new);
    }
}

/// Returns the value of a component of state among some that differ from a call's.
pub fn find_override(
    overrides: &[(StateComponent, Value)],
    wanted: StateComponent,
) -> Option<Value> {
    overrides.iter().rev().find(|(component, _)| *component == wanted).map(|(_, value)| *value)
}
