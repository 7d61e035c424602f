//! The memory of one thread: blocks of state and scratch, used over and over.

use rtsl::{LaneBlock, LaneIndices};
use rtsl_bvh::{LANES, Lanes, RayPacket};
use rtsl_math::sampling::Sampler;

use super::light_samples::LightSamples;
use crate::compiled::calls::CallBlocks;
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::tracer::SearchMemory;
use crate::lanes::lane_streams::LaneStreams;
use crate::statistics::RayCounts;
use crate::tiles::{CameraMemory, LaneContext};

/// What one thread needs.
pub struct Workspace {
    /// Levels of shading not in use: one is in use for each ray whose shading spawned the next.
    free_levels: Vec<Level>,
    /// Packets of spawned rays not in use.
    free_spawned: Vec<Box<SpawnedPacket>>,
    /// Samples of lights not in use.
    free_light_samples: Option<Box<LightSamples>>,
    /// For searches.
    pub search: SearchMemory,
    /// For camera rays.
    pub camera: CameraMemory,
    /// For lights, which spawn nothing.
    pub light: CallBlocks,
    /// Rays traced so far.
    pub rays: RayCounts,
    scratch_arrays: usize,
    sampler: Sampler,
}

/// Rays that materials ask for, and what belongs to them. What lanes have that do not ask means nothing.
// Seven kilobytes: made anew for each request they were cleared and copied. That they are not, and that streams are set in
// vectors, takes 7 % off the instructions of a render of three spheres.
pub struct SpawnedPacket {
    /// The rays.
    pub rays: RayPacket,
    /// How much of their radiance is taken.
    pub weights: Lanes,
    /// What belongs to them besides.
    pub context: LaneContext,
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

/// The rays that were traced with these.
pub fn rays_of(workspaces: &[Workspace]) -> RayCounts {
    let mut sum = RayCounts::default();
    workspaces.iter().for_each(|workspace| sum += workspace.rays);
    sum
}

impl Workspace {
    /// Memory for rendering a scene.
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

    /// A packet that is not in use.
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

    /// Takes a packet back, to be used again.
    pub fn keep_spawned(&mut self, packet: Box<SpawnedPacket>) {
        self.free_spawned.push(packet);
    }

    /// A level that is not in use.
    pub fn take_level(&mut self) -> Level {
        self.free_levels.pop().unwrap_or_else(|| Level {
            blocks: CallBlocks::new(self.scratch_arrays),
            kept_scratch: LaneBlock::new(self.scratch_arrays, LANES),
            numbers: LaneIndices::new(LANES),
        })
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
