//! The interpreter of packet code: chunk by chunk, operation by operation, lane by lane, on the scalar functions of
//! [`rtsl_ir::evaluate`].
//!
//! It has two uses. It tests the lowering without any code generator: its results equal those of the single-ray
//! interpreter to the bit. And it counts: the [`Profile`] of a run lists the operations that machine code of the same
//! kernel executes for the same rays.
//!
//! Rays that are off are never read: in their lanes, loads and unspecified values are noise that differs from lane to
//! lane, which exposes a lowering that uses them.

mod memory;
mod requests;

use rtsl_ir::host::{Host, MAX_LANES};
use rtsl_ir::{IndexVec, Scalar, Value, VariableId, evaluate};

use crate::Kernel;
use crate::kernel::{Op, OpKind, Region};
use crate::line_work::Lines;
use crate::profile::{Conditions, Profile};

/// The storage of a kernel's variables except locals, which the interpreter holds. Scalars are
/// [bits](rtsl_ir::Constant::bits); a bool is 0 or 1. Uniform variables are accessed as those of ray 0.
pub trait Storage {
    /// Returns the scalar at `index` of a state, member or scratch variable or a buffer; the index is less than the
    /// variable's length, for buffers times the number of elements.
    fn load(&self, variable: VariableId, index: u32, ray: u32) -> u32;

    /// Returns the number of elements of a buffer.
    fn elements(&self, buffer: VariableId, ray: u32) -> u32;

    /// Stores an output. The accepted one is stored for every ray, on or off; not at all by a kernel that [keeps the
    /// nearest hit](Kernel::keeps_nearest), which stores for ray 0.
    fn store(&mut self, variable: VariableId, component: u32, ray: u32, bits: u32);
}

/// The rays of a call.
#[derive(Clone, Copy)]
pub struct Rays<'a> {
    /// The number of rays.
    pub count: u32,
    /// Returns true for the rays that take part.
    pub is_on: &'a dyn Fn(u32) -> bool,
    /// The greatest number of iterations of all loops together, after which the run is aborted.
    pub round_limit: u64,
}

/// The result of a run, apart from the stored outputs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// True if a ray used up the budget of loop iterations.
    pub budget_exceeded: bool,
    /// The index within the call of the object with the nearest hit.
    pub nearest: Option<u32>,
    /// True if the limit of iterations aborted the run.
    pub cut_short: bool,
    /// The operation counts.
    pub profile: Profile,
}

/// A verified kernel, prepared for runs.
#[derive(Clone, Debug)]
pub struct Interpreter {
    kernel: Kernel,
    conditions: Conditions,
    lines: Lines,
}

impl Interpreter {
    /// Prepares a kernel.
    pub fn new(kernel: Kernel) -> Interpreter {
        let (conditions, lines) = (Conditions::of(&kernel), Lines::of(&kernel));
        Interpreter { kernel, conditions, lines }
    }

    /// The kernel.
    pub fn kernel(&self) -> &Kernel {
        &self.kernel
    }

    /// Runs the kernel for all rays of a call.
    pub fn run(&self, rays: Rays<'_>, storage: &mut dyn Storage, host: &mut dyn Host) -> Outcome {
        let Interpreter { kernel, conditions, lines } = self;
        let mut execution = Execution {
            kernel,
            rays,
            storage,
            host,
            conditions,
            lines,
            values: IndexVec::filled(kernel.values.len(), [0; MAX_LANES]),
            locals: memory::locals(kernel),
            base: 0,
            chunk: 0,
            active: 0,
            nearest: None,
            outcome: Outcome::default(),
        };
        execution.outcome.profile = Profile::new(conditions, rays.count);
        execution.outcome.profile.lines = lines.none();
        execution.run();
        execution.outcome
    }
}

/// A value's bits by lane; those of a uniform value are in all of them.
type Lanes = [u32; MAX_LANES];

/// The state of a run.
struct Execution<'a> {
    kernel: &'a Kernel,
    rays: Rays<'a>,
    storage: &'a mut dyn Storage,
    host: &'a mut dyn Host,
    conditions: &'a Conditions,
    lines: &'a Lines,
    values: IndexVec<Value, Lanes>,
    /// The memory of each variable; empty for those that are not locals.
    locals: IndexVec<VariableId, Vec<Lanes>>,
    /// The ray of lane 0.
    base: u32,
    /// The chunk's mask: bit `i` is set if lane `i` is on.
    chunk: u32,
    /// The lanes for which the open region runs.
    active: u32,
    nearest: Option<Hit>,
    outcome: Outcome,
}

/// A candidate for the nearest hit.
struct Hit {
    object: u32,
    /// The distance, with infinity instead of NaN.
    distance: f32,
    /// The bits of each output.
    bits: Vec<u32>,
}

impl<'a> Execution<'a> {
    fn run(&mut self) {
        if self.rays.count == 0 {
            return;
        }
        let kernel = self.kernel;
        self.ops(&kernel.prologue);
        for base in (0..self.rays.count).step_by(kernel.width as usize) {
            self.base = base;
            self.chunk = self.lanes_on();
            if self.chunk == 0 {
                self.store_nothing_accepted();
                continue;
            }
            self.active = self.chunk;
            let chunk = self.chunk;
            self.values[kernel.body.params[0]] = std::array::from_fn(|lane| chunk >> lane & 1);
            self.clear_locals();
            self.ops(&kernel.body);
            if self.outcome.cut_short {
                return;
            }
            if kernel.keeps_nearest() {
                self.keep_nearest();
            } else {
                self.store_outputs();
            }
        }
        self.store_nearest();
    }

    /// Returns the lanes of the chunk whose rays exist and take part.
    fn lanes_on(&self) -> u32 {
        let is_on = |lane: &u32| {
            let ray = self.base + lane;
            ray < self.rays.count && (self.rays.is_on)(ray)
        };
        (0..self.kernel.width).filter(is_on).fold(0, |lanes, lane| lanes | 1 << lane)
    }

    fn ops(&mut self, region: &'a Region) {
        region.ops.iter().for_each(|op| self.op(op));
    }

    fn op(&mut self, op: &'a Op) {
        let profile = &mut self.outcome.profile;
        profile.count(self.kernel, op, self.active);
        self.lines.count(&mut profile.lines, self.kernel, op, self.active);
        match &op.kind {
            OpKind::If { condition, then, otherwise } => {
                self.branch(op, *condition, then, otherwise);
            }
            OpKind::Loop { initial, body } => self.repeat(op, initial, body),
            kind => self.plain(op, kind),
        }
    }

    /// Executes an operation without regions. Separate from operations with regions, whose stack frames recurse.
    fn plain(&mut self, op: &'a Op, kind: &'a OpKind) {
        let result = || op.results.get(0);
        match kind {
            OpKind::Constant(constant) => self.define(result(), |_, _| constant.bits()),
            OpKind::Unary(op, a) => {
                let function = evaluate::unary(*op, self.scalar(*a)).expect("verified");
                self.define(result(), |it, lane| function(it.get(*a, lane)));
            }
            OpKind::Binary(op, a, b) => {
                let function = evaluate::binary(*op, self.scalar(*a)).expect("verified");
                self.define(result(), |it, lane| function(it.get(*a, lane), it.get(*b, lane)));
            }
            OpKind::Compare(op, a, b) => {
                let function = evaluate::compare(*op, self.scalar(*a)).expect("verified");
                self.define(result(), |it, lane| function(it.get(*a, lane), it.get(*b, lane)));
            }
            OpKind::Select(condition, a, b) => {
                self.observe(*condition);
                self.define(result(), |it, lane| {
                    let chosen = if it.get(*condition, lane) != 0 { a } else { b };
                    it.get(*chosen, lane)
                });
            }
            OpKind::Fma(a, b, c) => self.define(result(), |it, lane| {
                evaluate::fma(it.get(*a, lane), it.get(*b, lane), it.get(*c, lane))
            }),
            OpKind::Convert(to, a) => {
                let function = evaluate::convert(self.scalar(*a), *to);
                self.define(result(), |it, lane| function(it.get(*a, lane)));
            }
            OpKind::Bitcast(to, a) => {
                let function = evaluate::bitcast(self.scalar(*a), *to).expect("verified");
                self.define(result(), |it, lane| function(it.get(*a, lane)));
            }
            OpKind::Reinterpret(_, a) => self.define(result(), |it, lane| it.get(*a, lane)),
            OpKind::Unspecified => {
                let scalar = self.scalar(result());
                self.define(result(), |it, lane| it.noise(scalar, lane));
            }
            OpKind::Any(mask) => {
                let any = self.lanes_of(*mask) != 0;
                self.define(result(), |_, _| u32::from(any));
            }
            OpKind::First(mask, value) => {
                let lane = self.lanes_of(*mask).trailing_zeros() as usize;
                let first = self.get(*value, lane.min(MAX_LANES - 1));
                self.define(result(), |_, _| first);
            }
            OpKind::Load(variable, index) => self.load(result(), *variable, *index),
            OpKind::Store { variable, index, value, mask } => {
                self.store(*variable, *index, *value, *mask);
            }
            OpKind::Length(buffer) => self.length(result(), *buffer),
            OpKind::If { .. } | OpKind::Loop { .. } => unreachable!("it has regions"),
            OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightCount
            | OpKind::LightSample { .. }
            | OpKind::Ambient
            | OpKind::Rand(_)
            | OpKind::Query { .. }
            | OpKind::ReportBudget => self.request(op),
        }
    }

    // Branches and loops.

    fn branch(&mut self, op: &Op, condition: Value, then: &'a Region, otherwise: &'a Region) {
        if let Some(mask) = self.conditions.mask_of(condition) {
            self.observe(mask);
            self.count_condition(mask);
        }
        let outer = self.active;
        let holds = self.get(condition, 0) != 0;
        self.outcome.profile.branches.count(holds);
        let side = if holds { then } else { otherwise };
        if holds {
            self.narrow(condition);
        }
        self.ops(side);
        self.active = outer;
        for (result, value) in op.results.iter().zip(&side.yields) {
            self.values[result] = self.values[*value];
        }
    }

    fn repeat(&mut self, op: &Op, initial: &[Value], body: &'a Region) {
        let outer = self.active;
        let (again, next) = body.yields.split_first().expect("verified");
        let mut carried: Vec<Lanes> = self.lanes_of_each(initial);
        loop {
            for (param, lanes) in body.params.iter().zip(carried) {
                self.values[*param] = lanes;
            }
            self.ops(body);
            carried = self.lanes_of_each(next);
            self.outcome.profile.rounds += 1;
            if let Some(mask) = self.conditions.mask_of(*again) {
                self.observe(mask);
                self.count_condition(mask);
            }
            self.outcome.cut_short |= self.outcome.profile.rounds >= self.rays.round_limit;
            if self.get(*again, 0) == 0 || self.outcome.cut_short {
                break;
            }
            self.narrow(*again);
        }
        self.active = outer;
        for (result, lanes) in op.results.iter().zip(carried) {
            self.values[result] = lanes;
        }
    }

    fn lanes_of_each(&self, values: &[Value]) -> Vec<Lanes> {
        values.iter().map(|value| self.values[*value]).collect()
    }

    /// Restricts the active lanes to the mask whose [`OpKind::Any`] is `condition`.
    fn narrow(&mut self, condition: Value) {
        if let Some(mask) = self.conditions.mask_of(condition) {
            self.active &= self.lanes_of(mask);
        }
    }

    /// Records the lanes for which a condition is true and false.
    fn observe(&mut self, condition: Value) {
        if let Some(index) = self.conditions.index_of(condition) {
            let holds = self.lanes_of(condition);
            self.outcome.profile.observe(index, self.base, self.active & holds, true);
            self.outcome.profile.observe(index, self.base, self.active & !holds, false);
        }
    }

    /// Counts a condition of a branch or a loop for the line of its mask.
    fn count_condition(&mut self, mask: Value) {
        let holds = self.lanes_of(mask);
        let (held, failed) = (self.active & holds, self.active & !holds);
        self.lines.count_condition(&mut self.outcome.profile.lines, mask, held, failed);
    }

    // Values.

    fn scalar(&self, value: Value) -> Scalar {
        self.kernel.ty(value).scalar
    }

    fn get(&self, value: Value, lane: usize) -> u32 {
        self.values[value][lane]
    }

    /// Returns the lanes of a mask that are on.
    fn lanes_of(&self, mask: Value) -> u32 {
        let lanes = 0..self.kernel.width as usize;
        lanes.fold(0, |on, lane| on | self.get(mask, lane) << lane)
    }

    /// Computes a value lane by lane, or once if it is uniform.
    fn define(&mut self, result: Value, compute: impl Fn(&Self, usize) -> u32) {
        let lanes = if self.kernel.ty(result).lanes {
            let width = self.kernel.width as usize;
            std::array::from_fn(|lane| if lane < width { compute(self, lane) } else { 0 })
        } else {
            [compute(self, 0); MAX_LANES]
        };
        self.values[result] = lanes;
    }

    /// Returns bits that no observable result may depend on.
    fn noise(&self, scalar: Scalar, lane: usize) -> u32 {
        let bits = (self.base + lane as u32 + 1).wrapping_mul(0x9e37_79b9);
        if scalar == Scalar::Bool { bits >> 31 } else { bits }
    }
}
