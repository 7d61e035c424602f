//! Functions, regions and values.

use crate::{Names, Op, OpKind, Scalar, Variable, VariableId, VariableKind};

/// The greatest depth of nested regions in a function's body, which bounds recursion over them.
pub const MAX_NESTING: usize = 256;

/// An SSA value: an index into [`Function::values`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Value(pub u32);

/// A run of values with consecutive numbers: the results of one operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct Values {
    /// The index of the first value.
    pub first: u32,
    /// The number of values.
    pub count: u32,
}

impl Values {
    /// Returns the value at `index`.
    ///
    /// # Panics
    /// If `index` is out of range.
    pub fn get(self, index: u32) -> Value {
        assert!(index < self.count, "value {index} of {}", self.count);
        Value(self.first + index)
    }

    /// Iterates over the values.
    pub fn iter(self) -> impl DoubleEndedIterator<Item = Value> + ExactSizeIterator {
        (self.first..self.first.saturating_add(self.count)).map(Value)
    }
}

/// A list of operations, and the values that the region passes to the operation or function that holds it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Region {
    /// Values defined on entry: the carried values of a loop; none elsewhere.
    pub params: Vec<Value>,
    /// The operations, in order.
    pub ops: Vec<Op>,
    /// The results of the region: for an `if` its results; for the body of a loop a bool that continues the loop, then
    /// the next carried values; for a function's body one value for each output.
    pub yields: Vec<Value>,
}

/// The destination of a yielded value of a function's body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Output {
    /// A state, member, parameter, scratch or accepted variable.
    pub variable: VariableId,
    /// The index of the scalar within it.
    pub component: u32,
}

/// A method, for one ray and one object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Function {
    /// `Class.method`.
    pub name: String,
    /// The variables that it may read and store.
    pub variables: Vec<Variable>,
    /// The type of every value.
    pub values: Vec<Scalar>,
    /// The operations.
    pub body: Region,
    /// The destinations of the body's yields, one each; no component of a variable occurs twice.
    pub outputs: Vec<Output>,
    /// The names of values in the source, where known.
    pub names: Names,
}

impl Function {
    /// Returns a function with an empty body.
    pub fn new(name: impl Into<String>) -> Self {
        Function {
            name: name.into(),
            variables: Vec::new(),
            values: Vec::new(),
            body: Region::default(),
            outputs: Vec::new(),
            names: Names::default(),
        }
    }

    /// Returns the type of `value`.
    pub fn scalar(&self, value: Value) -> Scalar {
        self.values[value.0 as usize]
    }

    /// Returns the variable `id`.
    pub fn variable(&self, id: VariableId) -> &Variable {
        &self.variables[id.0 as usize]
    }

    /// Returns the variable of this kind and name, if the function has it.
    pub fn find_variable(&self, kind: VariableKind, name: &str) -> Option<VariableId> {
        let found = self
            .variables
            .iter()
            .position(|variable| variable.kind == kind && variable.name == name);
        found.map(|index| VariableId(index as u32))
    }

    /// Returns the variable equal to `variable`, which is added if it is missing.
    pub fn intern_variable(&mut self, variable: Variable) -> VariableId {
        if let Some(id) = self.find_variable(variable.kind, &variable.name) {
            debug_assert_eq!(*self.variable(id), variable);
            return id;
        }
        self.variables.push(variable);
        VariableId(self.variables.len() as u32 - 1)
    }

    /// Returns the depth of nested regions in the body, 0 if there are none.
    pub fn nesting(&self) -> usize {
        let (mut deepest, mut pending) = (0, vec![(&self.body, 0)]);
        while let Some((region, depth)) = pending.pop() {
            deepest = deepest.max(depth);
            let inner = region.ops.iter().flat_map(|op| op.kind.regions());
            pending.extend(inner.map(|region| (region, depth + 1)));
        }
        deepest
    }

    /// Removes the reports of a traced function.
    pub fn remove_reports(&mut self) {
        let mut pending = vec![&mut self.body];
        while let Some(region) = pending.pop() {
            region.ops.retain(|op| !matches!(op.kind, OpKind::Report(..)));
            pending.extend(region.ops.iter_mut().flat_map(|op| op.kind.regions_mut()));
        }
    }

    /// Renumbers the values in the order of the text form, without gaps.
    pub fn renumber(&mut self) {
        let names = self.names.without_values();
        let mut renumbering = Renumbering {
            new: vec![None; self.values.len()],
            old: self,
            values: Vec::new(),
            names,
        };
        let mut body = std::mem::take(&mut renumbering.old.body);
        renumbering.region(&mut body);
        let Renumbering { values, names, .. } = renumbering;
        self.values = values;
        self.names = names;
        self.body = body;
    }

    /// Adds a new value of each of these types, numbered consecutively.
    pub fn new_values(&mut self, scalars: &[Scalar]) -> Values {
        let first = self.values.len() as u32;
        self.values.extend_from_slice(scalars);
        Values { first, count: scalars.len() as u32 }
    }

    /// Appends an operation with one result of this type to `ops`, and returns the result.
    pub fn push(&mut self, ops: &mut Vec<Op>, scalar: Scalar, kind: OpKind) -> Value {
        let results = self.new_values(&[scalar]);
        ops.push(Op { results, precise: false, kind });
        results.get(0)
    }
}

/// The new numbers of values by their old ones, and the types and names by the new ones.
struct Renumbering<'a> {
    old: &'a mut Function,
    new: Vec<Option<Value>>,
    values: Vec<Scalar>,
    names: Names,
}

impl Renumbering<'_> {
    fn region(&mut self, region: &mut Region) {
        for op in &mut region.ops {
            op.kind.for_each_operand_mut(|value| *value = self.renamed(*value));
            let first = self.values.len() as u32;
            for result in op.results.iter() {
                self.define(result);
            }
            op.results.first = first;
            if let OpKind::Loop { body, .. } = &mut op.kind {
                for param in &mut body.params {
                    *param = self.define(*param);
                }
            }
            op.kind.regions_mut().for_each(|region| self.region(region));
        }
        for value in &mut region.yields {
            *value = self.renamed(*value);
        }
    }

    fn define(&mut self, old: Value) -> Value {
        let new = Value(self.values.len() as u32);
        self.values.push(self.old.scalar(old));
        self.names.copy(&self.old.names, 0, old, new);
        self.new[old.0 as usize] = Some(new);
        new
    }

    fn renamed(&self, old: Value) -> Value {
        self.new[old.0 as usize].expect("values are defined before they are used")
    }
}
