//! The interpreter: the oracle that defines the meaning of a function, and the backend of hosts without a code
//! generator.
//!
//! It runs one function for one ray. [`Interpreter::prepare`] compiles the regions to a flat program with jumps once;
//! [`Interpreter::run`] then works on one array of registers that is kept between runs: it neither allocates nor
//! recurses. The running time is not bounded here: functions with loops that may not end are instrumented with a budget
//! instead.

mod compile;
mod program;
mod watch;

use std::fmt::{self, Display, Formatter};
use std::sync::Arc;

use program::{Instruction, Program, Register};
use watch::{Observed, Unobserved, Watch};

use crate::host::{Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, RayLanes};
use crate::{Function, Observer, Query, VariableId, evaluate, scalar_count};

/// The storage of a function's variables except locals, which the interpreter holds. Scalars are
/// [bits](crate::Constant::bits); a bool is 0 or 1.
pub trait Storage {
    /// Returns the scalar at `index` of a state, member, parameter or scratch variable or a buffer; the index is less
    /// than the variable's length, for buffers times the number of elements.
    fn load(&self, variable: VariableId, index: u32) -> u32;

    /// Returns the number of elements of a buffer.
    fn elements(&self, buffer: VariableId) -> u32;

    /// Stores an output. All loads of a run come before its first store.
    fn store(&mut self, variable: VariableId, component: u32, bits: u32);
}

/// The result of a run, apart from the stored outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Outcome {
    /// The value of the accepted output; false if the function has none. If it has one and this is false, nothing was
    /// stored.
    pub accepted: bool,
    /// True if the budget of loop iterations was used up.
    pub budget_exceeded: bool,
}

/// A function ready to run. Clones share the program, so that each thread can have one.
#[derive(Clone, Debug)]
pub struct Interpreter {
    program: Arc<Program>,
    /// Constants are initialised once and never overwritten.
    registers: Vec<u32>,
    /// The operands of a query; kept to save allocations.
    operands: Vec<u32>,
    locals: Vec<u32>,
    lanes: Box<Lanes>,
}

/// Requests to the host and its answers, of which only lane 0 is used. Answers are zeroed before each request, since
/// hosts may rely on that and leave them unset.
#[derive(Clone, Debug, Default)]
struct Lanes {
    rays: RayLanes,
    query: LightQueryLanes,
    light: LightLanes,
    colors: LaneColors,
    floats: LaneFloats,
}

impl Interpreter {
    /// Prepares a verified function.
    pub fn prepare(function: &Function) -> Result<Interpreter, PrepareError> {
        Self::new(function, false)
    }

    /// Prepares a verified function whose runs are [observed](Interpreter::run_observed).
    pub fn prepare_observed(function: &Function) -> Result<Interpreter, PrepareError> {
        Self::new(function, true)
    }

    fn new(function: &Function, is_observed: bool) -> Result<Interpreter, PrepareError> {
        let program = compile::compile(function, is_observed)?;
        Ok(Interpreter {
            registers: program.registers.clone(),
            operands: Vec::new(),
            locals: vec![0; program.local_scalars as usize],
            program: Arc::new(program),
            lanes: Box::default(),
        })
    }

    /// Runs for the ray with index `ray` within the call, which is passed to the host.
    pub fn run<S: Storage + ?Sized>(
        &mut self,
        ray: u32,
        storage: &mut S,
        host: &mut dyn Host,
    ) -> Outcome {
        self.run_watched(ray, storage, host, &mut Unobserved)
    }

    /// Runs like [`Interpreter::run`], with the same results, and tells an observer what happens. Of a function that is
    /// not prepared for it, nothing is told.
    pub fn run_observed<S: Storage + ?Sized>(
        &mut self,
        ray: u32,
        storage: &mut S,
        host: &mut dyn Host,
        observer: &mut dyn Observer,
    ) -> Outcome {
        let mut watch = Observed::new(observer, self.registers.len(), self.locals.len());
        self.run_watched(ray, storage, host, &mut watch)
    }

    fn run_watched<S: Storage + ?Sized>(
        &mut self,
        ray: u32,
        storage: &mut S,
        host: &mut dyn Host,
        watch: &mut impl Watch,
    ) -> Outcome {
        self.locals.fill(0);
        let lanes = LaneSet { base: ray, active: 1 };
        let mut run = Run {
            registers: &mut self.registers,
            operands: &mut self.operands,
            locals: &mut self.locals,
            lanes: &mut self.lanes,
            lane_set: lanes,
            budget_exceeded: false,
        };
        run.execute(&self.program, storage, host, watch);
        let budget_exceeded = run.budget_exceeded;
        watch.ended(&self.program, &self.registers);
        let accepted = self.store_outputs(storage);
        Outcome { accepted, budget_exceeded }
    }

    fn store_outputs<S: Storage + ?Sized>(&self, storage: &mut S) -> bool {
        let accepted = self.program.accepted.map(|register| self.registers[register as usize] != 0);
        if accepted != Some(false) {
            for (output, register) in &self.program.outputs {
                storage.store(
                    output.variable,
                    output.component,
                    self.registers[*register as usize],
                );
            }
        }
        accepted.unwrap_or(false)
    }
}

/// The reason a function cannot be prepared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PrepareError {
    /// It calls or tests this reference, which linking would have replaced.
    Unlinked(String),
}

impl Display for PrepareError {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        match self {
            PrepareError::Unlinked(member) => {
                write!(out, "the reference `{member}` has not been linked")
            }
        }
    }
}

impl std::error::Error for PrepareError {}

/// The state of one run.
struct Run<'a> {
    registers: &'a mut [u32],
    operands: &'a mut Vec<u32>,
    locals: &'a mut [u32],
    lanes: &'a mut Lanes,
    lane_set: LaneSet,
    budget_exceeded: bool,
}

impl Run<'_> {
    fn execute<S: Storage + ?Sized, W: Watch>(
        &mut self,
        program: &Program,
        storage: &S,
        host: &mut dyn Host,
        watch: &mut W,
    ) {
        let mut position = 0;
        while let Some(instruction) = program.instructions.get(position) {
            let executed = position;
            position += 1;
            match *instruction {
                Instruction::Unary { function, to, a } => self.set(to, function(self.get(a))),
                Instruction::Binary { function, to, a, b } => {
                    self.set(to, function(self.get(a), self.get(b)));
                }
                Instruction::Select { to, condition, a, b } => {
                    let chosen = if self.get(condition) != 0 { a } else { b };
                    self.set(to, self.get(chosen));
                }
                Instruction::Fma { to, a, b, c } => {
                    self.set(to, evaluate::fma(self.get(a), self.get(b), self.get(c)));
                }
                Instruction::Copy { to, from } => self.set(to, self.get(from)),
                Instruction::Load { to, variable, index } => {
                    self.set(to, storage.load(variable, index));
                }
                Instruction::LoadAt { to, variable, index, len } => {
                    let index = clamp_index(self.get(index), len.into());
                    self.set(to, storage.load(variable, index));
                }
                Instruction::LoadBuffer { to, variable, index } => {
                    let empty = storage.elements(variable) == 0;
                    self.set(to, if empty { 0 } else { storage.load(variable, index) });
                }
                Instruction::LoadBufferAt { to, variable, index, len } => {
                    let scalars = u64::from(storage.elements(variable)) * u64::from(len);
                    let index = clamp_index(self.get(index), scalars);
                    self.set(to, if scalars == 0 { 0 } else { storage.load(variable, index) });
                }
                Instruction::LoadLocal { to, address } => {
                    self.set(to, self.locals[address as usize]);
                }
                Instruction::LoadLocalAt { to, index, base, len } => {
                    let address = base + clamp_index(self.get(index), len.into());
                    self.set(to, self.locals[address as usize]);
                }
                Instruction::StoreLocal { address, value } => {
                    self.locals[address as usize] = self.get(value);
                }
                Instruction::StoreLocalAt { value, index, base, len } => {
                    let address = base + clamp_index(self.get(index), len.into());
                    self.locals[address as usize] = self.get(value);
                }
                Instruction::Length { to, variable } => {
                    self.set(to, storage.elements(variable).min(i32::MAX as u32));
                }
                Instruction::Jump { target } => position = target as usize,
                Instruction::JumpIf { condition, target } => {
                    if self.get(condition) != 0 {
                        position = target as usize;
                    }
                }
                Instruction::JumpUnless { condition, target } => {
                    if self.get(condition) == 0 {
                        position = target as usize;
                    }
                }
                Instruction::Trace { to, operands } => {
                    let operands = &program.operands[operands as usize..];
                    self.ask_rays(operands);
                    self.lanes.rays.weight[0] = self.get_f32(operands[7]);
                    self.lanes.colors = LaneColors::default();
                    host.trace(self.lane_set, &self.lanes.rays, &mut self.lanes.colors);
                    for component in 0..self.lanes.colors.len() {
                        let radiance = self.lanes.colors[component][0];
                        self.set(to + component as u32, radiance.to_bits());
                    }
                }
                Instruction::Occluded { to, operands } => {
                    self.ask_rays(&program.operands[operands as usize..]);
                    let occluded = host.occluded(self.lane_set, &self.lanes.rays);
                    self.set(to, occluded & 1);
                }
                Instruction::LightCount { to } => self.set(to, host.light_count()),
                Instruction::LightSample { to, operands } => {
                    self.light_sample(to, &program.operands[operands as usize..], host);
                }
                Instruction::Ambient { to } => {
                    for (to, component) in (to..).zip(host.ambient()) {
                        self.set(to, component.to_bits());
                    }
                }
                Instruction::Rand { to } => {
                    self.lanes.floats = LaneFloats::default();
                    host.rand(self.lane_set, &mut self.lanes.floats);
                    self.set(to, self.lanes.floats[0].to_bits());
                }
                Instruction::Query { query, to, operands } => {
                    self.query(query, to, &program.operands[operands as usize..], host);
                }
                Instruction::ReportBudget => self.budget_exceeded = true,
                Instruction::Report { event, operands } => {
                    self.report(program, event, operands, watch);
                }
            }
            if W::IS_ON {
                watch.executed(program, executed, self.registers);
            }
        }
    }

    #[cold]
    fn report(&self, program: &Program, event: u32, operands: u32, watch: &mut impl Watch) {
        let Some(observed) = &program.observed else { return };
        let event = &observed.events[event as usize];
        let count = event.values.iter().map(|value| scalar_count(&value.ty)).sum();
        let operands = program.operands[operands as usize..].iter().take(count);
        let words: Vec<u32> = operands.map(|register| self.get(*register)).collect();
        watch.event(event, &words);
    }

    fn get(&self, register: Register) -> u32 {
        self.registers[register as usize]
    }

    fn get_f32(&self, register: Register) -> f32 {
        f32::from_bits(self.get(register))
    }

    fn set(&mut self, register: Register, bits: u32) {
        self.registers[register as usize] = bits;
    }

    /// Fills lane 0 of the rays from origin, direction and limit.
    fn ask_rays(&mut self, operands: &[Register]) {
        for axis in 0..3 {
            self.lanes.rays.origin[axis][0] = self.get_f32(operands[axis]);
            self.lanes.rays.direction[axis][0] = self.get_f32(operands[3 + axis]);
        }
        self.lanes.rays.limit[0] = self.get_f32(operands[6]);
    }

    fn query(&mut self, query: Query, to: Register, operands: &[Register], host: &mut dyn Host) {
        self.operands.clear();
        for (_, register) in query.operand_scalars().zip(operands) {
            self.operands.push(self.registers[*register as usize]);
        }
        let count = query.result_scalars().count();
        let results = &mut self.registers[to as usize..][..count];
        results.fill(0);
        host.query(self.lane_set.base, query, self.operands, results);
    }

    fn light_sample(&mut self, to: Register, operands: &[Register], host: &mut dyn Host) {
        let index = self.get(operands[0]);
        for axis in 0..3 {
            self.lanes.query.point[axis][0] = self.get_f32(operands[1 + axis]);
            self.lanes.query.normal[axis][0] = self.get_f32(operands[4 + axis]);
        }
        self.lanes.query.cosine[0] = self.get_f32(operands[7]);
        self.lanes.light = LightLanes::default();
        let Lanes { query, light, .. } = &mut *self.lanes;
        let reached = host.light_sample(self.lane_set, index, query, light) & 1 != 0;
        let direction = light.direction.iter().map(|lanes| lanes[0]);
        let color = light.color.iter().map(|lanes| lanes[0]);
        let floats = direction.chain([light.distance[0]]).chain(color).chain([light.pdf[0]]);
        self.registers[to as usize] = reached.into();
        for (to, value) in (to as usize + 1..).zip(floats) {
            self.registers[to] = if reached { value.to_bits() } else { 0 };
        }
    }
}

/// Clamps an i32 to `0..count`; 0 if `count` is 0.
fn clamp_index(index: u32, count: u64) -> u32 {
    let last = count.saturating_sub(1).min(i32::MAX as u64) as u32;
    (index as i32).clamp(0, last as i32) as u32
}
