//! Packet code: what one method does for W rays at once.
//!
//! # What a kernel means
//!
//! A [`Kernel`] is called for any number of rays. Its [prologue](Kernel::prologue) runs once per call
//! and computes what all rays share. Its [body](Kernel::body) runs once for each chunk of W
//! rays, in order, and yields one value for each [output](Kernel::outputs), which are then
//! stored. The first chunk starts at ray 0, or where the call says [so](Kernel::begins_at_any_chunk); the last
//! may stretch past the last ray.
//!
//! # Uniform values, lanes and masks
//!
//! A value is *uniform* (one scalar, the same for all rays) or *lanes* (W scalars, lane `i` for
//! ray `i` of the chunk). Lanes of bool are a *mask*. Where an operation takes lanes, a uniform
//! operand stands for W equal ones; a result is uniform where all operands are. Nothing but
//! [`Kernel::width`] says what W is: the same code serves every width.
//!
//! # Which lanes are on
//!
//! The body's one parameter is the mask of the chunk: rays that exist and that the caller
//! asked for. At least one lane of it is on. From it every other mask derives:
//!
//! 1. A lane that is off computes along, and what it computes is *unspecified but harmless*: all
//!    pure operations are total, and every address is clamped. So pure operations carry
//!    no mask.
//! 2. What could be seen carries a mask: stores into slots, requests to the host,
//!    and the outputs, which are stored under the chunk's mask.
//! 3. A branch on a condition that varies runs a side if any lane wants it, under the mask of
//!    those lanes: the enclosing mask and the condition. Where the sides meet again, a select by the
//!    condition takes each lane's value from its own side. A short side without effects
//!    runs for all lanes with no branch.
//! 4. A loop whose condition varies carries the mask of the lanes that are still in it, and
//!    runs while any is. Lanes leave and never come back; what a lane had when it left is kept for it
//!    by a select in each further round, and only if anything after the loop reads it.
//! 5. An `if` or a `loop` of packet code branches on a uniform bool: masks are data. [`OpKind::Any`]
//!    makes the one of the other.
//!
//! Because all lanes of a loop's mask go round together, a value that is uniform at the start of a loop
//! and whose next value is uniform stays uniform inside. It is lanes only after a loop that
//! lanes leave at different times.
//!
//! For W = 1 no condition diverges, so there is none of this: every branch is a real one.
//!
//! # The nearest hit
//!
//! In the leaf shape lanes are objects, and each is tested with the ray as it was before the call, so
//! that nothing depends on the width. A kernel with the accepted output [keeps the
//! nearest](Kernel::keeps_nearest) of all hits: the least `rt_HitDistance`, NaN and infinity being farthest, and
//! of equal ones that of the object with the lowest number. Its outputs are those of that object alone, they
//! go to the ray's lane, and the test says which object it was. No chunk's outputs are stored before the
//! last chunk is done.
//!
//! # One ray
//!
//! A kernel of [`CallMode::Single`] has W = 1 and one chunk, whose lane is on; its prologue holds constants
//! only.

use rtsl_abi::CallMode;
use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Index, Scalar, UnaryOp, Value, Values, Variable, VariableId,
    VariableKind,
};

/// The type of a packet value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Type {
    /// Of each lane, or of the one value.
    pub scalar: Scalar,
    /// One for each ray of a chunk; else one for all.
    pub lanes: bool,
}

impl Type {
    /// A bool for each lane.
    pub const MASK: Type = Type::lanes(Scalar::Bool);
    /// A bool to branch on.
    pub const CONDITION: Type = Type::uniform(Scalar::Bool);

    /// One value for all rays.
    pub const fn uniform(scalar: Scalar) -> Type {
        Type { scalar, lanes: false }
    }

    /// A value for each ray.
    pub const fn lanes(scalar: Scalar) -> Type {
        Type { scalar, lanes: true }
    }
}

/// A place and where the caller keeps it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KernelVariable {
    /// The single-ray function's place.
    pub variable: Variable,
    /// It differs from ray to ray: for a slot, its memory holds lanes.
    pub varies: bool,
    /// State: the index of its first component. Scratch: its first lane array. Members and
    /// buffers: the word of the instance's block, or of each object. Slots and accepted: 0.
    pub location: u32,
    /// Members and buffers: it stands in blocks of objects, not in the instance's block.
    pub of_objects: bool,
}

/// Where a value that the body yields goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KernelOutput {
    /// A state or scratch place, or the accepted one.
    pub variable: VariableId,
    /// Which scalar of it.
    pub component: u32,
}

/// The state variable that says how far away a hit is.
pub const HIT_DISTANCE: &str = "rt_HitDistance";

/// What one method does for W rays at once.
#[derive(Clone, Debug, PartialEq)]
pub struct Kernel {
    /// `Class.method`.
    pub name: String,
    /// What the rays have in common.
    pub shape: CallMode,
    /// Rays in a chunk: a power of two, at most [`rtsl_ir::host::MAX_LANES`].
    pub width: u32,
    /// Chunks in which all rays take part are done so many at a time, as one, by the same body:
    /// where one ray's chain of operations is long, others fill the time that it waits. Where
    /// `None`, those chunks are done like all others.
    pub interleave: Option<u32>,
    /// Words of each of the objects that it takes in blocks; `None` where it takes one instance's
    /// block and nothing else.
    pub object_words: Option<u32>,
    /// What it reads and stores, by [`VariableId`].
    pub variables: Vec<KernelVariable>,
    /// The type of every value.
    pub values: Vec<Type>,
    /// Runs once per call; no parameters, no yields. Its values are visible in the body.
    pub prologue: Region,
    /// Runs for each chunk. One parameter, the chunk's mask; one yield for each output.
    pub body: Region,
    /// Where the body's yields go.
    pub outputs: Vec<KernelOutput>,
}

impl Kernel {
    /// The type of `value`.
    pub fn ty(&self, value: Value) -> Type {
        self.values[value.0 as usize]
    }

    /// Whether a call may begin with any of its chunks, as the call says. So it is where the body asks for rays
    /// or light: chunks can then be called side by side, and what they ask for can be answered
    /// together.
    pub fn begins_at_any_chunk(&self) -> bool {
        match self.shape {
            // What accepts hits writes for chunks without rays, too.
            CallMode::Packet | CallMode::Stream => {
                self.width > 1 && self.accepted_output().is_none() && self.asks_for_rays()
            }
            // The one reads what all rays share from the first, the others have one ray.
            CallMode::CommonOrigin | CallMode::Leaf | CallMode::Single => false,
        }
    }

    /// Whether it asks the host for rays or light.
    pub fn asks_for_rays(&self) -> bool {
        self.body.asks_for_rays()
    }

    /// The place `id`.
    pub fn variable(&self, id: VariableId) -> &KernelVariable {
        &self.variables[id.0 as usize]
    }

    /// The position among the outputs of the accepted one.
    pub fn accepted_output(&self) -> Option<usize> {
        let is_accepted = |output: &KernelOutput| {
            self.variable(output.variable).variable.kind == VariableKind::Accepted
        };
        self.outputs.iter().position(is_accepted)
    }

    /// The position among the outputs of `rt_HitDistance`.
    pub fn distance_output(&self) -> Option<usize> {
        let is_distance = |output: &KernelOutput| {
            let variable = &self.variable(output.variable).variable;
            variable.kind == VariableKind::State && variable.name == HIT_DISTANCE
        };
        self.outputs.iter().position(is_distance)
    }

    /// Whether of all lanes' outputs those of the nearest hit are kept.
    pub fn keeps_nearest(&self) -> bool {
        self.shape == CallMode::Leaf && self.accepted_output().is_some()
    }
}

/// Operations in order, and the values handed to whoever holds the region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Region {
    /// The chunk's mask, or the carried values of a loop; none elsewhere.
    pub params: Vec<Value>,
    /// The operations, in order.
    pub ops: Vec<Op>,
    /// The results of an `if`; for the body of a loop a uniform bool, "again", then the next
    /// carried values; for a kernel's body one value for each output.
    pub yields: Vec<Value>,
}

impl Region {
    /// Whether it asks the host for rays or light, here or in what it holds.
    fn asks_for_rays(&self) -> bool {
        self.ops.iter().any(|op| match &op.kind {
            OpKind::Trace { .. } | OpKind::Occluded { .. } | OpKind::LightSample { .. } => true,
            kind => kind.regions().any(Region::asks_for_rays),
        })
    }
}

/// An operation with its results.
#[derive(Clone, Debug, PartialEq)]
pub struct Op {
    /// The values it defines.
    pub results: Values,
    /// What it does.
    pub kind: OpKind,
}

/// What an operation does. Those with the names of single-ray operations do the same in each
/// lane; one result where the text does not say otherwise.
#[derive(Clone, Debug, PartialEq)]
pub enum OpKind {
    /// This constant, uniform.
    Constant(Constant),
    /// As [`rtsl_ir::OpKind::Unary`].
    Unary(UnaryOp, Value),
    /// As [`rtsl_ir::OpKind::Binary`].
    Binary(BinaryOp, Value, Value),
    /// As [`rtsl_ir::OpKind::Compare`].
    Compare(CompareOp, Value, Value),
    /// As [`rtsl_ir::OpKind::Select`], lane by lane.
    Select(Value, Value, Value),
    /// As [`rtsl_ir::OpKind::Fma`].
    Fma(Value, Value, Value),
    /// As [`rtsl_ir::OpKind::Convert`].
    Convert(Scalar, Value),
    /// As [`rtsl_ir::OpKind::Bitcast`].
    Bitcast(Scalar, Value),
    /// The same bits as another type, those of NaNs too: where they show nowhere.
    Reinterpret(Scalar, Value),
    /// Lanes that nobody looks at; any value, the same at each use.
    Unspecified,
    /// Whether any lane of a mask is on; uniform.
    Any(Value),
    /// The second operand, lanes, in the first lane that is on in the first, a mask with a lane on;
    /// uniform.
    First(Value, Value),
    /// As [`rtsl_ir::OpKind::Load`]; uniform where neither place nor index varies.
    Load(VariableId, Index),
    /// Into a slot, in the lanes of the mask; without one in all of them. No result.
    Store {
        /// The slot.
        variable: VariableId,
        /// Which scalar of it, clamped.
        index: Index,
        /// What to store.
        value: Value,
        /// Where. None where the slot is uniform.
        mask: Option<Value>,
    },
    /// As [`rtsl_ir::OpKind::Length`].
    Length(VariableId),
    /// One of two regions, by a uniform bool.
    If {
        /// The uniform bool.
        condition: Value,
        /// Where it is true.
        then: Region,
        /// Where it is false.
        otherwise: Region,
    },
    /// As [`rtsl_ir::OpKind::Loop`]; "again" is uniform.
    Loop {
        /// The first carried values.
        initial: Vec<Value>,
        /// What is repeated.
        body: Region,
    },
    /// As [`rtsl_ir::OpKind::Trace`], for the lanes of a mask.
    Trace {
        /// Which rays ask.
        mask: Value,
        /// See there.
        ray: Ray,
        /// See there.
        weight: Value,
    },
    /// As [`rtsl_ir::OpKind::Occluded`]; a mask, off where `mask` is.
    Occluded {
        /// Which rays ask.
        mask: Value,
        /// See there.
        ray: Ray,
    },
    /// As [`rtsl_ir::OpKind::LightCount`]; uniform.
    LightCount,
    /// As [`rtsl_ir::OpKind::LightSample`], for the lanes of a mask; the first result is
    /// off where `mask` is.
    LightSample {
        /// Which rays ask.
        mask: Value,
        /// Which sample; uniform.
        index: Value,
        /// See there.
        point: [Value; 3],
        /// See there.
        normal: [Value; 3],
        /// See there.
        cosine: Value,
    },
    /// As [`rtsl_ir::OpKind::Ambient`]; uniform.
    Ambient,
    /// As [`rtsl_ir::OpKind::Rand`], for the lanes of a mask.
    Rand(Value),
    /// As [`rtsl_ir::OpKind::ReportBudget`]: some lane that is on did. No result.
    ReportBudget,
}

/// The operands of a request for a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// World space.
    pub origin: [Value; 3],
    /// World space, any length.
    pub direction: [Value; 3],
    /// The greatest parameter of a hit.
    pub limit: Value,
}

impl Ray {
    /// The seven operands in the order in which hosts get them.
    pub fn operands(&self) -> impl Iterator<Item = Value> {
        self.origin.into_iter().chain(self.direction).chain([self.limit])
    }
}

impl OpKind {
    /// Calls `visit` with each operand, those of nested regions left out.
    pub fn for_each_operand(&self, mut visit: impl FnMut(Value)) {
        match self {
            OpKind::Constant(_)
            | OpKind::Unspecified
            | OpKind::Length(_)
            | OpKind::LightCount
            | OpKind::Ambient
            | OpKind::ReportBudget => {}
            OpKind::Unary(_, a)
            | OpKind::Convert(_, a)
            | OpKind::Bitcast(_, a)
            | OpKind::Reinterpret(_, a)
            | OpKind::Any(a)
            | OpKind::Rand(a)
            | OpKind::If { condition: a, .. } => visit(*a),
            OpKind::Binary(_, a, b) | OpKind::Compare(_, a, b) | OpKind::First(a, b) => {
                [*a, *b].into_iter().for_each(visit);
            }
            OpKind::Select(a, b, c) | OpKind::Fma(a, b, c) => {
                [*a, *b, *c].into_iter().for_each(visit);
            }
            OpKind::Load(_, index) => index_operand(*index).into_iter().for_each(visit),
            OpKind::Store { variable: _, index, value, mask } => {
                index_operand(*index).into_iter().chain([*value]).chain(*mask).for_each(visit);
            }
            OpKind::Loop { initial, body: _ } => initial.iter().copied().for_each(visit),
            OpKind::Trace { mask, ray, weight } => {
                visit(*mask);
                ray.operands().chain([*weight]).for_each(visit);
            }
            OpKind::Occluded { mask, ray } => {
                visit(*mask);
                ray.operands().for_each(visit);
            }
            OpKind::LightSample { mask, index, point, normal, cosine } => {
                [*mask, *index].into_iter().chain(*point).chain(*normal).for_each(&mut visit);
                visit(*cosine);
            }
        }
    }

    /// The regions it holds, in order.
    pub fn regions(&self) -> impl Iterator<Item = &Region> {
        let (first, second) = match self {
            OpKind::If { condition: _, then, otherwise } => (Some(then), Some(otherwise)),
            OpKind::Loop { initial: _, body } => (Some(body), None),
            _ => (None, None),
        };
        first.into_iter().chain(second)
    }
}

fn index_operand(index: Index) -> Option<Value> {
    match index {
        Index::Constant(_) => None,
        Index::Dynamic(value) => Some(value),
    }
}
