//! Compiles functions to flat programs.

use super::PrepareError;
use super::program::{Computed, Instruction, Observed, Program, Register};
use crate::{
    Function, Index, Op, OpKind, Region, Scalar, Value, Values, VariableId, VariableKind, evaluate,
};

/// Compiles a verified function; an observed one with its reports.
pub(super) fn compile(function: &Function, is_observed: bool) -> Result<Program, PrepareError> {
    let mut compiler = Compiler::new(function);
    compiler.observed = is_observed.then(Observed::default);
    compiler.region(&function.body)?;
    let registers = function.body.yields.iter().map(|value| compiler.register(*value));
    let all: Vec<_> = function.outputs.iter().copied().zip(registers).collect();
    let kind = |variable| function.variable(variable).kind;
    let (accepted, outputs): (Vec<_>, Vec<_>) =
        all.into_iter().partition(|(output, _)| kind(output.variable) == VariableKind::Accepted);
    Ok(Program {
        instructions: compiler.instructions,
        operands: compiler.operands,
        registers: compiler.initial,
        local_scalars: compiler.local_scalars,
        outputs,
        accepted: accepted.first().map(|(_, register)| *register),
        observed: compiler.observed,
    })
}

struct Compiler<'a> {
    function: &'a Function,
    instructions: Vec<Instruction>,
    operands: Vec<Register>,
    /// The initial content of each register.
    initial: Vec<u32>,
    /// The register of each value.
    registers: Vec<Register>,
    /// The first scalar of each variable that is a local.
    local_bases: Vec<u32>,
    local_scalars: u32,
    observed: Option<Observed>,
}

impl<'a> Compiler<'a> {
    fn new(function: &'a Function) -> Self {
        let mut local_scalars = 0;
        let local_bases = function.variables.iter().map(|variable| {
            let base = local_scalars;
            if variable.kind == VariableKind::Local {
                local_scalars += variable.len;
            }
            base
        });
        Compiler {
            function,
            instructions: Vec::new(),
            operands: Vec::new(),
            initial: Vec::new(),
            registers: vec![Register::MAX; function.values.len()],
            local_bases: local_bases.collect(),
            local_scalars,
            observed: None,
        }
    }

    fn region(&mut self, region: &Region) -> Result<(), PrepareError> {
        region.ops.iter().try_for_each(|op| self.op(op))
    }

    fn op(&mut self, op: &Op) -> Result<(), PrepareError> {
        match &op.kind {
            OpKind::If { condition, then, otherwise } => {
                self.branch(op.results, *condition, then, otherwise)
            }
            OpKind::Loop { initial, body } => self.repeat(op.results, initial, body),
            kind => self.plain(op.results, kind),
        }
    }

    fn branch(
        &mut self,
        results: Values,
        condition: Value,
        then: &Region,
        otherwise: &Region,
    ) -> Result<(), PrepareError> {
        let to = self.define(results);
        let condition = self.register(condition);
        let to_otherwise = self.instructions.len();
        self.push(Instruction::JumpUnless { condition, target: 0 });
        self.region(then)?;
        self.copy_yields(to, &then.yields);
        let to_end = self.instructions.len();
        self.push(Instruction::Jump { target: 0 });
        self.set_target(to_otherwise);
        self.region(otherwise)?;
        self.copy_yields(to, &otherwise.yields);
        self.set_target(to_end);
        Ok(())
    }

    /// A loop's results share the registers of its parameters: the values carried into the next iteration are the
    /// results if there is none.
    fn repeat(
        &mut self,
        results: Values,
        initial: &[Value],
        body: &Region,
    ) -> Result<(), PrepareError> {
        let params = self.define(results);
        for (param, register) in body.params.iter().zip(params..) {
            self.registers[param.0 as usize] = register;
        }
        self.copy_yields(params, initial);
        let start = self.instructions.len() as u32;
        self.region(body)?;
        let (again, next) = body.yields.split_first().expect("a loop's body yields a bool");
        let mut again = self.register(*again);
        let carried = params..params + results.count;
        if carried.contains(&again) {
            again = self.copy_to_temporary(again);
        }
        self.copy_in_parallel(params, next);
        self.push(Instruction::JumpIf { condition: again, target: start });
        Ok(())
    }

    fn plain(&mut self, results: Values, kind: &OpKind) -> Result<(), PrepareError> {
        if let OpKind::Constant(constant) = kind {
            let to = self.define(results);
            self.initial[to as usize] = constant.bits();
            return Ok(());
        }
        let operands = self.operands.len() as u32;
        let to = self.define(results);
        let scalar = |value: Value| self.function.scalar(value);
        let instruction = match *kind {
            OpKind::Unary(op, a) => {
                let function = evaluate::unary(op, scalar(a)).expect("verified");
                Instruction::Unary { function, to, a: self.register(a) }
            }
            OpKind::Binary(op, a, b) => {
                let function = evaluate::binary(op, scalar(a)).expect("verified");
                Instruction::Binary { function, to, a: self.register(a), b: self.register(b) }
            }
            OpKind::Compare(op, a, b) => {
                let function = evaluate::compare(op, scalar(a)).expect("verified");
                Instruction::Binary { function, to, a: self.register(a), b: self.register(b) }
            }
            OpKind::Select(condition, a, b) => {
                let condition = self.register(condition);
                Instruction::Select { to, condition, a: self.register(a), b: self.register(b) }
            }
            OpKind::Fma(a, b, c) => {
                let (a, b, c) = (self.register(a), self.register(b), self.register(c));
                Instruction::Fma { to, a, b, c }
            }
            OpKind::Convert(target, a) => {
                let function = evaluate::convert(scalar(a), target);
                Instruction::Unary { function, to, a: self.register(a) }
            }
            OpKind::Bitcast(target, a) => {
                let function = evaluate::bitcast(scalar(a), target).expect("verified");
                Instruction::Unary { function, to, a: self.register(a) }
            }
            OpKind::Load(variable, index) => self.load(to, variable, index),
            OpKind::Store(variable, index, value) => self.store(variable, index, value),
            OpKind::Length(variable) => Instruction::Length { to, variable },
            OpKind::Trace { .. } => Instruction::Trace { to, operands },
            OpKind::Occluded { .. } => Instruction::Occluded { to, operands },
            OpKind::LightCount => Instruction::LightCount { to },
            OpKind::LightSample { .. } => Instruction::LightSample { to, operands },
            OpKind::Ambient => Instruction::Ambient { to },
            OpKind::Rand => Instruction::Rand { to },
            OpKind::Query(query, _) => Instruction::Query { query, to, operands },
            OpKind::ReportBudget => Instruction::ReportBudget,
            OpKind::Report(ref event, _) => {
                let Some(observed) = &mut self.observed else { return Ok(()) };
                observed.events.push(event.clone());
                Instruction::Report { event: observed.events.len() as u32 - 1, operands }
            }
            OpKind::ReferenceCall(ref call) => {
                return Err(PrepareError::Unlinked(call.member.clone()));
            }
            OpKind::IsSet(ref member, _) | OpKind::ReferenceCount(ref member) => {
                return Err(PrepareError::Unlinked(member.clone()));
            }
            OpKind::Seed(a) | OpKind::ChainRule(a, _) => {
                Instruction::Unary { function: |a| a, to, a: self.register(a) }
            }
            OpKind::Derivative(..) => return Err(PrepareError::Unlinked("gradient".to_owned())),
            OpKind::Constant(_) | OpKind::If { .. } | OpKind::Loop { .. } => {
                unreachable!("handled by the callers")
            }
        };
        if let Instruction::Trace { .. }
        | Instruction::Occluded { .. }
        | Instruction::LightSample { .. }
        | Instruction::Query { .. }
        | Instruction::Report { .. } = instruction
        {
            kind.for_each_operand(|value| self.operands.push(self.registers[value.0 as usize]));
        }
        self.push(instruction);
        self.observe_computed(results, kind);
        Ok(())
    }

    /// Notes that the last instruction computes an f32, if the program is observed.
    fn observe_computed(&mut self, results: Values, kind: &OpKind) {
        let (OpKind::Unary(..)
        | OpKind::Binary(..)
        | OpKind::Fma(..)
        | OpKind::Convert(..)
        | OpKind::Bitcast(..)) = kind
        else {
            return;
        };
        let result = results.get(0);
        let is_float = |value: Value| self.function.scalar(value) == Scalar::F32;
        let Some(observed) = self.observed.as_mut().filter(|_| is_float(result)) else { return };
        let mut operands = Vec::new();
        kind.for_each_operand(|value| operands.push(value));
        let floats = operands.iter().filter(|it| is_float(**it));
        let mut floats = floats.map(|value| self.registers[value.0 as usize]);
        let computed = Computed {
            to: self.registers[result.0 as usize],
            floats: std::array::from_fn(|_| floats.next()),
            place: self.function.names.place(result),
        };
        observed.computed.resize(self.instructions.len(), None);
        observed.computed[self.instructions.len() - 1] = Some(computed);
    }

    fn load(&self, to: Register, variable: VariableId, index: Index) -> Instruction {
        let len = self.function.variable(variable).len;
        let base = self.local_bases[variable.0 as usize];
        match (self.function.variable(variable).kind, index) {
            (VariableKind::Local, Index::Constant(index)) => {
                Instruction::LoadLocal { to, address: base + index }
            }
            (VariableKind::Local, Index::Dynamic(index)) => {
                Instruction::LoadLocalAt { to, index: self.register(index), base, len }
            }
            (VariableKind::Buffer, Index::Constant(index)) => {
                Instruction::LoadBuffer { to, variable, index }
            }
            (VariableKind::Buffer, Index::Dynamic(index)) => {
                Instruction::LoadBufferAt { to, variable, index: self.register(index), len }
            }
            (_, Index::Constant(index)) => Instruction::Load { to, variable, index },
            (_, Index::Dynamic(index)) => {
                Instruction::LoadAt { to, variable, index: self.register(index), len }
            }
        }
    }

    fn store(&self, variable: VariableId, index: Index, value: Value) -> Instruction {
        let base = self.local_bases[variable.0 as usize];
        let value = self.register(value);
        match index {
            Index::Constant(index) => Instruction::StoreLocal { address: base + index, value },
            Index::Dynamic(index) => {
                let len = self.function.variable(variable).len;
                Instruction::StoreLocalAt { value, index: self.register(index), base, len }
            }
        }
    }

    /// Copies to registers that hold none of the values.
    fn copy_yields(&mut self, to: Register, values: &[Value]) {
        for (to, value) in (to..).zip(values) {
            let from = self.register(*value);
            self.push(Instruction::Copy { to, from });
        }
    }

    /// Copies to registers that may be among the sources, as if all copies were simultaneous.
    fn copy_in_parallel(&mut self, to: Register, values: &[Value]) {
        let targets = to..to + values.len() as u32;
        let sources: Vec<Register> = (to..)
            .zip(values)
            .map(|(to, value)| {
                let from = self.register(*value);
                let overwritten_before = targets.contains(&from) && from < to;
                if overwritten_before { self.copy_to_temporary(from) } else { from }
            })
            .collect();
        for (to, from) in (to..).zip(sources) {
            if from != to {
                self.push(Instruction::Copy { to, from });
            }
        }
    }

    fn copy_to_temporary(&mut self, from: Register) -> Register {
        let to = self.new_registers(1);
        self.push(Instruction::Copy { to, from });
        to
    }

    fn register(&self, value: Value) -> Register {
        self.registers[value.0 as usize]
    }

    /// Allocates consecutive registers for results and returns the first.
    fn define(&mut self, results: Values) -> Register {
        let first = self.new_registers(results.count);
        for (value, register) in results.iter().zip(first..) {
            self.registers[value.0 as usize] = register;
        }
        first
    }

    fn new_registers(&mut self, count: u32) -> Register {
        let first = self.initial.len() as Register;
        self.initial.resize(self.initial.len() + count as usize, 0);
        first
    }

    fn push(&mut self, instruction: Instruction) {
        self.instructions.push(instruction);
    }

    /// Makes the jump at `position` target the next instruction.
    fn set_target(&mut self, position: usize) {
        let next = self.instructions.len() as u32;
        match &mut self.instructions[position] {
            Instruction::Jump { target } | Instruction::JumpUnless { target, .. } => *target = next,
            other => unreachable!("{other:?} is not a jump"),
        }
    }
}
