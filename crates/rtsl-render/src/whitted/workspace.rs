//! The memory of one thread: blocks of state and scratch, which are reused.

use rtsl::{LaneBlock, LaneIndices, RayType};
use rtsl_bvh::{LANES, Lanes, RayPacket};
use rtsl_math::sampling::Sampler;

use super::light_samples::LightSamples;
use crate::compiled::calls::CallBlocks;
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::tracer::SearchMemory;
use crate::compiled::variables::variables;
use crate::lanes::lane_streams::LaneStreams;
use crate::statistics::RayCounts;
use crate::tiles::{CameraMemory, LaneContext};

/// The memory of one thread.
pub struct Workspace {
    /// Unused levels of shading: one is in use for each depth of recursion.
    free_levels: Vec<Level>,
    /// Unused packets of spawned rays.
    free_spawned: Vec<Box<SpawnedPacket>>,
    /// Unused light samples.
    free_light_samples: Option<Box<LightSamples>>,
    /// The memory of searches.
    pub search: SearchMemory,
    /// The memory of camera rays.
    pub camera: CameraMemory,
    /// For calls of lights, which spawn no rays.
    pub light: CallBlocks,
    /// The number of rays traced so far.
    pub rays: RayCounts,
    scratch_arrays: usize,
    sampler: Sampler,
}

/// Rays requested by materials, with their context. Lanes without a request are undefined.
// Seven kilobytes: allocated for each request, they would be cleared and copied. Reusing them, and setting streams in
// vectors, saves 7 % of the instructions of rendering three spheres.
pub struct SpawnedPacket {
    /// The rays.
    pub rays: RayPacket,
    /// The weights of their radiance.
    pub weights: Lanes,
    /// Their context.
    pub context: LaneContext,
}

/// The memory for shading a packet.
pub struct Level {
    /// State, and scratch of materials.
    pub blocks: CallBlocks,
    /// The scratch of the shapes' `intersect` for the closest hits.
    pub kept_scratch: LaneBlock,
    /// The indices of the objects that were hit.
    pub indices: LaneIndices,
}

impl Level {
    /// Sets the number of surfaces that the rays have met before.
    pub fn set_depth(&mut self, depth: u32) {
        self.blocks.state.floats_mut(variables().ray_depth).fill(depth as f32);
        self.blocks.state.floats_mut(variables().ray_type).fill(RayType::of(depth, 0).value());
    }
}

/// Sums the rays traced with these workspaces.
pub fn rays_of(workspaces: &[Workspace]) -> RayCounts {
    let mut sum = RayCounts::default();
    workspaces.iter().for_each(|workspace| sum += workspace.rays);
    sum
}

impl Workspace {
    /// Allocates the memory for rendering a scene.
    pub fn new(scene: &CompiledScene) -> Self {
        Workspace {
            free_levels: Vec::new(),
            free_spawned: Vec::new(),
            free_light_samples: None,
            search: SearchMemory::new(scene),
            camera: CameraMemory::new(scene),
            light: CallBlocks::new(scene.scratch_arrays),
            rays: RayCounts::default(),
            scratch_arrays: scene.scratch_arrays,
            sampler: scene.settings.sampler,
        }
    }

    /// Takes an unused packet.
    pub fn take_spawned(&mut self) -> Box<SpawnedPacket> {
        self.free_spawned.pop().unwrap_or_else(|| {
            let streams = LaneStreams::new([0; LANES], 0);
            Box::new(SpawnedPacket {
                rays: RayPacket::default(),
                weights: [1.0; LANES],
                context: LaneContext::new(self.sampler, streams, [0.0; LANES]),
            })
        })
    }

    /// Returns a packet for reuse.
    pub fn keep_spawned(&mut self, packet: Box<SpawnedPacket>) {
        self.free_spawned.push(packet);
    }

    /// Takes an unused level.
    pub fn take_level(&mut self) -> Level {
        self.free_levels.pop().unwrap_or_else(|| Level {
            blocks: CallBlocks::new(self.scratch_arrays),
            kept_scratch: LaneBlock::new(self.scratch_arrays, LANES),
            indices: LaneIndices::new(LANES),
        })
    }

    /// Takes unused samples.
    pub fn take_light_samples(&mut self) -> Box<LightSamples> {
        self.free_light_samples.take().unwrap_or_else(|| Box::new(LightSamples::new()))
    }

    /// Returns samples for reuse.
    pub fn keep_light_samples(&mut self, samples: Box<LightSamples>) {
        self.free_light_samples = Some(samples);
    }

    /// Returns a level for reuse.
    pub fn return_level(&mut self, level: Level) {
        self.free_levels.push(level);
    }
}
