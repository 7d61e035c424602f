//! AOVs of a tile: the hits of its camera rays, and the time for its samples. The camera rays of the image are traced
//! again, so that rendering the image is not affected.

use std::time::Duration;

use rtsl_bvh::{Hits, LANES, LaneMask, RayPacket, lanes_of};
use rtsl_image::Aov;
use rtsl_math::dot;

use super::surface::{hit_groups, prepare};
use super::workspace::Workspace;
use crate::compiled::object_classes::ObjectClasses;
use crate::compiled::tracer::Tracer;
use crate::compiled::work_counts::WorkCounts;
use crate::statistics::LaneUse;
use crate::tiles::{CameraRays, Tile, camera_rays};

/// Sums over the samples of a tile.
pub struct TileAovs {
    distance: [f32; LANES],
    normal: [[f32; 3]; LANES],
    object: [f32; LANES],
    class: [f32; LANES],
    hits: [u32; LANES],
    visited: [u32; LANES],
    samples: u32,
}

/// The cost of a tile's samples.
#[derive(Clone, Copy, Default)]
pub struct TileWork {
    /// The time.
    pub time: Duration,
    /// The use of lanes in calls, if it was counted.
    pub lane_use: LaneUse,
}

/// The values of a tile.
pub type TileValues = [[f32; 3]; LANES];

impl TileAovs {
    /// Without samples.
    pub fn new() -> Self {
        TileAovs {
            distance: [0.0; LANES],
            normal: [[0.0; 3]; LANES],
            object: [-1.0; LANES],
            class: [-1.0; LANES],
            hits: [0; LANES],
            visited: [0; LANES],
            samples: 0,
        }
    }

    /// Traces the camera rays of a sample.
    pub fn add(
        &mut self,
        tracer: &Tracer<'_>,
        workspace: &mut Workspace,
        classes: &ObjectClasses,
        tile: Tile,
        sample: u32,
    ) {
        let settings = &tracer.scene.settings;
        let mut camera = camera_rays(tracer, &mut workspace.camera, tile, sample);
        let CameraRays { rays, context, .. } = &mut *camera;
        let mut level = workspace.take_level();
        let lanes = tile.lanes(settings.width, settings.height);
        let (hits, visited) = counted_hits(tracer, workspace, rays, lanes);
        for (sum, visited) in self.visited.iter_mut().zip(visited) {
            *sum += visited;
        }
        for group in &hit_groups(tracer.scene, &hits, lanes) {
            prepare(tracer, group, rays, &hits, &mut level, context);
            for lane in lanes_of(group.lanes) {
                let (direction, normal) = (rays.direction_of(lane), context.shading_normal(lane));
                self.distance[lane] += hits.distance[lane] * dot(direction, direction).sqrt();
                (0..3).for_each(|axis| self.normal[lane][axis] += normal[axis]);
                self.hits[lane] += 1;
                if self.samples == 0 {
                    self.object[lane] = group.index as f32;
                    self.class[lane] = classes.index(group.object);
                }
            }
        }
        workspace.return_level(level);
        workspace.camera.keep(camera);
        self.samples += 1;
    }

    /// Returns the values of a tile whose samples had this cost.
    pub fn values(&self, aov: Aov, work: TileWork, samples: u32) -> TileValues {
        let time = work.time.as_nanos() as f32 / (samples.max(1) as usize * LANES) as f32;
        let lanes = work.lane_use.part().unwrap_or(0.0);
        std::array::from_fn(|lane| match aov {
            // Avoids 0 / 0 without hits.
            Aov::Distance if self.hits[lane] == 0 => [f32::INFINITY; 3],
            Aov::Distance => [self.distance[lane] / self.hits[lane] as f32; 3],
            Aov::Normal => self.normal[lane].map(|x| x / self.samples.max(1) as f32),
            Aov::Object => [self.object[lane]; 3],
            Aov::Class => [self.class[lane]; 3],
            Aov::Samples => [samples as f32; 3],
            // The renderer rejects AOVs that it does not support.
            Aov::Albedo | Aov::Variance => [0.0; 3],
            Aov::Time => [time; 3],
            Aov::Nodes => [self.visited[lane] as f32 / self.samples.max(1) as f32; 3],
            Aov::Lanes => [lanes; 3],
        })
    }
}

/// Returns the number of nodes and leaves that the camera rays of a sample visit.
pub fn visits_of_sample(
    tracer: &Tracer<'_>,
    workspace: &mut Workspace,
    tile: Tile,
    sample: u32,
) -> [u32; LANES] {
    let settings = &tracer.scene.settings;
    let lanes = tile.lanes(settings.width, settings.height);
    let camera = camera_rays(tracer, &mut workspace.camera, tile, sample);
    let (_, visited) = counted_hits(tracer, workspace, &camera.rays, lanes);
    workspace.camera.keep(camera);
    visited
}

/// Finds the closest hits and counts, for each lane, the nodes and leaves that its ray visits.
fn counted_hits(
    tracer: &Tracer<'_>,
    workspace: &mut Workspace,
    rays: &RayPacket,
    lanes: LaneMask,
) -> (Hits, [u32; LANES]) {
    workspace.search.counts = Some(WorkCounts::new(tracer.scene.width));
    let hits = tracer.nearest(&mut workspace.search, rays, lanes);
    let counts = workspace.search.counts.take();
    (hits, counts.map_or([0; LANES], |counts| counts.visited))
}
