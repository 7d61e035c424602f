//! Packet code: one method for W rays at once.
//!
//! # Semantics of a kernel
//!
//! A [`Kernel`] is called for any number of rays. Its [prologue](Kernel::prologue) runs once per call and computes the
//! values common to all rays. Its [body](Kernel::body) runs once for each chunk of W rays, in order, and yields one
//! value for each [output](Kernel::outputs), which are then stored. The last chunk may extend beyond the last
//! ray.
//!
//! # Uniform values, lanes and masks
//!
//! A value is *uniform* (one scalar, the same for all rays) or *lanes* (W scalars, lane `i` for ray `i` of the chunk).
//! Lanes of bool are a *mask*. If an operation takes lanes, a uniform operand is broadcast; a result is uniform if all
//! operands are. W occurs only in [`Kernel::width`]: the same code serves every width.
//!
//! # Active lanes
//!
//! The body's one parameter is the mask of the chunk: rays that exist and that the caller selected. At least one lane
//! of it is on. All other masks derive from it:
//!
//! 1. A lane that is off also computes, and its results are *unspecified but harmless*: all pure operations are total,
//!    and every address is clamped. So pure operations carry no mask.
//! 2. Observable effects carry a mask: stores to locals, requests to the host, and the outputs, which are stored under
//!    the chunk's mask.
//! 3. A branch on a varying condition runs a side if any lane takes it, under the mask of those lanes: the enclosing
//!    mask and the condition. At the join, a select by the condition takes each lane's value from its side. A short
//!    side without effects runs for all lanes with no branch.
//! 4. A loop whose condition varies carries the mask of the lanes that are still in it, and runs while any is. Lanes
//!    never re-enter; the values of a lane that has left are preserved by a select in each further iteration, and only
//!    if they are read after the loop.
//! 5. An `if` or a `loop` of packet code branches on a uniform bool: masks are data. [`OpKind::Any`] converts a mask to
//!    a uniform bool.
//!
//! Because all lanes of a loop's mask iterate together, a value that is uniform at the start of a loop and whose next
//! value is uniform remains uniform inside. It becomes lanes only after a loop that lanes leave at different times.
//!
//! For W = 1 no condition diverges, so these rules are void: every branch is a real one.
//!
//! # The nearest hit
//!
//! In the leaf mode lanes are objects, and each is tested with the ray as it was before the call, so that nothing
//! depends on the width. A kernel with the accepted output [keeps the nearest](Kernel::keeps_nearest) of all hits: the
//! least `rt_HitDistance`, NaN and infinity being farthest, and of equal ones that of the object with the lowest index.
//! Its outputs are those of that object alone; they go to the ray's lane, and the test returns the object's index.
//! Outputs are stored only after the last chunk.
//!
//! # One ray
//!
//! A kernel of [`CallMode::Single`] has W = 1 and one chunk, whose lane is on; its prologue holds constants only.

use rtsl_abi::CallMode;
use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Index, Places, Query, Scalar, UnaryOp, Value, Values, Variable,
    VariableId, VariableKind,
};

/// The type of a packet value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Type {
    /// The scalar type of each lane, or of the uniform value.
    pub scalar: Scalar,
    /// True for one value per ray of a chunk, false for a uniform value.
    pub lanes: bool,
}

impl Type {
    /// The type of a mask: a bool for each lane.
    pub const MASK: Type = Type::lanes(Scalar::Bool);
    /// The type of a branch condition: a uniform bool.
    pub const CONDITION: Type = Type::uniform(Scalar::Bool);

    /// Returns the type of a uniform value.
    pub const fn uniform(scalar: Scalar) -> Type {
        Type { scalar, lanes: false }
    }

    /// Returns the type of one value per ray.
    pub const fn lanes(scalar: Scalar) -> Type {
        Type { scalar, lanes: true }
    }
}

/// A variable and its location in the caller's memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KernelVariable {
    /// The single-ray function's variable.
    pub variable: Variable,
    /// True if it differs from ray to ray; the memory of such a local holds lanes.
    pub varies: bool,
    /// State: the index of the first component. Scratch: the first lane array. Members and buffers: the word of the
    /// instance's block, or of each object. Locals and accepted: 0.
    pub location: u32,
    /// True for members and buffers in blocks of objects instead of the instance's block.
    pub of_objects: bool,
}

/// The destination of a value that the body yields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KernelOutput {
    /// A state, scratch or accepted variable.
    pub variable: VariableId,
    /// The index of the scalar within it.
    pub component: u32,
}

/// The state variable that holds the distance of a hit.
pub const HIT_DISTANCE: &str = "rt_HitDistance";

/// The packet code of one method, for W rays at once.
#[derive(Clone, Debug, PartialEq)]
pub struct Kernel {
    /// `Class.method`.
    pub name: String,
    /// The call mode.
    pub mode: CallMode,
    /// The number of rays in a chunk: a power of two, at most [`rtsl_ir::host::MAX_LANES`].
    pub width: u32,
    /// The number of full chunks (in which all rays take part) that one execution of the body processes together: if
    /// one ray's chain of operations is long, the others hide its latency. If `None`, full chunks are processed like
    /// all others.
    pub interleave: Option<u32>,
    /// The number of words of each object in blocks of objects; `None` if the kernel takes one instance's block only.
    pub object_words: Option<u32>,
    /// The greatest number of blocks of objects, if they are so few that their rows fit into registers.
    pub object_blocks: Option<u32>,
    /// The variables that it reads and stores, by [`VariableId`].
    pub variables: Vec<KernelVariable>,
    /// The type of every value.
    pub values: Vec<Type>,
    /// Runs once per call; no parameters, no yields. Its values are visible in the body.
    pub prologue: Region,
    /// Runs for each chunk. One parameter, the chunk's mask; one yield for each output.
    pub body: Region,
    /// The destinations of the body's yields.
    pub outputs: Vec<KernelOutput>,
    /// The places of values in the source, if the function had them.
    pub places: Places,
}

impl Kernel {
    /// Returns the type of `value`.
    pub fn ty(&self, value: Value) -> Type {
        self.values[value.0 as usize]
    }

    /// True if it requests anything from the host.
    pub fn asks_host(&self) -> bool {
        self.prologue.asks_host() || self.body.asks_host()
    }

    /// Returns the variable `id`.
    pub fn variable(&self, id: VariableId) -> &KernelVariable {
        &self.variables[id.0 as usize]
    }

    /// Returns the position of the accepted output.
    pub fn accepted_output(&self) -> Option<usize> {
        let is_accepted = |output: &KernelOutput| {
            self.variable(output.variable).variable.kind == VariableKind::Accepted
        };
        self.outputs.iter().position(is_accepted)
    }

    /// Returns the position of the output of `rt_HitDistance`.
    pub fn distance_output(&self) -> Option<usize> {
        let is_distance = |output: &KernelOutput| {
            let variable = &self.variable(output.variable).variable;
            variable.kind == VariableKind::State && variable.name == HIT_DISTANCE
        };
        self.outputs.iter().position(is_distance)
    }

    /// True if only the outputs of the nearest hit of all lanes are stored.
    pub fn keeps_nearest(&self) -> bool {
        self.mode == CallMode::Leaf && self.accepted_output().is_some()
    }
}

/// A list of operations, and the values that the region passes to the operation or kernel that holds it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Region {
    /// The chunk's mask, or the carried values of a loop; none elsewhere.
    pub params: Vec<Value>,
    /// The operations, in order.
    pub ops: Vec<Op>,
    /// The results of an `if`; for the body of a loop a uniform bool that continues the loop, then the next carried
    /// values; for a kernel's body one value for each output.
    pub yields: Vec<Value>,
}

impl Region {
    /// True if it or a nested region has a loop.
    pub fn has_loop(&self) -> bool {
        self.ops.iter().any(|op| {
            matches!(op.kind, OpKind::Loop { .. }) || op.kind.regions().any(Region::has_loop)
        })
    }

    /// True if it or a nested region requests anything from the host.
    fn asks_host(&self) -> bool {
        self.ops.iter().any(|op| match &op.kind {
            OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightCount
            | OpKind::LightSample { .. }
            | OpKind::Ambient
            | OpKind::Rand(_)
            | OpKind::Query { .. } => true,
            kind => kind.regions().any(Region::asks_host),
        })
    }
}

/// An operation with its results.
#[derive(Clone, Debug, PartialEq)]
pub struct Op {
    /// The values that it defines.
    pub results: Values,
    /// The operation itself.
    pub kind: OpKind,
}

/// The operations. Those with the names of single-ray operations do the same in each lane. Each has one result unless
/// its documentation states otherwise.
#[derive(Clone, Debug, PartialEq)]
pub enum OpKind {
    /// A uniform constant.
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
    /// Reinterprets the bits as another type without canonicalising NaNs, which must be unobservable.
    Reinterpret(Scalar, Value),
    /// Lanes of any value, the same at each use, on which no observable result depends.
    Unspecified,
    /// True if any lane of a mask is on; uniform.
    Any(Value),
    /// The value of the second operand, lanes, in the first lane that is on in the first operand, a mask with a lane
    /// on; uniform.
    First(Value, Value),
    /// As [`rtsl_ir::OpKind::Load`]; uniform if neither variable nor index varies.
    Load(VariableId, Index),
    /// Stores to a local, in the lanes of the mask, or in all of them without one. No result.
    Store {
        /// The local.
        variable: VariableId,
        /// The index of the scalar, clamped.
        index: Index,
        /// The stored value.
        value: Value,
        /// The mask of the lanes to store. `None` for a uniform local.
        mask: Option<Value>,
    },
    /// As [`rtsl_ir::OpKind::Length`].
    Length(VariableId),
    /// Executes one of two regions, by a uniform bool.
    If {
        /// The uniform bool.
        condition: Value,
        /// The region executed if it is true.
        then: Region,
        /// The region executed if it is false.
        otherwise: Region,
    },
    /// As [`rtsl_ir::OpKind::Loop`], with a uniform condition.
    Loop {
        /// The first carried values.
        initial: Vec<Value>,
        /// The repeated region.
        body: Region,
    },
    /// As [`rtsl_ir::OpKind::Trace`], for the lanes of a mask.
    Trace {
        /// The mask of the request.
        mask: Value,
        /// The ray.
        ray: Ray,
        /// The weight of the answer.
        weight: Value,
    },
    /// As [`rtsl_ir::OpKind::Occluded`]; a mask, off where `mask` is.
    Occluded {
        /// The mask of the request.
        mask: Value,
        /// The ray.
        ray: Ray,
    },
    /// As [`rtsl_ir::OpKind::LightCount`]; uniform.
    LightCount,
    /// As [`rtsl_ir::OpKind::LightSample`], for the lanes of a mask; the first result is
    /// off where `mask` is.
    LightSample {
        /// The mask of the request.
        mask: Value,
        /// The index of the sample; uniform.
        index: Value,
        /// The point to be lit.
        point: [Value; 3],
        /// The cone's axis.
        normal: [Value; 3],
        /// The least cosine between axis and light.
        cosine: Value,
    },
    /// As [`rtsl_ir::OpKind::Ambient`]; uniform.
    Ambient,
    /// As [`rtsl_ir::OpKind::Rand`], for the lanes of a mask.
    Rand(Value),
    /// As [`rtsl_ir::OpKind::Query`], for the lanes of a mask. The number of skies is uniform, and its query has no
    /// mask.
    Query {
        /// The mask of the request.
        mask: Option<Value>,
        /// The question.
        query: Query,
        /// Its operands.
        operands: Vec<Value>,
    },
    /// As [`rtsl_ir::OpKind::ReportBudget`], if any active lane reports. No result.
    ReportBudget,
}

/// The operands of a request for a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The origin, world space.
    pub origin: [Value; 3],
    /// The direction, world space, of any length.
    pub direction: [Value; 3],
    /// The greatest ray parameter of a hit.
    pub limit: Value,
}

impl Ray {
    /// Returns the seven operands in the order in which hosts receive them.
    pub fn operands(&self) -> impl Iterator<Item = Value> {
        self.origin.into_iter().chain(self.direction).chain([self.limit])
    }
}

impl OpKind {
    /// Calls `visit` with each operand, without those of nested regions.
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
            OpKind::Query { mask, query: _, operands } => {
                mask.iter().chain(operands).copied().for_each(visit);
            }
        }
    }

    /// Returns the regions of the operation, in order.
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
