//! Writes one stage: the code from a point outwards to the end of the function.
//!
//! Values of the stage's function take the place of those of the integrator's function, as `values` maps them. Copies
//! of one region, such as the iteration of a loop that a stage starts in and the loop that follows it, map its values
//! anew; regions are copied in the order of execution, so that the last mapping is always the right one.
//!
//! Everything that a stage passes to the runtime is stored to locals first, and loaded from them at its end. Promotion
//! of the locals then finds out which path yields what.

use std::collections::{BTreeMap, BTreeSet};

use rtsl_ir::{
    Constant, Function, Index, IndexVec, Op, OpKind, Output, Region, Scalar, Value, Variable,
    VariableId, VariableKind,
};

use crate::code::Code;
use crate::flow::{Flow, Flowing, Left};
use crate::live::{Kept, Live, Liveness};
use crate::points::{Level, Point, PointId, has_point, operands, queried_surface};
use crate::slots::Slots;
use crate::{END, Port, ResumedBy, SplitError};

/// The greatest number of loops, one in another, whose first iterations are peeled.
const MAX_PEELED_DEPTH: u32 = 2;

/// The greatest number of loops, one after another, whose first iterations are peeled. What follows a peeled iteration
/// is written in recursion.
const MAX_PEELED: u32 = 32;

/// The greatest number of operations in a peeled iteration.
const MAX_PEELED_OPERATIONS: usize = 4096;

/// The value of `next` for points that no path reaches; it never remains.
const UNREACHED: i32 = i32::MIN;

/// A function that is to be split, and the facts about its points.
pub(crate) struct Plan<'a> {
    pub function: &'a Function,
    pub points: BTreeMap<PointId, Point<'a>>,
    pub liveness: Liveness<'a>,
    pub lives: BTreeMap<PointId, Live>,
    /// The body of the function.
    pub start: Vec<Level<'a>>,
}

/// A stage as it is first written.
pub(crate) struct Draft {
    pub function: Function,
    /// The local for `next`.
    pub next: VariableId,
    /// The locals for all ports that it stores to.
    pub ports: BTreeMap<VariableId, Port>,
    /// The number of operations that may still be written.
    pub left: u32,
}

/// Writes the stage that starts at a point, or at the start of the function. `indices` has the value of `next` for each
/// point; at most `left` operations are written.
pub(crate) fn stage<'a>(
    plan: &'a Plan<'a>,
    slots: &'a Slots,
    indices: &'a BTreeMap<PointId, i32>,
    point: Option<PointId>,
    name: String,
    left: u32,
) -> Result<Draft, SplitError> {
    let mut code = Code::new(name, left);
    code.function.names.add_texts(&plan.function.names);
    let mut emitter = Emitter {
        plan,
        slots,
        indices,
        code,
        values: IndexVec::filled(plan.function.values.len(), None),
        variables: IndexVec::filled(plan.function.variables.len(), None),
        locals: BTreeMap::new(),
        outputs: Vec::new(),
        stored: BTreeSet::new(),
        ends: false,
        surface: None,
        peeled: 0,
        peeled_before: 0,
    };
    emitter.start(point);
    let (levels, from) = match point.map(|id| &plan.points[&id]) {
        Some(point) => (&point.levels, point.after()),
        None => (&plan.start, 0),
    };
    let depth = levels.len() - 1;
    emitter.ops(levels[depth].region, from, Then::Outside(levels, depth))?;
    Ok(emitter.finish())
}

struct Emitter<'a> {
    plan: &'a Plan<'a>,
    slots: &'a Slots,
    indices: &'a BTreeMap<PointId, i32>,
    code: Code,
    /// The values of the stage for those of the integrator's function.
    values: IndexVec<Value, Option<Value>>,
    variables: IndexVec<VariableId, Option<VariableId>>,
    /// The local for each port that the stage may store to.
    locals: BTreeMap<Port, VariableId>,
    /// The local for each output of the integrator's function.
    outputs: Vec<VariableId>,
    /// The ports that some path stores to.
    stored: BTreeSet<Port>,
    /// True if the integrator's function ends for some path.
    ends: bool,
    /// Object, instance and element of the stage's surface.
    surface: Option<[Value; 3]>,
    /// The number of loops, one in another, of which an iteration is being peeled.
    peeled: u32,
    /// The number of peeled loops before the current position.
    peeled_before: u32,
}

/// The continuation of a region.
#[derive(Clone, Copy)]
enum Then<'a, 't> {
    /// The region's yields are passed on to the operation that is being written.
    Yield,
    /// The code that follows the region at this depth is written, to the end of the function.
    Outside(&'a [Level<'a>], usize),
    /// The yields are the results of an operation, whose region goes on.
    After(&'t Step<'a, 't>),
    /// The region is the first iteration of a loop with this body. The loop follows, then this.
    Again(&'a Region, &'t Then<'a, 't>),
}

/// A place after an operation.
struct Step<'a, 't> {
    op: &'a Op,
    /// The region of the operation, and the index in it of the next.
    region: &'a Region,
    next: usize,
    then: Then<'a, 't>,
}

impl Flowing for Emitter<'_> {
    fn code(&mut self) -> &mut Code {
        &mut self.code
    }
}

impl<'a> Emitter<'a> {
    /// Writes the start of the stage: gets frame, answers and surface.
    fn start(&mut self, point: Option<PointId>) {
        // Locals first, so that they keep their names.
        let variables = &self.plan.function.variables;
        for id in (0..variables.len() as u32).map(VariableId) {
            if self.plan.function.variable(id).kind == VariableKind::Local {
                self.variable(id);
            }
        }
        let outputs = self.plan.function.outputs.iter();
        self.outputs = outputs.map(|output| self.output(*output)).collect();
        // Every path sets it; so a value in passing is not taken for a stage.
        let next = self.local(Port::Next, Scalar::I32);
        let end = self.code.constant(Constant::I32(END));
        self.code.store(next, 0, end);
        let Some(id) = point else { return };
        let live = &self.plan.lives[&id];
        for kept in &live.kept {
            self.restore(*kept);
        }
        let point = &self.plan.points[&id];
        for (index, old) in (0..).zip(point.surface.into_iter().flatten()) {
            if self.values[old].is_none() {
                let value = self.load_port(Port::Surface(index), Scalar::I32);
                self.define(old, value);
            }
        }
        for value in &live.recomputed {
            self.recompute(*value);
        }
        let op = point.op();
        let answers = (0..).zip(point.event.answers());
        for (old, (index, scalar)) in op.results.iter().zip(answers) {
            let answer = self.load_port(Port::Answer(index), *scalar);
            self.define(old, answer);
        }
        let found = (point.event == ResumedBy::NearestHit)
            .then(|| std::array::from_fn(|index| op.results.get(index as u32 + 1)));
        let surface = point.surface.or(found);
        self.surface = surface.map(|values| values.map(|value| self.get(value)));
    }

    /// Gets a scalar from the frame.
    fn restore(&mut self, kept: Kept) {
        let slot = self.slots.of(kept);
        let scalar = self.slots.slots[slot.0 as usize].scalar;
        let port = Port::Frame(slot);
        let value = self.load_port(port, scalar);
        match kept {
            Kept::Value(old) => self.define(old, value),
            Kept::Local(local, index) => {
                let local = self.variable(local);
                self.code.store(local, index, value);
            }
        }
    }

    fn load_port(&mut self, port: Port, scalar: Scalar) -> Value {
        let variable = self.code.function.intern_variable(port.variable(scalar));
        self.code.load(variable, 0)
    }

    /// Computes a value again, and first the values that it needs.
    fn recompute(&mut self, value: Value) {
        if self.values[value].is_some() {
            return;
        }
        let op = self.plan.liveness.definition(value).expect("an operation defines it");
        operands(op).into_iter().for_each(|operand| self.recompute(operand));
        self.copy(op);
    }

    /// Writes the operations of a region from one on, and what follows them.
    fn ops(
        &mut self,
        region: &'a Region,
        from: usize,
        then: Then<'a, '_>,
    ) -> Result<Flow, SplitError> {
        for (index, op) in region.ops.iter().enumerate().skip(from) {
            let step = Step { op, region, next: index + 1, then };
            match &op.kind {
                OpKind::If { condition, then: a, otherwise: b } => {
                    let condition = self.get(*condition);
                    let start = self.code.value_count();
                    let a = self.side(|it| it.ops(a, 0, Then::Yield))?;
                    let b = self.side(|it| it.ops(b, 0, Then::Yield))?;
                    if a.flow.left != Left::Never || b.flow.left != Left::Never {
                        let rest = |it: &mut Self, values| it.go_on(Then::After(&step), values);
                        return self.fork(start, condition, a, b, rest);
                    }
                    let Flow { values, .. } = self.code.join(start, condition, a, b);
                    self.define_results(op, values);
                }
                OpKind::Loop { initial, body } => {
                    let initial = initial.iter().map(|value| self.get(*value));
                    let initial: Vec<Value> = initial.collect();
                    if self.is_peeled(body, &initial) {
                        return self.peel(body, initial, Then::After(&step));
                    }
                    let flow = self.copy_loop(body, initial)?;
                    if flow.left != Left::Never {
                        return self.after(flow, |it, values| it.go_on(Then::After(&step), values));
                    }
                    self.define_results(op, flow.values);
                }
                _ if self.suspends(op) => {
                    self.suspend(op);
                    return Ok(Flow::ended());
                }
                _ => self.copy(op),
            }
        }
        let values = region.yields.iter().map(|value| self.get(*value)).collect();
        self.go_on(then, values)
    }

    /// Writes what follows a region that yields these values.
    fn go_on(&mut self, then: Then<'a, '_>, mut values: Vec<Value>) -> Result<Flow, SplitError> {
        match then {
            Then::Yield => Ok(Flow::on(values)),
            Then::After(step) => {
                self.define_results(step.op, values);
                self.ops(step.region, step.next, step.then)
            }
            Then::Again(body, then) => {
                // The iteration ends here; what follows is not in it.
                self.peeled -= 1;
                let again = values.remove(0);
                let flow =
                    self.repeat(again, values, *then, |it, values| it.copy_loop(body, values));
                self.peeled += 1;
                flow
            }
            Then::Outside(levels, depth) => self.outside(levels, depth, values),
        }
    }

    fn outside(
        &mut self,
        levels: &'a [Level<'a>],
        depth: usize,
        mut values: Vec<Value>,
    ) -> Result<Flow, SplitError> {
        let Some(outer) = depth.checked_sub(1) else {
            self.end(&values);
            return Ok(Flow::ended());
        };
        let Level { region, index, .. } = levels[outer];
        let (op, then) = (levels[outer].op(), Then::Outside(levels, outer));
        let step = Step { op, region, next: index + 1, then };
        let OpKind::Loop { body, .. } = &op.kind else {
            return self.go_on(Then::After(&step), values);
        };
        let again = values.remove(0);
        let is_certain = self.is_true(again) == Some(true);
        if is_certain && self.is_peeled(body, &values) {
            return self.peel(body, values, Then::After(&step));
        }
        self.repeat(again, values, Then::After(&step), |it, values| {
            if it.is_peeled(body, &values) {
                return it.peel(body, values, Then::Yield);
            }
            it.copy_loop(body, values)
        })
    }

    /// Writes a loop for the paths for which a bool is true, and what follows it for all. These values are the first of
    /// the loop, and its results for the others.
    fn repeat(
        &mut self,
        again: Value,
        values: Vec<Value>,
        then: Then<'a, '_>,
        write: impl FnOnce(&mut Self, Vec<Value>) -> Result<Flow, SplitError>,
    ) -> Result<Flow, SplitError> {
        match self.is_true(again) {
            Some(false) => self.go_on(then, values),
            Some(true) => {
                let flow = write(self, values)?;
                self.after(flow, |it, results| it.go_on(then, results))
            }
            None => {
                let start = self.code.value_count();
                let results = values.clone();
                let repeating = self.side(|it| write(it, values))?;
                let others = self.side(|_| Ok(Flow::on(results)))?;
                let rest = |it: &mut Self, results| it.go_on(then, results);
                self.fork(start, again, repeating, others, rest)
            }
        }
    }

    /// Writes the first iteration of a loop by itself, then the loop, and what follows it.
    fn peel(
        &mut self,
        body: &'a Region,
        initial: Vec<Value>,
        then: Then<'a, '_>,
    ) -> Result<Flow, SplitError> {
        self.peeled += 1;
        self.peeled_before += 1;
        self.define_all(&body.params, &initial);
        let flow = self.ops(body, 0, Then::Again(body, &then));
        self.peeled -= 1;
        self.peeled_before -= 1;
        flow
    }

    /// Returns the value of a bool, if it is known.
    fn is_true(&self, value: Value) -> Option<bool> {
        self.code.known(value).map(|known| known.bits() != 0)
    }

    /// True if the first iteration of a loop is written by itself: in it, parameters are the stage's surface.
    fn is_peeled(&self, body: &Region, initial: &[Value]) -> bool {
        let Some(surface) = self.surface else { return false };
        if self.peeled >= MAX_PEELED_DEPTH || self.peeled_before >= MAX_PEELED {
            return false;
        }
        let first = |value: Value| match body.params.iter().position(|it| *it == value) {
            Some(index) => (Some(initial[index]), true),
            None => (self.values[value], false),
        };
        let (mut found, mut count) = (false, 0);
        body.for_each_op(&mut |op| {
            count += 1;
            if let Some(queried) = queried_surface(&op.kind).map(|values| values.map(first)) {
                let is_surface = queried.iter().map(|it| it.0).eq(surface.map(Some));
                found |= is_surface && queried.iter().any(|it| it.1);
            }
        });
        found && count <= MAX_PEELED_OPERATIONS
    }

    /// Writes a loop as a loop. It ends when it suspends.
    fn copy_loop(&mut self, body: &'a Region, mut initial: Vec<Value>) -> Result<Flow, SplitError> {
        let count = initial.len();
        let may_leave = has_point(body);
        if may_leave {
            initial.push(self.code.bool(false));
        }
        let scalars: Vec<Scalar> = initial.iter().map(|value| self.code.scalar(*value)).collect();
        let params: Vec<Value> = self.code.new_values(&scalars).iter().collect();
        self.define_all(&body.params, &params[..count]);
        let mut yields = Vec::with_capacity(count + 2);
        let mut left = Left::Never;
        let side = self.side(|it| {
            let Flow { left: found, values } = it.ops(body, 0, Then::Yield)?;
            left = found;
            match left {
                Left::Never => yields.extend(values),
                Left::Always => {
                    yields.push(it.code.bool(false));
                    yields.extend(&params[..count]);
                }
                Left::If(left) => {
                    let stays = it.code.not(left);
                    let again = it.code.and(values[0], stays);
                    yields.push(again);
                    yields.extend(&values[1..]);
                }
            }
            if may_leave {
                yields.push(it.code.flag(left));
            }
            Ok(Flow::on(Vec::new()))
        })?;
        let body = Region { params, ops: side.ops, yields };
        let results = self.code.push(OpKind::Loop { initial, body }, false, &scalars);
        let values = results.iter().take(count).collect();
        Ok(match left {
            Left::Never => Flow::on(values),
            Left::If(_) => Flow { left: Left::If(results.get(count as u32)), values },
            Left::Always => Flow::ended(),
        })
    }

    /// True if the stage ends before this operation, which has no regions.
    fn suspends(&self, op: &Op) -> bool {
        match queried_surface(&op.kind) {
            Some(queried) => Some(queried.map(|value| self.get(value))) != self.surface,
            None => ResumedBy::of(&op.kind).is_some(),
        }
    }

    /// Writes a suspension: keeps what is live, and passes on the request.
    fn suspend(&mut self, op: &Op) {
        let id = op.results.get(0);
        let Some(index) = self.indices.get(&id) else {
            return self.set_next(UNREACHED);
        };
        for kept in &self.plan.lives[&id].kept {
            let value = match *kept {
                Kept::Value(value) => self.get(value),
                Kept::Local(local, index) => {
                    let local = self.variable(local);
                    self.code.load(local, index)
                }
            };
            self.set(Port::Frame(self.slots.of(*kept)), value);
        }
        let point = &self.plan.points[&id];
        for (index, operand) in point.request() {
            self.set(Port::Request(index), self.get(operand));
        }
        for (index, operand) in (0..).zip(point.surface.into_iter().flatten()) {
            self.set(Port::Surface(index), self.get(operand));
        }
        self.set_next(*index);
    }

    /// Writes the end of the integrator's function.
    fn end(&mut self, values: &[Value]) {
        self.ends = true;
        for (local, value) in self.outputs.clone().into_iter().zip(values) {
            self.code.store(local, 0, *value);
        }
        self.set_next(END);
    }

    fn set_next(&mut self, next: i32) {
        let next = self.code.constant(Constant::I32(next));
        self.set(Port::Next, next);
    }

    fn set(&mut self, port: Port, value: Value) {
        let local = self.local(port, self.code.scalar(value));
        self.stored.insert(port);
        self.code.store(local, 0, value);
    }

    /// Copies an operation without regions.
    fn copy(&mut self, op: &Op) {
        let mut kind = op.kind.clone();
        kind.for_each_operand_mut(|value| *value = self.get(*value));
        match &mut kind {
            OpKind::Load(variable, _) | OpKind::Store(variable, ..) | OpKind::Length(variable) => {
                *variable = self.variable(*variable);
            }
            _ => {}
        }
        let scalars = op.results.iter().map(|value| self.plan.function.scalar(value));
        let scalars: Vec<Scalar> = scalars.collect();
        let results = self.code.emit(kind, op.precise, &scalars);
        self.define_results(op, results.iter().collect());
    }

    fn get(&self, old: Value) -> Value {
        self.values[old].expect("what is used after a point is live there")
    }

    fn define(&mut self, old: Value, new: Value) {
        self.values[old] = Some(new);
        if self.code.known(new).is_none() {
            self.code.function.names.copy(&self.plan.function.names, 0, old, new);
        }
    }

    fn define_results(&mut self, op: &Op, values: Vec<Value>) {
        op.results.iter().zip(values).for_each(|(old, new)| self.define(old, new));
    }

    fn define_all(&mut self, old: &[Value], new: &[Value]) {
        old.iter().zip(new).for_each(|(old, new)| self.define(*old, *new));
    }

    /// Returns the variable of the stage for one of the integrator's function.
    fn variable(&mut self, old: VariableId) -> VariableId {
        if let Some(known) = self.variables[old] {
            return known;
        }
        let variable = self.plan.function.variable(old).clone();
        let new = self.code.function.intern_variable(variable);
        self.variables[old] = Some(new);
        new
    }

    /// Returns the local for a port.
    fn local(&mut self, port: Port, scalar: Scalar) -> VariableId {
        if let Some(known) = self.locals.get(&port) {
            return *known;
        }
        let local = self.new_local(format!("#{}", port.name()), scalar);
        self.locals.insert(port, local);
        local
    }

    fn new_local(&mut self, mut name: String, scalar: Scalar) -> VariableId {
        while self.code.function.find_variable(VariableKind::Local, &name).is_some() {
            name.push('#');
        }
        let local = Variable { kind: VariableKind::Local, name, scalar, len: 1 };
        self.code.function.intern_variable(local)
    }

    /// Returns a local for an output of the integrator's function; where that does not end, the output is unchanged.
    fn output(&mut self, output: Output) -> VariableId {
        let Variable { scalar, ref name, .. } = *self.plan.function.variable(output.variable);
        let local = self.new_local(format!("#{name}.{}", output.component), scalar);
        let variable = self.variable(output.variable);
        let before = self.code.load(variable, output.component);
        self.code.store(local, 0, before);
        local
    }

    /// Makes outputs of the locals that some path stores to.
    fn finish(mut self) -> Draft {
        let mut yields = Vec::new();
        let mut outputs = Vec::new();
        for port in &self.stored {
            let local = self.locals[port];
            let scalar = self.code.function.variable(local).scalar;
            yields.push(self.code.load(local, 0));
            let variable = self.code.function.intern_variable(port.variable(scalar));
            outputs.push(Output { variable, component: 0 });
        }
        if self.ends {
            for (output, local) in self.plan.function.outputs.iter().zip(&self.outputs) {
                yields.push(self.code.load(*local, 0));
                let variable = self.variables[output.variable].expect("outputs come first");
                outputs.push(Output { variable, component: output.component });
            }
        }
        let (next, left) = (self.locals[&Port::Next], self.code.left());
        let ports = self.stored.iter().map(|port| (self.locals[port], *port)).collect();
        let mut function = self.code.finish();
        function.body.yields = yields;
        function.outputs = outputs;
        Draft { function, next, ports, left }
    }
}

/// Returns the values that a draft may store to `next`.
pub(crate) fn next_values(draft: &Draft) -> Vec<i32> {
    let mut constants = BTreeMap::new();
    let mut found = Vec::new();
    draft.function.body.for_each_op(&mut |op| match op.kind {
        OpKind::Constant(Constant::I32(constant)) => {
            constants.insert(op.results.get(0), constant);
        }
        OpKind::Store(local, Index::Constant(_), value) if local == draft.next => {
            let next = constants.get(&value).expect("`next` is a constant");
            if !found.contains(next) {
                found.push(*next);
            }
        }
        _ => {}
    });
    found
}
