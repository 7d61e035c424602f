//! The storage of variables while their function is lowered.

use std::collections::BTreeMap;
use std::rc::Rc;

use rtsl_ir::{Constant, Name, Scalar, Value, VariableId, VariableKind};
use rtsl_sema::hir::Type;
use rtsl_source::Span;
use rtsl_spec::Default;

use crate::Lowering;
use crate::cells::Cell;
use crate::layout::Layout;
use crate::limits::{self, Lowered};

/// An index into [`Lowering::variables`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct SourceVariableId(pub u32);

/// A local, parameter, member or state variable of one inlined call.
#[derive(Clone, Debug)]
pub(crate) struct SourceVariable {
    pub name: String,
    pub layout: Rc<Layout>,
    pub storage: Storage,
    /// The computed default, for state variables whose default depends on other variables.
    pub default: Option<ComputedDefault>,
    /// The host's value, for state variables that are loaded at the start.
    pub input: Option<Vec<Value>>,
}

/// A default that depends on other variables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ComputedDefault {
    /// The flag that the variable has been set.
    pub written: Cell,
    pub default: Default,
}

/// The name rank of parameters and results of functions.
pub(crate) const RANK_OF_PARAMETERS: u8 = Name::DECLARED;
/// The name rank of members and state variables.
pub(crate) const RANK_OF_DATA: u8 = 192;
/// The name rank of values that the compiler introduces.
pub(crate) const RANK_OF_TEMPORARIES: u8 = 255;

/// The storage of a variable's value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Storage {
    /// SSA values in consecutive cells, of which this is the first.
    Cells(Cell),
    /// Memory of the function: one IR local for each leaf.
    Locals(Vec<VariableId>),
    /// Memory of the host, which is never written.
    Memory(VariableKind),
}

/// The maximum length of an array in SSA values. A longer one is kept in memory even if all its
/// indices are constant, since control flow would have to carry each of its scalars.
const SCALARS_IN_VALUES: u32 = 256;

impl Lowering<'_> {
    pub fn variable(&self, id: SourceVariableId) -> &SourceVariable {
        &self.variables[id.0 as usize]
    }

    pub fn add_variable(&mut self, variable: SourceVariable) -> SourceVariableId {
        self.variables.push(variable);
        SourceVariableId(self.variables.len() as u32 - 1)
    }

    /// Creates a variable in cells or locals, whose value is not yet set.
    pub fn new_variable(
        &mut self,
        name: &str,
        ty: &Type,
        indexed: bool,
        rank: u8,
        span: Span,
    ) -> Lowered<SourceVariableId> {
        let layout = self.layouts.layout(ty, span)?;
        let memory = indexed || (holds_array(ty) && layout.len() > SCALARS_IN_VALUES);
        let storage = if memory {
            Storage::Locals(self.take_locals(name, &layout, span)?)
        } else {
            let zeros = self.zeros(&layout);
            let names = self.scalar_names(name, &layout, rank);
            Storage::Cells(Cell(self.cells.allocate_named(zeros, names).start))
        };
        let name = name.to_owned();
        Ok(self.add_variable(SourceVariable { name, layout, storage, default: None, input: None }))
    }

    /// Creates a variable in host memory that is never written.
    pub fn new_host_variable(
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

    /// The names of the scalars of a variable.
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

    /// Sets a scalar of a variable and gives its name to the value.
    pub fn set_cell(&mut self, cell: Cell, value: Value) {
        if let Some(name) = self.cells.name(cell) {
            self.builder.name(value, name);
        }
        self.cells.set(cell, value);
    }

    /// Creates a cell for one scalar.
    pub fn new_cell(&mut self, initial: Value) -> Cell {
        Cell(self.cells.allocate([initial]).start)
    }

    /// Creates a flag, which is false.
    pub fn new_flag(&mut self) -> Cell {
        let no = self.builder.bool(false);
        self.new_cell(no)
    }

    /// A zero for each scalar.
    pub fn zeros(&mut self, layout: &Layout) -> Vec<Value> {
        layout.scalars().map(|scalar| self.builder.constant(Constant::zero(scalar))).collect()
    }

    /// The cells of a variable, if it is stored in cells.
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
            Storage::Locals(locals) => {
                // Values stored to locals need no names: mem2reg names them after the locals.
                let mut values = values.iter();
                for (local, leaf) in locals.iter().zip(&variable.layout.leaves) {
                    for (index, value) in (0..leaf.len).zip(&mut values) {
                        self.builder.store(*local, index, *value);
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

    /// The stored value of a variable, whether or not it was set.
    pub fn stored(&mut self, id: SourceVariableId) -> Vec<Value> {
        let variable = &self.variables[id.0 as usize];
        match &variable.storage {
            Storage::Cells(Cell(first)) => {
                let cells = *first..first + variable.layout.len();
                cells.map(|cell| self.cells.get(Cell(cell))).collect()
            }
            Storage::Locals(locals) => {
                let mut values = Vec::new();
                for (local, leaf) in locals.iter().zip(&variable.layout.leaves) {
                    values.extend((0..leaf.len).map(|index| self.builder.load(*local, index)));
                }
                values
            }
            Storage::Memory(kind) => {
                let variables: Vec<_> = variable.layout.variables(*kind, &variable.name).collect();
                let mut values = Vec::new();
                for variable in variables {
                    let len = variable.len;
                    let variable = self.builder.variable(variable);
                    values.extend((0..len).map(|index| self.builder.load(variable, index)));
                }
                values
            }
        }
    }

    fn take_locals(&mut self, name: &str, layout: &Layout, span: Span) -> Lowered<Vec<VariableId>> {
        let mut locals = Vec::new();
        for leaf in &layout.leaves {
            let local = match self.locals.free.entry((leaf.scalar, leaf.len)).or_default().pop() {
                Some(local) => local,
                None => {
                    self.locals.scalars += leaf.len;
                    if self.locals.scalars > limits::SCALARS_OF_LOCALS {
                        return Err(limits::too_many_locals(span));
                    }
                    let name = self.locals.new_name(format!("{name}{}", leaf.suffix));
                    self.builder.local(&name, leaf.scalar, leaf.len)
                }
            };
            locals.push(local);
        }
        Ok(locals)
    }

    /// Ends the lifetime of variables, so that their locals can be reused.
    pub fn release_locals(&mut self, variables: impl IntoIterator<Item = SourceVariableId>) {
        for id in variables {
            if let Storage::Locals(locals) = &self.variables[id.0 as usize].storage {
                for local in locals {
                    let variable = self.builder.function().variable(*local);
                    let key = (variable.scalar, variable.len);
                    self.locals.free.entry(key).or_default().push(*local);
                }
            }
        }
    }
}

/// The IR locals of a function.
#[derive(Clone, Debug, Default)]
pub(crate) struct LocalPool {
    /// The locals whose variables are no longer live.
    free: BTreeMap<(Scalar, u32), Vec<VariableId>>,
    /// The number of scalars of all locals.
    scalars: u32,
    /// The number of locals named after each variable.
    named: BTreeMap<String, u32>,
}

impl LocalPool {
    /// Returns a name that no local has yet. The builder would search for one from the start each
    /// time.
    fn new_name(&mut self, name: String) -> String {
        let used = self.named.entry(name.clone()).or_default();
        *used += 1;
        if *used == 1 { name } else { format!("{name}.{used}") }
    }
}

fn holds_array(ty: &Type) -> bool {
    // Structs count too: they may contain arrays, and large ones without arrays are rare.
    matches!(ty, Type::Array(..) | Type::Struct(_))
}
