//! Visitors of operations: the one module that enumerates the operands and regions of each.

use crate::{
    Index, Op, OpKind, Query, ReferencePath, Region, Value, Variable, VariableId, VariableKind,
};

/// Calls `$visit` with each operand of `$kind`, in the order of the text form. One body serves shared and exclusive
/// access: `$borrow` is `&` or `&mut`, and `$kind` a reference of that sort.
macro_rules! visit_operands {
    ($kind:expr, $visit:expr, $($borrow:tt)+) => {{
        let mut visit = $visit;
        match $kind {
            OpKind::Constant(_)
            | OpKind::Length(_)
            | OpKind::LightCount
            | OpKind::Ambient
            | OpKind::ReferenceCount(_)
            | OpKind::Rand
            | OpKind::ReportBudget => {}
            OpKind::Unary(_, a)
            | OpKind::Convert(_, a)
            | OpKind::Bitcast(_, a)
            | OpKind::Seed(a) => visit(a),
            OpKind::ChainRule(value, factors) => {
                visit(value);
                for (of, factor) in factors {
                    visit(of);
                    visit(factor);
                }
            }
            OpKind::Binary(_, a, b) | OpKind::Compare(_, a, b) | OpKind::Derivative(a, b) => {
                visit(a);
                visit(b);
            }
            OpKind::Select(a, b, c) | OpKind::Fma(a, b, c) => {
                visit(a);
                visit(b);
                visit(c);
            }
            OpKind::Load(_, index) => match index {
                Index::Constant(_) => {}
                Index::Dynamic(index) => visit(index),
            },
            OpKind::Store(_, index, value) => {
                match index {
                    Index::Constant(_) => {}
                    Index::Dynamic(index) => visit(index),
                }
                visit(value);
            }
            OpKind::If { condition, then: _, otherwise: _ } => visit(condition),
            OpKind::Loop { initial, body: _ } => {
                for value in initial {
                    visit(value);
                }
            }
            OpKind::Trace { origin, direction, limit, weight } => {
                for value in origin {
                    visit(value);
                }
                for value in direction {
                    visit(value);
                }
                visit(limit);
                visit(weight);
            }
            OpKind::Occluded { origin, direction, limit } => {
                for value in origin {
                    visit(value);
                }
                for value in direction {
                    visit(value);
                }
                visit(limit);
            }
            OpKind::LightSample { index, point, normal, cosine } => {
                visit(index);
                for value in point {
                    visit(value);
                }
                for value in normal {
                    visit(value);
                }
                visit(cosine);
            }
            OpKind::Query(_, operands) | OpKind::Report(_, operands) => {
                for value in operands {
                    visit(value);
                }
            }
            OpKind::ReferenceCall(call) => {
                match $($borrow)+ call.path {
                    ReferencePath::Single => {}
                    ReferencePath::Element(index) => visit(index),
                }
                for (_, value) in $($borrow)+ call.overrides {
                    visit(value);
                }
            }
            OpKind::IsSet(_, path) => match path {
                ReferencePath::Single => {}
                ReferencePath::Element(index) => visit(index),
            },
        }
    }};
}

/// The side effect of an operation. Its regions have their effects separately.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// None: the operation may be removed, repeated, moved and speculated.
    None,
    /// The result depends on previous stores to this local.
    ReadsLocal(VariableId),
    /// Stores to this local.
    WritesLocal(VariableId),
    /// Queries the host, which may advance samplers and count calls: neither removed nor reordered.
    Host,
}

impl OpKind {
    /// Calls `visit` with each operand, in the order of the text form. Values that regions of the operation yield are
    /// not included.
    pub fn for_each_operand(&self, mut visit: impl FnMut(Value)) {
        visit_operands!(self, |value: &Value| visit(*value), &)
    }

    /// Like [`OpKind::for_each_operand`], with mutable access.
    pub fn for_each_operand_mut(&mut self, visit: impl FnMut(&mut Value)) {
        visit_operands!(self, visit, &mut)
    }

    /// Returns the regions of the operation, in the order of the text form.
    pub fn regions(&self) -> impl DoubleEndedIterator<Item = &Region> {
        let regions = match self {
            OpKind::If { then, otherwise, .. } => [Some(then), Some(otherwise)],
            OpKind::Loop { body, .. } => [Some(body), None],
            _ => [None, None],
        };
        regions.into_iter().flatten()
    }

    /// Like [`OpKind::regions`], with mutable access.
    pub fn regions_mut(&mut self) -> impl DoubleEndedIterator<Item = &mut Region> {
        let regions = match self {
            OpKind::If { then, otherwise, .. } => [Some(then), Some(otherwise)],
            OpKind::Loop { body, .. } => [Some(body), None],
            _ => [None, None],
        };
        regions.into_iter().flatten()
    }

    /// Returns the side effect of the operation itself, in a function with these variables.
    pub fn effect(&self, variables: &[Variable]) -> Effect {
        let is_local =
            |variable: &VariableId| variables[variable.0 as usize].kind == VariableKind::Local;
        match self {
            OpKind::Load(variable, _) if is_local(variable) => Effect::ReadsLocal(*variable),
            OpKind::Store(variable, ..) => Effect::WritesLocal(*variable),
            OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightSample { .. }
            | OpKind::Rand
            | OpKind::ReferenceCall(_)
            | OpKind::ReportBudget
            | OpKind::Report(..) => Effect::Host,
            OpKind::Query(query, _) => query.effect(),
            OpKind::Constant(_)
            | OpKind::Unary(..)
            | OpKind::Binary(..)
            | OpKind::Compare(..)
            | OpKind::Select(..)
            | OpKind::Fma(..)
            | OpKind::Convert(..)
            | OpKind::Bitcast(..)
            | OpKind::Load(..)
            | OpKind::Length(_)
            | OpKind::If { .. }
            | OpKind::Loop { .. }
            | OpKind::LightCount
            | OpKind::Ambient
            | OpKind::Seed(_)
            | OpKind::Derivative(..)
            | OpKind::ChainRule(..)
            | OpKind::IsSet(..)
            | OpKind::ReferenceCount(_) => Effect::None,
        }
    }
}

impl Region {
    /// Calls `visit` with every operation of this region and the regions nested in it, in the order of the text form:
    /// an operation before those of its regions.
    pub fn for_each_op<'a>(&'a self, visit: &mut impl FnMut(&'a Op)) {
        for op in &self.ops {
            visit(op);
            for region in op.kind.regions() {
                region.for_each_op(visit);
            }
        }
    }

    /// True if an operation of this region or of those nested in it asks a query that `is_wanted`.
    pub fn asks(&self, is_wanted: impl Fn(Query) -> bool) -> bool {
        let mut asks = false;
        self.for_each_op(&mut |op| {
            asks |= matches!(op.kind, OpKind::Query(query, _) if is_wanted(query));
        });
        asks
    }

    /// Calls `visit` with every use of a value in this region and the regions nested in it: operands and yields.
    pub fn for_each_use(&self, visit: &mut impl FnMut(Value)) {
        for op in &self.ops {
            op.kind.for_each_operand(&mut *visit);
            for region in op.kind.regions() {
                region.for_each_use(visit);
            }
        }
        self.yields.iter().for_each(|value| visit(*value));
    }

    /// Like [`Region::for_each_use`], with mutable access.
    pub fn for_each_use_mut(&mut self, visit: &mut impl FnMut(&mut Value)) {
        for op in &mut self.ops {
            op.kind.for_each_operand_mut(&mut *visit);
            for region in op.kind.regions_mut() {
                region.for_each_use_mut(visit);
            }
        }
        self.yields.iter_mut().for_each(visit);
    }
}
