//! The decomposition of the language's types into scalars.
//!
//! A type has *leaves*: the scalars, vectors, matrices and colors at the ends of its structs. All
//! elements of an array share the leaves of their type, so an array of structs is stored as a
//! structure of arrays. A value is the list of its scalars, leaf by leaf, and within a leaf element
//! by element. A field of a struct is therefore a range of the struct's list, and each leaf is one
//! [`rtsl_ir::Variable`].

use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Range;
use std::rc::Rc;

use rtsl_ir::{Scalar, Value, Variable, VariableKind};
use rtsl_sema::hir::{Module, StructId, Type};
use rtsl_source::Span;
use rtsl_spec::COLOR_COMPONENTS;

use crate::limits::{self, Lowered};

/// A run of scalars of one type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Leaf {
    /// The suffix after the variable's name: empty, or `.field.field`.
    pub suffix: String,
    /// The type of each scalar.
    pub scalar: Scalar,
    /// The number of scalars.
    pub len: u32,
}

/// The leaves of a type, in order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Layout {
    pub leaves: Vec<Leaf>,
}

impl Layout {
    /// The number of scalars.
    pub fn len(&self) -> u32 {
        self.leaves.iter().map(|leaf| leaf.len).sum()
    }

    /// The type of each scalar, in order.
    pub fn scalars(&self) -> impl Iterator<Item = Scalar> {
        self.leaves.iter().flat_map(|leaf| std::iter::repeat_n(leaf.scalar, leaf.len as usize))
    }

    /// The IR variables that store a value of this layout under `name`.
    pub fn variables(&self, kind: VariableKind, name: &str) -> impl Iterator<Item = Variable> {
        (0..self.leaves.len()).map(move |leaf| self.variable(leaf, kind, name))
    }

    /// The IR variable that stores one leaf of a value of this layout under `name`.
    pub fn variable(&self, leaf: usize, kind: VariableKind, name: &str) -> Variable {
        let Leaf { suffix, scalar, len } = &self.leaves[leaf];
        Variable { kind, name: format!("{name}{suffix}"), scalar: *scalar, len: *len }
    }
}

/// The layouts of a module's types, each computed once.
#[derive(Debug)]
pub(crate) struct Layouts<'m> {
    module: &'m Module,
    made: RefCell<HashMap<Type, Rc<Layout>>>,
    /// For each struct, the first leaf of each field, and behind them the number of leaves.
    first_leaves: RefCell<HashMap<StructId, Rc<[usize]>>>,
}

impl<'m> Layouts<'m> {
    pub fn new(module: &'m Module) -> Self {
        Layouts { module, made: RefCell::default(), first_leaves: RefCell::default() }
    }

    /// The layout of `ty`; for a buffer, that of its elements. Types without data have no leaves.
    pub fn layout(&self, ty: &Type, span: Span) -> Lowered<Rc<Layout>> {
        if let Some(made) = self.made.borrow().get(ty) {
            return Ok(made.clone());
        }
        let scalars = self.scalar_count(ty);
        if scalars > limits::SCALARS_OF_A_TYPE {
            return Err(limits::too_large(span, scalars));
        }
        let mut layout = Layout::default();
        self.collect_leaves(ty, "", 1, &mut layout.leaves);
        let layout = Rc::new(layout);
        self.made.borrow_mut().insert(ty.clone(), layout.clone());
        Ok(layout)
    }

    /// The number of scalars of a type, saturating. Fast even for types far past the limit.
    pub fn scalar_count(&self, ty: &Type) -> u64 {
        match ty {
            Type::Struct(id) => {
                let mut known = HashMap::new();
                self.struct_scalar_count(*id, &mut known)
            }
            other => self.count(other, &mut HashMap::new()),
        }
    }

    fn struct_scalar_count(&self, id: StructId, known: &mut HashMap<StructId, u64>) -> u64 {
        if let Some(count) = known.get(&id) {
            return *count;
        }
        let fields = self.fields(id).iter();
        let count = fields.fold(0u64, |sum, (_, ty)| sum.saturating_add(self.count(ty, known)));
        known.insert(id, count);
        count
    }

    fn count(&self, ty: &Type, known: &mut HashMap<StructId, u64>) -> u64 {
        match ty {
            Type::Void | Type::Reference(_) | Type::Error => 0,
            Type::Scalar(_) => 1,
            Type::Vector(_, size) => u64::from(*size),
            Type::Matrix(columns, rows) => u64::from(*columns) * u64::from(*rows),
            Type::Color => u64::from(COLOR_COMPONENTS),
            Type::Struct(id) => self.struct_scalar_count(*id, known),
            Type::Array(element, count) => {
                self.count(element, known).saturating_mul(u64::from(*count))
            }
            Type::Buffer(element) => self.count(element, known),
        }
    }

    /// Collects the leaves of `ty`, each with `count` times its scalars, for the arrays around it.
    fn collect_leaves(&self, ty: &Type, suffix: &str, count: u32, leaves: &mut Vec<Leaf>) {
        let mut leaf = |scalar, len: u32| {
            leaves.push(Leaf { suffix: suffix.to_owned(), scalar, len: len * count });
        };
        match ty {
            Type::Void | Type::Reference(_) | Type::Error => {}
            Type::Scalar(scalar) => leaf(*scalar, 1),
            Type::Vector(scalar, size) => leaf(*scalar, u32::from(*size)),
            Type::Matrix(columns, rows) => {
                leaf(Scalar::F32, u32::from(*columns) * u32::from(*rows))
            }
            Type::Color => leaf(Scalar::F32, COLOR_COMPONENTS),
            Type::Struct(id) => {
                for (name, field) in &self.module.structs[id.0 as usize].fields {
                    self.collect_leaves(field, &format!("{suffix}.{name}"), count, leaves);
                }
            }
            Type::Array(element, elements) => {
                self.collect_leaves(element, suffix, count * elements, leaves);
            }
            Type::Buffer(element) => self.collect_leaves(element, suffix, count, leaves),
        }
    }

    /// The fields of a struct.
    pub fn fields(&self, id: StructId) -> &'m [(String, Type)] {
        &self.module.structs[id.0 as usize].fields
    }

    /// The name of a struct.
    pub fn struct_name(&self, id: StructId) -> &'m str {
        &self.module.structs[id.0 as usize].name
    }

    /// The range of a struct's leaves that belong to a field.
    pub fn field_leaves(&self, id: StructId, field: u32, span: Span) -> Lowered<Range<usize>> {
        let first = self.first_leaves(id, span)?;
        Ok(first[field as usize]..first[field as usize + 1])
    }

    fn first_leaves(&self, id: StructId, span: Span) -> Lowered<Rc<[usize]>> {
        if let Some(made) = self.first_leaves.borrow().get(&id) {
            return Ok(made.clone());
        }
        let mut count = 0;
        let mut first = vec![count];
        for (_, ty) in self.fields(id) {
            count += self.layout(ty, span)?.leaves.len();
            first.push(count);
        }
        let first: Rc<[usize]> = first.into();
        self.first_leaves.borrow_mut().insert(id, first.clone());
        Ok(first)
    }

    /// Reorders the scalars of an aggregate from element by element and field by field to leaf by
    /// leaf.
    pub fn by_leaves(&self, ty: &Type, scalars: Vec<Value>, span: Span) -> Lowered<Vec<Value>> {
        let layout = self.layout(ty, span)?;
        if layout.leaves.len() <= 1 {
            return Ok(scalars);
        }
        let mut leaves = vec![Vec::new(); layout.leaves.len()];
        self.deal(ty, &mut scalars.into_iter(), &mut leaves);
        Ok(leaves.concat())
    }

    /// Distributes the scalars of one value to its leaves; returns the number of leaves.
    fn deal(
        &self,
        ty: &Type,
        scalars: &mut impl Iterator<Item = Value>,
        leaves: &mut [Vec<Value>],
    ) -> usize {
        match ty {
            Type::Struct(id) => {
                let mut first = 0;
                for (_, field) in self.fields(*id) {
                    first += self.deal(field, scalars, &mut leaves[first..]);
                }
                first
            }
            Type::Array(element, count) => {
                let mut used = 0;
                for _ in 0..*count {
                    used = self.deal(element, scalars, leaves);
                }
                used
            }
            Type::Void | Type::Reference(_) | Type::Buffer(_) | Type::Error => 0,
            Type::Scalar(_) | Type::Vector(..) | Type::Matrix(..) | Type::Color => {
                leaves[0].extend(scalars.take(self.scalar_count(ty) as usize));
                1
            }
        }
    }
}

/// Builds the value of an array from the values of its elements, whose layout is `element`.
pub(crate) fn join_elements(element: &Layout, elements: &[Vec<Value>]) -> Vec<Value> {
    let mut joined = Vec::new();
    let mut first = 0;
    for leaf in &element.leaves {
        let range = first..first + leaf.len as usize;
        for value in elements {
            joined.extend_from_slice(&value[range.clone()]);
        }
        first = range.end;
    }
    joined
}

/// Extracts the value of one element from the value of an array with `count` elements.
pub(crate) fn split_element(
    element: &Layout,
    array: &[Value],
    count: u32,
    index: u32,
) -> Vec<Value> {
    let mut value = Vec::new();
    let mut first = 0;
    for leaf in &element.leaves {
        let start = first + (index * leaf.len) as usize;
        value.extend_from_slice(&array[start..start + leaf.len as usize]);
        first += (count * leaf.len) as usize;
    }
    value
}
