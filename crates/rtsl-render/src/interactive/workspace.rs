//! The memory of one thread: blocks of state and scratch, used over and over.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use fearless_simd::{Level as SimdLevel, Simd, dispatch};
use rtsl::host::Host;
use rtsl::{
    CallArguments, Instances, Kernel, LaneBlock, LaneIndices, LaneMask as MaskBlock, Method,
    Program, new_state,
};

use crate::acceleration::{LANES, LaneMask, Visits};
use crate::statistics::RayCounts;

use super::camera::CameraRays;
use super::compiled::{CompiledScene, ShaderInstance};
use super::intersection::IntersectionBlocks;
use super::light_samples::LightSamples;
use super::mask_bits::{bits, set_bits};
use super::work_counts::WorkCounts;

/// What one thread needs.
pub struct Workspace {
    /// Levels of shading not in use: one is in use for each ray whose shading spawned the next.
    free_levels: Vec<Level>,
    /// Camera rays not in use.
    free_camera_rays: Option<Box<CameraRays>>,
    /// Samples of lights not in use.
    free_light_samples: Option<Box<LightSamples>>,
    /// For `intersect`, which spawns nothing.
    pub intersection: IntersectionBlocks,
    /// For searches.
    pub visits: Visits,
    /// For the camera.
    pub camera: CallBlocks,
    /// For lights, which spawn nothing.
    pub light: CallBlocks,
    /// Rays traced so far.
    pub rays: RayCounts,
    /// What searches and shading do, while somebody wants to know.
    pub counts: Option<WorkCounts>,
    scratch_arrays: usize,
}

/// What shading a packet needs.
pub struct Level {
    /// State, and scratch of materials.
    pub blocks: CallBlocks,
    /// What the shapes' `intersect` left for the nearest hits.
    pub kept_scratch: LaneBlock,
    /// The numbers of the objects that were hit.
    pub numbers: LaneIndices,
}

/// The blocks of one call.
pub struct CallBlocks {
    /// The state.
    pub state: LaneBlock,
    /// The scratch.
    pub scratch: LaneBlock,
    /// The lanes that take part, where these are not the first so many.
    pub mask: MaskBlock,
    /// Whether the mask counts.
    pub is_masked: bool,
    /// What `mask` holds.
    masked: LaneMask,
    /// The lanes that accepted a hit.
    pub accepted: MaskBlock,
}

impl Workspace {
    /// Memory for rendering a scene.
    pub fn new(scene: &CompiledScene) -> Self {
        Workspace {
            free_levels: Vec::new(),
            free_camera_rays: None,
            free_light_samples: None,
            intersection: IntersectionBlocks::new(scene.scratch_arrays),
            visits: Visits::default(),
            camera: CallBlocks::new(scene.scratch_arrays),
            light: CallBlocks::new(scene.scratch_arrays),
            rays: RayCounts::default(),
            counts: None,
            scratch_arrays: scene.scratch_arrays,
        }
    }

    /// A level that is not in use.
    pub fn take_level(&mut self) -> Level {
        self.free_levels.pop().unwrap_or_else(|| Level {
            blocks: CallBlocks::new(self.scratch_arrays),
            kept_scratch: LaneBlock::new(self.scratch_arrays, LANES),
            numbers: LaneIndices::new(LANES),
        })
    }

    /// Camera rays not in use, if there are any.
    pub fn take_camera_rays(&mut self) -> Option<Box<CameraRays>> {
        self.free_camera_rays.take()
    }

    /// Takes camera rays back, to be filled again.
    pub fn keep_camera_rays(&mut self, rays: Box<CameraRays>) {
        self.free_camera_rays = Some(rays);
    }

    /// Samples not in use.
    pub fn take_light_samples(&mut self) -> Box<LightSamples> {
        self.free_light_samples.take().unwrap_or_else(|| Box::new(LightSamples::new()))
    }

    /// Takes samples back, to be used again.
    pub fn keep_light_samples(&mut self, samples: Box<LightSamples>) {
        self.free_light_samples = Some(samples);
    }

    /// Gives a level back.
    pub fn return_level(&mut self, level: Level) {
        self.free_levels.push(level);
    }
}

impl CallBlocks {
    /// For shaders with at most so many arrays of scratch.
    pub fn new(scratch_arrays: usize) -> Self {
        CallBlocks {
            state: new_state(LANES),
            scratch: LaneBlock::new(scratch_arrays, LANES),
            mask: MaskBlock::new(LANES),
            is_masked: false,
            masked: 0,
            accepted: MaskBlock::new(LANES),
        }
    }

    /// Sets the first `arrays` arrays of scratch to zero.
    pub fn clear_scratch(&mut self, arrays: usize) {
        (0..arrays).for_each(|array| self.scratch.words_mut(array).fill(0));
    }

    /// Makes a mask of lanes where a call needs one: how many rays the call is for.
    // Without a mask full packets go the way that was made for them.
    #[inline(always)]
    pub fn prepare_mask<S: Simd>(&mut self, simd: S, lanes: LaneMask) -> usize {
        let count = LANES - lanes.leading_zeros() as usize;
        self.is_masked = lanes.trailing_ones() as usize != count;
        if self.is_masked && self.masked != lanes {
            set_bits(simd, &mut self.mask, lanes);
            self.masked = lanes;
        }
        count
    }

    /// Calls a method for `lanes`; returns the lanes that accepted a hit. `scratch` stands for
    /// the blocks' own where it is given.
    pub fn call(
        &mut self,
        call: &KernelCall<'_>,
        lanes: LaneMask,
        scratch: Option<&mut LaneBlock>,
        host: &mut dyn Host,
    ) -> LaneMask {
        let count = dispatch!(SimdLevel::new(), simd => self.prepare_mask(simd, lanes));
        let status = call.kernel.call(CallArguments {
            state: &mut self.state,
            scratch: scratch.unwrap_or(&mut self.scratch),
            count,
            mask: self.is_masked.then_some(&self.mask),
            accepted: (call.method == Method::Intersect).then_some(&mut self.accepted),
            instances: call.instances,
            host,
        });
        if status.budget_exhausted {
            call.problems.report(call.class, call.method);
        }
        match call.method {
            Method::Intersect => {
                dispatch!(SimdLevel::new(), simd => bits(simd, &self.accepted, lanes))
            }
            _ => 0,
        }
    }
}

/// A kernel, whose it is, and where its problems go.
pub struct KernelCall<'a> {
    /// The kernel.
    pub kernel: &'a Kernel,
    /// Its method.
    pub method: Method,
    /// The instance, or instances.
    pub instances: Instances<'a>,
    /// The number of scratch arrays that the kernel may use.
    pub scratch_arrays: usize,
    /// The class's name, for messages.
    pub class: &'a str,
    /// Where problems go.
    pub problems: &'a Problems,
}

impl KernelCall<'_> {
    /// Whether the kernel reads or writes a component of the state.
    pub fn touches(&self, component: usize) -> bool {
        self.kernel.state_components().contains(component as u32)
    }
}

impl<'a> KernelCall<'a> {
    /// A call of a method of a program's class.
    pub fn new(
        program: &'a Program,
        kernel: &'a Kernel,
        method: Method,
        instances: Instances<'a>,
        problems: &'a Problems,
    ) -> Self {
        let scratch_arrays = program.layout().scratch_arrays as usize;
        let class = &program.class().name;
        KernelCall { kernel, method, instances, scratch_arrays, class, problems }
    }
}

impl CompiledScene {
    /// The call of an instance's method; `None` if its class has none.
    pub fn call<'a>(
        &'a self,
        instance: &'a ShaderInstance,
        method: Method,
        problems: &'a Problems,
    ) -> Option<KernelCall<'a>> {
        let shader = self.shader(instance);
        let kernel = instance.specialised.kernel(method).or_else(|| shader.kernel(method))?;
        let instances = Instances::One(&instance.block);
        Some(KernelCall::new(&shader.program, kernel, method, instances, problems))
    }
}

/// What went wrong while rendering: a shader ran past its budget.
#[derive(Debug, Default)]
pub struct Problems {
    any: AtomicBool,
    /// Class and method.
    exhausted: Mutex<Vec<(String, Method)>>,
}

impl Problems {
    /// Whether there is any.
    pub fn any(&self) -> bool {
        self.any.load(Ordering::Relaxed)
    }

    /// The methods that ran past their budget, each once, in a fixed order.
    pub fn exhausted(&self) -> Vec<(String, Method)> {
        let mut list = self.exhausted.lock().map(|list| list.clone()).unwrap_or_default();
        list.sort();
        list
    }

    /// A method of a class ran past its budget.
    #[cold]
    pub fn report(&self, class: &str, method: Method) {
        self.any.store(true, Ordering::Relaxed);
        if let Ok(mut list) = self.exhausted.lock() {
            let entry = (class.to_owned(), method);
            if !list.contains(&entry) {
                list.push(entry);
            }
        }
    }
}
