//! Runs the compiled stages of a function for many paths, each stage for the paths that it is the next of.

use rtsl_abi::{CallMode, LaneBlock, LaneMask, Layout};
use rtsl_ir::host::{Host, LaneColors, LaneSet, LightLanes, LightQueryLanes, RayLanes};
use rtsl_ir::{Scalar, Variable, VariableKind};
use rtsl_jit::{CompiledKernel, OptLevel};
use rtsl_llvm::TargetFeatures;
use rtsl_packet::interleave;
use rtsl_stages::{Port, ResumedBy, Stages};
use rtsl_testing::functions::HashHost;

use super::{Called, Case, Outcome, RAYS, WIDTHS, llvm};

/// The call of a wave.
const ALL: Called<'_> = Called { mode: CallMode::Packet, count: RAYS, mask: None };

impl Case {
    /// Compares the compiled stages of the function with the interpreter of the whole, at every width.
    pub fn check_stages(&self, stages: &Stages) -> Result<(), String> {
        let layout = self.layout_of(stages);
        let expected = self.interpret(ALL, &self.layout);
        let target = llvm().host();
        let features = TargetFeatures::new(target.triple(), target.cpu(), target.features());
        for width in WIDTHS {
            let kernels = stages.stages.iter().map(|stage| {
                let kernel = rtsl_packet::lower(&stage.function, &layout, CallMode::Packet, width);
                let mut kernel = kernel.expect("stages can be lowered");
                kernel.interleave = interleave::choose(&kernel, Some(16 / width.max(4)));
                kernel
            });
            let kernels: Vec<_> = kernels.collect();
            let kernels = CompiledKernel::compile(llvm(), &kernels, &features, OptLevel::O2)
                .map_err(|error| error.to_string())?;
            let found = self.wave(stages, &layout, &kernels);
            self.compare(&expected, &found).map_err(|error| format!("width {width}: {error}"))?;
        }
        Ok(())
    }

    /// Returns the function's layout with the variables of the stages' interface, one word a lane for each name.
    fn layout_of(&self, stages: &Stages) -> Layout {
        let of = |kind| self.function.variables.iter().filter(move |it| it.kind == kind);
        let mut scratch: Vec<&Variable> = of(VariableKind::Scratch).collect();
        for variable in stages.stages.iter().flat_map(|stage| &stage.function.variables) {
            if Port::of(variable).is_some() && scratch.iter().all(|it| it.name != variable.name) {
                scratch.push(variable);
            }
        }
        Layout::new(of(VariableKind::Member), of(VariableKind::Buffer), scratch)
    }

    /// Runs all paths to their ends.
    fn wave(&self, stages: &Stages, layout: &Layout, kernels: &[CompiledKernel]) -> Outcome {
        let scratch = LaneBlock::new(layout.scratch_arrays as usize, RAYS);
        let outcome = Outcome { scratch, ..self.untouched() };
        let mut wave = Wave { layout, outcome, host: HashHost::default() };
        for array in 0..self.layout.scratch_arrays as usize {
            wave.outcome.scratch.words_mut(array).copy_from_slice(self.scratch.words(array));
        }
        loop {
            let mut is_done = true;
            for (index, (stage, kernel)) in (0..).zip(stages.stages.iter().zip(kernels)) {
                let next = wave.words(Port::Next);
                let mask = LaneMask::from_fn(RAYS, |ray| next[ray] == index);
                let rays: Vec<usize> = (0..RAYS).filter(|ray| mask.get(*ray)).collect();
                if rays.is_empty() {
                    continue;
                }
                is_done = false;
                rays.iter().for_each(|ray| wave.answer(stage.resumed_by, *ray));
                let Wave { layout: _, outcome, host } = &mut wave;
                let called = Called { mask: Some(&mask), ..ALL };
                self.call_on(kernel, called, layout, outcome, host);
            }
            if is_done {
                break;
            }
        }
        let mut scratch = self.scratch.clone();
        for array in 0..self.layout.scratch_arrays as usize {
            scratch.words_mut(array).copy_from_slice(wave.outcome.scratch.words(array));
        }
        // Functions that accept hits have no stages, so no mask tells of them.
        Outcome { scratch, accepted: LaneMask::from_fn(RAYS, |_| true), ..wave.outcome }
    }
}

struct Wave<'a> {
    layout: &'a Layout,
    /// Its scratch is that of the function, then the frames of all paths, their requests and answers.
    outcome: Outcome,
    host: HashHost,
}

impl Wave<'_> {
    fn words(&self, port: Port) -> &[u32] {
        self.outcome.scratch.words(self.layout.scratch[&port.name()] as usize)
    }

    fn set(&mut self, port: Port, ray: usize, bits: u32, scalar: Scalar) {
        let word = if scalar == Scalar::Bool { 0_u32.wrapping_sub(bits) } else { bits };
        if let Some(array) = self.layout.scratch.get(&port.name()) {
            self.outcome.scratch.words_mut(*array as usize)[ray] = word;
        }
    }

    /// Has the host answer the request of a path.
    fn answer(&mut self, event: ResumedBy, ray: usize) {
        let request = event.request().iter();
        let request = request.map(|port| self.words(Port::Request(*port))[ray]);
        let words: Vec<u32> = request.collect();
        let request: Vec<f32> = words.iter().map(|bits| f32::from_bits(*bits)).collect();
        let lanes = LaneSet { base: ray as u32, active: 1 };
        let mut rays = RayLanes::default();
        let operands = rays.origin.iter_mut().chain(&mut rays.direction);
        let operands = operands.chain([&mut rays.limit, &mut rays.weight]);
        operands.zip(&request).for_each(|(lanes, operand)| lanes[0] = *operand);
        let answers = match event {
            ResumedBy::Start | ResumedBy::Dispatch => return,
            ResumedBy::NearestHit | ResumedBy::Shade => {
                unreachable!("the functions have no queries")
            }
            ResumedBy::LightSample => {
                let (mut query, mut light) = (LightQueryLanes::default(), LightLanes::default());
                let numbers = query.point.iter_mut().chain(&mut query.normal);
                let numbers = numbers.chain([&mut query.cosine]);
                numbers.zip(&request[1..]).for_each(|(lanes, operand)| lanes[0] = *operand);
                let reached = self.host.light_sample(lanes, words[0], &query, &mut light) & 1;
                let LightLanes { direction, distance, color, pdf } = &light;
                let numbers = direction.iter().chain([distance]).chain(color).chain([pdf]);
                let numbers = numbers.map(|lanes| lanes[0].to_bits() * reached);
                [reached].into_iter().chain(numbers).collect()
            }
            ResumedBy::Occluded => vec![self.host.occluded(lanes, &rays) & 1],
            ResumedBy::Trace => {
                let mut radiance = LaneColors::default();
                self.host.trace(lanes, &rays, &mut radiance);
                radiance.iter().map(|component| component[0].to_bits()).collect()
            }
        };
        for ((index, scalar), bits) in (0..).zip(event.answers()).zip(answers) {
            self.set(Port::Answer(index), ray, bits, *scalar);
        }
    }
}
