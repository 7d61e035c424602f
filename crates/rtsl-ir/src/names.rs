//! Names and places of values in the source text from which a function was made.

use std::sync::Arc;

use crate::place::Places;
use crate::{Place, Source, Value};

/// The index of a text in a [`Names`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NameText(u32);

/// The name of a value: a variable of the source, or a component of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Name {
    /// The variable.
    pub text: NameText,
    /// The index of the component.
    pub component: u16,
    /// The number of components of the variable.
    pub len: u16,
    /// The rank; of two names a value keeps the one of lower rank. A declared variable is more informative than a
    /// parameter or a result of an inlined function.
    pub rank: u8,
}

impl Name {
    /// Ranks below this belong to declared variables, the others to parameters and results of functions.
    pub const DECLARED: u8 = 64;
}

/// Names of values, for readers of generated code, and in traced functions their places. They do not affect semantics:
/// any two `Names` compare equal, and passes need not preserve them.
#[derive(Clone, Debug, Default)]
pub struct Names {
    texts: Vec<Arc<str>>,
    of: Vec<Option<Name>>,
    places: Places,
}

impl Names {
    /// Adds a text; the caller avoids adding the same text often.
    pub fn add_text(&mut self, text: impl Into<Arc<str>>) -> NameText {
        self.texts.push(text.into());
        NameText(self.texts.len() as u32 - 1)
    }

    /// Adds the texts of other names and returns the index here of their first.
    pub fn add_texts(&mut self, others: &Names) -> u32 {
        let first = self.texts.len() as u32;
        self.texts.extend(others.texts.iter().cloned());
        first
    }

    /// Names a value, unless it has a name of lower rank.
    pub fn set(&mut self, value: Value, name: Name) {
        let index = value.0 as usize;
        if self.of.len() <= index {
            self.of.resize(index + 1, None);
        }
        let known = &mut self.of[index];
        if known.is_none_or(|known| name.rank < known.rank) {
            *known = Some(name);
        }
    }

    /// Returns the name of a value.
    pub fn get(&self, value: Value) -> Option<Name> {
        self.of.get(value.0 as usize).copied().flatten()
    }

    /// Gives `new` the name of `old`, unless it has a name of lower rank.
    pub fn keep(&mut self, old: Value, new: Value) {
        if let Some(name) = self.get(old) {
            self.set(new, name);
        }
        if let Some(place) = self.place(old) {
            self.set_place(new, &place);
        }
    }

    /// Sets the place of a value, unless it has one.
    pub fn set_place(&mut self, value: Value, place: &Place) {
        self.places.set(value, place);
    }

    /// Returns the texts in which values have places.
    pub fn sources(&self) -> &[Arc<Source>] {
        self.places.sources()
    }

    /// Returns the place of a value, if it is known.
    pub fn place(&self, value: Value) -> Option<Place> {
        self.places.get(value)
    }

    /// Copies the name and the place of a value of other names, whose texts start at `first` here.
    pub fn copy(&mut self, others: &Names, first: u32, old: Value, new: Value) {
        if let Some(name) = others.get(old) {
            self.set(new, Name { text: NameText(first + name.text.0), ..name });
        }
        if let Some(place) = others.place(old) {
            self.set_place(new, &place);
        }
    }

    /// Returns the same texts with no value named.
    pub(crate) fn without_values(&self) -> Names {
        Names { texts: self.texts.clone(), ..Names::default() }
    }

    /// Formats a name: `toOrigin`, `toOrigin.x`, `weights.7`.
    pub fn written(&self, name: Name) -> String {
        let text = &self.texts[name.text.0 as usize];
        let component = name.component;
        match name.len {
            1 => text.to_string(),
            2..=4 => format!("{text}.{}", ["x", "y", "z", "w"][usize::from(component.min(3))]),
            _ => format!("{text}.{component}"),
        }
    }
}

impl PartialEq for Names {
    fn eq(&self, _: &Names) -> bool {
        true
    }
}
