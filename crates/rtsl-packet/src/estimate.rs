//! A rough estimate of the execution time of packet code: latency and throughput.
//!
//! Latencies and rates approximate those of current processors, in cycles; they do not affect results. Work on uniform
//! values is not counted, since little of it is left in the body.

use std::collections::HashMap;

use rtsl_ir::{BinaryOp, Index, IndexVec, Scalar, UnaryOp, Value, VariableKind};

use crate::Kernel;
use crate::kernel::{Op, OpKind, Region, Type};

/// The size of the processor's out-of-order window, in operations.
const WINDOW: f32 = 224.0;

/// The number of vector operations issued per cycle.
const RATE: f32 = 3.0;

/// The number of lanes of which the divider takes longer the more there are. A Zen 5 divides 16 as fast as 8.
const MAX_DIVIDED: f32 = 8.0;

/// The assumed trip count of a loop.
const ROUNDS: f32 = 8.0;

/// The estimated time of one chunk of a kernel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The number of operations on lanes in the code of the body.
    pub operations: u32,
    /// The number of these that the divide and square root unit executes; an approximate inverse root counts as two.
    pub divisions: u32,
    /// Issue cycles.
    pub issue: f32,
    /// Cycles of the divide and square root unit.
    pub divider: f32,
    /// Cycles of latency, less those in which the processor executes later chunks, or iterations of loops, within its
    /// window.
    pub waiting: f32,
    /// True if it has a loop.
    pub loops: bool,
}

impl Estimate {
    /// Estimates the body of `kernel`.
    pub fn new(kernel: &Kernel) -> Estimate {
        let mut walk = Walk {
            kernel,
            ready: IndexVec::filled(kernel.values.len(), 0.0),
            operations: 0,
            divisions: 0,
            done: Work::default(),
            waiting: 0.0,
            loops: false,
        };
        let end = walk.region(&kernel.body, 0.0);
        Estimate {
            operations: walk.operations,
            divisions: walk.divisions,
            issue: walk.done.operations / RATE,
            divider: walk.done.divider,
            waiting: walk.waiting + beyond_window(end, walk.done.operations),
            loops: walk.loops,
        }
    }

    /// Returns the cycles for which the execution units are busy.
    pub fn busy(&self) -> f32 {
        self.issue.max(self.divider)
    }
}

/// Returns the part of `cycles` during which the window is exhausted.
fn beyond_window(cycles: f32, operations: f32) -> f32 {
    cycles * operations / (operations + WINDOW)
}

/// The load of the execution units.
#[derive(Clone, Copy, Default)]
struct Work {
    operations: f32,
    /// Cycles of the divide and square root unit.
    divider: f32,
}

struct Cost {
    latency: f32,
    work: Work,
}

/// Returns the cost of `operations` issued at once, with the result after `latency` cycles.
const fn cost(latency: f32, operations: f32) -> Cost {
    Cost { latency, work: Work { operations, divider: 0.0 } }
}

/// A pass over the code in which every operation starts when its operands are ready.
struct Walk<'a> {
    kernel: &'a Kernel,
    /// The time at which each value is ready.
    ready: IndexVec<Value, f32>,
    operations: u32,
    divisions: u32,
    done: Work,
    /// The waiting cycles in loops.
    waiting: f32,
    loops: bool,
}

impl Walk<'_> {
    /// Returns the time at which the yields of a region that begins at `start` are ready.
    fn region(&mut self, region: &Region, start: f32) -> f32 {
        region.ops.iter().for_each(|op| self.op(op, start));
        region.yields.iter().map(|value| self.ready[*value]).fold(start, f32::max)
    }

    fn op(&mut self, op: &Op, start: f32) {
        let mut begin = start;
        op.kind.for_each_operand(|value| begin = begin.max(self.ready[value]));
        let end = match &op.kind {
            OpKind::If { condition: _, then, otherwise } => {
                self.region(then, begin).max(self.region(otherwise, begin))
            }
            OpKind::Loop { initial: _, body } => self.run_loop(body, begin),
            kind if op.results.iter().any(|result| self.kernel.ty(result).lanes) => {
                let Cost { latency, work } = self.cost(kind);
                self.operations += 1;
                self.divisions += self.divisions_of(kind);
                self.done.operations += work.operations;
                self.done.divider += work.divider;
                begin + latency
            }
            _ => begin,
        };
        op.results.iter().for_each(|result| self.ready[result] = end);
    }

    fn run_loop(&mut self, body: &Region, begin: f32) -> f32 {
        self.loops = true;
        let before = self.done;
        body.params.iter().for_each(|param| self.ready[*param] = begin);
        let end = self.region(body, begin);
        let operations = self.done.operations - before.operations;
        let round = self.recurrence(body).max(beyond_window(end - begin, operations));
        self.waiting += ROUNDS * round;
        self.done.operations += (ROUNDS - 1.0) * operations;
        self.done.divider += (ROUNDS - 1.0) * (self.done.divider - before.divider);
        end
    }

    /// Returns the longest dependency chain from a carried value to a carried value of the next iteration.
    fn recurrence(&self, body: &Region) -> f32 {
        let carried = body.params.iter().zip(body.yields.iter().skip(1));
        let chains =
            carried.filter(|(param, _)| self.kernel.ty(**param).lanes).map(|(param, next)| {
                let mut reached = HashMap::from([(*param, 0.0)]);
                self.follow(body, &mut reached);
                reached.get(next).copied().unwrap_or(0.0)
            });
        chains.fold(0.0, f32::max)
    }

    /// Adds to `reached` the values that depend on it, with the length of the chain.
    fn follow(&self, region: &Region, reached: &mut HashMap<Value, f32>) {
        for op in &region.ops {
            let mut values = Vec::new();
            op.kind.for_each_operand(|operand| values.push(operand));
            for inner in op.kind.regions() {
                self.follow(inner, reached);
                values.extend(&inner.yields);
            }
            let ends = values.iter().filter_map(|value| reached.get(value).copied());
            if let Some(begin) = ends.reduce(f32::max) {
                let end = begin + self.cost(&op.kind).latency;
                reached.extend(op.results.iter().map(|result| (result, end)));
            }
        }
    }

    /// Returns the number of divisions and roots of an operation.
    fn divisions_of(&self, kind: &OpKind) -> u32 {
        match kind {
            OpKind::Unary(UnaryOp::ApproximateInverseSqrt, _) => 2,
            OpKind::Unary(
                UnaryOp::Sqrt | UnaryOp::ApproximateReciprocal | UnaryOp::ApproximateSqrt,
                _,
            ) => 1,
            OpKind::Binary(BinaryOp::Divide, a, _) if self.kernel.ty(*a).scalar == Scalar::F32 => 1,
            _ => 0,
        }
    }

    fn cost(&self, kind: &OpKind) -> Cost {
        cost_of(self.kernel, kind)
    }
}

/// Returns the cycles for which an operation keeps the execution units busy.
pub(crate) fn busy_cycles(kernel: &Kernel, kind: &OpKind) -> f32 {
    let Work { operations, divider } = cost_of(kernel, kind).work;
    (operations / RATE).max(divider)
}

fn cost_of(kernel: &Kernel, kind: &OpKind) -> Cost {
    let lanes = kernel.width as f32;
    let divided = lanes.min(MAX_DIVIDED);
    let divider = |latency, cycles_a_lane: f32| Cost {
        latency,
        work: Work { operations: 1.0, divider: divided * cycles_a_lane },
    };
    let is_float = |value: &Value| kernel.ty(*value).scalar == Scalar::F32;
    match kind {
        OpKind::Constant(_)
        | OpKind::Unspecified
        | OpKind::Reinterpret(..)
        | OpKind::If { .. }
        | OpKind::Loop { .. } => cost(0.0, 0.0),
        OpKind::Unary(UnaryOp::Sqrt, _) => divider(15.0, 1.1),
        OpKind::Unary(UnaryOp::Floor | UnaryOp::Ceil | UnaryOp::Trunc | UnaryOp::RoundEven, _) => {
            cost(6.0, 1.0)
        }
        // The machine's estimate and one Newton step.
        OpKind::Unary(
            UnaryOp::ApproximateReciprocal
            | UnaryOp::ApproximateInverseSqrt
            | UnaryOp::ApproximateSqrt,
            _,
        ) => cost(18.0, 5.0),
        OpKind::Unary(UnaryOp::Negate | UnaryOp::Not | UnaryOp::Abs | UnaryOp::Seldom, _)
        | OpKind::Select(..) => cost(1.0, 1.0),
        OpKind::Binary(BinaryOp::Divide | BinaryOp::Remainder, a, _) if is_float(a) => {
            divider(12.0, 0.75)
        }
        OpKind::Binary(BinaryOp::Divide | BinaryOp::Remainder, ..) => cost(40.0, 12.0),
        OpKind::Binary(BinaryOp::Multiply | BinaryOp::MultiplyHigh, ..) | OpKind::Fma(..) => {
            cost(4.0, 1.0)
        }
        OpKind::Binary(BinaryOp::Add | BinaryOp::Subtract, a, _) if is_float(a) => cost(4.0, 1.0),
        OpKind::Binary(..) => cost(1.0, 1.0),
        OpKind::Compare(..) | OpKind::Bitcast(..) => cost(3.0, 1.0),
        OpKind::Convert(to, a) if is_float(a) && *to != Scalar::Bool => cost(10.0, 6.0),
        OpKind::Convert(..) => cost(4.0, 1.0),
        OpKind::Load(variable, index) => load_cost(kernel, *variable, *index, lanes),
        OpKind::Any(_)
        | OpKind::First(..)
        | OpKind::Store { .. }
        | OpKind::Length(_)
        | OpKind::Trace { .. }
        | OpKind::Occluded { .. }
        | OpKind::LightCount
        | OpKind::LightSample { .. }
        | OpKind::Ambient
        | OpKind::Rand(_)
        | OpKind::Query { .. }
        | OpKind::ReportBudget => cost(5.0, 1.0),
    }
}

fn load_cost(kernel: &Kernel, variable: rtsl_ir::VariableId, index: Index, lanes: f32) -> Cost {
    let in_lanes = match kernel.variable(variable).variable.kind {
        VariableKind::State | VariableKind::Scratch | VariableKind::Local => true,
        VariableKind::Member
        | VariableKind::Parameter
        | VariableKind::Buffer
        | VariableKind::Accepted => false,
    };
    match index {
        Index::Constant(_) if in_lanes => cost(5.0, 1.0),
        Index::Dynamic(value) if in_lanes && kernel.ty(value) == Type::uniform(Scalar::I32) => {
            cost(10.0, 2.0)
        }
        Index::Constant(_) | Index::Dynamic(_) => cost(20.0, 4.0 * lanes),
    }
}
