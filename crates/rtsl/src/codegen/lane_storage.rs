//! The variables of a method in the arguments of a call, for interpreters.

use rtsl_abi::{
    ComponentSet, DataLocation, InstanceBlock, Instances, LaneBlock, LaneMask, Layout, ObjectForm,
    Objects, Signature,
};
use rtsl_ir::{Scalar, Variable, VariableId, VariableKind};
use rtsl_spec::lookup_state;

/// The locations of a method's variables in calls of one mode.
#[derive(Clone, Debug)]
pub(crate) struct LaneVariables {
    variables: Vec<LaneVariable>,
    /// The components of the state that the method reads or writes; calls may lack others.
    touched: ComponentSet,
}

/// The location of a variable.
#[derive(Clone, Copy, Debug)]
struct LaneVariable {
    location: Location,
    len: u32,
    /// True if the variable differs between lanes; otherwise all lanes have the value of one lane before the call.
    varies: bool,
}

/// The location of the scalars of a variable.
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
    /// The words of each object from this one on.
    ObjectMember(u32),
    /// The buffer whose entry starts at this word of each object.
    ObjectBuffer(u32),
    /// The mask of accepted hits.
    Accepted,
    /// Not in the call: locals belong to the interpreter, parameters to the constructor.
    Nowhere,
}

impl LaneVariables {
    /// Locates the variables of a function whose calls the signature describes.
    pub fn new(variables: &[Variable], layout: &Layout, signature: &Signature) -> LaneVariables {
        let mode = signature.mode;
        let form = layout.object_form(mode);
        let variables = variables.iter().map(|variable| {
            let location =
                Location::of(variable, layout, form.as_ref()).unwrap_or(Location::Nowhere);
            let of_objects =
                matches!(location, Location::ObjectMember(_) | Location::ObjectBuffer(_));
            LaneVariable { location, len: variable.len, varies: mode.varies(variable, of_objects) }
        });
        LaneVariables { variables: variables.collect(), touched: signature.state }
    }

    fn get(&self, variable: VariableId) -> LaneVariable {
        self.variables[variable.0 as usize]
    }

    /// Copies the scalars of state and scratch that all lanes share from the lane that has them, by variable: the call
    /// may change the lane. Scalars that the method does not read are zero; all are zero if the call has no lanes.
    fn shared_inputs(&self, lane: usize, state: &LaneBlock, scratch: &LaneBlock) -> Vec<Vec<u32>> {
        let is_read = |location: Location, index: u32| match location {
            Location::State(first) => self.touched.contains(first + index) && lane < state.lanes(),
            _ => lane < scratch.lanes(),
        };
        let shared = |location: Location, index: u32| match is_read(location, index) {
            true => location.lane(index, lane, state, scratch),
            false => 0,
        };
        let of_lane = |variable: &LaneVariable| match variable.location {
            Location::State(_) | Location::Scratch(..) if !variable.varies => {
                (0..variable.len).map(|index| shared(variable.location, index)).collect()
            }
            Location::State(_)
            | Location::Scratch(..)
            | Location::Member(_)
            | Location::Buffer(_)
            | Location::ObjectMember(_)
            | Location::ObjectBuffer(_)
            | Location::Accepted
            | Location::Nowhere => Vec::new(),
        };
        self.variables.iter().map(of_lane).collect()
    }
}

impl Location {
    fn of(variable: &Variable, layout: &Layout, form: Option<&ObjectForm>) -> Option<Location> {
        let name = variable.name.as_str();
        match variable.kind {
            VariableKind::State => {
                lookup_state(name).map(|variable| Location::State(variable.first_component))
            }
            VariableKind::Scratch => {
                layout.scratch.get(name).map(|first| Location::Scratch(*first, variable.scalar))
            }
            VariableKind::Member => Some(match layout.locate(variable, form)? {
                DataLocation::Instance(word) => Location::Member(word),
                DataLocation::Objects(word) => Location::ObjectMember(word),
            }),
            VariableKind::Buffer => Some(match layout.locate(variable, form)? {
                DataLocation::Instance(word) => Location::Buffer(word),
                DataLocation::Objects(word) => Location::ObjectBuffer(word),
            }),
            VariableKind::Accepted => Some(Location::Accepted),
            VariableKind::Parameter | VariableKind::Local => None,
        }
    }

    /// A scalar of the state or scratch of one lane.
    fn lane(self, index: u32, lane: usize, state: &LaneBlock, scratch: &LaneBlock) -> u32 {
        match self {
            Location::State(first) => state.words((first + index) as usize)[lane],
            Location::Scratch(first, scalar) => {
                let word = scratch.words((first + index) as usize)[lane];
                if scalar == Scalar::Bool { u32::from(word != 0) } else { word }
            }
            Location::Member(_)
            | Location::Buffer(_)
            | Location::ObjectMember(_)
            | Location::ObjectBuffer(_)
            | Location::Accepted
            | Location::Nowhere => 0,
        }
    }
}

/// The variables in the arguments of one call.
pub(crate) struct CallStorage<'a> {
    variables: &'a LaneVariables,
    /// See [`LaneVariables::shared_inputs`].
    shared: Vec<Vec<u32>>,
    /// The lane whose ray all lanes share, in the call mode `leaf`; 0 in others.
    ray: usize,
    state: &'a mut LaneBlock,
    scratch: &'a mut LaneBlock,
    accepted: Option<&'a mut LaneMask>,
    instances: Instances<'a>,
}

impl<'a> CallStorage<'a> {
    pub fn new(
        variables: &'a LaneVariables,
        state: &'a mut LaneBlock,
        scratch: &'a mut LaneBlock,
        accepted: Option<&'a mut LaneMask>,
        instances: Instances<'a>,
    ) -> Self {
        CallStorage::of_ray(0, variables, state, scratch, accepted, instances)
    }

    /// Creates the storage of a call whose lanes share a ray other than the first.
    pub fn of_ray(
        ray: usize,
        variables: &'a LaneVariables,
        state: &'a mut LaneBlock,
        scratch: &'a mut LaneBlock,
        accepted: Option<&'a mut LaneMask>,
        instances: Instances<'a>,
    ) -> Self {
        let shared = variables.shared_inputs(ray, state, scratch);
        CallStorage { variables, shared, ray, state, scratch, accepted, instances }
    }

    /// Returns the variables of one lane.
    pub fn lane(&mut self, lane: usize) -> LaneStorage<'a, '_> {
        LaneStorage { data: Data::of(self.instances, lane), call: self, lane }
    }

    pub fn accept(&mut self, lane: usize, is_accepted: bool) {
        if let Some(accepted) = self.accepted.as_deref_mut() {
            accepted.set(lane, is_accepted);
        }
    }

    fn load(&self, variable: VariableId, index: u32, lane: usize, data: Data<'_>) -> u32 {
        if let Some(shared) = self.shared[variable.0 as usize].get(index as usize) {
            return *shared;
        }
        match self.variables.get(variable).location {
            location @ (Location::State(_) | Location::Scratch(..)) => {
                location.lane(index, lane, self.state, self.scratch)
            }
            Location::Member(first) => data.block.words()[(first + index) as usize],
            Location::ObjectMember(first) => data.object_word(first + index),
            Location::ObjectBuffer(entry) => {
                let words = data
                    .object
                    .and_then(|(objects, number)| objects.buffer(number as usize, entry as usize));
                words.and_then(|words| words.get(index as usize)).copied().unwrap_or(0)
            }
            Location::Buffer(entry) => {
                let buffer = data.block.buffers().iter().find(|buffer| buffer.offset == entry);
                buffer.and_then(|it| it.words.get(index as usize)).copied().unwrap_or(0)
            }
            Location::Accepted | Location::Nowhere => 0,
        }
    }

    fn elements(&self, buffer: VariableId, data: Data<'_>) -> u32 {
        match self.variables.get(buffer).location {
            Location::Buffer(entry) => {
                let buffer = data.block.buffers().iter().find(|buffer| buffer.offset == entry);
                buffer.map_or(0, |buffer| buffer.elements())
            }
            // The entry's third word.
            Location::ObjectBuffer(entry) => data.object_word(entry + 2),
            Location::State(_)
            | Location::Scratch(..)
            | Location::Member(_)
            | Location::ObjectMember(_)
            | Location::Accepted
            | Location::Nowhere => 0,
        }
    }

    fn store(&mut self, variable: VariableId, component: u32, lane: usize, bits: u32) {
        match self.variables.get(variable).location {
            Location::State(first) => {
                self.state.words_mut((first + component) as usize)[lane] = bits;
            }
            Location::Scratch(first, scalar) => {
                let word = if scalar == Scalar::Bool && bits != 0 { u32::MAX } else { bits };
                self.scratch.words_mut((first + component) as usize)[lane] = word;
            }
            Location::Accepted => self.accept(lane, bits != 0),
            Location::Member(_)
            | Location::Buffer(_)
            | Location::ObjectMember(_)
            | Location::ObjectBuffer(_)
            | Location::Nowhere => {}
        }
    }
}

/// The data of a lane's object.
#[derive(Clone, Copy)]
struct Data<'a> {
    /// The instance, or what objects share.
    block: &'a InstanceBlock,
    object: Option<(&'a Objects, u32)>,
}

impl<'a> Data<'a> {
    fn of(instances: Instances<'a>, lane: usize) -> Data<'a> {
        let object = instances.objects().zip(instances.number(lane));
        Data { block: instances.block(), object }
    }

    fn object_word(self, position: u32) -> u32 {
        self.object.map_or(0, |(objects, number)| objects.word(number as usize, position as usize))
    }
}

/// The variables of one lane.
pub(crate) struct LaneStorage<'a, 'call> {
    call: &'call mut CallStorage<'a>,
    lane: usize,
    data: Data<'a>,
}

impl rtsl_ir::Storage for LaneStorage<'_, '_> {
    fn load(&self, variable: VariableId, index: u32) -> u32 {
        self.call.load(variable, index, self.lane, self.data)
    }

    fn elements(&self, buffer: VariableId) -> u32 {
        self.call.elements(buffer, self.data)
    }

    fn store(&mut self, variable: VariableId, component: u32, bits: u32) {
        self.call.store(variable, component, self.lane, bits);
    }
}

impl rtsl_packet::interpreter::Storage for CallStorage<'_> {
    fn load(&self, variable: VariableId, index: u32, ray: u32) -> u32 {
        let lane = ray as usize;
        self.load(variable, index, lane, Data::of(self.instances, lane))
    }

    fn elements(&self, buffer: VariableId, ray: u32) -> u32 {
        self.elements(buffer, Data::of(self.instances, ray as usize))
    }

    fn store(&mut self, variable: VariableId, component: u32, ray: u32, bits: u32) {
        // Kernels that keep the nearest hit store for ray 0.
        self.store(variable, component, self.ray + ray as usize, bits);
    }
}
