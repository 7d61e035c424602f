//! The values of variables while an instance is made.

use std::collections::BTreeMap;

use rtsl_ir::host::NoHost;
use rtsl_ir::{Function, Interpreter, Storage, Variable, VariableId, VariableKind};
use rtsl_source::Diagnostic;

use super::words::Words;
use crate::{errors, nesting};

/// The scalars of members, constructor parameters and buffers, by name.
#[derive(Clone, Debug, Default)]
pub(crate) struct Environment {
    values: BTreeMap<(VariableKind, String), Vec<u32>>,
    /// The scalars of buffers, shared if possible: meshes have millions.
    buffers: BTreeMap<String, Words>,
}

impl Environment {
    /// Sets the scalars of a variable other than a buffer.
    pub fn set(&mut self, kind: VariableKind, name: &str, words: &[u32]) {
        self.values.insert((kind, name.to_owned()), words.to_vec());
    }

    /// Sets the scalars of a buffer.
    pub fn set_buffer(&mut self, name: &str, words: Words) {
        self.buffers.insert(name.to_owned(), words);
    }

    /// Removes and returns the scalars of a member; zeros if it was not set.
    pub fn take(&mut self, variable: &Variable) -> Vec<u32> {
        let key = (variable.kind, variable.name.clone());
        let mut words = self.values.remove(&key).unwrap_or_default();
        words.resize(variable.len as usize, 0);
        words
    }

    /// Runs a linked initialiser or constructor.
    ///
    /// # Errors
    /// If the function is not linked, or used up its budget.
    pub fn run(&mut self, function: &Function) -> Result<(), Diagnostic> {
        let interpreter =
            nesting::with_stack_for(function.nesting(), || Interpreter::prepare(function));
        let mut interpreter =
            interpreter.map_err(|error| errors::code_generation(&function.name, &error))?;
        let mut storage = FunctionStorage {
            variables: &function.variables,
            values: function.variables.iter().map(|variable| self.stored(variable)).collect(),
        };
        let outcome = interpreter.run(0, &mut storage, &mut NoHost);
        if outcome.budget_exceeded {
            return Err(errors::endless_constructor(&function.name));
        }
        let values = storage.values;
        for (variable, words) in function.variables.iter().zip(values) {
            if matches!(variable.kind, VariableKind::Member | VariableKind::Parameter) {
                self.set(variable.kind, &variable.name, words.as_slice());
            }
        }
        Ok(())
    }

    /// Returns the scalars of a variable other than a buffer; zeros if it was not set.
    pub fn words(&self, variable: &Variable) -> Vec<u32> {
        let known = self.values.get(&(variable.kind, variable.name.clone()));
        let mut words = known.cloned().unwrap_or_default();
        words.resize(variable.len as usize, 0);
        words
    }

    fn stored(&self, variable: &Variable) -> Words {
        if variable.kind != VariableKind::Buffer {
            return Words::Owned(self.words(variable));
        }
        self.buffers.get(&variable.name).cloned().unwrap_or(Words::Owned(Vec::new()))
    }
}

struct FunctionStorage<'a> {
    variables: &'a [Variable],
    /// In the order of the variables.
    values: Vec<Words>,
}

impl Storage for FunctionStorage<'_> {
    fn load(&self, variable: VariableId, index: u32) -> u32 {
        self.values[variable.0 as usize].as_slice().get(index as usize).copied().unwrap_or(0)
    }

    fn elements(&self, buffer: VariableId) -> u32 {
        let variable = buffer.0 as usize;
        self.values[variable].as_slice().len() as u32 / self.variables[variable].len.max(1)
    }

    fn store(&mut self, variable: VariableId, component: u32, bits: u32) {
        // Buffers are not written to.
        if let Words::Owned(words) = &mut self.values[variable.0 as usize]
            && let Some(word) = words.get_mut(component as usize)
        {
            *word = bits;
        }
    }
}
