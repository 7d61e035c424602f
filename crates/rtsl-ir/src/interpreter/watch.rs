//! Observed runs: they tell events, and find the operations from which values that are not finite come.
//!
//! Each register and each scalar of a local has an origin: the operation that made its value not finite of finite
//! operands. Operations pass the origin on to their results. Values that a method has received have none, and neither
//! have constants. An origin is told once its value leaves the method, as an output or in a request, so that what is
//! computed and not used is not told. That a value is made is told at once, too.

use super::program::{Computed, Instruction, Program, Register};
use crate::{Event, Observer, Spoilt};

/// The observer of a run, or none.
pub(super) trait Watch {
    /// True if anything is observed.
    const IS_ON: bool;

    /// Receives an event.
    fn event(&mut self, event: &Event, words: &[u32]);

    /// Follows the instruction with the index `executed`.
    fn executed(&mut self, program: &Program, executed: usize, registers: &[u32]);

    /// Follows the end of the run.
    fn ended(&mut self, program: &Program, registers: &[u32]);
}

/// No observer.
pub(super) struct Unobserved;

impl Watch for Unobserved {
    const IS_ON: bool = false;

    fn event(&mut self, _: &Event, _: &[u32]) {}
    fn executed(&mut self, _: &Program, _: usize, _: &[u32]) {}
    fn ended(&mut self, _: &Program, _: &[u32]) {}
}

/// An observer, with the origins of the run so far.
pub(super) struct Observed<'a> {
    observer: &'a mut dyn Observer,
    registers: Vec<Origin>,
    locals: Vec<Origin>,
    /// The number of values that are not finite and were made so far.
    made: u32,
}

/// The origin of a value that is not finite.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
struct Origin {
    /// The instruction, counted from 1; 0 for none.
    instruction: u32,
    /// The number of the value that it has made.
    number: u32,
}

impl Origin {
    const NONE: Origin = Origin { instruction: 0, number: 0 };
}

impl<'a> Observed<'a> {
    /// Begins a run with so many registers and scalars of locals.
    pub fn new(observer: &'a mut dyn Observer, registers: usize, locals: usize) -> Self {
        let (registers, locals) = (vec![Origin::NONE; registers], vec![Origin::NONE; locals]);
        Observed { observer, registers, locals, made: 0 }
    }

    fn tell(&mut self, program: &Program, register: Register, registers: &[u32]) {
        let origin = std::mem::take(&mut self.registers[register as usize]);
        let computed = program.observed.as_ref().zip(origin.instruction.checked_sub(1));
        let computed = computed.and_then(|(it, index)| it.computed.get(index as usize)?.as_ref());
        if let Some(Computed { place, .. }) = computed {
            let value = f32::from_bits(registers[register as usize]);
            let (number, place) = (origin.number, place.clone());
            self.observer.spoilt(Spoilt { value, number, place });
            // One operation is told once.
            let is_same = |it: &&mut Origin| it.instruction == origin.instruction;
            self.registers.iter_mut().filter(is_same).for_each(|it| *it = Origin::NONE);
        }
    }

    fn pass_on(&mut self, from: Register, to: Register) {
        self.registers[to as usize] = self.registers[from as usize];
    }

    /// Sets the origin of a computed value.
    fn compute(&mut self, computed: &Computed, executed: usize, registers: &[u32]) {
        let number = |register: Register| f32::from_bits(registers[register as usize]);
        let value = number(computed.to);
        let operands = || computed.floats.iter().flatten();
        let spoilt = operands().filter(|it| !number(**it).is_finite());
        let known = spoilt.map(|it| self.registers[*it as usize]).find(|it| *it != Origin::NONE);
        let is_as_bad = |operand: f32| match value.is_nan() {
            true => operand.is_nan(),
            false => !operand.is_finite(),
        };
        self.registers[computed.to as usize] = match known {
            _ if value.is_finite() => Origin::NONE,
            Some(origin) => origin,
            None if operands().any(|it| is_as_bad(number(*it))) => Origin::NONE,
            None => {
                self.made = self.made.wrapping_add(1);
                let (number, place) = (self.made, computed.place.clone());
                self.observer.made(Spoilt { value, number, place });
                Origin { instruction: executed as u32 + 1, number }
            }
        };
    }

    fn tell_operands(&mut self, program: &Program, operands: u32, count: usize, words: &[u32]) {
        let operands = program.operands[operands as usize..].iter().take(count);
        operands.for_each(|register| self.tell(program, *register, words));
    }
}

impl Watch for Observed<'_> {
    const IS_ON: bool = true;

    fn event(&mut self, event: &Event, words: &[u32]) {
        self.observer.event(event, words);
    }

    fn executed(&mut self, program: &Program, executed: usize, registers: &[u32]) {
        let computed = program.observed.as_ref().and_then(|it| it.computed.get(executed)?.as_ref());
        if let Some(computed) = computed {
            return self.compute(computed, executed, registers);
        }
        match program.instructions[executed] {
            Instruction::Copy { to, from } => self.pass_on(from, to),
            Instruction::Select { to, condition, a, b } => {
                self.pass_on(if registers[condition as usize] != 0 { a } else { b }, to);
            }
            Instruction::LoadLocal { to, address } => {
                self.registers[to as usize] = self.locals[address as usize];
            }
            Instruction::StoreLocal { address, value } => {
                self.locals[address as usize] = self.registers[value as usize];
            }
            Instruction::LoadLocalAt { to, index, base, len } => {
                let address = base + super::clamp_index(registers[index as usize], len.into());
                self.registers[to as usize] = self.locals[address as usize];
            }
            Instruction::StoreLocalAt { value, index, base, len } => {
                let address = base + super::clamp_index(registers[index as usize], len.into());
                self.locals[address as usize] = self.registers[value as usize];
            }
            Instruction::Trace { operands, .. } | Instruction::LightSample { operands, .. } => {
                self.tell_operands(program, operands, OPERANDS_OF_RAYS, registers);
            }
            Instruction::Occluded { operands, .. } => {
                self.tell_operands(program, operands, OPERANDS_OF_RAYS - 1, registers);
            }
            Instruction::Query { query, operands, .. } => {
                let count = query.operand_scalars().count();
                self.tell_operands(program, operands, count, registers);
            }
            _ => {}
        }
    }

    fn ended(&mut self, program: &Program, registers: &[u32]) {
        for (_, register) in &program.outputs {
            self.tell(program, *register, registers);
        }
    }
}

/// The number of operands of a request for a ray or a light sample.
const OPERANDS_OF_RAYS: usize = 8;
