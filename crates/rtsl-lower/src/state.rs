//! State variables, as the table of `rtsl_spec` defines them for the method being lowered.
//!
//! - A variable that the method only reads is loaded at each read.
//! - A variable that it may write starts with the host's value, or with the default.
//! - A default that depends on another variable is computed when the variable is read before it was
//!   set; a flag in a cell holds whether it was set.
//! - A variable that the table does not list for the method is a local that starts with the
//!   default.

use rtsl_ir::{Constant, Scalar, Value, Variable, VariableKind};
use rtsl_sema::hir::{StateId, Type};
use rtsl_source::Span;
use rtsl_spec::{Default, Direction, Method, Role, Row};

use crate::cells::Cell;
use crate::facts::Root;
use crate::limits::Lowered;
use crate::state_table::{entry, state_id, type_of};
use crate::variables::{ComputedDefault, RANK_OF_DATA, SourceVariable, SourceVariableId, Storage};
use crate::{Lowering, Purpose};

impl Lowering<'_> {
    /// Creates the variables for all state that the method may write or has to output.
    pub fn begin_state(&mut self, span: Span) -> Lowered<()> {
        for id in all_states() {
            if self.is_state_written(id) || self.is_output(id) {
                self.state_variable(id, span)?;
            }
        }
        Ok(())
    }

    /// Outputs the state variables that the method passes out.
    pub fn output_state(&mut self) -> Lowered<()> {
        for id in all_states() {
            if let Some(variable) = self.states.get(&id).copied()
                && self.is_output(id)
            {
                let values = self.get_variable(variable)?;
                self.output_variable(variable, VariableKind::State, &values);
            }
        }
        Ok(())
    }

    /// Outputs a variable with this value.
    pub fn output_variable(&mut self, id: SourceVariableId, kind: VariableKind, values: &[Value]) {
        let variable = self.variable(id);
        let variables: Vec<Variable> = variable.layout.variables(kind, &variable.name).collect();
        let mut values = values.iter();
        for variable in variables {
            let len = variable.len;
            let variable = self.builder.variable(variable);
            for (component, value) in (0..len).zip(&mut values) {
                self.builder.output(variable, component, *value);
            }
        }
    }

    /// The source variable of a state variable.
    pub fn state_variable(&mut self, id: StateId, span: Span) -> Lowered<SourceVariableId> {
        if let Some(made) = self.states.get(&id) {
            return Ok(*made);
        }
        let variable = self.new_state_variable(id, span)?;
        self.states.insert(id, variable);
        Ok(variable)
    }

    fn new_state_variable(&mut self, id: StateId, span: Span) -> Lowered<SourceVariableId> {
        let (direction, row) = self.row(id);
        let ty = type_of(row.ty);
        let written = self.is_state_written(id);
        if direction == Some(Direction::In) && !written {
            return self.new_host_variable(row.name, &ty, VariableKind::State, span);
        }
        let layout = self.layouts.layout(&ty, span)?;
        let (initial, default, input) = match direction {
            Some(Direction::In | Direction::InOut) => {
                let loaded = self.load_state(id);
                (loaded.clone(), None, Some(loaded))
            }
            Some(Direction::Out) | None => match self.constant_default(row) {
                Some(constant) => (constant, None, None),
                None => {
                    let written = self.new_flag();
                    let default = ComputedDefault { written, default: row.default };
                    (self.zeros(&layout), Some(default), None)
                }
            },
        };
        let names = self.scalar_names(row.name, &layout, RANK_OF_DATA);
        let storage = Storage::Cells(Cell(self.cells.allocate_named(initial, names).start));
        let name = row.name.to_owned();
        Ok(self.add_variable(SourceVariable { name, layout, storage, default, input }))
    }

    fn load_state(&mut self, id: StateId) -> Vec<Value> {
        let variable = entry(id);
        let len = variable.ty.components();
        let variable = Variable {
            kind: VariableKind::State,
            name: variable.name.to_owned(),
            scalar: Scalar::F32,
            len,
        };
        let variable = self.builder.variable(variable);
        (0..len).map(|component| self.builder.load(variable, component)).collect()
    }

    /// The value of a constant default; `None` if the default depends on other variables.
    pub fn constant_default(&mut self, row: &Row) -> Option<Vec<Value>> {
        let components: Vec<f32> = match row.default {
            Default::Constant(value) => vec![value; row.ty.components() as usize],
            Default::Components(components) => components.to_vec(),
            Default::Variable(_)
            | Default::Grey(_)
            | Default::Luminance(_)
            | Default::Tangent(_) => return None,
        };
        let constants = components.into_iter().map(Constant::F32);
        Some(constants.map(|constant| self.builder.constant(constant)).collect())
    }

    /// The value of a state variable, or its computed default if it has not been set.
    pub fn effective_state(&mut self, id: SourceVariableId) -> Lowered<Vec<Value>> {
        let stored = self.stored(id);
        let Some(ComputedDefault { written, default }) = self.variable(id).default else {
            return Ok(stored);
        };
        let written = self.cells.get(written);
        if self.builder.known(written) == Some(Constant::Bool(true)) {
            return Ok(stored);
        }
        let default = self.computed_default(default, stored.len())?;
        Ok(self.select_all(written, &stored, &default))
    }

    fn computed_default(&mut self, default: Default, len: usize) -> Lowered<Vec<Value>> {
        let span = self.class.span;
        match default {
            Default::Constant(value) => Ok(vec![self.builder.f32(value); len]),
            Default::Components(components) => {
                Ok(components.iter().map(|value| self.builder.f32(*value)).collect())
            }
            Default::Variable(name) => {
                let other = self.state_variable(state_id(name), span)?;
                self.get_variable(other)
            }
            // The stored value is 0 if the other variable is unset, too, which breaks the cycle of
            // the two defaults.
            Default::Grey(name) => {
                let other = self.state_variable(state_id(name), span)?;
                Ok(vec![self.stored(other)[0]; len])
            }
            Default::Luminance(name) => {
                let other = self.state_variable(state_id(name), span)?;
                let color = self.stored(other);
                self.call_prelude("luminance", &[Type::Color], vec![color], span)
            }
            Default::Tangent(second) => {
                let normal = self.state_variable(state_id("rt_GeometricNormal"), span)?;
                let normal = self.get_variable(normal)?;
                let vec3 = Type::Vector(Scalar::F32, 3);
                let arguments = vec![normal.clone()];
                let first = self.call_prelude(
                    "perpendicularTo",
                    std::slice::from_ref(&vec3),
                    arguments,
                    span,
                )?;
                if !second {
                    return Ok(first);
                }
                self.call_prelude("cross", &[vec3.clone(), vec3], vec![normal, first], span)
            }
        }
    }

    /// The direction and the row of a state variable in the method being lowered. In a class with
    /// several roles, the rows of roles that have the method take precedence.
    pub fn row(&self, id: StateId) -> (Option<Direction>, &'static Row) {
        let name = entry(id).name;
        if let Purpose::Method(method) = self.purpose {
            for role in self.roles_of(method) {
                if let Some(row) = role.row(name)
                    && let Some(direction) = row.direction(method)
                {
                    return (Some(direction), row);
                }
            }
            if let Some(row) = self.roles_of(method).find_map(|role| role.row(name)) {
                return (None, row);
            }
        }
        let of_class = self.class.roles.iter().find_map(|role| role.row(name));
        let of_any = || rtsl_spec::rows().iter().find(|row| row.name == name);
        let row = of_class.or_else(of_any).expect("each distinct variable comes from a row");
        (None, row)
    }

    fn roles_of(&self, method: Method) -> impl Iterator<Item = Role> {
        self.class.roles.iter().copied().filter(move |role| method.roles().contains(role))
    }

    /// True if the method passes a variable out: not what comes in and is never assigned.
    fn is_output(&self, id: StateId) -> bool {
        let (direction, row) = self.row(id);
        match direction {
            Some(Direction::Out) if !row.is_optional => true,
            Some(Direction::Out | Direction::InOut) => self.is_state_written(id),
            Some(Direction::In) | None => false,
        }
    }

    fn is_state_written(&self, id: StateId) -> bool {
        self.writes.contains(&Root::State(id))
    }
}

fn all_states() -> impl Iterator<Item = StateId> {
    rtsl_spec::state_variables().iter().map(|variable| StateId(variable.index))
}
