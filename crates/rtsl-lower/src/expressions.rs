//! Expressions.

use rtsl_ir::{UnaryOp, Value};
use rtsl_sema::hir::{
    BinaryOperator, Expression, ExpressionKind, StepOperator, Type, UnaryOperator,
};
use rtsl_spec::builtins::{Builtin, Lowering as BuiltinLowering, Special};

use crate::access::{Access, element_count};
use crate::facts::{CHOICE, Root, root_of};
use crate::layout::split_element;
use crate::limits::Lowered;
use crate::operators::Operand;
use crate::parameters::reference_role;
use crate::variables::RANK_OF_TEMPORARIES;
use crate::{Lowering, Purpose};
use rtsl_sema::walk::{Node, walk_expression};

impl<'m> Lowering<'m> {
    /// Lowers an expression to the scalars of its value, leaf by leaf; none for `void`.
    pub fn lower_expression(&mut self, expression: &'m Expression) -> Lowered<Vec<Value>> {
        self.enter(expression.span)?;
        let values = match &expression.kind {
            ExpressionKind::Constant(constants) => {
                let values = constants.iter().map(|value| self.builder.constant(*value)).collect();
                self.layouts.by_leaves(&expression.ty, values, expression.span)
            }
            ExpressionKind::Local(_) | ExpressionKind::Member(_) | ExpressionKind::State(_) => {
                self.lower_variable(expression)
            }
            ExpressionKind::Textured(id) => self.lower_textured(*id, expression.span),
            ExpressionKind::Computed(id, function) => {
                self.lower_computed(*id, *function, expression.span)
            }
            ExpressionKind::Swizzle(whole, _)
            | ExpressionKind::Field(whole, _)
            | ExpressionKind::Index(whole, _) => self.lower_part(whole, expression),
            ExpressionKind::Convert(value) | ExpressionKind::Length(value) => {
                self.lower_conversion(value, expression)
            }
            ExpressionKind::Construct(parts) => {
                self.lower_construct(&expression.ty, parts, expression.span)
            }
            ExpressionKind::Unary(operator, value) => self.lower_unary(*operator, value),
            ExpressionKind::Binary(..)
            | ExpressionKind::And(..)
            | ExpressionKind::Or(..)
            | ExpressionKind::Sequence(..) => self.lower_chain(expression),
            ExpressionKind::Assign { target, operator, value } => {
                self.lower_assign(target, *operator, value)
            }
            ExpressionKind::Step { target, by, prefix } => self.lower_step(target, *by, *prefix),
            ExpressionKind::Conditional(condition, a, b) => self.lower_conditional(condition, a, b),
            ExpressionKind::Call(function, arguments) => {
                self.lower_call(*function, arguments, expression.span)
            }
            ExpressionKind::Builtin(call) => self.lower_builtin(call, expression),
            ExpressionKind::ReferenceCall(call) => self.lower_reference_call(call, expression.span),
            ExpressionKind::IsSet(reference) => self.lower_is_set(reference),
            ExpressionKind::Error => unreachable!("trees with errors are not lowered"),
        }?;
        self.leave();
        Ok(values)
    }

    /// Lowers an expression with one scalar.
    pub fn lower_scalar(&mut self, expression: &'m Expression) -> Lowered<Value> {
        Ok(self.lower_expression(expression)?[0])
    }

    /// Lowers a value, as precise if it is assigned to a `precise` variable.
    pub fn lower_precisely(&mut self, precise: bool, value: &'m Expression) -> Lowered<Vec<Value>> {
        self.precisely(precise, |lowering| lowering.lower_expression(value))
    }

    /// Marks the operations that `compute` adds as precise, or leaves the current setting.
    pub fn precisely<T>(
        &mut self,
        precise: bool,
        compute: impl FnOnce(&mut Self) -> Lowered<T>,
    ) -> Lowered<T> {
        if !precise {
            return compute(self);
        }
        let outer = self.builder.set_precise(true);
        let computed = compute(self);
        self.builder.set_precise(outer);
        computed
    }

    fn lower_variable(&mut self, expression: &'m Expression) -> Lowered<Vec<Value>> {
        match self.lower_access(expression)? {
            Some(access) => self.read(&access),
            None => Ok(Vec::new()),
        }
    }

    /// Lowers a part of a variable, of a constant table or of a computed value.
    fn lower_part(
        &mut self,
        whole: &'m Expression,
        expression: &'m Expression,
    ) -> Lowered<Vec<Value>> {
        if let Some(access) = self.lower_access(expression)? {
            return self.read(&access);
        }
        if let ExpressionKind::Index(_, index) = &expression.kind
            && !matches!(index.kind, ExpressionKind::Constant(_))
            && element_count(&whole.ty).is_some_and(|count| count > CHOICE)
            && let Some(table) = self.host_variable_of(whole)?
        {
            let index = self.lower_scalar(index)?;
            let access = Access::element(table, index, &whole.ty, &expression.ty, whole.span);
            return self.read(&access);
        }
        let values = self.lower_expression(whole)?;
        match &expression.kind {
            ExpressionKind::Swizzle(_, components) => {
                Ok(components.iter().map(|pick| values[usize::from(*pick)]).collect())
            }
            ExpressionKind::Field(_, field) => self.field_of_value(whole, *field, &values),
            ExpressionKind::Index(_, index) => {
                let index = self.lower_scalar(index)?;
                self.element_of_value(whole, &expression.ty, values, index)
            }
            _ => unreachable!("a part is a swizzle, field or element"),
        }
    }

    fn field_of_value(
        &mut self,
        whole: &Expression,
        field: u32,
        values: &[Value],
    ) -> Lowered<Vec<Value>> {
        let Type::Struct(id) = whole.ty else { unreachable!("only structs have fields") };
        let layout = self.layouts.layout(&whole.ty, whole.span)?;
        let leaves = self.layouts.field_leaves(id, field, whole.span)?;
        let scalars = |range: std::ops::Range<usize>| -> usize {
            layout.leaves[range].iter().map(|leaf| leaf.len as usize).sum()
        };
        let first = scalars(0..leaves.start);
        Ok(values[first..first + scalars(leaves)].to_vec())
    }

    fn element_of_value(
        &mut self,
        whole: &'m Expression,
        element: &Type,
        values: Vec<Value>,
        index: Value,
    ) -> Lowered<Vec<Value>> {
        let count = element_count(&whole.ty).expect("buffers are variables");
        let layout = self.layouts.layout(element, whole.span)?;
        if let Some(known) = self.known_index(index) {
            return Ok(split_element(&layout, &values, count, known.min(count - 1)));
        }
        if count <= CHOICE {
            let elements = (0..count).map(|index| split_element(&layout, &values, count, index));
            return Ok(self.choose(index, elements.collect()));
        }
        let copy =
            self.new_variable("temporary", &whole.ty, true, RANK_OF_TEMPORARIES, whole.span)?;
        self.set_variable(copy, &values);
        let access = Access::element(copy, index, &whole.ty, element, whole.span);
        let value = self.read(&access)?;
        self.release_locals([copy]);
        Ok(value)
    }

    fn lower_conversion(
        &mut self,
        value: &'m Expression,
        expression: &'m Expression,
    ) -> Lowered<Vec<Value>> {
        if matches!(expression.kind, ExpressionKind::Length(_)) {
            return self.lower_length(value);
        }
        let values = self.lower_expression(value)?;
        let layout = self.layouts.layout(&expression.ty, expression.span)?;
        let converted = layout.scalars().zip(values);
        Ok(converted.map(|(scalar, value)| self.builder.convert(scalar, value)).collect())
    }

    fn lower_length(&mut self, buffer: &'m Expression) -> Lowered<Vec<Value>> {
        if let Some(count) = element_count(&buffer.ty) {
            return Ok(vec![self.builder.i32(count as i32)]);
        }
        if reference_role(&buffer.ty).is_some() {
            let place = self.lower_reference(buffer)?;
            return Ok(vec![self.reference_count(place.member)]);
        }
        let length = match self.lower_access(buffer)? {
            Some(access) => self.length_of_buffer(access.root),
            None => None,
        };
        Ok(vec![length.unwrap_or_else(|| self.builder.i32(0))])
    }

    fn lower_unary(
        &mut self,
        operator: UnaryOperator,
        value: &'m Expression,
    ) -> Lowered<Vec<Value>> {
        let op = match operator {
            UnaryOperator::Plus => return self.lower_expression(value),
            UnaryOperator::Negate => UnaryOp::Negate,
            UnaryOperator::Not | UnaryOperator::BitNot => UnaryOp::Not,
        };
        let values = self.lower_expression(value)?;
        Ok(values.into_iter().map(|value| self.builder.unary(op, value)).collect())
    }

    /// Lowers a chain of operations, each of which is the left operand of the next, the innermost
    /// first.
    fn lower_chain(&mut self, expression: &'m Expression) -> Lowered<Vec<Value>> {
        let (first, links) = expression.chain();
        let mut values = self.lower_expression(first)?;
        for link in links {
            self.enter(link.span)?;
            values = match &link.kind {
                ExpressionKind::Binary(operator, a, b) => {
                    let right = self.lower_expression(b)?;
                    let a = Operand { ty: &a.ty, values: &values };
                    self.binary(*operator, a, Operand { ty: &b.ty, values: &right })
                }
                ExpressionKind::And(_, b) => self.lower_logical(false, values[0], b)?,
                ExpressionKind::Or(_, b) => self.lower_logical(true, values[0], b)?,
                ExpressionKind::Sequence(_, b) => self.lower_expression(b)?,
                _ => values,
            };
            self.leave();
        }
        Ok(values)
    }

    /// Lowers `first || b` if `or`, else `first && b`.
    fn lower_logical(&mut self, or: bool, first: Value, b: &'m Expression) -> Lowered<Vec<Value>> {
        if self.builder.known(first).is_none() && is_cheap(b) {
            let second = self.lower_scalar(b)?;
            return Ok(vec![if or {
                self.either(first, second)
            } else {
                self.both(first, second)
            }]);
        }
        let decided = |lowering: &mut Self| Ok(vec![lowering.builder.bool(or)]);
        let second = |lowering: &mut Self| Ok(vec![lowering.lower_scalar(b)?]);
        if or {
            self.lower_if(first, b.span, decided, second)
        } else {
            self.lower_if(first, b.span, second, decided)
        }
    }

    fn lower_conditional(
        &mut self,
        condition: &'m Expression,
        a: &'m Expression,
        b: &'m Expression,
    ) -> Lowered<Vec<Value>> {
        let span = condition.span;
        let condition = self.lower_scalar(condition)?;
        if self.builder.known(condition).is_none() && is_cheap(a) && is_cheap(b) {
            let a = self.lower_expression(a)?;
            let b = self.lower_expression(b)?;
            return Ok(self.select_all(condition, &a, &b));
        }
        self.lower_if(
            condition,
            span,
            |lowering| lowering.lower_expression(a),
            |lowering| lowering.lower_expression(b),
        )
    }

    fn lower_assign(
        &mut self,
        target: &'m Expression,
        operator: Option<BinaryOperator>,
        value: &'m Expression,
    ) -> Lowered<Vec<Value>> {
        self.precisely(self.is_precise_target(target), |lowering| {
            let access = lowering.lower_access(target)?.expect("targets are parts of variables");
            let new = match operator {
                None => lowering.lower_expression(value)?,
                Some(operator) => {
                    let old = lowering.read(&access)?;
                    let value_of = lowering.lower_expression(value)?;
                    let old = Operand { ty: &target.ty, values: &old };
                    lowering.binary(operator, old, Operand { ty: &value.ty, values: &value_of })
                }
            };
            lowering.write(&access, &new)?;
            lowering.report_assignment(target, &new);
            Ok(new)
        })
    }

    fn lower_step(
        &mut self,
        target: &'m Expression,
        by: StepOperator,
        prefix: bool,
    ) -> Lowered<Vec<Value>> {
        self.precisely(self.is_precise_target(target), |lowering| {
            let access = lowering.lower_access(target)?.expect("targets are parts of variables");
            let old = lowering.read(&access)?;
            let new: Vec<Value> = old.iter().map(|old| lowering.step(by, *old)).collect();
            lowering.write(&access, &new)?;
            lowering.report_assignment(target, &new);
            Ok(if prefix { new } else { old })
        })
    }

    fn is_precise_target(&self, target: &Expression) -> bool {
        match root_of(target) {
            Some(Root::Local(local)) => self.is_precise(local),
            Some(Root::Member(_) | Root::State(_) | Root::Accepted) | None => false,
        }
    }

    /// True if this indexes a table of constants that has to be in memory.
    pub fn reads_table(&self, expression: &Expression) -> bool {
        let mut dynamic = false;
        let mut part = expression;
        loop {
            match &part.kind {
                ExpressionKind::Index(whole, index) => {
                    dynamic |= matches!(whole.ty, Type::Array(..))
                        && !matches!(index.kind, ExpressionKind::Constant(_));
                    part = whole;
                }
                ExpressionKind::Field(whole, _) | ExpressionKind::Swizzle(whole, _) => part = whole,
                ExpressionKind::Constant(constants) => {
                    return dynamic
                        && constants.len() > SMALL_TABLE
                        && self.purpose != Purpose::Initializer;
                }
                _ => return false,
            }
        }
    }
}

/// The maximum number of scalars of a constant table that is indexed by selects.
const SMALL_TABLE: usize = 8;

/// The maximum number of nodes of an expression that is evaluated speculatively.
const CHEAP_NODES: u32 = 12;

/// True if an expression has no effects and costs little, so that evaluating it always is cheaper
/// than a branch. Every operation is defined for all operands.
pub(crate) fn is_cheap(expression: &Expression) -> bool {
    let mut nodes = 0;
    let mut cheap = true;
    walk_expression(expression, |node| {
        let Node::Expression(part) = node else { return };
        nodes += 1;
        cheap &= !matches!(part.ty, Type::Struct(_) | Type::Array(..))
            || matches!(part.kind, ExpressionKind::Local(_) | ExpressionKind::Member(_));
        cheap &= match &part.kind {
            ExpressionKind::Constant(_)
            | ExpressionKind::Local(_)
            | ExpressionKind::Member(_)
            | ExpressionKind::State(_)
            | ExpressionKind::Swizzle(..)
            | ExpressionKind::Field(..)
            | ExpressionKind::Index(..)
            | ExpressionKind::Convert(_)
            | ExpressionKind::Construct(_)
            | ExpressionKind::Unary(..)
            | ExpressionKind::Binary(..)
            | ExpressionKind::And(..)
            | ExpressionKind::Or(..)
            | ExpressionKind::Conditional(..)
            | ExpressionKind::IsSet(_)
            | ExpressionKind::Length(_) => true,
            ExpressionKind::Builtin(call) => is_cheap_builtin(call.builtin),
            ExpressionKind::Assign { .. }
            | ExpressionKind::Step { .. }
            | ExpressionKind::Sequence(..)
            | ExpressionKind::Call(..)
            | ExpressionKind::Textured(_)
            | ExpressionKind::Computed(..)
            | ExpressionKind::ReferenceCall(_)
            | ExpressionKind::Error => false,
        };
    });
    cheap && nodes <= CHEAP_NODES
}

fn is_cheap_builtin(builtin: &Builtin) -> bool {
    match builtin.lowering {
        BuiltinLowering::Operation(_) => true,
        BuiltinLowering::Special(special) => match special {
            Special::Inside
            | Special::IsSet
            | Special::IsTextured
            | Special::Rgb
            | Special::Any
            | Special::All
            | Special::Transpose => true,
            Special::Hit
            | Special::Trace
            | Special::Occluded
            | Special::Ambient
            | Special::NearestHit
            | Special::Query(_)
            | Special::Rand
            | Special::Map(..)
            | Special::Gradient
            | Special::Change(_)
            | Special::MatrixCompMult => false,
        },
        BuiltinLowering::Prelude => false,
    }
}
