//! Runs a function for many rays, interpreted and compiled.

mod waves;

use std::sync::{Arc, OnceLock};

use rtsl_abi::offsets::BUFFER_WORDS;
use rtsl_abi::{
    BoundBuffer, CallArguments, CallMode, CallStatus, DataLocation, InstanceBlock, Instances,
    LaneBlock, LaneIndices, LaneMask, Layout, ObjectForm, Objects,
};
use rtsl_ir::evaluate::CANONICAL_NAN;
use rtsl_ir::{Function, Interpreter, Output, Scalar, Storage, Variable, VariableId, VariableKind};
use rtsl_jit::{CompiledKernel, Llvm, OptLevel};
use rtsl_llvm::TargetFeatures;
use rtsl_packet::{Kernel, interleave};
use rtsl_testing::functions::{Entropy, HashHost};
use rtsl_testing::turns::is_long_run;

/// Full chunks and a partial one at every width.
const RAYS: usize = 37;
/// The first object in the leaf mode, which takes as many objects as there are rays.
const FIRST: usize = 8;
const OBJECTS: usize = FIRST + RAYS;
/// The object in the modes with one object.
const OBJECT: usize = 13;
const WIDTHS: [u32; 4] = [1, 4, 8, 16];

/// A function with data for its variables.
pub struct Case {
    function: Function,
    /// The layout without a form of objects: they share nothing, and modes with one object take an instance.
    layout: Layout,
    /// The layout with a form: some variables differ from object to object.
    sharing: Layout,
    /// The same for few objects.
    of_few: Layout,
    instances: Vec<InstanceBlock>,
    /// The object of each ray, for the stream mode.
    indices: LaneIndices,
    /// The same if these are few.
    few_indices: LaneIndices,
    few: usize,
    state: LaneBlock,
    scratch: LaneBlock,
    mask: LaneMask,
    /// Selects half of the kernels: every mode at some widths, every width in some modes. `RTSL_LONG` selects all.
    half: Option<usize>,
}

/// The result of a run for all rays.
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
        let variables =
            |kind| function.variables.iter().filter(move |variable| variable.kind == kind);
        let layout = Layout::new(
            variables(VariableKind::Member),
            variables(VariableKind::Buffer),
            variables(VariableKind::Scratch),
        );
        let bytes = Entropy::bytes(seed ^ 0x5eed, 1 << 15);
        let entropy = &mut Entropy::new(&bytes);
        let instances = (0..OBJECTS).map(|_| instance(&function, &layout, entropy)).collect();
        let sharing = Layout { objects: Some(form(&function, &layout, entropy)), ..layout.clone() };
        let few = 1 + entropy.below(16);
        let form_of_few = sharing.objects.clone().map(|form| form.of_count(few));
        let of_few = Layout { objects: form_of_few, ..layout.clone() };
        let [indices, few_indices] = [OBJECTS, few].map(|objects| {
            let mut indices = LaneIndices::new(RAYS);
            let of_rays = indices.as_mut_slice().iter_mut();
            of_rays.for_each(|index| *index = entropy.below(objects) as u32);
            indices
        });
        // All chunks before that of the first ray that is on are left out.
        let first_on = seed as usize % 3 * 17;
        let components = rtsl_spec::state_component_count() as usize;
        let mut case = Case {
            instances,
            indices,
            few_indices,
            few,
            state: LaneBlock::new(components, RAYS),
            scratch: LaneBlock::new(layout.scratch_arrays as usize, RAYS),
            mask: LaneMask::from_fn(RAYS, |ray| ray >= first_on && entropy.chance(150)),
            half: (!is_long_run()).then_some(seed as usize % 2),
            function,
            layout,
            sharing,
            of_few,
        };
        case.fill_lanes(entropy);
        case
    }

    fn fill_lanes(&mut self, entropy: &mut Entropy<'_>) {
        for variable in &self.function.variables {
            let (first, block) = match variable.kind {
                VariableKind::State => (first_component(variable), &mut self.state),
                VariableKind::Scratch => (self.layout.scratch[&variable.name], &mut self.scratch),
                _ => continue,
            };
            for array in first..first + variable.len {
                for word in block.words_mut(array as usize) {
                    let bits = entropy.constant(variable.scalar).bits();
                    *word = if variable.scalar == Scalar::Bool {
                        0_u32.wrapping_sub(bits)
                    } else {
                        bits
                    };
                }
            }
        }
    }

    /// Compares kernels with the interpreter, with text for this machine and for others: LLVM emulates features
    /// that this one lacks.
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
        // With a form the modes differ less from one another.
        let of_objects = [CallMode::Packet, CallMode::Stream, CallMode::Leaf];
        let all = [
            (&self.layout, CallMode::ALL.as_slice()),
            (&self.sharing, of_objects.as_slice()),
            (&self.of_few, &[CallMode::Stream]),
        ];
        for (layout, modes) in all {
            let mut kernels = Vec::new();
            let mode_count = modes.len();
            let all = (0..mode_count).flat_map(|mode| (0..widths.len()).map(move |it| (mode, it)));
            for (mode, width) in all.filter(|(mode, width)| self.is_selected(mode + width)) {
                let (mode, width) = (modes[mode], widths[width]);
                let mut kernel = rtsl_packet::lower(&self.function, layout, mode, width)
                    .map_err(|error| error.to_string())?;
                rtsl_packet::verify(&kernel).map_err(|error| format!("{error}\n{kernel}"))?;
                // The greatest interleaving for the number of rays.
                kernel.interleave = interleave::choose(&kernel, Some(16 / width.max(4)));
                kernels.push(kernel);
            }
            self.check_kernels(layout, &kernels, features)?;
        }
        Ok(())
    }

    /// Returns true if kernels at this place in the table of modes and widths are tested.
    fn is_selected(&self, place: usize) -> bool {
        self.half.is_none_or(|half| place % 2 == half)
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
                let mask = mask.filter(|_| kernel.mode != CallMode::Single);
                let all = Called { mode: kernel.mode, count: count(kernel.mode), mask };
                // As many objects as lanes have code of their own.
                let is_leaf = kernel.mode == CallMode::Leaf;
                let full = is_leaf.then_some(Called { count: kernel.width as usize, ..all });
                for called in [all].into_iter().chain(full) {
                    let expected = self.interpret(called, layout);
                    let found = self.call(compiled, called, layout);
                    self.compare(&expected, &found).map_err(|difference| {
                        let (count, is_masked) = (called.count, mask.is_some());
                        format!("{count}, masked: {is_masked}: {difference}\n{kernel}")
                    })?;
                }
            }
        }
        Ok(())
    }

    fn call(&self, kernel: &CompiledKernel, called: Called<'_>, layout: &Layout) -> Outcome {
        let mut outcome = self.untouched();
        self.call_on(kernel, called, layout, &mut outcome, &mut HashHost::default());
        outcome
    }

    /// Calls a kernel on the lanes of an outcome.
    fn call_on(
        &self,
        kernel: &CompiledKernel,
        Called { mode, count, mask }: Called<'_>,
        layout: &Layout,
        outcome: &mut Outcome,
        host: &mut HashHost,
    ) {
        outcome.accepted = LaneMask::from_fn(RAYS, |ray| mode != CallMode::Leaf && ray < count);
        let form = layout.object_form(mode);
        let objects = form.map(|form| {
            let count = if form.few_blocks().is_some() { self.few } else { OBJECTS };
            Objects::of_instances(form, &self.instances[..count])
        });
        let instances = match (mode, &objects) {
            (_, None) => Instances::One(&self.instances[0]),
            (CallMode::Packet | CallMode::CommonOrigin | CallMode::Single, Some(objects)) => {
                Instances::Object(objects, OBJECT as u32)
            }
            (CallMode::Stream, Some(objects)) => Instances::Many(objects, self.indices(layout)),
            (CallMode::Leaf, Some(objects)) => Instances::Range(objects, FIRST as u32),
        };
        let status = kernel.call(CallArguments {
            state: &mut outcome.state,
            scratch: &mut outcome.scratch,
            count,
            mask,
            accepted: Some(&mut outcome.accepted),
            instances,
            host,
        });
        let CallStatus { budget_exhausted, nearest } = status;
        outcome.nearest = nearest;
        outcome.budget |= budget_exhausted;
    }

    /// Returns the object of each ray.
    fn indices(&self, layout: &Layout) -> &LaneIndices {
        let are_few = layout.objects.as_ref().is_some_and(|form| form.few_blocks().is_some());
        if are_few { &self.few_indices } else { &self.indices }
    }

    fn interpret(&self, Called { mode, count, mask }: Called<'_>, layout: &Layout) -> Outcome {
        let mut interpreter =
            Interpreter::prepare(&self.function).expect("generated functions run");
        let mut outcome = self.untouched();
        let accepts = |output: &Output| {
            self.function.variable(output.variable).kind == VariableKind::Accepted
        };
        let keeps_nearest = mode == CallMode::Leaf && self.function.outputs.iter().any(accepts);
        let mut nearest: Option<(f32, Outcome)> = None;
        for ray in (0..count).filter(|ray| mask.is_none_or(|mask| mask.get(*ray))) {
            if keeps_nearest {
                // Initially the outputs of the ray itself, as if this were the only object.
                let mut alone = self.untouched();
                let result = self.interpret_ray(&mut interpreter, mode, layout, ray, 0, &mut alone);
                outcome.budget |= result.budget_exceeded;
                let distance = self.distance(&alone);
                let is_nearer = nearest.as_ref().is_none_or(|(nearest, _)| distance < *nearest);
                if result.accepted && is_nearer {
                    alone.nearest = Some((FIRST + ray) as u32);
                    nearest = Some((distance, alone));
                }
                continue;
            }
            let result = self.interpret_ray(&mut interpreter, mode, layout, ray, ray, &mut outcome);
            outcome.accepted.set(ray, result.accepted);
            outcome.budget |= result.budget_exceeded;
        }
        match nearest {
            Some((_, nearest)) => Outcome { budget: outcome.budget, ..nearest },
            None => outcome,
        }
    }

    /// Returns the values before the call.
    fn untouched(&self) -> Outcome {
        Outcome {
            state: self.state.clone(),
            scratch: self.scratch.clone(),
            accepted: LaneMask::new(RAYS),
            nearest: None,
            budget: false,
        }
    }

    /// Runs for the ray with this index and its object; outputs go to a separate lane.
    fn interpret_ray(
        &self,
        interpreter: &mut Interpreter,
        mode: CallMode,
        layout: &Layout,
        ray: usize,
        output: usize,
        outcome: &mut Outcome,
    ) -> rtsl_ir::Outcome {
        let object = match mode {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => OBJECT,
            CallMode::Stream => self.indices(layout).as_slice()[ray] as usize,
            CallMode::Leaf => FIRST + ray,
        };
        let mut storage = RayStorage {
            case: self,
            mode,
            form: layout.object_form(mode),
            object: &self.instances[object],
            ray,
            output,
            state: &mut outcome.state,
            scratch: &mut outcome.scratch,
        };
        interpreter.run(ray as u32, &mut storage, &mut HashHost::default())
    }

    /// Returns the key by which hits are compared: the distance of the ray, or nothing.
    fn distance(&self, outcome: &Outcome) -> f32 {
        let sets =
            |output: &Output| self.function.variable(output.variable).name == "rt_HitDistance";
        if !self.function.outputs.iter().any(sets) {
            return 0.0;
        }
        let variable = rtsl_spec::lookup_state("rt_HitDistance").unwrap();
        let distance = outcome.state.floats(variable.first_component as usize)[0];
        if distance.is_nan() { f32::INFINITY } else { distance }
    }

    fn compare(&self, expected: &Outcome, found: &Outcome) -> Result<(), String> {
        for output in &self.function.outputs {
            let variable = self.function.variable(output.variable);
            let name = format!("{}[{}]", variable.name, output.component);
            if variable.kind == VariableKind::Accepted {
                for ray in 0..RAYS {
                    let (expected, found) = (expected.accepted.get(ray), found.accepted.get(ray));
                    if expected != found {
                        return Err(format!("ray {ray}: {name} is {found}, not {expected}"));
                    }
                }
            }
        }
        for variable in &self.function.variables {
            let (first, expected, found) = match variable.kind {
                VariableKind::State => (first_component(variable), &expected.state, &found.state),
                VariableKind::Scratch => {
                    (self.layout.scratch[&variable.name], &expected.scratch, &found.scratch)
                }
                _ => continue,
            };
            for component in 0..variable.len {
                let array = (first + component) as usize;
                for ray in 0..RAYS {
                    let of =
                        |block: &LaneBlock| canonical(variable.scalar, block.words(array)[ray]);
                    let (expected, found) = (of(expected), of(found));
                    if expected != found {
                        let name = format!("{}[{component}]", variable.name);
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

/// Returns the bits to compare, with canonical NaNs.
fn canonical(scalar: Scalar, bits: u32) -> u32 {
    let nan = scalar == Scalar::F32 && f32::from_bits(bits).is_nan();
    if nan { CANONICAL_NAN } else { bits }
}

fn first_component(variable: &Variable) -> u32 {
    rtsl_spec::lookup_state(&variable.name).expect("a state variable").first_component
}

/// Returns an instance with members and buffers drawn from `entropy`.
fn instance(function: &Function, layout: &Layout, entropy: &mut Entropy<'_>) -> InstanceBlock {
    let mut members = vec![0; layout.block_words as usize];
    let mut buffers = Vec::new();
    for variable in &function.variables {
        let mut words = |count: u32| -> Vec<u32> {
            (0..count).map(|_| entropy.constant(variable.scalar).bits()).collect()
        };
        match variable.kind {
            VariableKind::Member => {
                let first = layout.members[&variable.name] as usize;
                members[first..first + variable.len as usize].copy_from_slice(&words(variable.len));
            }
            VariableKind::Buffer => {
                let seven = words(7 * variable.len);
                let elements = entropy.below(7) as u32;
                buffers.push(BoundBuffer {
                    offset: layout.buffers[&variable.name],
                    words: seven[..(elements * variable.len) as usize].into(),
                    element_words: variable.len,
                });
            }
            _ => {}
        }
    }
    InstanceBlock::new(&members, buffers)
}

/// Returns a form with some of the members and buffers.
fn form(function: &Function, layout: &Layout, entropy: &mut Entropy<'_>) -> ObjectForm {
    let variables =
        function.variables.iter().filter_map(|variable| match layout.locate(variable, None)? {
            DataLocation::Instance(first) | DataLocation::Objects(first) => Some((variable, first)),
        });
    let words = |(variable, first): (&Variable, u32)| match variable.kind {
        VariableKind::Buffer => first..first + BUFFER_WORDS,
        _ => first..first + variable.len,
    };
    ObjectForm::new(variables.filter(|_| entropy.chance(128)).flat_map(words))
}

/// The lanes of a call.
#[derive(Clone, Copy)]
struct Called<'a> {
    mode: CallMode,
    count: usize,
    mask: Option<&'a LaneMask>,
}

/// Returns the greatest number of rays of a call.
fn count(mode: CallMode) -> usize {
    match mode {
        CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream | CallMode::Leaf => RAYS,
        CallMode::Single => 1,
    }
}

/// One ray's view of the data.
struct RayStorage<'a> {
    case: &'a Case,
    mode: CallMode,
    form: Option<ObjectForm>,
    object: &'a InstanceBlock,
    ray: usize,
    /// The lane of the outputs.
    output: usize,
    state: &'a mut LaneBlock,
    scratch: &'a mut LaneBlock,
}

impl RayStorage<'_> {
    fn is_of_objects(&self, variable: &Variable) -> bool {
        let location = self.case.layout.locate(variable, self.form.as_ref());
        matches!(location, Some(DataLocation::Objects(_)))
    }

    /// Returns the instance that holds a variable: shared data is in the first one.
    fn instance(&self, variable: &Variable) -> &InstanceBlock {
        if self.is_of_objects(variable) { self.object } else { &self.case.instances[0] }
    }

    fn buffer(&self, variable: &Variable) -> &BoundBuffer {
        let offset = self.case.layout.buffers[&variable.name];
        let mut buffers = self.instance(variable).buffers().iter();
        buffers.find(|buffer| buffer.offset == offset).expect("every buffer is bound")
    }
}

impl Storage for RayStorage<'_> {
    fn load(&self, id: VariableId, index: u32) -> u32 {
        let variable = self.case.function.variable(id);
        // Uniform variables have the value of the first ray before the call.
        let (state, scratch, ray) = match self.mode.varies(variable, self.is_of_objects(variable)) {
            true => (&*self.state, &*self.scratch, self.ray),
            false => (&self.case.state, &self.case.scratch, 0),
        };
        let word = match variable.kind {
            VariableKind::State => state.words((first_component(variable) + index) as usize)[ray],
            VariableKind::Scratch => {
                scratch.words((self.case.layout.scratch[&variable.name] + index) as usize)[ray]
            }
            VariableKind::Member => self.instance(variable).words()
                [(self.case.layout.members[&variable.name] + index) as usize],
            VariableKind::Buffer => self.buffer(variable).words[index as usize],
            VariableKind::Parameter | VariableKind::Local | VariableKind::Accepted => {
                unreachable!("not loaded through storage")
            }
        };
        if variable.scalar == Scalar::Bool { u32::from(word != 0) } else { word }
    }

    fn elements(&self, buffer: VariableId) -> u32 {
        self.buffer(self.case.function.variable(buffer)).elements()
    }

    fn store(&mut self, id: VariableId, component: u32, bits: u32) {
        let variable = self.case.function.variable(id);
        let bits = if variable.scalar == Scalar::Bool { 0_u32.wrapping_sub(bits) } else { bits };
        let (first, block) = match variable.kind {
            VariableKind::State => (first_component(variable), &mut *self.state),
            VariableKind::Scratch => (self.case.layout.scratch[&variable.name], &mut *self.scratch),
            VariableKind::Accepted => return,
            _ => unreachable!("not an output"),
        };
        block.words_mut((first + component) as usize)[self.output] = bits;
    }
}
