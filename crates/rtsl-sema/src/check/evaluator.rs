//! Evaluates typed trees with constant leaves, for constant expressions. These may call built-in
//! functions and through them the prelude.
//!
//! A value is the list of its leaves in order. Every operation gives the same bits as at run time
//! with contraction off.

use rtsl_ir::{BinaryOp, Constant, Scalar, UnaryOp};
use rtsl_source::Span;
use rtsl_spec::builtins::Lowering;

use super::evaluated::{Evaluated, Stop, Value};
use super::folding::{
    apply_binary, apply_special, apply_unary, combine, converted, diagonal, operate, resized,
};
use super::types::{StructInfo, component_scalar, leaf_count};
use crate::hir::{
    BinaryOperator, BuiltinCall, Expression, ExpressionKind, Function, FunctionId, LocalId, Loop,
    Member, MemberId, Module, Passing, Statement, StatementKind, StepOperator, Storage, SwitchCase,
    Type, UnaryOperator,
};

/// The limit on operations for one constant expression, not counting those written out in the text.
const EXPRESSION_FUEL: u32 = 200_000;

/// The limit on operations for all constant expressions of a unit.
pub(super) const UNIT_FUEL: u32 = 20_000_000;

/// The evaluation of one constant expression.
#[derive(Debug)]
pub(super) struct Evaluator<'m> {
    module: &'m Module,
    structs: &'m [StructInfo],
    callable: usize,
    fuel: u32,
    calls: bool,
    /// The members whose parameters have the values of their defaults; none where a constant must be one for all
    /// instances.
    members: &'m [Member],
    /// The number of calls around the expression being evaluated.
    depth: u32,
}

/// The locals of the function being evaluated; empty outside of functions.
#[derive(Debug, Default)]
struct Frame {
    locals: Vec<Value>,
    result: Value,
}

/// Some of the leaves of a local.
struct Place {
    local: LocalId,
    leaves: Vec<usize>,
}

impl Place {
    fn read(&self, frame: &Frame) -> Value {
        let value = &frame.locals[self.local.0 as usize];
        self.leaves.iter().map(|leaf| value[*leaf]).collect()
    }

    fn write(&self, value: &[Constant], frame: &mut Frame) {
        for (leaf, value) in self.leaves.iter().zip(value) {
            frame.locals[self.local.0 as usize][*leaf] = *value;
        }
    }
}

/// The destination of an `out` argument.
struct Target {
    place: Place,
    /// The scalar type that the leaves are converted to; `None` for arrays and structs, which do
    /// not convert.
    scalar: Option<Scalar>,
}

impl Target {
    fn write(&self, mut value: Value, frame: &mut Frame) {
        if let Some(scalar) = self.scalar {
            value.iter_mut().for_each(|leaf| *leaf = converted(*leaf, scalar));
        }
        self.place.write(&value, frame);
    }
}

/// The way in which a statement ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    Next,
    Break,
    Continue,
    Return,
}

impl<'m> Evaluator<'m> {
    /// Creates an evaluator that calls only the first `callable` functions of the module. `fuel` is
    /// the number of operations left to the unit.
    pub(super) fn new(
        module: &'m Module,
        structs: &'m [StructInfo],
        callable: usize,
        fuel: u32,
    ) -> Self {
        let fuel = fuel.min(EXPRESSION_FUEL);
        Evaluator { module, structs, callable, fuel, calls: true, members: &[], depth: 0 }
    }

    /// Makes the evaluator treat calls of functions as not constant, for contexts that require no
    /// constant and where the effort is not worthwhile.
    pub(super) fn without_calls(self) -> Self {
        Evaluator { calls: false, ..self }
    }

    /// Makes the evaluator give these members' parameters the values of their defaults.
    pub(super) fn with_defaults(self, members: &'m [Member]) -> Self {
        Evaluator { members, ..self }
    }

    /// Returns the leaves of the expression's value, and the number of operations spent.
    pub(super) fn evaluate(mut self, expression: &Expression) -> (Evaluated<Value>, u32) {
        let fuel = self.fuel;
        let value = self.expression(expression, &mut Frame::default());
        (value, fuel - self.fuel)
    }

    fn spend(&mut self, span: Span, amount: usize) -> Evaluated<()> {
        match self.fuel.checked_sub(amount.min(u32::MAX as usize) as u32) {
            Some(left) => {
                self.fuel = left;
                Ok(())
            }
            None => Err(Stop::TooLong(span)),
        }
    }

    /// Spends fuel inside functions only. Outside of functions everything that is evaluated is
    /// written out in the text, which bounds it.
    fn spend_in_function(&mut self, span: Span, amount: usize) -> Evaluated<()> {
        if self.depth == 0 { Ok(()) } else { self.spend(span, amount) }
    }

    fn zero(&self, ty: &Type) -> Value {
        match ty {
            Type::Struct(id) => {
                let fields = &self.module.structs[id.0 as usize].fields;
                fields.iter().flat_map(|(_, ty)| self.zero(ty)).collect()
            }
            Type::Array(element, size) => {
                let element = self.zero(element);
                element.repeat(*size as usize)
            }
            _ => {
                let scalar = component_scalar(ty).unwrap_or(Scalar::F32);
                vec![Constant::zero(scalar); leaf_count(self.structs, ty) as usize]
            }
        }
    }

    fn expression(&mut self, expression: &Expression, frame: &mut Frame) -> Evaluated<Value> {
        let (ty, span) = (&expression.ty, expression.span);
        self.spend_in_function(span, 1)?;
        match &expression.kind {
            ExpressionKind::Constant(values) => {
                // Larger constants may be named constants, of any size.
                if values.len() > 1 {
                    self.spend(span, values.len())?;
                }
                Ok(values.to_vec())
            }
            ExpressionKind::Local(_)
            | ExpressionKind::Swizzle(..)
            | ExpressionKind::Field(..)
            | ExpressionKind::Index(..) => self.read(expression, frame),
            ExpressionKind::Convert(operand) => self.convert(ty, operand, frame),
            ExpressionKind::Construct(arguments) => self.construct(ty, arguments, span, frame),
            ExpressionKind::Unary(operator, operand) => self.unary(*operator, operand, frame),
            ExpressionKind::Binary(..)
            | ExpressionKind::And(..)
            | ExpressionKind::Or(..)
            | ExpressionKind::Sequence(..) => self.chain(expression, frame),
            ExpressionKind::Assign { target, operator, value } => {
                self.assign(target, *operator, value, frame)
            }
            ExpressionKind::Step { target, by, prefix } => self.step(target, *by, *prefix, frame),
            ExpressionKind::Conditional(condition, then, otherwise) => {
                let chosen = if self.is_met(condition, frame)? { then } else { otherwise };
                self.expression(chosen, frame)
            }
            ExpressionKind::Call(id, arguments) => self.call(*id, arguments, span, frame),
            ExpressionKind::Builtin(call) => self.builtin(ty, call, span, frame),
            ExpressionKind::Error => Err(Stop::Error),
            ExpressionKind::Member(id) => self.default_of(*id, span, frame),
            ExpressionKind::Textured(_)
            | ExpressionKind::Computed(..)
            | ExpressionKind::State(_)
            | ExpressionKind::ReferenceCall(_)
            | ExpressionKind::IsSet(_)
            | ExpressionKind::Length(_) => Err(Stop::NotConstant(span)),
        }
    }

    /// The default of a parameter. Other members may be assigned, and those that textures can give vary.
    fn default_of(&mut self, id: MemberId, span: Span, frame: &mut Frame) -> Evaluated<Value> {
        let members: &'m [Member] = self.members;
        let parameter = members.get(id.0 as usize).filter(|member| {
            member.storage == Storage::Public && !member.textured && member.computed.is_none()
        });
        match parameter.and_then(|it| it.initializer.as_ref()) {
            Some(initializer) => self.expression(initializer, frame),
            None => Err(Stop::NotConstant(span)),
        }
    }

    fn is_met(&mut self, condition: &Expression, frame: &mut Frame) -> Evaluated<bool> {
        Ok(is_true(&self.expression(condition, frame)?))
    }

    /// The leaves of a local that a place expression denotes; `None` for parts of other values.
    fn place(&mut self, place: &Expression, frame: &mut Frame) -> Evaluated<Option<Place>> {
        match &place.kind {
            ExpressionKind::Local(id) => match frame.locals.get(id.0 as usize) {
                Some(value) => Ok(Some(Place { local: *id, leaves: (0..value.len()).collect() })),
                None => Err(Stop::NotConstant(place.span)),
            },
            ExpressionKind::Field(base, _)
            | ExpressionKind::Index(base, _)
            | ExpressionKind::Swizzle(base, _) => {
                let Some(whole) = self.place(base, frame)? else { return Ok(None) };
                self.spend(place.span, whole.leaves.len())?;
                let part = self.part(place, base, frame)?;
                let leaves = part.into_iter().map(|index| whole.leaves[index]).collect();
                Ok(Some(Place { local: whole.local, leaves }))
            }
            _ => Ok(None),
        }
    }

    /// The indices of the leaves of `base` that the field, element or swizzle `whole` selects.
    fn part(
        &mut self,
        whole: &Expression,
        base: &Expression,
        frame: &mut Frame,
    ) -> Evaluated<Vec<usize>> {
        let count = leaf_count(self.structs, &whole.ty) as usize;
        Ok(match &whole.kind {
            ExpressionKind::Field(_, index) => {
                let Type::Struct(id) = base.ty else { return Err(Stop::Error) };
                let fields = &self.module.structs[id.0 as usize].fields[..*index as usize];
                let start: u32 = fields.iter().map(|(_, ty)| leaf_count(self.structs, ty)).sum();
                (start as usize..start as usize + count).collect()
            }
            ExpressionKind::Index(_, index) => {
                let elements = leaf_count(self.structs, &base.ty) as usize / count.max(1);
                let index = clamped(self.expression(index, frame)?, elements);
                (index * count..(index + 1) * count).collect()
            }
            ExpressionKind::Swizzle(_, components) => {
                components.iter().map(|each| usize::from(*each)).collect()
            }
            _ => return Err(Stop::Error),
        })
    }

    fn read(&mut self, place: &Expression, frame: &mut Frame) -> Evaluated<Value> {
        if let Some(place) = self.place(place, frame)? {
            return Ok(place.read(frame));
        }
        let (ExpressionKind::Field(base, _)
        | ExpressionKind::Index(base, _)
        | ExpressionKind::Swizzle(base, _)) = &place.kind
        else {
            return Err(Stop::Error);
        };
        let value = self.expression(base, frame)?;
        let part = self.part(place, base, frame)?;
        Ok(part.into_iter().map(|leaf| value[leaf]).collect())
    }

    /// The destination of an assignment to a local; its indices are evaluated once.
    fn assignable(&mut self, place: &Expression, frame: &mut Frame) -> Evaluated<Place> {
        self.place(place, frame)?.ok_or(Stop::NotConstant(place.span))
    }

    /// The values of a call's arguments, and the destinations of those that are copied out.
    fn arguments(
        &mut self,
        id: FunctionId,
        arguments: &[Expression],
        frame: &mut Frame,
    ) -> Evaluated<(Vec<Value>, Vec<Option<Target>>)> {
        let function: &'m Function = &self.module.functions[id.0 as usize];
        let mut values = Vec::with_capacity(arguments.len());
        let mut targets = Vec::with_capacity(arguments.len());
        for (argument, passing) in arguments.iter().zip(&function.parameters) {
            if *passing == Passing::In {
                values.push(self.expression(argument, frame)?);
                targets.push(None);
                continue;
            }
            let place = self.assignable(argument, frame)?;
            values.push(place.read(frame));
            targets.push(Some(Target { place, scalar: component_scalar(&argument.ty) }));
        }
        Ok((values, targets))
    }

    fn convert(&mut self, ty: &Type, operand: &Expression, frame: &mut Frame) -> Evaluated<Value> {
        let value = self.expression(operand, frame)?;
        let to = component_scalar(ty).ok_or(Stop::Error)?;
        Ok(value.into_iter().map(|each| converted(each, to)).collect())
    }

    fn construct(
        &mut self,
        ty: &Type,
        arguments: &[Expression],
        span: Span,
        frame: &mut Frame,
    ) -> Evaluated<Value> {
        let mut leaves = Vec::new();
        for argument in arguments {
            leaves.extend(self.expression(argument, frame)?);
        }
        self.spend_in_function(span, leaves.len())?;
        let Some(scalar) = component_scalar(ty) else { return Ok(leaves) };
        let leaves: Value = leaves.into_iter().map(|each| converted(each, scalar)).collect();
        let count = leaf_count(self.structs, ty) as usize;
        Ok(match (ty, arguments) {
            (Type::Matrix(columns, rows), [argument]) => match argument.ty {
                Type::Matrix(_, from_rows) => resized(&leaves, from_rows, *columns, *rows),
                Type::Scalar(_) => diagonal(leaves[0], *columns, *rows),
                _ => leaves,
            },
            (_, [argument]) if matches!(argument.ty, Type::Scalar(_)) => {
                vec![leaves[0]; count]
            }
            _ => leaves.into_iter().take(count).collect(),
        })
    }

    fn unary(
        &mut self,
        operator: UnaryOperator,
        operand: &Expression,
        frame: &mut Frame,
    ) -> Evaluated<Value> {
        let value = self.expression(operand, frame)?;
        let op = match operator {
            UnaryOperator::Plus => return Ok(value),
            UnaryOperator::Negate => UnaryOp::Negate,
            UnaryOperator::Not | UnaryOperator::BitNot => UnaryOp::Not,
        };
        value.into_iter().map(|each| apply_unary(op, each)).collect()
    }

    fn chain(&mut self, expression: &Expression, frame: &mut Frame) -> Evaluated<Value> {
        let (first, links) = expression.chain();
        let mut value = self.expression(first, frame)?;
        for link in links {
            self.spend_in_function(link.span, 1)?;
            value = match &link.kind {
                ExpressionKind::Binary(operator, left, right) => {
                    let other = self.expression(right, frame)?;
                    self.spend(left.span, value.len() + other.len())?;
                    combine(*operator, &left.ty, &value, &right.ty, &other)?
                }
                ExpressionKind::And(_, right) if is_true(&value) => {
                    self.expression(right, frame)?
                }
                ExpressionKind::Or(_, right) if !is_true(&value) => {
                    self.expression(right, frame)?
                }
                ExpressionKind::Sequence(..) if self.depth == 0 => {
                    return Err(Stop::Sequence(link.span));
                }
                ExpressionKind::Sequence(_, right) => self.expression(right, frame)?,
                _ => value,
            };
        }
        Ok(value)
    }

    fn assign(
        &mut self,
        target: &Expression,
        operator: Option<BinaryOperator>,
        value: &Expression,
        frame: &mut Frame,
    ) -> Evaluated<Value> {
        let place = self.assignable(target, frame)?;
        let old = place.read(frame);
        let value_of = self.expression(value, frame)?;
        let new = match operator {
            None => value_of,
            Some(operator) => combine(operator, &target.ty, &old, &value.ty, &value_of)?,
        };
        place.write(&new, frame);
        Ok(new)
    }

    fn step(
        &mut self,
        target: &Expression,
        by: StepOperator,
        prefix: bool,
        frame: &mut Frame,
    ) -> Evaluated<Value> {
        let place = self.assignable(target, frame)?;
        let old = place.read(frame);
        let op = match by {
            StepOperator::Increment => BinaryOp::Add,
            StepOperator::Decrement => BinaryOp::Subtract,
        };
        let new = old
            .iter()
            .map(|each| apply_binary(op, *each, converted(Constant::I32(1), each.scalar())))
            .collect::<Evaluated<Value>>()?;
        place.write(&new, frame);
        Ok(if prefix { new } else { old })
    }

    fn call(
        &mut self,
        id: FunctionId,
        arguments: &[Expression],
        span: Span,
        frame: &mut Frame,
    ) -> Evaluated<Value> {
        if !self.calls || id.0 as usize >= self.callable {
            return Err(Stop::NotConstant(span));
        }
        let (values, targets) = self.arguments(id, arguments, frame)?;
        let (result, locals) = self.run(id, values, span)?;
        for (target, value) in targets.into_iter().zip(locals) {
            if let Some(target) = target {
                target.write(value, frame);
            }
        }
        Ok(result)
    }

    /// Runs a function. Returns its result and its locals, parameters first.
    fn run(
        &mut self,
        id: FunctionId,
        arguments: Vec<Value>,
        span: Span,
    ) -> Evaluated<(Value, Vec<Value>)> {
        let function: &'m Function = &self.module.functions[id.0 as usize];
        if function.body.is_empty() && function.result != Type::Void {
            // The function is not checked yet, or has an error.
            return Err(Stop::NotConstant(span));
        }
        let mut locals = arguments;
        for (index, passing) in function.parameters.iter().enumerate() {
            if *passing == Passing::Out {
                locals[index] = self.zero(&function.locals[index].ty);
            }
        }
        for local in &function.locals[locals.len()..] {
            let zero = self.zero(&local.ty);
            self.spend(span, zero.len())?;
            locals.push(zero);
        }
        let result = self.zero(&function.result);
        let mut frame = Frame { locals, result };
        self.depth += 1;
        self.statements(&function.body, &mut frame)?;
        self.depth -= 1;
        Ok((frame.result, frame.locals))
    }

    fn statements(&mut self, statements: &[Statement], frame: &mut Frame) -> Evaluated<Outcome> {
        for statement in statements {
            let outcome = self.statement(statement, frame)?;
            if outcome != Outcome::Next {
                return Ok(outcome);
            }
        }
        Ok(Outcome::Next)
    }

    fn statement(&mut self, statement: &Statement, frame: &mut Frame) -> Evaluated<Outcome> {
        self.spend(statement.span, 1)?;
        match &statement.kind {
            StatementKind::Expression(expression) => {
                self.expression(expression, frame)?;
            }
            StatementKind::Declare(id, value) => {
                let value = match value {
                    Some(value) => self.expression(value, frame)?,
                    None => frame.locals[id.0 as usize]
                        .iter()
                        .map(|leaf| Constant::zero(leaf.scalar()))
                        .collect(),
                };
                frame.locals[id.0 as usize] = value;
            }
            StatementKind::Block(body) => return self.statements(body, frame),
            StatementKind::If { condition, then, otherwise } => {
                let chosen = if self.is_met(condition, frame)? { then } else { otherwise };
                return self.statements(chosen, frame);
            }
            StatementKind::Switch { selector, cases } => {
                return self.switch(selector, cases, frame);
            }
            StatementKind::Loop(body) => return self.run_loop(body, statement.span, frame),
            StatementKind::Illuminance(_) => return Err(Stop::NotConstant(statement.span)),
            StatementKind::Return(value) => {
                if let Some(value) = value {
                    frame.result = self.expression(value, frame)?;
                }
                return Ok(Outcome::Return);
            }
            // A constant is computed once, by no ray.
            StatementKind::Print { arguments, .. } => {
                for argument in arguments {
                    self.expression(argument, frame)?;
                }
            }
            StatementKind::Break => return Ok(Outcome::Break),
            StatementKind::Continue => return Ok(Outcome::Continue),
        }
        Ok(Outcome::Next)
    }

    fn switch(
        &mut self,
        selector: &Expression,
        cases: &[SwitchCase],
        frame: &mut Frame,
    ) -> Evaluated<Outcome> {
        let value = self.expression(selector, frame)?[0].bits();
        let first = cases
            .iter()
            .position(|case| case.value.is_some_and(|label| label.bits() == value))
            .or_else(|| cases.iter().position(|case| case.value.is_none()));
        for case in first.map_or(&[][..], |first| &cases[first..]) {
            match self.statements(&case.body, frame)? {
                Outcome::Next => {}
                Outcome::Break => return Ok(Outcome::Next),
                outcome @ (Outcome::Continue | Outcome::Return) => return Ok(outcome),
            }
        }
        Ok(Outcome::Next)
    }

    fn run_loop(&mut self, body: &Loop, span: Span, frame: &mut Frame) -> Evaluated<Outcome> {
        self.statements(&body.initializer, frame)?;
        let mut tested = body.test_last;
        loop {
            self.spend(span, 1)?;
            if !tested && !self.loop_condition(body, frame)? {
                return Ok(Outcome::Next);
            }
            tested = false;
            match self.statements(&body.body, frame)? {
                Outcome::Next | Outcome::Continue => {}
                Outcome::Break => return Ok(Outcome::Next),
                Outcome::Return => return Ok(Outcome::Return),
            }
            if let Some(step) = &body.step {
                self.expression(step, frame)?;
            }
        }
    }

    fn loop_condition(&mut self, body: &Loop, frame: &mut Frame) -> Evaluated<bool> {
        let Some(condition) = &body.condition else { return Ok(true) };
        let value = self.expression(condition, frame)?;
        let result = value[0].bits() != 0;
        if let Some(id) = body.declaration {
            frame.locals[id.0 as usize] = value;
        }
        Ok(result)
    }

    fn builtin(
        &mut self,
        ty: &Type,
        call: &BuiltinCall,
        span: Span,
        frame: &mut Frame,
    ) -> Evaluated<Value> {
        if !self.calls {
            return Err(Stop::NotConstant(span));
        }
        match call.builtin.lowering {
            Lowering::Operation(operation) => {
                let arguments = self.values(&call.arguments, frame)?;
                let count = leaf_count(self.structs, ty) as usize;
                (0..count).map(|index| operate(operation, &nth_leaves(&arguments, index))).collect()
            }
            Lowering::Special(special) => {
                let arguments = self.values(&call.arguments, frame)?;
                apply_special(special, ty, &arguments).ok_or(Stop::NotConstant(span))
            }
            Lowering::Prelude => self.prelude(ty, call, span, frame),
        }
    }

    fn values(&mut self, arguments: &[Expression], frame: &mut Frame) -> Evaluated<Vec<Value>> {
        arguments.iter().map(|argument| self.expression(argument, frame)).collect()
    }

    fn prelude(
        &mut self,
        ty: &Type,
        call: &BuiltinCall,
        span: Span,
        frame: &mut Frame,
    ) -> Evaluated<Value> {
        let Some(id) = call.prelude else { return Err(Stop::NotConstant(span)) };
        let (arguments, targets) = self.arguments(id, &call.arguments, frame)?;
        let mut results: Vec<(Value, Vec<Value>)> = Vec::new();
        if call.componentwise {
            let count = arguments.iter().map(Vec::len).max().unwrap_or(1);
            for index in 0..count {
                let scalars = nth_leaves(&arguments, index);
                let scalars = scalars.into_iter().map(|each| vec![each]).collect();
                results.push(self.run(id, scalars, span)?);
            }
        } else {
            results.push(self.run(id, arguments, span)?);
        }
        for (index, target) in targets.into_iter().enumerate() {
            if let Some(target) = target {
                let value = results.iter().flat_map(|(_, locals)| locals[index].clone()).collect();
                target.write(value, frame);
            }
        }
        if *ty == Type::Void {
            return Ok(Value::new());
        }
        Ok(results.into_iter().flat_map(|(result, _)| result).collect())
    }
}

fn is_true(value: &[Constant]) -> bool {
    value.first().is_some_and(|value| value.bits() != 0)
}

/// Converts an index to an element's position, clamped as at run time.
fn clamped(index: Value, elements: usize) -> usize {
    let last = elements.saturating_sub(1);
    match index[0] {
        Constant::I32(value) => (value.max(0) as usize).min(last),
        value => (value.bits() as usize).min(last),
    }
}

/// Leaf `index` of each value; for scalars, their only leaf.
fn nth_leaves(values: &[Value], index: usize) -> Vec<Constant> {
    values.iter().map(|value| value[index.min(value.len() - 1)]).collect()
}
