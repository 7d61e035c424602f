//! Functions, regions and values.

use crate::{Names, Op, OpKind, Scalar, Variable, VariableId, VariableKind};

/// How deep regions may be nested in a function's body, so that walking them by recursion is safe.
pub const MAX_NESTING: usize = 256;

/// An SSA value: an index into [`Function::values`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Value(pub u32);

/// A run of values with consecutive numbers: the results of one operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct Values {
    /// The number of the first.
    pub first: u32,
    /// How many.
    pub count: u32,
}

impl Values {
    /// The value at `index`.
    ///
    /// # Panics
    /// If there are not that many.
    pub fn get(self, index: u32) -> Value {
        assert!(index < self.count, "value {index} of {}", self.count);
        Value(self.first + index)
    }

    /// All of them.
    pub fn iter(self) -> impl DoubleEndedIterator<Item = Value> + ExactSizeIterator {
        (self.first..self.first.saturating_add(self.count)).map(Value)
    }
}

/// Operations in order, and the values handed to whoever holds the region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Region {
    /// Values defined on entry: the carried values of a loop; none elsewhere.
    pub params: Vec<Value>,
    /// The operations, in order.
    pub ops: Vec<Op>,
    /// What the region gives: the results of an `if`; for the body of a loop first a bool, "again",
    /// then the next carried values; for a function's body one value for each output.
    pub yields: Vec<Value>,
}

/// Where a yielded value of a function's body goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Output {
    /// A state, member, parameter, scratch or accepted place.
    pub variable: VariableId,
    /// Which scalar of it.
    pub component: u32,
}

/// What one method does for one ray and one object.
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    /// `Class.method`.
    pub name: String,
    /// The places that it may read and store.
    pub variables: Vec<Variable>,
    /// The type of every value.
    pub values: Vec<Scalar>,
    /// What it does.
    pub body: Region,
    /// Where the body's yields go, one each; no place and component twice.
    pub outputs: Vec<Output>,
    /// What values are called, where that is known.
    pub names: Names,
}

impl Function {
    /// A function that does nothing.
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

    /// The type of `value`.
    pub fn scalar(&self, value: Value) -> Scalar {
        self.values[value.0 as usize]
    }

    /// The place `id`.
    pub fn variable(&self, id: VariableId) -> &Variable {
        &self.variables[id.0 as usize]
    }

    /// The place of this kind and name, if the function has it.
    pub fn find_variable(&self, kind: VariableKind, name: &str) -> Option<VariableId> {
        let found = self
            .variables
            .iter()
            .position(|variable| variable.kind == kind && variable.name == name);
        found.map(|index| VariableId(index as u32))
    }

    /// The place equal to `place`, added where it is missing.
    pub fn intern_place(&mut self, variable: Variable) -> VariableId {
        if let Some(id) = self.find_variable(variable.kind, &variable.name) {
            debug_assert_eq!(*self.variable(id), variable);
            return id;
        }
        self.variables.push(variable);
        VariableId(self.variables.len() as u32 - 1)
    }

    /// How deep regions are nested in the body, 0 where it has none in it.
    pub fn nesting(&self) -> usize {
        let (mut deepest, mut pending) = (0, vec![(&self.body, 0)]);
        while let Some((region, depth)) = pending.pop() {
            deepest = deepest.max(depth);
            let inner = region.ops.iter().flat_map(|op| op.kind.regions());
            pending.extend(inner.map(|region| (region, depth + 1)));
        }
        deepest
    }

    /// Numbers the values anew in the order of the text form, without gaps.
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

    /// A new value of each of these types, numbered consecutively.
    pub fn new_values(&mut self, scalars: &[Scalar]) -> Values {
        let first = self.values.len() as u32;
        self.values.extend_from_slice(scalars);
        Values { first, count: scalars.len() as u32 }
    }

    /// Appends an operation with one result, of this type, to `ops`, and gives the result.
    pub fn push(&mut self, ops: &mut Vec<Op>, scalar: Scalar, kind: OpKind) -> Value {
        let results = self.new_values(&[scalar]);
        ops.push(Op { results, precise: false, kind });
        results.get(0)
    }
}

/// Values by their old numbers, and the types and names by the new ones.
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
        if let Some(name) = self.old.names.get(old) {
            self.names.set(new, name);
        }
        self.new[old.0 as usize] = Some(new);
        new
    }

    fn renamed(&self, old: Value) -> Value {
        self.new[old.0 as usize].expect("values are defined before they are used")
    }
}
