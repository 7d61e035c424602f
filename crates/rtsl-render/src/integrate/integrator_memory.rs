//! The memory of one thread for an integrator.

use std::cell::RefCell;

use rtsl::{LaneBlock, new_state};

use super::following::{FollowedPaths, MAX_WAITING};
use super::host::RayOfCall;
use super::integrator::Integrator;
use super::memory::ThreadMemory;
use super::output_columns::copy_outputs;
use super::rows::are_finite;
use super::staged::{Frames, Wave};
use super::suspect::report_suspect;
use super::waiting_paths::WaitingPaths;
use super::wavefront::Path;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::variables::{variables, vector};
use crate::film::features::{FeatureValues, FirstHit};
use crate::statistics::RayCounts;

/// The number of rays of a call.
pub(super) const RAYS_OF_CALL: usize = 64;

/// The memory of one thread for an integrator, for one level of recursion.
pub struct IntegratorMemory {
    /// The memory of stages, if the integrator runs as stages.
    pub(super) stages: Option<StageMemory>,
    /// The inputs and outputs of a call.
    pub(super) state: LaneBlock,
    pub(super) scratch: LaneBlock,
    /// The rays of the call.
    pub(super) rays: Vec<RayOfCall>,
    /// The memory of queries, which are about one ray.
    pub(crate) queries: Box<ThreadMemory>,
    /// The memory of further levels, when they are not in use.
    pub(super) free: RefCell<Vec<IntegratorMemory>>,
    /// Memory for paths that wait.
    spare: Vec<WaitingPaths>,
    /// Memory for those that run.
    pub(super) followed: FollowedPaths,
}

/// The memory of stages.
pub(super) struct StageMemory {
    pub(super) frames: Frames,
    pub(super) wave: Wave,
}

impl IntegratorMemory {
    /// Returns the numbers of rays traced since the last call.
    pub fn take_ray_counts(&mut self) -> RayCounts {
        std::mem::take(&mut self.queries.rays)
    }

    /// Allocates the memory for a scene.
    pub fn new(scene: &RenderScene) -> Self {
        let integrator = &scene.integrator;
        let stages = integrator.staged.as_ref().map(|staged| StageMemory {
            frames: Frames::new(scene.block_sizes(staged)),
            wave: Wave::default(),
        });
        IntegratorMemory {
            stages,
            state: new_state(RAYS_OF_CALL),
            scratch: integrator.program.new_scratch(RAYS_OF_CALL),
            rays: Vec::new(),
            queries: Box::new(ThreadMemory::for_queries(scene)),
            free: RefCell::default(),
            spare: Vec::new(),
            followed: FollowedPaths::default(),
        }
    }

    /// Returns memory for paths that wait, without any.
    pub(super) fn new_waiting(&mut self) -> WaitingPaths {
        self.spare.pop().unwrap_or_default()
    }

    /// Keeps memory for paths that wait, unless it is for far more than usual.
    pub(super) fn keep_waiting<const N: usize>(&mut self, used: [WaitingPaths; N]) {
        for mut waiting in used.into_iter().filter(|it| it.capacity() <= MAX_WAITING) {
            waiting.clear();
            self.spare.push(waiting);
        }
    }

    /// Copies the features of the last call, which was for these paths, to those of all paths, as far as they are kept.
    pub(super) fn keep_features(
        &self,
        integrator: &Integrator,
        active: &[u32],
        FeatureValues { first_hits, outputs }: &mut FeatureValues,
    ) {
        let lanes = active.iter().enumerate().map(|(lane, index)| (lane, *index as usize));
        // Paths of further rays have no features.
        if !first_hits.is_empty() {
            for (lane, index) in lanes.clone() {
                first_hits[index] = FirstHit::from(self.rays[lane].first_hit);
            }
        }
        if !outputs.is_empty() {
            let columns = integrator.outputs.iter().copied();
            copy_outputs(columns, &self.scratch, lanes, outputs);
        }
    }

    /// Adds the radiance of a lane of the last call to its path.
    pub(super) fn add_radiance(
        &self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        lane: usize,
        path: &mut Path,
    ) {
        let color = vector(&self.state, variables().sample_color, lane);
        let RayOfCall { lit, suspect, .. } = &self.rays[lane];
        for channel in 0..3 {
            path.radiance[channel] += path.throughput[channel] * (color[channel] + lit[channel]);
        }
        if !are_finite(&path.radiance) && !path.is_blamed {
            path.is_blamed = true;
            report_suspect(scene, errors, *suspect);
        }
    }
}
