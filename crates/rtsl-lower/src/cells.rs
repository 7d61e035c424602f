//! The current values of all variables at the point where code is generated.
//!
//! A cell is one scalar of a variable, and holds an SSA value. At the end of each branch its
//! changes are rolled back, and where control flow joins they are compared. A journal of old values
//! makes the cost proportional to the changes, not to the number of variables.

use std::collections::BTreeMap;
use std::ops::Range;

use rtsl_ir::{Name, Value};

/// One scalar of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Cell(pub u32);

/// A position in the journal to roll back to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mark(usize);

/// The cells that changed, with their new values.
pub(crate) type Changes = BTreeMap<Cell, Value>;

/// All cells.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cells {
    values: Vec<Value>,
    names: Vec<Option<Name>>,
    /// The old values, recorded while any mark is open.
    journal: Vec<(Cell, Value)>,
    open_marks: usize,
}

impl Cells {
    /// Allocates consecutive cells with these initial values.
    pub fn allocate(&mut self, initial: impl IntoIterator<Item = Value>) -> Range<u32> {
        let first = self.values.len() as u32;
        self.values.extend(initial);
        self.names.resize(self.values.len(), None);
        first..self.values.len() as u32
    }

    /// Allocates consecutive cells with these initial values and names.
    pub fn allocate_named(
        &mut self,
        initial: impl IntoIterator<Item = Value>,
        names: impl IntoIterator<Item = Name>,
    ) -> Range<u32> {
        let cells = self.allocate(initial);
        for (cell, name) in cells.clone().zip(names) {
            self.names[cell as usize] = Some(name);
        }
        cells
    }

    /// The name of a cell.
    pub fn name(&self, cell: Cell) -> Option<Name> {
        self.names[cell.0 as usize]
    }

    pub fn get(&self, cell: Cell) -> Value {
        self.values[cell.0 as usize]
    }

    pub fn set(&mut self, cell: Cell, value: Value) {
        let old = std::mem::replace(&mut self.values[cell.0 as usize], value);
        if old != value && self.open_marks > 0 {
            self.journal.push((cell, old));
        }
    }

    /// The number of cells.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Starts to record changes, until they are [rolled back](Cells::take_back).
    pub fn mark(&mut self) -> Mark {
        self.open_marks += 1;
        Mark(self.journal.len())
    }

    /// Restores every cell to its value at the mark, and returns the changes.
    pub fn take_back(&mut self, mark: Mark) -> Changes {
        let mut changes = Changes::new();
        for (cell, _) in &self.journal[mark.0..] {
            changes.insert(*cell, self.values[cell.0 as usize]);
        }
        for (cell, old) in self.journal.drain(mark.0..).rev() {
            self.values[cell.0 as usize] = old;
        }
        self.open_marks -= 1;
        changes.retain(|cell, value| self.values[cell.0 as usize] != *value);
        changes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_taken_back_in_nested_marks() {
        let mut cells = Cells::default();
        cells.allocate([Value(10), Value(11), Value(12)]);
        let outer = cells.mark();
        cells.set(Cell(0), Value(20));
        let inner = cells.mark();
        cells.set(Cell(0), Value(30));
        cells.set(Cell(1), Value(31));
        cells.set(Cell(1), Value(32));
        cells.set(Cell(2), Value(33));
        cells.set(Cell(2), Value(12));
        let inner = cells.take_back(inner);
        assert_eq!(inner, Changes::from([(Cell(0), Value(30)), (Cell(1), Value(32))]));
        assert_eq!(cells.get(Cell(0)), Value(20));
        assert_eq!(cells.get(Cell(1)), Value(11));
        assert_eq!(cells.take_back(outer), Changes::from([(Cell(0), Value(20))]));
        assert_eq!(cells.get(Cell(0)), Value(10));
    }
}
