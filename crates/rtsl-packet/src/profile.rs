//! Operation counts of a run of packet code.
//!
//! The convention: a float addition, subtraction, multiplication, division, minimum, maximum, square root or rounding
//! to an integral value is one float operation, an `fma` two. Divisions and square roots are also counted separately,
//! since they bound many kernels. Comparisons, selects, conversions, integer operations, and logic (of bools and of the
//! sign of floats) are no float operations. Constants and bit casts are not counted.
//!
//! A load or store moves 4 bytes per lane. Accesses to the kernel's locals are counted separately from those to the
//! caller's memory.
//!
//! Everything has two [counts](Count): an operation on lanes is executed in all W of them, but is active only in those
//! that are on at that point. An operation on uniform values is executed once, and active.

use std::fmt::{self, Display, Formatter};

use rtsl_ir::{BinaryOp, Scalar, UnaryOp, Value, VariableKind};

use crate::Kernel;
use crate::kernel::{Op, OpKind, Region};
use crate::line_work::LineWork;

/// The counts of a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Profile {
    /// The rays of the call.
    pub rays: u64,
    /// Lanes in which operations on lanes were done: the occupancy of packets.
    pub lanes: Count,
    /// Float operations, including the next two.
    pub float_operations: Count,
    /// Float divisions.
    pub divisions: Count,
    /// Square roots.
    pub square_roots: Count,
    /// Comparisons of any type.
    pub comparisons: Count,
    /// Selects of any type.
    pub selects: Count,
    /// Conversions between types.
    pub conversions: Count,
    /// Arithmetic and logic of integers.
    pub integer_operations: Count,
    /// Logic of bools and of the sign of floats.
    pub logic: Count,
    /// State and the accepted output.
    pub state: Traffic,
    /// Scratch.
    pub scratch: Traffic,
    /// Members of instances.
    pub members: Traffic,
    /// Buffers.
    pub buffers: Traffic,
    /// The kernel's locals.
    pub locals: Traffic,
    /// Executed branches, by side.
    pub branches: Sides,
    /// Iterations of loops.
    pub rounds: u64,
    /// The varying conditions, in the order of their definition.
    pub decisions: Vec<Decision>,
    /// The work by lines of the source, in their order, if the kernel has places.
    pub lines: Vec<LineWork>,
}

/// The number of executions of an operation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// In all lanes.
    pub executed: u64,
    /// In lanes that are on.
    pub active: u64,
}

impl Count {
    pub(crate) fn add(&mut self, lanes: Count, times: u64) {
        self.executed += times * lanes.executed;
        self.active += times * lanes.active;
    }
}

/// Bytes moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Bytes read.
    pub loaded: Count,
    /// Bytes written.
    pub stored: Count,
}

/// The number of executions of each side of a branch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sides {
    /// The condition was true.
    pub taken: u64,
    /// The condition was false.
    pub not_taken: u64,
}

impl Sides {
    pub(crate) fn count(&mut self, holds: bool) {
        if holds {
            self.taken += 1;
        } else {
            self.not_taken += 1;
        }
    }
}

/// A condition on which rays diverge: of a branch, of a loop, or of selects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Decision {
    /// The first ray for which it was true.
    pub held: Option<u32>,
    /// The first ray for which it was false.
    pub failed: Option<u32>,
}

impl Profile {
    pub(crate) fn new(conditions: &Conditions, rays: u32) -> Profile {
        let decisions = vec![Decision::default(); conditions.decisions];
        Profile { rays: rays.into(), decisions, ..Profile::default() }
    }

    /// Returns the bytes moved from and to the caller's memory.
    pub fn bytes(&self) -> Count {
        let Profile { state, scratch, members, buffers, .. } = self;
        let mut bytes = Count::default();
        for Traffic { loaded, stored } in [state, scratch, members, buffers] {
            bytes.add(*loaded, 1);
            bytes.add(*stored, 1);
        }
        bytes
    }

    /// Adds the counts of another run of the same kernel.
    pub fn add(&mut self, other: &Profile) {
        self.rays += other.rays;
        self.rounds += other.rounds;
        self.branches.taken += other.branches.taken;
        self.branches.not_taken += other.branches.not_taken;
        for (count, other) in self.counts_mut().into_iter().zip(other.clone().counts_mut()) {
            count.add(*other, 1);
        }
        self.lines.resize_with(other.lines.len(), LineWork::default);
        for (line, other) in self.lines.iter_mut().zip(&other.lines) {
            line.add(other);
        }
        self.decisions.resize(other.decisions.len(), Decision::default());
        for (decision, other) in self.decisions.iter_mut().zip(&other.decisions) {
            decision.held = decision.held.or(other.held);
            decision.failed = decision.failed.or(other.failed);
        }
    }

    pub(crate) fn observe(&mut self, decision: usize, base: u32, lanes: u32, held: bool) {
        if lanes == 0 {
            return;
        }
        let decision = &mut self.decisions[decision];
        let first = if held { &mut decision.held } else { &mut decision.failed };
        first.get_or_insert(base + lanes.trailing_zeros());
    }

    /// Counts an operation executed while the lanes `active` are on.
    pub(crate) fn count(&mut self, kernel: &Kernel, op: &Op, active: u32) {
        let Some(work) = Work::of(kernel, op) else { return };
        let is_lanes = match &op.kind {
            OpKind::Store { variable, .. } => kernel.variable(*variable).varies,
            _ => op.results.iter().any(|result| kernel.ty(result).lanes),
        };
        let lanes = if is_lanes {
            let active = active.count_ones();
            let lanes = Count { executed: kernel.width.into(), active: active.into() };
            self.lanes.add(lanes, 1);
            lanes
        } else {
            Count { executed: 1, active: 1 }
        };
        self.count_work(work, lanes);
    }

    /// Counts the store of an output in the lanes `on`. If no lane is on, there is no store.
    pub(crate) fn count_output(&mut self, kind: VariableKind, width: u32, on: u32) {
        if on == 0 {
            return;
        }
        let lanes = Count { executed: width.into(), active: on.count_ones().into() };
        self.lanes.add(lanes, 1);
        self.count_work(Work::Store(kind), lanes);
    }

    fn count_work(&mut self, work: Work, lanes: Count) {
        match work {
            Work::Float(operations) => self.float_operations.add(lanes, operations),
            Work::Division => {
                self.float_operations.add(lanes, 1);
                self.divisions.add(lanes, 1);
            }
            Work::SquareRoot => {
                self.float_operations.add(lanes, 1);
                self.square_roots.add(lanes, 1);
            }
            Work::Comparison => self.comparisons.add(lanes, 1),
            Work::Select => self.selects.add(lanes, 1),
            Work::Conversion => self.conversions.add(lanes, 1),
            Work::Integer => self.integer_operations.add(lanes, 1),
            Work::Logic => self.logic.add(lanes, 1),
            Work::Load(kind) => self.traffic(kind).loaded.add(lanes, WORD_BYTES),
            Work::Store(kind) => self.traffic(kind).stored.add(lanes, WORD_BYTES),
        }
    }

    fn traffic(&mut self, kind: VariableKind) -> &mut Traffic {
        match kind {
            VariableKind::State | VariableKind::Accepted => &mut self.state,
            VariableKind::Scratch => &mut self.scratch,
            VariableKind::Member | VariableKind::Parameter => &mut self.members,
            VariableKind::Buffer => &mut self.buffers,
            VariableKind::Local => &mut self.locals,
        }
    }
}

const WORD_BYTES: u64 = 4;

/// The category under which an operation is counted.
enum Work {
    Float(u64),
    Division,
    SquareRoot,
    Comparison,
    Select,
    Conversion,
    Integer,
    Logic,
    Load(VariableKind),
    Store(VariableKind),
}

impl Work {
    fn of(kernel: &Kernel, op: &Op) -> Option<Work> {
        let scalar = |value: Value| kernel.ty(value).scalar;
        Some(match &op.kind {
            OpKind::Unary(unary, a) => Work::of_unary(*unary, scalar(*a)),
            OpKind::Binary(binary, a, _) => Work::of_binary(*binary, scalar(*a)),
            OpKind::Compare(..) => Work::Comparison,
            OpKind::Select(..) => Work::Select,
            OpKind::Fma(..) => Work::Float(2),
            OpKind::Convert(..) => Work::Conversion,
            OpKind::Load(variable, _) => Work::Load(kernel.variable(*variable).variable.kind),
            OpKind::Store { variable, .. } => Work::Store(kernel.variable(*variable).variable.kind),
            OpKind::Constant(_)
            | OpKind::Bitcast(..)
            | OpKind::Reinterpret(..)
            | OpKind::Unspecified
            | OpKind::Any(_)
            | OpKind::First(..)
            | OpKind::Length(_)
            | OpKind::If { .. }
            | OpKind::Loop { .. }
            | OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightCount
            | OpKind::LightSample { .. }
            | OpKind::Ambient
            | OpKind::Rand(_)
            | OpKind::Query { .. }
            | OpKind::ReportBudget => return None,
        })
    }

    fn of_unary(op: UnaryOp, scalar: Scalar) -> Work {
        match (op, scalar) {
            (UnaryOp::Sqrt | UnaryOp::ApproximateSqrt | UnaryOp::ApproximateInverseSqrt, _) => {
                Work::SquareRoot
            }
            (UnaryOp::ApproximateReciprocal, _) => Work::Division,
            (UnaryOp::Floor | UnaryOp::Ceil | UnaryOp::Trunc | UnaryOp::RoundEven, _) => {
                Work::Float(1)
            }
            (
                UnaryOp::Negate | UnaryOp::Abs | UnaryOp::Not | UnaryOp::Seldom,
                Scalar::F32 | Scalar::Bool,
            ) => Work::Logic,
            (
                UnaryOp::Negate | UnaryOp::Abs | UnaryOp::Not | UnaryOp::Seldom,
                Scalar::I32 | Scalar::U32,
            ) => Work::Integer,
        }
    }

    fn of_binary(op: BinaryOp, scalar: Scalar) -> Work {
        match (scalar, op) {
            (Scalar::F32, BinaryOp::Divide) => Work::Division,
            (Scalar::F32, _) => Work::Float(1),
            (Scalar::I32 | Scalar::U32, _) => Work::Integer,
            (Scalar::Bool, _) => Work::Logic,
        }
    }
}

/// The varying conditions of a kernel.
#[derive(Clone, Debug)]
pub(crate) struct Conditions {
    /// By value: the mask whose [`OpKind::Any`] the value is.
    masks: Vec<Option<Value>>,
    /// By value: the index of its decision.
    indices: Vec<Option<usize>>,
    decisions: usize,
}

impl Conditions {
    pub fn of(kernel: &Kernel) -> Conditions {
        let count = kernel.values.len();
        let mut conditions =
            Conditions { masks: vec![None; count], indices: vec![None; count], decisions: 0 };
        conditions.find_masks(&kernel.body);
        let mut decides = vec![false; count];
        conditions.find_decisions(kernel, &kernel.body, &mut decides);
        for (index, _) in decides.iter().enumerate().filter(|(_, decides)| **decides) {
            conditions.indices[index] = Some(conditions.decisions);
            conditions.decisions += 1;
        }
        conditions
    }

    /// Returns the mask whose [`OpKind::Any`] is `condition`.
    pub fn mask_of(&self, condition: Value) -> Option<Value> {
        self.masks[condition.0 as usize]
    }

    /// Returns the index of the decision that `condition` belongs to.
    pub fn index_of(&self, condition: Value) -> Option<usize> {
        self.indices[condition.0 as usize]
    }

    fn find_masks(&mut self, region: &Region) {
        for op in &region.ops {
            if let OpKind::Any(mask) = op.kind {
                self.masks[op.results.first as usize] = Some(mask);
            }
            op.kind.regions().for_each(|region| self.find_masks(region));
        }
    }

    fn find_decisions(&self, kernel: &Kernel, region: &Region, decides: &mut [bool]) {
        for op in &region.ops {
            let condition = match &op.kind {
                OpKind::Select(condition, ..) => Some(*condition),
                OpKind::If { condition, .. } => self.mask_of(*condition),
                OpKind::Loop { body, .. } => self.mask_of(body.yields[0]),
                _ => None,
            };
            if let Some(condition) = condition.filter(|condition| kernel.ty(*condition).lanes) {
                decides[condition.0 as usize] = true;
            }
            op.kind.regions().for_each(|region| self.find_decisions(kernel, region, decides));
        }
    }
}

/// Prints one line for each count that is not zero.
impl Display for Profile {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "rays: {}", self.rays)?;
        for (name, Count { executed, active }) in self.named_counts() {
            if executed > 0 {
                writeln!(f, "{name}: {active} of {executed}")?;
            }
        }
        let Sides { taken, not_taken } = self.branches;
        if taken + not_taken > 0 {
            writeln!(f, "branches: {taken} taken, {not_taken} not taken")?;
        }
        if self.rounds > 0 {
            writeln!(f, "rounds of loops: {}", self.rounds)?;
        }
        for (number, Decision { held, failed }) in self.decisions.iter().enumerate() {
            let ray =
                |ray: &Option<u32>| ray.map_or("never".to_owned(), |ray| format!("ray {ray}"));
            writeln!(f, "decision {number}: held {}, failed {}", ray(held), ray(failed))?;
        }
        Ok(())
    }
}

impl Profile {
    fn counts_mut(&mut self) -> Vec<&mut Count> {
        let Profile {
            rays: _,
            lanes,
            float_operations,
            divisions,
            square_roots,
            comparisons,
            selects,
            conversions,
            integer_operations,
            logic,
            state,
            scratch,
            members,
            buffers,
            locals,
            branches: _,
            rounds: _,
            decisions: _,
            lines: _,
        } = self;
        let mut counts = vec![lanes, float_operations, divisions, square_roots, comparisons];
        counts.extend([selects, conversions, integer_operations, logic]);
        for Traffic { loaded, stored } in [state, scratch, members, buffers, locals] {
            counts.extend([loaded, stored]);
        }
        counts
    }

    fn named_counts(&self) -> Vec<(String, Count)> {
        let operations = [
            ("lanes", self.lanes),
            ("float operations", self.float_operations),
            ("divisions", self.divisions),
            ("square roots", self.square_roots),
            ("comparisons", self.comparisons),
            ("selects", self.selects),
            ("conversions", self.conversions),
            ("integer operations", self.integer_operations),
            ("logic", self.logic),
        ];
        let memory = [
            ("state", self.state),
            ("scratch", self.scratch),
            ("members", self.members),
            ("buffers", self.buffers),
            ("locals", self.locals),
        ];
        let operations = operations.into_iter().map(|(name, count)| (name.to_owned(), count));
        let bytes = memory.into_iter().flat_map(|(name, Traffic { loaded, stored })| {
            let loaded = (format!("bytes loaded from {name}"), loaded);
            [loaded, (format!("bytes stored to {name}"), stored)]
        });
        operations.chain(bytes).collect()
    }
}
