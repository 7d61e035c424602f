//! The values of places while an instance is made.

use std::collections::BTreeMap;

use rtsl_ir::host::NoHost;
use rtsl_ir::{Function, Interpreter, Place, PlaceId, PlaceKind, Storage};
use rtsl_source::Diagnostic;

use crate::parameters::Words;
use crate::{errors, nesting};

/// The scalars of members, constructor parameters and buffers, by name.
#[derive(Clone, Debug, Default)]
pub(crate) struct Environment {
    values: BTreeMap<(PlaceKind, String), Vec<u32>>,
    /// Those of buffers, which are shared where they can be: meshes have millions.
    buffers: BTreeMap<String, Words>,
}

impl Environment {
    /// Sets the scalars of a place that is no buffer.
    pub fn set(&mut self, kind: PlaceKind, name: &str, words: &[u32]) {
        self.values.insert((kind, name.to_owned()), words.to_vec());
    }

    /// Sets the scalars of a buffer.
    pub fn set_buffer(&mut self, name: &str, words: Words) {
        self.buffers.insert(name.to_owned(), words);
    }

    /// The scalars of a member; zeros where nobody set it.
    pub fn take(&mut self, place: &Place) -> Vec<u32> {
        let key = (place.kind, place.name.clone());
        let mut words = self.values.remove(&key).unwrap_or_default();
        words.resize(place.len as usize, 0);
        words
    }

    /// Runs a linked initialiser or constructor, which reads places and then sets others.
    ///
    /// # Errors
    /// Where it is not linked, or ran past its budget.
    pub fn run(&mut self, function: &Function) -> Result<(), Diagnostic> {
        let interpreter = nesting::bear_function(function, || Interpreter::prepare(function));
        let mut interpreter =
            interpreter.map_err(|error| errors::code_generation(&function.name, &error))?;
        let mut storage = FunctionStorage {
            places: &function.places,
            values: function.places.iter().map(|place| self.stored(place)).collect(),
        };
        let outcome = interpreter.run(0, &mut storage, &mut NoHost);
        if outcome.budget_exceeded {
            return Err(errors::endless_constructor(&function.name));
        }
        let values = storage.values;
        for (place, words) in function.places.iter().zip(values) {
            if matches!(place.kind, PlaceKind::Member | PlaceKind::Parameter) {
                self.set(place.kind, &place.name, words.as_slice());
            }
        }
        Ok(())
    }

    /// The scalars of a place that is no buffer; zeros where nobody set it.
    pub fn words(&self, place: &Place) -> Vec<u32> {
        let known = self.values.get(&(place.kind, place.name.clone()));
        let mut words = known.cloned().unwrap_or_default();
        words.resize(place.len as usize, 0);
        words
    }

    fn stored(&self, place: &Place) -> Words {
        if place.kind != PlaceKind::Buffer {
            return Words::Owned(self.words(place));
        }
        self.buffers.get(&place.name).cloned().unwrap_or(Words::Owned(Vec::new()))
    }
}

struct FunctionStorage<'a> {
    places: &'a [Place],
    /// In the order of the places.
    values: Vec<Words>,
}

impl Storage for FunctionStorage<'_> {
    fn load(&self, place: PlaceId, index: u32) -> u32 {
        self.values[place.0 as usize].as_slice().get(index as usize).copied().unwrap_or(0)
    }

    fn elements(&self, buffer: PlaceId) -> u32 {
        let place = buffer.0 as usize;
        self.values[place].as_slice().len() as u32 / self.places[place].len.max(1)
    }

    fn store(&mut self, place: PlaceId, component: u32, bits: u32) {
        // Buffers are not written to.
        if let Words::Owned(words) = &mut self.values[place.0 as usize]
            && let Some(word) = words.get_mut(component as usize)
        {
            *word = bits;
        }
    }
}
