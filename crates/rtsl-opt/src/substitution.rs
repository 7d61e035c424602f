//! Values that stand for others.

use rtsl_ir::{Names, OpKind, Region, Value, Values};

/// Which values are to be used instead of others. Made in the order of the text, so that a
/// value's substitute is known before its first use.
#[derive(Debug, Default)]
pub(crate) struct Substitution {
    substitutes: Vec<Option<Value>>,
}

impl Substitution {
    /// Uses of `old` become uses of `new`, or of what stands for that.
    pub fn set(&mut self, old: Value, new: Value) {
        let index = old.0 as usize;
        if self.substitutes.len() <= index {
            self.substitutes.resize(index + 1, None);
        }
        self.substitutes[index] = Some(self.get(new));
    }

    /// The same for all results of an operation.
    pub fn set_all(&mut self, old: Values, new: impl IntoIterator<Item = Value>) {
        for (old, new) in old.iter().zip(new) {
            self.set(old, new);
        }
    }

    /// Uses of `old` are of itself from here on.
    pub fn unset(&mut self, old: Value) {
        self.substitutes[old.0 as usize] = None;
    }

    /// What stands for `value`: itself unless something was set.
    pub fn get(&self, value: Value) -> Value {
        self.substitutes.get(value.0 as usize).copied().flatten().unwrap_or(value)
    }

    /// What stands for a value is called as that was, unless it has a better name.
    pub fn keep_names(&self, names: &mut Names) {
        for (old, new) in (0..).map(Value).zip(&self.substitutes) {
            if let Some(new) = new {
                names.keep(old, *new);
            }
        }
    }

    /// Substitutes the operands of an operation, not what is in its regions.
    pub fn apply_to_operands(&self, kind: &mut OpKind) {
        kind.for_each_operand_mut(|value| *value = self.get(*value));
    }

    /// Substitutes the yields of a region, not what is in its operations.
    pub fn apply_to_yields(&self, region: &mut Region) {
        region.yields.iter_mut().for_each(|value| *value = self.get(*value));
    }
}
