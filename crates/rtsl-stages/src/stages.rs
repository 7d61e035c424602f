//! Stages, the slots of their frame, and the names of the variables through which they meet the runtime.

use rtsl_ir::{Function, OpKind, Query, Scalar, Variable, VariableKind};

/// The number of ports for the operands of suspensions.
pub const MAX_REQUEST: u32 = 14;

/// The greatest number of answers to a suspension.
pub const MAX_ANSWERS: usize = ResumedBy::LightSample.answers().len();

/// The number of these ports that hold f32; the others hold i32.
const FLOATS_OF_REQUEST: u32 = 11;

/// The index of the slot in [`Stages::slots`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SlotId(pub u32);

/// A scalar of the frame: a column of the runtime's structure of arrays.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slot {
    /// The type.
    pub scalar: Scalar,
    /// The name in the source of the first value that the slot holds, for readers; empty if it has none.
    pub name: String,
}

/// The event after which a stage runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ResumedBy {
    /// The start of the integrator's function.
    Start,
    /// The answer of a search for the nearest hit.
    NearestHit,
    /// The answer of a shadow ray.
    Occluded,
    /// The radiance along another ray.
    Trace,
    /// A sample of a light that materials name by its index.
    LightSample,
    /// The light that `shade` of a surface's material computes.
    Shade,
    /// The arrival at code that knows the classes of a surface. It has no answer.
    Dispatch,
}

impl ResumedBy {
    /// All events.
    pub const ALL: [ResumedBy; 7] = [
        ResumedBy::Start,
        ResumedBy::NearestHit,
        ResumedBy::Occluded,
        ResumedBy::Trace,
        ResumedBy::LightSample,
        ResumedBy::Shade,
        ResumedBy::Dispatch,
    ];

    /// Returns the event for which this operation waits, if it always waits for one.
    pub fn of(kind: &OpKind) -> Option<ResumedBy> {
        match kind {
            OpKind::Query(Query::NearestHit, _) => Some(ResumedBy::NearestHit),
            OpKind::Occluded { .. } => Some(ResumedBy::Occluded),
            OpKind::Trace { .. } => Some(ResumedBy::Trace),
            OpKind::LightSample { .. } => Some(ResumedBy::LightSample),
            OpKind::Query(Query::Shade, _) => Some(ResumedBy::Shade),
            _ => None,
        }
    }

    /// Returns the keyword of the text form.
    pub const fn name(self) -> &'static str {
        match self {
            ResumedBy::Start => "start",
            ResumedBy::NearestHit => "nearest_hit",
            ResumedBy::Occluded => "occluded",
            ResumedBy::Trace => "trace",
            ResumedBy::LightSample => "light_sample",
            ResumedBy::Shade => "shade",
            ResumedBy::Dispatch => "dispatch",
        }
    }

    /// Returns the event with this keyword.
    pub fn from_name(name: &str) -> Option<ResumedBy> {
        ResumedBy::ALL.into_iter().find(|event| event.name() == name)
    }

    /// Returns the types of the answers, in order.
    pub const fn answers(self) -> &'static [Scalar] {
        use Scalar::{Bool, F32, I32};
        match self {
            ResumedBy::Start | ResumedBy::Dispatch => &[],
            ResumedBy::NearestHit => &[Bool, I32, I32, I32, F32],
            ResumedBy::Occluded => &[Bool],
            ResumedBy::Trace | ResumedBy::Shade => &[F32, F32, F32],
            ResumedBy::LightSample => &[Bool, F32, F32, F32, F32, F32, F32, F32, F32],
        }
    }

    /// Returns the [ports](Port::Request) of the operands of the request, in order. A surface that is shaded is among
    /// them; that of the next stage is not.
    pub const fn request(self) -> &'static [u32] {
        match self {
            ResumedBy::Start | ResumedBy::Dispatch => &[],
            ResumedBy::NearestHit | ResumedBy::Trace => &[0, 1, 2, 3, 4, 5, 6, 7],
            ResumedBy::Occluded => &[0, 1, 2, 3, 4, 5, 6],
            ResumedBy::LightSample => &[11, 0, 1, 2, 3, 4, 5, 6],
            ResumedBy::Shade => &[11, 12, 13, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10],
        }
    }
}

/// The surface whose queries remain in a stage as operations. Linking replaces them, once for each pair of primitive
/// class and material class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Surface {
    /// The stage has no queries about surfaces.
    None,
    /// The surface that the search found: object, instance and element are `answer.1`, `answer.2` and `answer.3`.
    Answer,
    /// The surface that the suspension named: `surface.0`, `surface.1` and `surface.2`.
    Request,
}

impl Surface {
    /// All.
    pub const ALL: [Surface; 3] = [Surface::None, Surface::Answer, Surface::Request];

    /// Returns the keyword of the text form.
    pub const fn name(self) -> &'static str {
        match self {
            Surface::None => "none",
            Surface::Answer => "answer",
            Surface::Request => "request",
        }
    }

    /// Returns the surface with this keyword.
    pub fn from_name(name: &str) -> Option<Surface> {
        Surface::ALL.into_iter().find(|surface| surface.name() == name)
    }
}

/// The part of an integrator's function from one point where it is resumed to the next suspensions or its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// The function. Its outputs are slots that it changes, operands of requests, the surfaces named in them, `next`,
    /// and the outputs of the integrator's function.
    pub function: Function,
    /// The event after which it runs.
    pub resumed_by: ResumedBy,
    /// The surface about which it has queries.
    pub surface: Surface,
    /// The slots that hold values when it is resumed, in ascending order.
    pub live: Vec<SlotId>,
}

/// An integrator's function as stages; the first is its start.
#[derive(Clone, Debug, PartialEq)]
pub struct Stages {
    /// The name of the integrator's function.
    pub name: String,
    /// The frame.
    pub slots: Vec<Slot>,
    /// The stages. `next` is an index into them.
    pub stages: Vec<Stage>,
}

/// The value of `next` after the end of the integrator's function.
pub const END: i32 = -1;

/// A scratch variable of a stage's function that is part of its interface to the runtime.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Port {
    /// A slot of the frame: `frame.N`, of the slot's type.
    Frame(SlotId),
    /// A result of the operation that suspended: `answer.N`, of the types of [`ResumedBy::answers`].
    Answer(u32),
    /// An operand of the operation that suspends: `request.N`, f32; arbitrary where a path does not request.
    Request(u32),
    /// Object, instance or element of the surface that a suspension names: `surface.N`, i32; arbitrary where it names
    /// none.
    Surface(u32),
    /// The index of the next stage, or [`END`]: `next`, i32.
    Next,
}

impl Port {
    /// Returns the port that a variable is; `None` for others, which belong to the integrator's function.
    pub fn of(variable: &Variable) -> Option<Port> {
        if variable.kind != VariableKind::Scratch {
            return None;
        }
        if variable.name == "next" {
            return Some(Port::Next);
        }
        let (group, index) = variable.name.split_once('.')?;
        let is_decimal = index.bytes().all(|byte| byte.is_ascii_digit());
        let index = index.parse().ok().filter(|_| is_decimal)?;
        match group {
            "frame" => Some(Port::Frame(SlotId(index))),
            "answer" => Some(Port::Answer(index)),
            "request" => Some(Port::Request(index)),
            "surface" => Some(Port::Surface(index)),
            _ => None,
        }
    }

    /// Returns the name of the variable.
    pub fn name(self) -> String {
        match self {
            Port::Frame(slot) => format!("frame.{}", slot.0),
            Port::Answer(index) => format!("answer.{index}"),
            Port::Request(index) => format!("request.{index}"),
            Port::Surface(index) => format!("surface.{index}"),
            Port::Next => "next".to_owned(),
        }
    }

    /// Returns the type of the request's operand with this index.
    pub const fn request_scalar(index: u32) -> Scalar {
        if index < FLOATS_OF_REQUEST { Scalar::F32 } else { Scalar::I32 }
    }

    /// Returns the variable, of this type.
    pub(crate) fn variable(self, scalar: Scalar) -> Variable {
        Variable { kind: VariableKind::Scratch, name: self.name(), scalar, len: 1 }
    }
}

/// The sizes of stages, for reports.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// The number of slots.
    pub slots: usize,
    /// The number of bytes of a path's frame, four for each slot.
    pub frame_bytes: usize,
    /// The sizes of each stage.
    pub stages: Vec<StageSizes>,
}

/// The sizes of one stage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StageSizes {
    /// The number of slots that hold values when it is resumed.
    pub live: usize,
    /// The number of slots that it changes.
    pub changed: usize,
    /// The number of operations, those of nested regions included.
    pub operations: usize,
}

impl Stages {
    /// Returns the sizes of frame and stages.
    pub fn sizes(&self) -> Sizes {
        Sizes {
            slots: self.slots.len(),
            frame_bytes: self.slots.len() * 4,
            stages: self.stages.iter().map(Stage::sizes).collect(),
        }
    }
}

impl Stage {
    /// Returns the ports that the stage stores to.
    pub fn stored(&self) -> impl Iterator<Item = Port> {
        let outputs = self.function.outputs.iter();
        outputs.filter_map(|output| Port::of(self.function.variable(output.variable)))
    }

    fn sizes(&self) -> StageSizes {
        let mut operations = 0;
        self.function.body.for_each_op(&mut |_| operations += 1);
        let changed = self.stored().filter(|port| matches!(port, Port::Frame(_))).count();
        StageSizes { live: self.live.len(), changed, operations }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_are_found_by_their_names() {
        let ports = [
            Port::Frame(SlotId(12)),
            Port::Answer(4),
            Port::Request(7),
            Port::Surface(2),
            Port::Next,
        ];
        for port in ports {
            assert_eq!(Port::of(&port.variable(Scalar::F32)), Some(port));
        }
        for name in ["frame", "frame.", "frame.+1", "frame.x", "frames.1", "kept"] {
            let variable = Variable { name: name.to_owned(), ..Port::Next.variable(Scalar::I32) };
            assert_eq!(Port::of(&variable), None, "{name}");
        }
    }

    /// The tables of this file agree with those of the representation.
    #[test]
    fn queries_answer_and_request_as_in_the_representation() {
        for (event, query) in
            [(ResumedBy::NearestHit, Query::NearestHit), (ResumedBy::Shade, Query::Shade)]
        {
            assert!(event.answers().iter().copied().eq(query.result_scalars()));
            let request = event.request().iter().map(|port| Port::request_scalar(*port));
            assert!(request.eq(query.operand_scalars()));
        }
    }

    #[test]
    fn each_operand_of_a_request_has_a_port_of_its_own() {
        for event in ResumedBy::ALL {
            let mut ports = event.request().to_vec();
            ports.sort_unstable();
            ports.dedup();
            assert_eq!(ports.len(), event.request().len(), "{event:?}");
            assert!(ports.iter().all(|port| *port < MAX_REQUEST));
            assert!(event.answers().len() <= MAX_ANSWERS);
        }
    }
}
