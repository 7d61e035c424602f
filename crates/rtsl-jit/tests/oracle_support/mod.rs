//! Runs a function for many rays, interpreted and compiled.

use std::sync::{Arc, OnceLock};

use rtsl_abi::offsets::BUFFER_WORDS;
use rtsl_abi::{
    BoundBuffer, CallArguments, CallMode, CallStatus, DataLocation, InstanceBlock, Instances,
    LaneBlock, LaneIndices, LaneMask, Layout, ObjectForm, Objects,
};
use rtsl_ir::evaluate::CANONICAL_NAN;
use rtsl_ir::{Function, Interpreter, Output, Place, PlaceId, PlaceKind, Scalar, Storage};
use rtsl_jit::{CompiledKernel, Llvm, OptLevel};
use rtsl_llvm::TargetFeatures;
use rtsl_packet::{Kernel, interleave};
use rtsl_testing::functions::{Entropy, HashHost};

/// Full chunks and a part of one at every width.
const RAYS: usize = 37;
/// The leaf shape takes as many as rays, from this one on.
const FIRST: usize = 8;
const OBJECTS: usize = FIRST + RAYS;
/// The one that the shapes with one object take.
const OBJECT: usize = 13;
const WIDTHS: [u32; 4] = [1, 4, 8, 16];

/// A function with data for its places.
pub struct Case {
    function: Function,
    /// Without a form of objects: they share nothing, and shapes with one object take an instance.
    layout: Layout,
    /// With one: some places differ from object to object.
    sharing: Layout,
    instances: Vec<InstanceBlock>,
    /// The object of each ray, for the stream shape.
    indices: LaneIndices,
    state: LaneBlock,
    scratch: LaneBlock,
    mask: LaneMask,
}

/// What a run for all rays gives.
struct Outcome {
    state: LaneBlock,
    scratch: LaneBlock,
    accepted: LaneMask,
    nearest: Option<u32>,
    budget: bool,
}

fn llvm() -> &'static Arc<Llvm> {
    static LLVM: OnceLock<Arc<Llvm>> = OnceLock::new();
    LLVM.get_or_init(|| Llvm::load().unwrap_or_else(|error| panic!("{error}")))
}

impl Case {
    pub fn new(function: Function, seed: u64) -> Case {
        let places = |kind| function.places.iter().filter(move |place| place.kind == kind);
        let layout = Layout::new(
            places(PlaceKind::Member),
            places(PlaceKind::Buffer),
            places(PlaceKind::Scratch),
        );
        let bytes = Entropy::bytes(seed ^ 0x5eed, 1 << 15);
        let entropy = &mut Entropy::new(&bytes);
        let instances = (0..OBJECTS).map(|_| instance(&function, &layout, entropy)).collect();
        let sharing = Layout { objects: Some(form(&function, &layout, entropy)), ..layout.clone() };
        let mut indices = LaneIndices::new(RAYS);
        indices.as_mut_slice().iter_mut().for_each(|index| *index = entropy.below(OBJECTS) as u32);
        let components = rtsl_spec::state_component_count() as usize;
        let mut case = Case {
            instances,
            indices,
            state: LaneBlock::new(components, RAYS),
            scratch: LaneBlock::new(layout.scratch_arrays as usize, RAYS),
            mask: LaneMask::from_fn(RAYS, |_| entropy.chance(150)),
            function,
            layout,
            sharing,
        };
        case.fill_lanes(entropy);
        case
    }

    fn fill_lanes(&mut self, entropy: &mut Entropy<'_>) {
        for place in &self.function.places {
            let (first, block) = match place.kind {
                PlaceKind::State => (first_component(place), &mut self.state),
                PlaceKind::Scratch => (self.layout.scratch[&place.name], &mut self.scratch),
                _ => continue,
            };
            for array in first..first + place.len {
                for word in block.words_mut(array as usize) {
                    let bits = entropy.constant(place.scalar).bits();
                    *word =
                        if place.scalar == Scalar::Bool { 0_u32.wrapping_sub(bits) } else { bits };
                }
            }
        }
    }

    /// Compares all kernels with the interpreter, with text made for this machine and for others:
    /// LLVM makes up for what this one lacks.
    pub fn check(&self) -> Result<(), String> {
        let target = llvm().host();
        let host = TargetFeatures::new(target.triple(), target.cpu(), target.features());
        let other = TargetFeatures {
            fma: !host.fma,
            mask_registers: !host.mask_registers,
            vector_lanes: 16,
            gathers: !host.gathers,
            ..host.clone()
        };
        self.check_code(&host, &WIDTHS)?;
        self.check_code(&other, &WIDTHS[1..3])
            .map_err(|difference| format!("{other:?}: {difference}"))
    }

    fn check_code(&self, features: &TargetFeatures, widths: &[u32]) -> Result<(), String> {
        // With a form shapes differ less from one another.
        let of_objects = [CallMode::Packet, CallMode::Stream, CallMode::Leaf];
        let all =
            [(&self.layout, CallMode::ALL.as_slice()), (&self.sharing, of_objects.as_slice())];
        for (layout, shapes) in all {
            let mut kernels = Vec::new();
            for (shape, width) in shapes.iter().flat_map(|it| widths.iter().map(|w| (*it, *w))) {
                let mut kernel = rtsl_packet::lower(&self.function, layout, shape, width)
                    .map_err(|error| error.to_string())?;
                rtsl_packet::verify(&kernel).map_err(|error| format!("{error}\n{kernel}"))?;
                // As many rays as there are allow.
                kernel.interleave = interleave::choose(&kernel, Some(16 / width.max(4)));
                kernels.push(kernel);
            }
            self.check_kernels(layout, &kernels, features)?;
        }
        Ok(())
    }

    fn check_kernels(
        &self,
        layout: &Layout,
        kernels: &[Kernel],
        features: &TargetFeatures,
    ) -> Result<(), String> {
        let compiled = CompiledKernel::compile(llvm(), kernels, features, OptLevel::O2)
            .map_err(|error| error.to_string())?;
        for mask in [None, Some(&self.mask)] {
            for (kernel, compiled) in kernels.iter().zip(&compiled) {
                let mask = mask.filter(|_| kernel.shape != CallMode::Single);
                let expected = self.interpret(kernel.shape, layout, mask);
                let found = self.call(compiled, kernel.shape, layout, mask);
                self.compare(&expected, &found).map_err(|difference| {
                    format!("masked: {}: {difference}\n{kernel}", mask.is_some())
                })?;
            }
        }
        Ok(())
    }

    fn call(
        &self,
        kernel: &CompiledKernel,
        shape: CallMode,
        layout: &Layout,
        mask: Option<&LaneMask>,
    ) -> Outcome {
        let (mut state, mut scratch) = (self.state.clone(), self.scratch.clone());
        let mut accepted =
            LaneMask::from_fn(RAYS, |ray| shape != CallMode::Leaf && ray < count(shape));
        let form = layout.object_form(shape);
        let objects = form.map(|form| Objects::of_instances(form, &self.instances));
        let instances = match (shape, &objects) {
            (_, None) => Instances::One(&self.instances[0]),
            (CallMode::Packet | CallMode::CommonOrigin | CallMode::Single, Some(objects)) => {
                Instances::Object(objects, OBJECT as u32)
            }
            (CallMode::Stream, Some(objects)) => Instances::Many(objects, &self.indices),
            (CallMode::Leaf, Some(objects)) => Instances::Range(objects, FIRST as u32),
        };
        let status = kernel.call(CallArguments {
            state: &mut state,
            scratch: &mut scratch,
            count: count(shape),
            mask,
            accepted: Some(&mut accepted),
            instances,
            host: &mut HashHost::default(),
        });
        let CallStatus { budget_exhausted: budget, nearest } = status;
        Outcome { state, scratch, accepted, nearest, budget }
    }

    fn interpret(&self, shape: CallMode, layout: &Layout, mask: Option<&LaneMask>) -> Outcome {
        let mut interpreter =
            Interpreter::prepare(&self.function).expect("generated functions run");
        let mut outcome = self.untouched();
        let accepts =
            |output: &Output| self.function.place(output.place).kind == PlaceKind::Accepted;
        let keeps_nearest = shape == CallMode::Leaf && self.function.outputs.iter().any(accepts);
        let mut nearest: Option<(f32, Outcome)> = None;
        for ray in (0..count(shape)).filter(|ray| mask.is_none_or(|mask| mask.get(*ray))) {
            if keeps_nearest {
                // Its own ray's outputs to begin with, as if it were the only object.
                let mut alone = self.untouched();
                let result = self.interpret_ray(
                    &mut interpreter,
                    (shape, layout),
                    FIRST + ray,
                    (ray, 0),
                    &mut alone,
                );
                outcome.budget |= result.budget_exceeded;
                let distance = self.distance(&alone);
                let is_nearer = nearest.as_ref().is_none_or(|(nearest, _)| distance < *nearest);
                if result.accepted && is_nearer {
                    alone.nearest = Some((FIRST + ray) as u32);
                    nearest = Some((distance, alone));
                }
                continue;
            }
            let object = match shape {
                CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => OBJECT,
                CallMode::Stream => self.indices.as_slice()[ray] as usize,
                CallMode::Leaf => FIRST + ray,
            };
            let result = self.interpret_ray(
                &mut interpreter,
                (shape, layout),
                object,
                (ray, ray),
                &mut outcome,
            );
            outcome.accepted.set(ray, result.accepted);
            outcome.budget |= result.budget_exceeded;
        }
        match nearest {
            Some((_, nearest)) => Outcome { budget: outcome.budget, ..nearest },
            None => outcome,
        }
    }

    /// Before the call.
    fn untouched(&self) -> Outcome {
        Outcome {
            state: self.state.clone(),
            scratch: self.scratch.clone(),
            accepted: LaneMask::new(RAYS),
            nearest: None,
            budget: false,
        }
    }

    /// Runs for the ray of this number and the object; outputs go to a lane of their own.
    fn interpret_ray(
        &self,
        interpreter: &mut Interpreter,
        (shape, layout): (CallMode, &Layout),
        object: usize,
        (ray, output): (usize, usize),
        outcome: &mut Outcome,
    ) -> rtsl_ir::Outcome {
        let mut storage = RayStorage {
            case: self,
            shape,
            form: layout.object_form(shape),
            object: &self.instances[object],
            ray,
            output,
            state: &mut outcome.state,
            scratch: &mut outcome.scratch,
        };
        interpreter.run(ray as u32, &mut storage, &mut HashHost::default())
    }

    /// What hits are compared by: the distance that the ray has now, or nothing.
    fn distance(&self, outcome: &Outcome) -> f32 {
        let sets = |output: &Output| self.function.place(output.place).name == "rt_HitDistance";
        if !self.function.outputs.iter().any(sets) {
            return 0.0;
        }
        let variable = rtsl_spec::lookup_state("rt_HitDistance").unwrap();
        let distance = outcome.state.floats(variable.first_component as usize)[0];
        if distance.is_nan() { f32::INFINITY } else { distance }
    }

    fn compare(&self, expected: &Outcome, found: &Outcome) -> Result<(), String> {
        for output in &self.function.outputs {
            let place = self.function.place(output.place);
            let name = format!("{}[{}]", place.name, output.component);
            if place.kind == PlaceKind::Accepted {
                for ray in 0..RAYS {
                    let (expected, found) = (expected.accepted.get(ray), found.accepted.get(ray));
                    if expected != found {
                        return Err(format!("ray {ray}: {name} is {found}, not {expected}"));
                    }
                }
            }
        }
        for place in &self.function.places {
            let (first, expected, found) = match place.kind {
                PlaceKind::State => (first_component(place), &expected.state, &found.state),
                PlaceKind::Scratch => {
                    (self.layout.scratch[&place.name], &expected.scratch, &found.scratch)
                }
                _ => continue,
            };
            for component in 0..place.len {
                let array = (first + component) as usize;
                for ray in 0..RAYS {
                    let of = |block: &LaneBlock| canonical(place.scalar, block.words(array)[ray]);
                    let (expected, found) = (of(expected), of(found));
                    if expected != found {
                        let name = format!("{}[{component}]", place.name);
                        return Err(format!("ray {ray}: {name} is {found:#x}, not {expected:#x}"));
                    }
                }
            }
        }
        if expected.nearest != found.nearest {
            return Err(format!("nearest is {:?}, not {:?}", found.nearest, expected.nearest));
        }
        match expected.budget == found.budget {
            true => Ok(()),
            false => Err(format!("budget exhausted: {}", found.budget)),
        }
    }
}

/// The bits to compare: every NaN is the same.
fn canonical(scalar: Scalar, bits: u32) -> u32 {
    let nan = scalar == Scalar::F32 && f32::from_bits(bits).is_nan();
    if nan { CANONICAL_NAN } else { bits }
}

fn first_component(place: &Place) -> u32 {
    rtsl_spec::lookup_state(&place.name).expect("a state variable").first_component
}

/// An instance with members and buffers drawn from `entropy`.
fn instance(function: &Function, layout: &Layout, entropy: &mut Entropy<'_>) -> InstanceBlock {
    let mut members = vec![0; layout.block_words as usize];
    let mut buffers = Vec::new();
    for place in &function.places {
        let mut words = |count: u32| -> Vec<u32> {
            (0..count).map(|_| entropy.constant(place.scalar).bits()).collect()
        };
        match place.kind {
            PlaceKind::Member => {
                let first = layout.members[&place.name] as usize;
                members[first..first + place.len as usize].copy_from_slice(&words(place.len));
            }
            PlaceKind::Buffer => {
                let seven = words(7 * place.len);
                let elements = entropy.below(7) as u32;
                buffers.push(BoundBuffer {
                    offset: layout.buffers[&place.name],
                    words: seven[..(elements * place.len) as usize].into(),
                    element_words: place.len,
                });
            }
            _ => {}
        }
    }
    InstanceBlock::new(&members, buffers)
}

/// Some of the members and buffers.
fn form(function: &Function, layout: &Layout, entropy: &mut Entropy<'_>) -> ObjectForm {
    let places = function.places.iter().filter_map(|place| match layout.locate(place, None)? {
        DataLocation::Instance(first) | DataLocation::Objects(first) => Some((place, first)),
    });
    let words = |(place, first): (&Place, u32)| match place.kind {
        PlaceKind::Buffer => first..first + BUFFER_WORDS,
        _ => first..first + place.len,
    };
    ObjectForm::new(places.filter(|_| entropy.chance(128)).flat_map(words))
}

/// The rays of a call.
fn count(shape: CallMode) -> usize {
    match shape {
        CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream | CallMode::Leaf => RAYS,
        CallMode::Single => 1,
    }
}

/// One ray's view of the data.
struct RayStorage<'a> {
    case: &'a Case,
    shape: CallMode,
    form: Option<ObjectForm>,
    object: &'a InstanceBlock,
    ray: usize,
    /// The lane of the outputs.
    output: usize,
    state: &'a mut LaneBlock,
    scratch: &'a mut LaneBlock,
}

impl RayStorage<'_> {
    fn is_of_objects(&self, place: &Place) -> bool {
        let location = self.case.layout.locate(place, self.form.as_ref());
        matches!(location, Some(DataLocation::Objects(_)))
    }

    /// The instance in which a place stands: what objects share is the first one's.
    fn instance(&self, place: &Place) -> &InstanceBlock {
        if self.is_of_objects(place) { self.object } else { &self.case.instances[0] }
    }

    fn buffer(&self, place: &Place) -> &BoundBuffer {
        let offset = self.case.layout.buffers[&place.name];
        let mut buffers = self.instance(place).buffers().iter();
        buffers.find(|buffer| buffer.offset == offset).expect("every buffer is bound")
    }
}

impl Storage for RayStorage<'_> {
    fn load(&self, id: PlaceId, index: u32) -> u32 {
        let place = self.case.function.place(id);
        // What rays share is what the first one had before the call.
        let (state, scratch, ray) = match self.shape.varies(place, self.is_of_objects(place)) {
            true => (&*self.state, &*self.scratch, self.ray),
            false => (&self.case.state, &self.case.scratch, 0),
        };
        let word = match place.kind {
            PlaceKind::State => state.words((first_component(place) + index) as usize)[ray],
            PlaceKind::Scratch => {
                scratch.words((self.case.layout.scratch[&place.name] + index) as usize)[ray]
            }
            PlaceKind::Member => self.instance(place).words()
                [(self.case.layout.members[&place.name] + index) as usize],
            PlaceKind::Buffer => self.buffer(place).words[index as usize],
            PlaceKind::Parameter | PlaceKind::Slot | PlaceKind::Accepted => {
                unreachable!("not loaded through storage")
            }
        };
        if place.scalar == Scalar::Bool { u32::from(word != 0) } else { word }
    }

    fn elements(&self, buffer: PlaceId) -> u32 {
        self.buffer(self.case.function.place(buffer)).elements()
    }

    fn store(&mut self, id: PlaceId, component: u32, bits: u32) {
        let place = self.case.function.place(id);
        let bits = if place.scalar == Scalar::Bool { 0_u32.wrapping_sub(bits) } else { bits };
        let (first, block) = match place.kind {
            PlaceKind::State => (first_component(place), &mut *self.state),
            PlaceKind::Scratch => (self.case.layout.scratch[&place.name], &mut *self.scratch),
            PlaceKind::Accepted => return,
            _ => unreachable!("not an output"),
        };
        block.words_mut((first + component) as usize)[self.output] = bits;
    }
}
