//! Builds functions operation by operation.

use std::collections::HashMap;

use crate::{
    BinaryOp, CompareOp, Constant, ConstantPool, Function, Index, Name, NameText, Op, OpKind,
    Output, Place, Region, Scalar, UnaryOp, Value, Values, Variable, VariableId, VariableKind,
    evaluate,
};

/// A function under construction: operations are added to the innermost open region.
///
/// Operations on constants are folded at once, and equal constants are one value, defined at the start of the function.
///
/// # Panics
/// The methods may panic if the caller breaks the verifier's rules on types and variables, where they need to inspect
/// them: the builder is for code that has checked its input already.
#[derive(Clone, Debug)]
pub struct Builder {
    function: Function,
    constants: ConstantPool,
    /// The constant of each value that is one.
    known: Vec<Option<Constant>>,
    /// The open regions, the body first.
    open: Vec<OpenRegion>,
    precise: bool,
    /// The place of the operations that follow.
    place: Option<Place>,
    /// Used for lookup only, so the iteration order cannot affect results; likewise the next two maps.
    texts: HashMap<String, NameText>,
    /// A map, because a class may have tens of thousands of members and a method name them all.
    variables: HashMap<(VariableKind, String), VariableId>,
    /// The last number tried to make a local's name unique, by name.
    local_numbers: HashMap<String, u32>,
}

#[derive(Clone, Debug, Default)]
struct OpenRegion {
    region: Region,
    /// For the body of a loop: the initial carried values.
    initial: Vec<Value>,
}

impl Builder {
    /// Returns a builder of an empty function of this name.
    pub fn new(name: impl Into<String>) -> Self {
        Builder {
            function: Function::new(name),
            constants: ConstantPool::default(),
            known: Vec::new(),
            open: vec![OpenRegion::default()],
            precise: false,
            place: None,
            texts: HashMap::new(),
            variables: HashMap::new(),
            local_numbers: HashMap::new(),
        }
    }

    /// Returns the function so far: its variables, outputs and types of values, without the open regions.
    pub fn function(&self) -> &Function {
        &self.function
    }

    /// Returns the type of `value`.
    pub fn scalar(&self, value: Value) -> Scalar {
        self.function.scalar(value)
    }

    /// Returns the constant that `value` is known to be.
    pub fn known(&self, value: Value) -> Option<Constant> {
        self.known.get(value.0 as usize).copied().flatten()
    }

    /// Returns the number of open regions, including the body.
    pub fn depth(&self) -> usize {
        self.open.len()
    }

    /// Returns the number of values so far. It grows with every operation, so callers can bound the size.
    pub fn value_count(&self) -> usize {
        self.function.values.len()
    }

    /// Marks the operations that follow as precise or not; returns the previous setting.
    pub fn set_precise(&mut self, precise: bool) -> bool {
        std::mem::replace(&mut self.precise, precise)
    }

    /// Sets the place of the operations that follow; returns the previous one.
    pub fn set_place(&mut self, place: Option<Place>) -> Option<Place> {
        std::mem::replace(&mut self.place, place)
    }

    /// Returns the place of the operations that follow.
    pub fn place(&self) -> Option<&Place> {
        self.place.as_ref()
    }

    /// Adds a text for names.
    pub fn name_text(&mut self, text: &str) -> NameText {
        if let Some(known) = self.texts.get(text) {
            return *known;
        }
        let new = self.function.names.add_text(text);
        self.texts.insert(text.to_owned(), new);
        new
    }

    /// Names a value. Constants have no names, since one value is shared by all equal constants.
    pub fn name(&mut self, value: Value, name: Name) {
        if self.known(value).is_none() {
            self.function.names.set(value, name);
        }
    }

    // Variables.

    /// Returns the variable equal to `variable`, which is added if it is missing.
    pub fn variable(&mut self, variable: Variable) -> VariableId {
        if let Some(known) = self.variables.get(&(variable.kind, variable.name.clone())) {
            debug_assert_eq!(*self.function.variable(*known), variable);
            return *known;
        }
        let new = VariableId(self.function.variables.len() as u32);
        self.variables.insert((variable.kind, variable.name.clone()), new);
        self.function.variables.push(variable);
        new
    }

    /// Adds a new local; its name starts with `name`, with a number appended if that is taken.
    pub fn local(&mut self, name: &str, scalar: Scalar, len: u32) -> VariableId {
        let mut key = (VariableKind::Local, name.to_owned());
        if self.variables.contains_key(&key) {
            let number = self.local_numbers.entry(name.to_owned()).or_insert(1);
            while self.variables.contains_key(&key) {
                *number += 1;
                key.1 = format!("{name}.{number}");
            }
        }
        let (kind, name) = key;
        self.variable(Variable { kind, name, scalar, len })
    }

    /// Makes `value` the output to this scalar of a variable.
    pub fn output(&mut self, variable: VariableId, component: u32, value: Value) {
        assert_eq!(self.open.len(), 1, "outputs belong to the function's body");
        self.function.outputs.push(Output { variable, component });
        self.region().yields.push(value);
    }

    // Operations.

    /// Adds an operation of any kind, without folding, and returns its results.
    pub fn push(&mut self, kind: OpKind) -> Values {
        let mut scalars = Vec::new();
        kind.result_scalars(&self.function, &mut scalars);
        let results = self.function.new_values(&scalars);
        if let Some(place) = &self.place {
            results.iter().for_each(|result| self.function.names.set_place(result, place));
        }
        let precise = self.precise;
        self.region().ops.push(Op { results, precise, kind });
        results
    }

    /// Adds an operation with one result, or folds it to a constant.
    pub fn emit(&mut self, kind: OpKind) -> Value {
        match evaluate::fold(&kind, |value| self.known(value)) {
            Some(constant) => self.constant(constant),
            None => self.push(kind).get(0),
        }
    }

    /// Returns the value of a constant.
    pub fn constant(&mut self, constant: Constant) -> Value {
        let value = self.constants.intern(&mut self.function.values, constant);
        let index = value.0 as usize;
        if self.known.len() <= index {
            self.known.resize(index + 1, None);
        }
        self.known[index] = Some(constant);
        value
    }

    /// Returns the value of a constant of type f32.
    pub fn f32(&mut self, constant: f32) -> Value {
        self.constant(Constant::F32(constant))
    }

    /// Returns the value of a constant of type i32.
    pub fn i32(&mut self, constant: i32) -> Value {
        self.constant(Constant::I32(constant))
    }

    /// Returns the value of a constant of type u32.
    pub fn u32(&mut self, constant: u32) -> Value {
        self.constant(Constant::U32(constant))
    }

    /// Returns the value of a constant of type bool.
    pub fn bool(&mut self, constant: bool) -> Value {
        self.constant(Constant::Bool(constant))
    }

    /// [`OpKind::Unary`]
    pub fn unary(&mut self, op: UnaryOp, a: Value) -> Value {
        self.emit(OpKind::Unary(op, a))
    }

    /// [`OpKind::Binary`]
    pub fn binary(&mut self, op: BinaryOp, a: Value, b: Value) -> Value {
        self.emit(OpKind::Binary(op, a, b))
    }

    /// [`BinaryOp::Add`]
    pub fn add(&mut self, a: Value, b: Value) -> Value {
        self.binary(BinaryOp::Add, a, b)
    }

    /// [`BinaryOp::Subtract`]
    pub fn subtract(&mut self, a: Value, b: Value) -> Value {
        self.binary(BinaryOp::Subtract, a, b)
    }

    /// [`BinaryOp::Multiply`]
    pub fn multiply(&mut self, a: Value, b: Value) -> Value {
        self.binary(BinaryOp::Multiply, a, b)
    }

    /// [`BinaryOp::Divide`]
    pub fn divide(&mut self, a: Value, b: Value) -> Value {
        self.binary(BinaryOp::Divide, a, b)
    }

    /// [`UnaryOp::Not`]
    pub fn not(&mut self, a: Value) -> Value {
        self.unary(UnaryOp::Not, a)
    }

    /// [`BinaryOp::And`]
    pub fn and(&mut self, a: Value, b: Value) -> Value {
        self.binary(BinaryOp::And, a, b)
    }

    /// [`BinaryOp::Or`]
    pub fn or(&mut self, a: Value, b: Value) -> Value {
        self.binary(BinaryOp::Or, a, b)
    }

    /// [`OpKind::Compare`]
    pub fn compare(&mut self, op: CompareOp, a: Value, b: Value) -> Value {
        self.emit(OpKind::Compare(op, a, b))
    }

    /// [`OpKind::Select`]; the chosen value if the condition is known.
    pub fn select(&mut self, condition: Value, a: Value, b: Value) -> Value {
        match self.known(condition) {
            Some(known) => [b, a][known.bits() as usize],
            None if a == b => a,
            None => self.emit(OpKind::Select(condition, a, b)),
        }
    }

    /// [`OpKind::Fma`]
    pub fn fma(&mut self, a: Value, b: Value, c: Value) -> Value {
        self.emit(OpKind::Fma(a, b, c))
    }

    /// [`OpKind::Convert`]; the value itself if it has that type.
    pub fn convert(&mut self, to: Scalar, a: Value) -> Value {
        if self.scalar(a) == to { a } else { self.emit(OpKind::Convert(to, a)) }
    }

    /// [`OpKind::Bitcast`]; the value itself if it has that type.
    pub fn bitcast(&mut self, to: Scalar, a: Value) -> Value {
        if self.scalar(a) == to { a } else { self.emit(OpKind::Bitcast(to, a)) }
    }

    /// Loads the scalar of a variable at a constant index.
    pub fn load(&mut self, variable: VariableId, index: u32) -> Value {
        self.push(OpKind::Load(variable, Index::Constant(index))).get(0)
    }

    /// Loads the scalar of a variable at an i32, constant or not. A known index must be in range.
    pub fn load_at(&mut self, variable: VariableId, index: Value) -> Value {
        let index = self.index(index);
        self.push(OpKind::Load(variable, index)).get(0)
    }

    /// Stores to a local at a constant index.
    pub fn store(&mut self, local: VariableId, index: u32, value: Value) {
        self.push(OpKind::Store(local, Index::Constant(index), value));
    }

    /// Stores to a local at an i32, constant or not. A known index must be in range.
    pub fn store_at(&mut self, local: VariableId, index: Value, value: Value) {
        let index = self.index(index);
        self.push(OpKind::Store(local, index, value));
    }

    /// [`OpKind::Length`]
    pub fn length(&mut self, buffer: VariableId) -> Value {
        self.emit(OpKind::Length(buffer))
    }

    /// [`OpKind::ReportBudget`]
    pub fn report_budget(&mut self) {
        self.push(OpKind::ReportBudget);
    }

    // Regions.

    /// Opens a region, to which operations are added until [`Builder::end_region`].
    pub fn begin_region(&mut self) {
        self.open.push(OpenRegion::default());
    }

    /// Closes the innermost region opened by [`Builder::begin_region`].
    pub fn end_region(&mut self, yields: Vec<Value>) -> Region {
        let OpenRegion { mut region, initial } = self.close();
        assert!(initial.is_empty() && region.params.is_empty(), "the open region is a loop's");
        region.yields = yields;
        region
    }

    /// Adds an `if` of two closed regions.
    pub fn if_regions(&mut self, condition: Value, then: Region, otherwise: Region) -> Values {
        self.push(OpKind::If { condition, then, otherwise })
    }

    /// Adds an `if` whose regions the closures fill; they return the yields.
    pub fn if_(
        &mut self,
        condition: Value,
        then: impl FnOnce(&mut Self) -> Vec<Value>,
        otherwise: impl FnOnce(&mut Self) -> Vec<Value>,
    ) -> Values {
        self.begin_region();
        let yields = then(self);
        let then = self.end_region(yields);
        self.begin_region();
        let yields = otherwise(self);
        let otherwise = self.end_region(yields);
        self.if_regions(condition, then, otherwise)
    }

    /// Opens the body of a loop and returns its carried values.
    pub fn begin_loop(&mut self, initial: Vec<Value>) -> Values {
        let scalars: Vec<Scalar> = initial.iter().map(|value| self.scalar(*value)).collect();
        let params = self.function.new_values(&scalars);
        let region = Region { params: params.iter().collect(), ..Region::default() };
        self.open.push(OpenRegion { region, initial });
        params
    }

    /// Closes the body of the innermost loop. The loop repeats with the `next` carried values while `again` is true,
    /// and ends with them as its results.
    pub fn end_loop(&mut self, again: Value, next: &[Value]) -> Values {
        let OpenRegion { region: mut body, initial } = self.close();
        assert_eq!(initial.len(), next.len(), "a loop carries as many values as it starts with");
        body.yields = [&[again], next].concat();
        self.push(OpKind::Loop { initial, body })
    }

    /// Adds a loop whose body the closure fills from the carried values; the closure returns `again` and the next
    /// carried values.
    pub fn loop_(
        &mut self,
        initial: Vec<Value>,
        body: impl FnOnce(&mut Self, Values) -> (Value, Vec<Value>),
    ) -> Values {
        let params = self.begin_loop(initial);
        let (again, next) = body(self, params);
        self.end_loop(again, &next)
    }

    /// Returns the function, with its constants at the start.
    pub fn finish(mut self) -> Function {
        let OpenRegion { region, .. } = self.close();
        assert!(self.open.is_empty(), "{} regions are still open", self.open.len());
        self.function.body = region;
        self.constants.define_in(&mut self.function);
        self.function
    }

    fn region(&mut self) -> &mut Region {
        &mut self.open.last_mut().expect("the body is open").region
    }

    fn close(&mut self) -> OpenRegion {
        self.open.pop().expect("a region is open")
    }

    fn index(&self, index: Value) -> Index {
        match self.known(index) {
            Some(constant) => Index::Constant(constant.bits()),
            None => Index::Dynamic(index),
        }
    }
}
