//! Parts of variables such as `a.b[i].xy`, read and written without touching the rest.

use rtsl_ir::{CompareOp, OpKind, Scalar, Value, VariableId, VariableKind};
use rtsl_sema::hir::{Expression, ExpressionKind, StructId, Type};
use rtsl_source::Span;

use crate::Lowering;
use crate::facts::{CHOICE, root_of};
use crate::leaf_part::LeafPart;
use crate::limits::Lowered;
use crate::variables::{SourceVariable, SourceVariableId, Storage};

/// A part of a variable. Its indices have been evaluated, so that it can be read and then written.
#[derive(Clone, Debug)]
pub(crate) struct Access {
    pub root: SourceVariableId,
    pub steps: Vec<Step>,
    pub ty: Type,
    pub span: Span,
}

/// One step from a value to a part of it.
#[derive(Clone, Debug)]
pub(crate) enum Step {
    Field(StructId, u32),
    Element {
        position: Position,
        /// The number of elements; `None` in a buffer.
        count: Option<u32>,
        /// True if the element is a scalar, vector, matrix or color.
        basic: bool,
    },
    /// Components of a vector; always the last step.
    Components(Vec<u8>),
}

/// The index of an element.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Position {
    /// A constant, which is in range except in a buffer.
    Constant(u32),
    /// An i32 or u32 computed at run time, not yet clamped.
    Dynamic(Value),
}

impl Access {
    /// A whole variable.
    pub fn whole(root: SourceVariableId, ty: Type, span: Span) -> Self {
        Access { root, steps: Vec::new(), ty, span }
    }

    /// An element of a variable.
    pub fn element(
        root: SourceVariableId,
        index: Value,
        whole: &Type,
        element: &Type,
        span: Span,
    ) -> Self {
        let step = Step::Element {
            position: Position::Dynamic(index),
            count: element_count(whole),
            basic: is_basic(element),
        };
        Access { root, steps: vec![step], ty: element.clone(), span }
    }

    pub fn is_whole(&self) -> bool {
        self.steps.is_empty()
    }

    /// Extends the access by a step. Steps after components are merged into them.
    fn then(mut self, step: Step, part: &Expression) -> Access {
        self.ty = part.ty.clone();
        self.span = part.span;
        if let Some(Step::Components(of)) = self.steps.last_mut() {
            match &step {
                Step::Components(components) => {
                    *of = components.iter().map(|pick| of[usize::from(*pick)]).collect();
                    return self;
                }
                Step::Element { position: Position::Constant(index), .. } => {
                    *of = vec![of[*index as usize]];
                    return self;
                }
                Step::Element { .. } | Step::Field(..) => {}
            }
        }
        self.steps.push(step);
        self
    }

    /// Replaces the position of one step by a constant.
    fn with_position(&self, step: usize, chosen: u32) -> Access {
        let mut access = self.clone();
        let before = step.checked_sub(1).map(|before| &self.steps[before]);
        if let Some(Step::Components(components)) = before {
            access.steps.truncate(step - 1);
            access.steps.push(Step::Components(vec![components[chosen as usize]]));
        } else if let Step::Element { position, .. } = &mut access.steps[step] {
            *position = Position::Constant(chosen);
        }
        access
    }
}

impl<'m> Lowering<'m> {
    /// Lowers `expression` to the part of a variable that it denotes; `None` if it is a computed
    /// value.
    pub fn lower_access(&mut self, expression: &'m Expression) -> Lowered<Option<Access>> {
        if root_of(expression).is_some() || self.reads_table(expression) {
            return self.lower_path(expression).map(Some);
        }
        Ok(None)
    }

    fn lower_path(&mut self, expression: &'m Expression) -> Lowered<Access> {
        let (whole, step) = match &expression.kind {
            ExpressionKind::Field(whole, field) => {
                let access = self.lower_path(whole)?;
                let Type::Struct(id) = whole.ty else { unreachable!("only structs have fields") };
                (access, Step::Field(id, *field))
            }
            ExpressionKind::Swizzle(whole, components) => {
                let access = self.lower_path(whole)?;
                (access, Step::Components(components.clone()))
            }
            ExpressionKind::Index(whole, index) => {
                let access = self.lower_path(whole)?;
                (access, self.lower_element(&whole.ty, index)?)
            }
            _ => {
                let id = self.root_variable(expression)?;
                return Ok(Access::whole(id, expression.ty.clone(), expression.span));
            }
        };
        Ok(whole.then(step, expression))
    }

    fn lower_element(&mut self, whole: &Type, index: &'m Expression) -> Lowered<Step> {
        let count = element_count(whole);
        let basic = match whole {
            Type::Array(element, _) | Type::Buffer(element) => is_basic(element),
            _ => true,
        };
        let index = self.lower_scalar(index)?;
        let position = match self.known_index(index) {
            Some(known) => {
                let last = count.map_or(i32::MAX as u32, |count| count - 1);
                Position::Constant(known.min(last))
            }
            None => Position::Dynamic(index),
        };
        Ok(Step::Element { position, count, basic })
    }

    /// The value of an index that is constant, clamped to at least 0.
    pub fn known_index(&self, index: Value) -> Option<u32> {
        let bits = self.builder.known(index)?.bits();
        let negative = self.builder.scalar(index) == Scalar::I32 && (bits as i32) < 0;
        Some(if negative { 0 } else { bits })
    }

    /// The value of a part of a variable.
    pub fn read(&mut self, access: &Access) -> Lowered<Vec<Value>> {
        if access.is_whole() {
            return self.get_variable(access.root);
        }
        if let Some((step, index, count)) = self.choice_to_read(access) {
            let mut values = Vec::with_capacity(count as usize);
            for chosen in 0..count {
                values.push(self.read(&access.with_position(step, chosen))?);
            }
            return Ok(self.choose(index, values));
        }
        let parts = self.resolve(access)?;
        match &self.variable(access.root).storage {
            Storage::Cells(_) => {
                let whole = self.get_variable(access.root)?;
                let variable = self.variable(access.root);
                let mut starts = Vec::with_capacity(variable.layout.leaves.len());
                let mut start = 0;
                for leaf in &variable.layout.leaves {
                    starts.push(start);
                    start += leaf.len;
                }
                let cells = parts.iter().flat_map(|part| {
                    let start = starts[part.leaf];
                    part.positions.iter().map(move |position| start + position)
                });
                Ok(cells.map(|cell| whole[cell as usize]).collect())
            }
            Storage::Locals(locals) => {
                let of_parts: Vec<_> = parts.iter().map(|part| locals[part.leaf]).collect();
                Ok(self.load_parts(&parts, &of_parts))
            }
            Storage::Memory(kind) => {
                let kind = *kind;
                let SourceVariable { name, layout, .. } = &self.variables[access.root.0 as usize];
                let variables = parts.iter().map(|part| layout.variable(part.leaf, kind, name));
                let of_parts: Vec<_> = variables.map(|it| self.builder.variable(it)).collect();
                Ok(self.load_parts(&parts, &of_parts))
            }
        }
    }

    /// Loads parts, each of a variable of its own.
    fn load_parts(&mut self, parts: &[LeafPart], variables: &[VariableId]) -> Vec<Value> {
        let mut values = Vec::new();
        for (part, variable) in parts.iter().zip(variables) {
            for position in part.positions.iter() {
                let kind = OpKind::Load(*variable, self.index_of(part, position));
                values.push(self.builder.push(kind).get(0));
            }
        }
        values
    }

    /// Writes a part of a variable.
    pub fn write(&mut self, access: &Access, values: &[Value]) -> Lowered<()> {
        if access.is_whole() {
            self.set_variable(access.root, values);
            return Ok(());
        }
        if let Some((step, index, count)) = self.choice_to_write(access) {
            return self.write_choices(access, step, index, count, values);
        }
        let parts = self.resolve(access)?;
        if let Storage::Locals(locals) = &self.variable(access.root).storage {
            let of_parts: Vec<_> = parts.iter().map(|part| locals[part.leaf]).collect();
            let mut values = values.iter();
            for (part, local) in parts.iter().zip(of_parts) {
                for (position, value) in part.positions.iter().zip(&mut values) {
                    let index = self.index_of(part, position);
                    self.builder.push(OpKind::Store(local, index, *value));
                }
            }
            return Ok(());
        }
        let mut whole = self.get_variable(access.root)?;
        let layout = self.variable(access.root).layout.clone();
        let mut values = values.iter();
        for part in &parts {
            let start: u32 = layout.leaves[..part.leaf].iter().map(|leaf| leaf.len).sum();
            for (position, value) in part.positions.iter().zip(&mut values) {
                whole[(start + position) as usize] = *value;
            }
        }
        self.set_variable(access.root, &whole);
        Ok(())
    }

    /// Writes the element at a dynamic index: each element becomes a select of the new and the old
    /// value.
    fn write_choices(
        &mut self,
        access: &Access,
        step: usize,
        index: Value,
        count: u32,
        values: &[Value],
    ) -> Lowered<()> {
        for chosen in 0..count {
            let compare = if chosen == 0 {
                CompareOp::LessEqual
            } else if chosen == count - 1 {
                CompareOp::GreaterEqual
            } else {
                CompareOp::Equal
            };
            let condition = self.compare_index(compare, index, chosen);
            let element = access.with_position(step, chosen);
            let old = self.read(&element)?;
            let new = self.select_all(condition, values, &old);
            self.write(&element, &new)?;
        }
        Ok(())
    }

    /// Selects the element at a dynamic index, which is clamped.
    pub fn choose(&mut self, index: Value, elements: Vec<Vec<Value>>) -> Vec<Value> {
        let mut chosen: Option<Vec<Value>> = None;
        for (position, element) in elements.into_iter().enumerate().rev() {
            chosen = Some(match chosen {
                None => element,
                Some(later) => {
                    let condition =
                        self.compare_index(CompareOp::LessEqual, index, position as u32);
                    self.select_all(condition, &element, &later)
                }
            });
        }
        chosen.unwrap_or_default()
    }

    fn compare_index(&mut self, op: CompareOp, index: Value, with: u32) -> Value {
        let with = match self.builder.scalar(index) {
            Scalar::U32 => self.builder.u32(with),
            _ => self.builder.i32(with as i32),
        };
        self.builder.compare(op, index, with)
    }

    pub fn select_all(&mut self, condition: Value, a: &[Value], b: &[Value]) -> Vec<Value> {
        a.iter().zip(b).map(|(a, b)| self.builder.select(condition, *a, *b)).collect()
    }

    /// The first step that needs selects among values for reading.
    fn choice_to_read(&self, access: &Access) -> Option<(usize, Value, u32)> {
        let storage = &self.variable(access.root).storage;
        self.choice(access, |count, basic| match storage {
            Storage::Cells(_) | Storage::Memory(VariableKind::State) => true,
            Storage::Memory(_) => basic && count <= CHOICE,
            Storage::Locals(_) => false,
        })
    }

    fn choice_to_write(&self, access: &Access) -> Option<(usize, Value, u32)> {
        let cells = matches!(self.variable(access.root).storage, Storage::Cells(_));
        self.choice(access, |_, _| cells)
    }

    fn choice(
        &self,
        access: &Access,
        wanted: impl Fn(u32, bool) -> bool,
    ) -> Option<(usize, Value, u32)> {
        let mut after_components = None;
        for (number, step) in access.steps.iter().enumerate() {
            match step {
                Step::Element { position: Position::Dynamic(index), count, basic } => {
                    if let Some(count) = after_components {
                        return Some((number, *index, count));
                    }
                    if let Some(count) = *count
                        && wanted(count, *basic)
                    {
                        return Some((number, *index, count));
                    }
                }
                Step::Components(components) => after_components = Some(components.len() as u32),
                Step::Element { .. } | Step::Field(..) => {}
            }
        }
        None
    }
}

/// True if the type is neither an array nor a struct.
fn is_basic(ty: &Type) -> bool {
    !matches!(ty, Type::Array(..) | Type::Struct(_))
}

/// The number of elements that can be indexed; `None` in a buffer.
pub(crate) fn element_count(whole: &Type) -> Option<u32> {
    match whole {
        Type::Array(_, count) => Some(*count),
        Type::Vector(_, size) => Some(u32::from(*size)),
        Type::Matrix(columns, _) => Some(u32::from(*columns)),
        _ => None,
    }
}
