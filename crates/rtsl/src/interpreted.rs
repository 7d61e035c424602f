//! Methods on the interpreter, called as machine code is called.

use rtsl_ir::{Function, Interpreter, PlaceId, PlaceKind, PrepareError, Scalar, Storage};
use rtsl_jit::{CallArguments, CallStatus, InstanceBlock, Instances, LaneBlock, Signature};
use rtsl_packet::Layout;
use rtsl_spec::lookup_state;

/// A method, run ray by ray.
#[derive(Clone, Debug)]
pub(crate) struct InterpretedKernel {
    /// Copied for each call: a call needs registers of its own, since hosts call kernels from
    /// within calls.
    interpreter: Interpreter,
    places: Vec<InterpretedPlace>,
    signature: Signature,
}

/// One of a function's places.
#[derive(Clone, Copy, Debug)]
struct InterpretedPlace {
    location: Location,
    len: u32,
    /// It differs from lane to lane; else what the first lane had before the call counts for all.
    varies: bool,
}

/// Where the scalars of one of a function's places lie.
#[derive(Clone, Copy, Debug)]
enum Location {
    /// The state arrays from this one on.
    State(u32),
    /// The scratch arrays from this one on; bools are 0 and -1 there.
    Scratch(u32, Scalar),
    /// The words of the instance's block from this one on.
    Member(u32),
    /// The buffer whose entry starts at this word of the block.
    Buffer(u32),
    /// Slots and acceptance are the interpreter's, parameters the constructor's.
    Nowhere,
}

impl InterpretedKernel {
    pub fn new(
        function: &Function,
        layout: &Layout,
        signature: Signature,
    ) -> Result<InterpretedKernel, PrepareError> {
        let locate = |name: &str, kind, scalar| match kind {
            PlaceKind::State => {
                lookup_state(name).map(|variable| Location::State(variable.first_component))
            }
            PlaceKind::Scratch => {
                layout.scratch.get(name).map(|first| Location::Scratch(*first, scalar))
            }
            PlaceKind::Member => layout.members.get(name).map(|word| Location::Member(*word)),
            PlaceKind::Buffer => layout.buffers.get(name).map(|word| Location::Buffer(*word)),
            PlaceKind::Parameter | PlaceKind::Slot | PlaceKind::Accepted => None,
        };
        let places = function.places.iter().map(|place| {
            let location = locate(&place.name, place.kind, place.scalar);
            InterpretedPlace {
                location: location.unwrap_or(Location::Nowhere),
                len: place.len,
                varies: signature.shape.varies(place),
            }
        });
        let places = places.collect();
        Ok(InterpretedKernel { interpreter: Interpreter::prepare(function)?, places, signature })
    }

    /// Runs the method for all rays of the call, in order.
    pub fn call(&self, call: CallArguments<'_>) -> CallStatus {
        self.signature.check(&call);
        let CallArguments { state, scratch, count, mask, mut accepted, instances, host } = call;
        let shared = self.shared_inputs(state, scratch);
        let mut interpreter = self.interpreter.clone();
        let mut status = CallStatus::default();
        for lane in 0..count {
            let is_on = mask.is_none_or(|mask| mask.get(lane));
            let mut hit = false;
            if is_on {
                let mut storage = LaneStorage {
                    places: &self.places,
                    shared: &shared,
                    lane,
                    state: &mut *state,
                    scratch: &mut *scratch,
                    block: block_of(instances, lane),
                };
                let outcome = interpreter.run(lane as u32, &mut storage, &mut *host);
                status.budget_exhausted |= outcome.budget_exceeded;
                hit = outcome.accepted;
            }
            if let Some(accepted) = accepted.as_deref_mut() {
                accepted.set(lane, hit);
            }
        }
        status
    }

    /// By place the scalars of state and scratch that all lanes share: copies, since the call
    /// may change what they were read from.
    fn shared_inputs(&self, state: &LaneBlock, scratch: &LaneBlock) -> Vec<Vec<u32>> {
        let of_first_lane = |place: &InterpretedPlace| match place.location {
            Location::State(_) | Location::Scratch(..) if !place.varies => {
                let scalars =
                    (0..place.len).map(|index| place.location.lane(index, 0, state, scratch));
                scalars.collect()
            }
            Location::State(_)
            | Location::Scratch(..)
            | Location::Member(_)
            | Location::Buffer(_)
            | Location::Nowhere => Vec::new(),
        };
        self.places.iter().map(of_first_lane).collect()
    }
}

impl Location {
    /// A scalar of the state or scratch of one lane.
    fn lane(self, index: u32, lane: usize, state: &LaneBlock, scratch: &LaneBlock) -> u32 {
        match self {
            Location::State(first) => state.words((first + index) as usize)[lane],
            Location::Scratch(first, scalar) => {
                let word = scratch.words((first + index) as usize)[lane];
                if scalar == Scalar::Bool { u32::from(word != 0) } else { word }
            }
            Location::Member(_) | Location::Buffer(_) | Location::Nowhere => 0,
        }
    }
}

fn block_of(instances: Instances<'_>, lane: usize) -> &InstanceBlock {
    match instances {
        Instances::One(block) => block,
        Instances::Many(table, indices) => &table.blocks()[indices.as_slice()[lane] as usize],
    }
}

/// The places of one lane.
struct LaneStorage<'a> {
    places: &'a [InterpretedPlace],
    /// See [`InterpretedKernel::shared_inputs`].
    shared: &'a [Vec<u32>],
    lane: usize,
    state: &'a mut LaneBlock,
    scratch: &'a mut LaneBlock,
    block: &'a InstanceBlock,
}

impl Storage for LaneStorage<'_> {
    fn load(&self, place: PlaceId, index: u32) -> u32 {
        if let Some(shared) = self.shared[place.0 as usize].get(index as usize) {
            return *shared;
        }
        match self.places[place.0 as usize].location {
            location @ (Location::State(_) | Location::Scratch(..)) => {
                location.lane(index, self.lane, self.state, self.scratch)
            }
            Location::Member(first) => self.block.words()[(first + index) as usize],
            Location::Buffer(entry) => {
                let buffer = self.block.buffers().iter().find(|buffer| buffer.offset == entry);
                buffer.and_then(|it| it.words.get(index as usize)).copied().unwrap_or(0)
            }
            Location::Nowhere => 0,
        }
    }

    fn elements(&self, buffer: PlaceId) -> u32 {
        match self.places[buffer.0 as usize].location {
            Location::Buffer(entry) => {
                let buffer = self.block.buffers().iter().find(|buffer| buffer.offset == entry);
                buffer.map_or(0, |buffer| buffer.elements())
            }
            Location::State(_)
            | Location::Scratch(..)
            | Location::Member(_)
            | Location::Nowhere => 0,
        }
    }

    fn store(&mut self, place: PlaceId, component: u32, bits: u32) {
        match self.places[place.0 as usize].location {
            Location::State(first) => {
                self.state.words_mut((first + component) as usize)[self.lane] = bits;
            }
            Location::Scratch(first, scalar) => {
                let word = if scalar == Scalar::Bool && bits != 0 { u32::MAX } else { bits };
                self.scratch.words_mut((first + component) as usize)[self.lane] = word;
            }
            Location::Member(_) | Location::Buffer(_) | Location::Nowhere => {}
        }
    }
}
