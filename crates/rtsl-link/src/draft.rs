//! A function that is being linked.

use std::collections::{BTreeMap, BTreeSet};

use rtsl_ir::{
    Constant, Function, Index, MAX_NESTING, Op, OpKind, Scalar, StateComponent, Value, Values,
    Variable, VariableId, VariableKind,
};
use rtsl_source::{Diagnostic, deep_stack};

use crate::attributes::AttributeUse;
use crate::errors;
use crate::site::Site;

/// The greatest number of operations of a linked function.
const OPERATION_LIMIT: usize = 1 << 17;

/// The result of a step of linking, which fails at a limit.
pub type Linking<T> = Result<T, Diagnostic>;

/// A function that is being linked, with what is known of it.
#[derive(Default)]
pub struct Draft {
    /// The function.
    pub out: Function,
    /// Scratch that is not in memory: the values of its scalars, by the names of variables and components, in the order
    /// of their assignments, of which the last counts. Others are zero. `None` if scratch is in memory.
    pub scratch: Option<Vec<((String, u32), Value)>>,
    /// The variables of `out`.
    variables: BTreeMap<(VariableKind, String), VariableId>,
    operations: usize,
    /// The values that are constants, by the constants.
    known: BTreeMap<Value, Constant>,
    depth: usize,
    locals: u32,
    /// Unset references, by class and path.
    pub(crate) warnings: BTreeSet<(String, String)>,
    /// True within a loop, where copies may run several times.
    pub in_loop: bool,
    /// True if copies of linked methods are reported as calls, for traces.
    pub reports_calls: bool,
    /// The use of the attributes of objects.
    pub(crate) attributes: AttributeUse,
    /// True if derivatives may be taken of the called methods.
    pub(crate) takes_derivatives: bool,
    /// The locals with the scratch that calls of `intersect` of other primitives have left, by its names.
    pub(crate) called_scratch: BTreeMap<String, VariableId>,
}

impl Draft {
    /// Begins a function of this name.
    pub fn new(name: impl Into<String>) -> Draft {
        Draft { out: Function::new(name), ..Draft::default() }
    }

    /// Adds an operation, and returns its results.
    ///
    /// # Errors
    /// If the function becomes too large.
    pub fn emit(
        &mut self,
        to: &mut Vec<Op>,
        kind: OpKind,
        results: &[Scalar],
        precise: bool,
    ) -> Linking<Values> {
        self.operations += 1;
        if self.operations > OPERATION_LIMIT {
            return Err(errors::link_limit(&self.out.name, "is too large"));
        }
        let results = self.out.new_values(results);
        to.push(Op { results, precise, kind });
        Ok(results)
    }

    /// Adds a constant.
    ///
    /// # Errors
    /// If the function becomes too large.
    pub fn constant(&mut self, to: &mut Vec<Op>, constant: Constant) -> Linking<Value> {
        let kind = OpKind::Constant(constant);
        let value = self.emit(to, kind, &[constant.scalar()], false)?.get(0);
        self.known.insert(value, constant);
        Ok(value)
    }

    /// Returns the constant that a value is known to be.
    pub fn known(&self, value: Value) -> Option<Constant> {
        self.known.get(&value).copied()
    }

    /// Returns the variable with this kind and name; the first call adds it.
    pub fn intern_variable(&mut self, variable: Variable) -> VariableId {
        // `Function::intern_variable` searches linearly.
        let next = VariableId(self.out.variables.len() as u32);
        let id = *self.variables.entry((variable.kind, variable.name.clone())).or_insert(next);
        if id == next {
            self.out.variables.push(variable);
        }
        id
    }

    /// Returns the variable for one of a site's.
    pub fn variable(&mut self, site: &mut Site<'_>, id: VariableId) -> VariableId {
        if let Some(known) = site.variables[id] {
            return known;
        }
        let variable = site.function.variable(id);
        let name = match variable.kind {
            VariableKind::State | VariableKind::Parameter | VariableKind::Accepted => {
                variable.name.clone()
            }
            VariableKind::Member | VariableKind::Scratch | VariableKind::Buffer => {
                site.name_of(variable)
            }
            VariableKind::Local if site.is_root => variable.name.clone(),
            VariableKind::Local => {
                self.locals += 1;
                format!("{}{}.{}", site.prefix, variable.name, self.locals)
            }
        };
        let new = self.intern_variable(Variable { name, ..variable.clone() });
        site.variables[id] = Some(new);
        new
    }

    /// Loads a scalar of a variable.
    ///
    /// # Errors
    /// If the function becomes too large.
    pub fn load(&mut self, variable: VariableId, index: Index, to: &mut Vec<Op>) -> Linking<Value> {
        let scalar = self.out.variable(variable).scalar;
        Ok(self.emit(to, OpKind::Load(variable, index), &[scalar], false)?.get(0))
    }

    /// Begins a region of the function.
    ///
    /// # Errors
    /// If it is nested too deeply.
    pub fn enter(&mut self) -> Linking<()> {
        // All later stages recurse as deep.
        if self.depth >= MAX_NESTING.min(deep_stack::depth()) {
            return Err(errors::link_limit(&self.out.name, "is nested too deeply"));
        }
        self.depth += 1;
        Ok(())
    }

    /// Ends the region that was begun last.
    pub fn leave(&mut self) {
        self.depth -= 1;
    }

    /// Returns the state that a copied body sets; its scratch is noted if scratch is not in memory.
    pub fn note_outputs(&mut self, site: &Site<'_>) -> Vec<(StateComponent, Value)> {
        let function = site.function;
        let mut state = Vec::new();
        for (output, value) in function.outputs.iter().zip(&function.body.yields) {
            let (place, value) = (function.variable(output.variable), site.value(*value));
            match place.kind {
                VariableKind::State => state.extend(
                    StateComponent::named(&place.name, output.component).map(|it| (it, value)),
                ),
                VariableKind::Scratch => {
                    if let Some(scratch) = &mut self.scratch {
                        scratch.push(((site.name_of(place), output.component), value));
                    }
                }
                VariableKind::Accepted
                | VariableKind::Member
                | VariableKind::Parameter
                | VariableKind::Buffer
                | VariableKind::Local => {}
            }
        }
        state
    }

    pub(crate) fn keep_name(&mut self, site: &Site<'_>, old: Value, new: Value) {
        self.out.names.copy(&site.function.names, site.first_text, old, new);
    }
}
