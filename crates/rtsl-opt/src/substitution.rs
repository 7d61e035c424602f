//! Substitution of values.

use rtsl_ir::{IndexVec, Names, OpKind, Region, Value, Values};

/// A map from values to their replacements. Made in the order of the text, so that a value's substitute is known before
/// its first use.
#[derive(Debug, Default)]
pub(crate) struct Substitution {
    substitutes: IndexVec<Value, Option<Value>>,
}

impl Substitution {
    /// Replaces `old` by the substitute of `new`.
    pub fn set(&mut self, old: Value, new: Value) {
        let new = self.get(new);
        self.substitutes.insert(old, Some(new), None);
    }

    /// Replaces all results of an operation.
    pub fn set_all(&mut self, old: Values, new: impl IntoIterator<Item = Value>) {
        for (old, new) in old.iter().zip(new) {
            self.set(old, new);
        }
    }

    /// Removes the substitute of `old` from here on.
    pub fn unset(&mut self, old: Value) {
        self.substitutes[old] = None;
    }

    /// Returns the substitute of `value`, or `value` if it has none.
    pub fn get(&self, value: Value) -> Value {
        self.substitutes.get(value).copied().flatten().unwrap_or(value)
    }

    /// Gives substitutes the names of the values they replace, unless they have a name of lower rank.
    pub fn keep_names(&self, names: &mut Names) {
        for (old, new) in (0..).map(Value).zip(self.substitutes.iter()) {
            if let Some(new) = new {
                names.keep(old, *new);
            }
        }
    }

    /// Substitutes the operands of an operation, but not in its regions.
    pub fn apply_to_operands(&self, kind: &mut OpKind) {
        kind.for_each_operand_mut(|value| *value = self.get(*value));
    }

    /// Substitutes the yields of a region, but not in its operations.
    pub fn apply_to_yields(&self, region: &mut Region) {
        region.yields.iter_mut().for_each(|value| *value = self.get(*value));
    }
}
