//! What values are called in the text that a function was made of.

use std::sync::Arc;

use crate::Value;

/// A text among those of some [`Names`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NameText(u32);

/// What a value is called: a variable of the source, or a component of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Name {
    /// The variable.
    pub text: NameText,
    /// Which of its scalars.
    pub component: u16,
    /// How many it has.
    pub len: u16,
    /// Of two names a value keeps the one of lesser rank: a variable that is declared tells more than a parameter or a
    /// result of a function that was inlined.
    pub rank: u8,
}

impl Name {
    /// Ranks below this are of variables that are declared somewhere, others of what functions take and give.
    pub const DECLARED: u8 = 64;
}

/// Names of values, for people who read what is made of a function. They are no part of what it means, so any two are
/// equal, and passes need not keep them.
#[derive(Clone, Debug, Default)]
pub struct Names {
    texts: Vec<Arc<str>>,
    of: Vec<Option<Name>>,
}

impl Names {
    /// Adds a text; the caller sees to it that none is added often.
    pub fn add_text(&mut self, text: impl Into<Arc<str>>) -> NameText {
        self.texts.push(text.into());
        NameText(self.texts.len() as u32 - 1)
    }

    /// Adds the texts of other names: what the others' first is here.
    pub fn add_texts(&mut self, others: &Names) -> u32 {
        let first = self.texts.len() as u32;
        self.texts.extend(others.texts.iter().cloned());
        first
    }

    /// Names a value, unless it has a better name.
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

    /// The name of a value.
    pub fn get(&self, value: Value) -> Option<Name> {
        self.of.get(value.0 as usize).copied().flatten()
    }

    /// Names `new` as `old` is named, unless it has a better name.
    pub fn keep(&mut self, old: Value, new: Value) {
        if let Some(name) = self.get(old) {
            self.set(new, name);
        }
    }

    /// Names a value as one of other names is, whose texts are here from `first` on.
    pub fn copy(&mut self, others: &Names, first: u32, old: Value, new: Value) {
        if let Some(name) = others.get(old) {
            self.set(new, Name { text: NameText(first + name.text.0), ..name });
        }
    }

    /// The same texts, and no value named.
    pub(crate) fn without_values(&self) -> Names {
        Names { texts: self.texts.clone(), of: Vec::new() }
    }

    /// `toOrigin`, `toOrigin.x`, `weights.7`.
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
