//! Variables: how each is stored while its function is made.

use std::collections::BTreeMap;
use std::rc::Rc;

use rtsl_ir::{Constant, Name, Scalar, Value, VariableId, VariableKind};
use rtsl_sema::hir::Type;
use rtsl_source::Span;

use crate::Lowering;
use crate::cells::Cell;
use crate::layout::Layout;
use crate::limits::{self, Lowered};
use crate::state::ComputedDefault;

/// An index into [`Lowering::variables`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct SourceVariableId(pub u32);

/// A local, parameter, member or state variable of one instance of a function.
#[derive(Clone, Debug)]
pub(crate) struct SourceVariable {
    pub name: String,
    pub layout: Rc<Layout>,
    pub storage: Storage,
    /// For state variables whose default depends on other variables.
    pub default: Option<ComputedDefault>,
    /// For state variables what the host has set, where it was loaded at the start.
    pub input: Option<Vec<Value>>,
}

/// The rank of names of what functions take and give.
pub(crate) const RANK_OF_PARAMETERS: u8 = Name::DECLARED;
/// Of members and state.
pub(crate) const RANK_OF_DATA: u8 = 192;
/// Of what the compiler makes by itself.
pub(crate) const RANK_OF_TEMPORARIES: u8 = 255;

/// Where a variable's value is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Storage {
    /// In SSA values: the first of its cells.
    Cells(Cell),
    /// In memory of its own, a place for each leaf.
    Locals(Vec<VariableId>),
    /// Where the host has put it; it is never written.
    Memory(VariableKind),
}

/// An array longer than this is kept in memory even if all its indices are constant, since control flow would
/// have to hand on every scalar of it.
const SCALARS_IN_VALUES: u32 = 256;

impl Lowering<'_> {
    pub fn variable(&self, id: SourceVariableId) -> &SourceVariable {
        &self.variables[id.0 as usize]
    }

    pub fn add_variable(&mut self, variable: SourceVariable) -> SourceVariableId {
        self.variables.push(variable);
        SourceVariableId(self.variables.len() as u32 - 1)
    }

    /// A new variable in cells or slots, whose value is not yet set.
    pub fn new_variable(
        &mut self,
        name: &str,
        ty: &Type,
        (indexed, rank): (bool, u8),
        span: Span,
    ) -> Lowered<SourceVariableId> {
        let layout = self.layouts.layout(ty, span)?;
        let memory = indexed || (holds_array(ty) && layout.len() > SCALARS_IN_VALUES);
        let storage = if memory {
            Storage::Locals(self.take_slots(name, &layout, span)?)
        } else {
            let zeros = self.zeros(&layout);
            let names = self.scalar_names(name, &layout, rank);
            Storage::Cells(Cell(self.cells.allocate_named(zeros, names).start))
        };
        let name = name.to_owned();
        Ok(self.add_variable(SourceVariable { name, layout, storage, default: None, input: None }))
    }

    /// A new variable that is never written and lies where the host has put it.
    pub fn new_place_variable(
        &mut self,
        name: &str,
        ty: &Type,
        kind: VariableKind,
        span: Span,
    ) -> Lowered<SourceVariableId> {
        let layout = self.layouts.layout(ty, span)?;
        Ok(self.add_variable(SourceVariable {
            name: name.to_owned(),
            layout,
            storage: Storage::Memory(kind),
            default: None,
            input: None,
        }))
    }

    /// What the scalars of a variable are called.
    pub fn scalar_names(&mut self, name: &str, layout: &Layout, rank: u8) -> Vec<Name> {
        let mut names = Vec::with_capacity(layout.len() as usize);
        for leaf in &layout.leaves {
            let text = match leaf.suffix.as_str() {
                "" => self.builder.name_text(name),
                suffix => self.builder.name_text(&format!("{name}{suffix}")),
            };
            let len = leaf.len.min(u16::MAX.into()) as u16;
            names.extend((0..len).map(|component| Name { text, component, len, rank }));
        }
        names
    }

    /// Sets a scalar of a variable, whose name the value gets.
    pub fn set_cell(&mut self, cell: Cell, value: Value) {
        if let Some(name) = self.cells.name(cell) {
            self.builder.name(value, name);
        }
        self.cells.set(cell, value);
    }

    /// A new cell for one scalar.
    pub fn new_cell(&mut self, initial: Value) -> Cell {
        Cell(self.cells.allocate([initial]).start)
    }

    /// A new flag, false.
    pub fn new_flag(&mut self) -> Cell {
        let no = self.builder.bool(false);
        self.new_cell(no)
    }

    /// Zero for each scalar.
    pub fn zeros(&mut self, layout: &Layout) -> Vec<Value> {
        layout.scalars().map(|scalar| self.builder.constant(Constant::zero(scalar))).collect()
    }

    /// The cells of a variable, if it is stored so.
    pub fn cells_of(&self, id: SourceVariableId) -> Option<impl Iterator<Item = Cell> + use<>> {
        let variable = self.variable(id);
        match variable.storage {
            Storage::Cells(Cell(first)) => Some((first..first + variable.layout.len()).map(Cell)),
            Storage::Locals(_) | Storage::Memory(_) => None,
        }
    }

    /// Sets a whole variable.
    pub fn set_variable(&mut self, id: SourceVariableId, values: &[Value]) {
        let variable = &self.variables[id.0 as usize];
        debug_assert_eq!(variable.layout.len() as usize, values.len(), "{}", variable.name);
        match &variable.storage {
            Storage::Cells(Cell(first)) => {
                let first = *first;
                for (cell, value) in (first..).zip(values) {
                    self.set_cell(Cell(cell), *value);
                }
            }
            Storage::Locals(slots) => {
                // Values of slots have no names: where slots are promoted their places tell enough.
                let mut values = values.iter();
                for (slot, leaf) in slots.iter().zip(&variable.layout.leaves) {
                    for (index, value) in (0..leaf.len).zip(&mut values) {
                        self.builder.store(*slot, index, *value);
                    }
                }
            }
            Storage::Memory(_) => debug_assert!(false, "{} is never written", variable.name),
        }
        if let Some(default) = &self.variables[id.0 as usize].default {
            let written = default.written;
            let yes = self.builder.bool(true);
            self.cells.set(written, yes);
        }
    }

    /// The value of a whole variable.
    pub fn get_variable(&mut self, id: SourceVariableId) -> Lowered<Vec<Value>> {
        if self.variable(id).default.is_some() {
            return self.effective_state(id);
        }
        Ok(self.stored(id))
    }

    /// What is stored for a variable, whether or not it was set.
    pub fn stored(&mut self, id: SourceVariableId) -> Vec<Value> {
        let variable = &self.variables[id.0 as usize];
        match &variable.storage {
            Storage::Cells(Cell(first)) => {
                let cells = *first..first + variable.layout.len();
                cells.map(|cell| self.cells.get(Cell(cell))).collect()
            }
            Storage::Locals(slots) => {
                let mut values = Vec::new();
                for (slot, leaf) in slots.iter().zip(&variable.layout.leaves) {
                    values.extend((0..leaf.len).map(|index| self.builder.load(*slot, index)));
                }
                values
            }
            Storage::Memory(kind) => {
                let places: Vec<_> = variable.layout.variables(*kind, &variable.name).collect();
                let mut values = Vec::new();
                for place in places {
                    let len = place.len;
                    let place = self.builder.variable(place);
                    values.extend((0..len).map(|index| self.builder.load(place, index)));
                }
                values
            }
        }
    }

    fn take_slots(&mut self, name: &str, layout: &Layout, span: Span) -> Lowered<Vec<VariableId>> {
        let mut slots = Vec::new();
        for leaf in &layout.leaves {
            let slot = match self.slots.free.entry((leaf.scalar, leaf.len)).or_default().pop() {
                Some(slot) => slot,
                None => {
                    self.slots.scalars += leaf.len;
                    if self.slots.scalars > limits::SCALARS_OF_SLOTS {
                        return Err(limits::too_many_slots(span));
                    }
                    let name = self.slots.new_name(format!("{name}{}", leaf.suffix));
                    self.builder.local(&name, leaf.scalar, leaf.len)
                }
            };
            slots.push(slot);
        }
        Ok(slots)
    }

    /// Ends the life of variables: their slots may serve others.
    pub fn release_slots(&mut self, variables: impl IntoIterator<Item = SourceVariableId>) {
        for id in variables {
            if let Storage::Locals(slots) = &self.variables[id.0 as usize].storage {
                for slot in slots {
                    let place = self.builder.function().variable(*slot);
                    let key = (place.scalar, place.len);
                    self.slots.free.entry(key).or_default().push(*slot);
                }
            }
        }
    }
}

/// The slots of a function.
#[derive(Clone, Debug, Default)]
pub(crate) struct LocalPool {
    /// Those whose variables live no longer.
    free: BTreeMap<(Scalar, u32), Vec<VariableId>>,
    /// How many scalars all slots have.
    scalars: u32,
    /// How many slots were named after each variable.
    named: BTreeMap<String, u32>,
}

impl LocalPool {
    /// A name that no slot has yet; the builder would look for one from the start each time.
    fn new_name(&mut self, name: String) -> String {
        let used = self.named.entry(name.clone()).or_default();
        *used += 1;
        if *used == 1 { name } else { format!("{name}.{used}") }
    }
}

fn holds_array(ty: &Type) -> bool {
    // Structs count too: they may hold arrays, and large ones without are rare.
    matches!(ty, Type::Array(..) | Type::Struct(_))
}
