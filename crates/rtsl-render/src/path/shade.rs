//! Materials that have only `shade`: it is called as in the interactive renderer, and its rays are traced as paths.

use std::cell::RefCell;

use rtsl_bvh::{HitId, Hits, LANES, LaneMask, RayPacket, lanes_of};
use rtsl_math::sampling::hash;

use super::memory::{BatchMemory, ShadeMemory};
use super::path_tracer::PathTracer;
use super::wavefront::{NO_INSTANCE, Path, PathHit};
use crate::compiled::tracer::Tracer;
use crate::lanes::lane_streams::LaneStreams;
use crate::statistics::RayCounts;
use crate::tiles::LaneContext;
use crate::whitted::{Emitters, PacketColors, ShadingHost, SpawnedRays, Workspace, shade_hits};

/// Selects the random numbers of `shade` and of its rays' paths.
const NUMBERS_OF_SHADE: u32 = 0x107;

impl PathTracer<'_> {
    /// Adds the radiance of hits whose materials have only `shade`, after `depth` other surfaces. Returns the number of
    /// rays.
    pub fn add_shading(
        &self,
        mut hits: Vec<PathHit>,
        depth: u32,
        paths: &mut [Path],
        memory: &mut ShadeMemory,
    ) -> RayCounts {
        // The lanes of a packet have one sample index.
        hits.sort_by_key(|hit| paths[hit.path as usize].sample);
        let sample = |hit: &PathHit| paths[hit.path as usize].sample;
        let packets: Vec<&[PathHit]> = hits
            .chunk_by(|one, other| sample(one) == sample(other))
            .flat_map(|hits| hits.chunks(LANES))
            .collect();
        for hits in packets {
            let sample = hits.first().map_or(0, |hit| paths[hit.path as usize].sample);
            let ShadeMemory { workspace, free } = &mut *memory;
            let spawned = SpawnedPaths { tracer: self, sample, free };
            let colors = self.shading(hits, depth, paths, workspace, &spawned);
            for (lane, hit) in hits.iter().enumerate() {
                let path = &mut paths[hit.path as usize];
                for (channel, colors) in colors.iter().enumerate() {
                    path.radiance[channel] += path.throughput[channel] * colors[lane];
                }
            }
        }
        std::mem::take(&mut memory.workspace.rays)
    }

    /// Calls `shade` for hits of one sample, at most as many as a packet has lanes. `spawned` traces its rays.
    pub fn shading(
        &self,
        hits: &[PathHit],
        depth: u32,
        paths: &[Path],
        workspace: &mut Workspace,
        spawned: &dyn SpawnedRays,
    ) -> PacketColors {
        let scene = &self.scene.compiled;
        let mut rays = RayPacket::default();
        let mut keys = [0; LANES];
        for (lane, hit) in hits.iter().enumerate() {
            let path = &paths[hit.path as usize];
            rays.set(lane, path.origin, path.direction);
            rays.epsilon[lane] = path.epsilon;
            rays.limit[lane] = path.limit;
            rays.time[lane] = path.time;
            keys[lane] = hash(path.key, NUMBERS_OF_SHADE);
        }
        let mut found = Hits::new(&rays);
        for (lane, hit) in hits.iter().enumerate() {
            found.set(lane, paths[hit.path as usize].distance, self.id_of(hit));
        }
        let sample = hits.first().map_or(0, |hit| paths[hit.path as usize].sample);
        let streams = LaneStreams::new(keys, sample);
        let mut context = LaneContext::new(scene.settings.sampler, streams, rays.time);
        let tracer = Tracer { scene, errors: self.errors };
        let context = &mut context;
        let mut host = ShadingHost { tracer: &tracer, workspace, context, depth, spawned };
        let mut colors = [[0.0; LANES]; 3];
        let lanes = LaneMask::MAX >> (LANES - hits.len());
        shade_hits(&rays, &found, lanes, &mut host, Emitters::LeftOut, &mut colors);
        colors
    }

    /// The id of a hit in searches.
    fn id_of(&self, hit: &PathHit) -> HitId {
        let item = self.scene.objects[hit.object as usize].first_item + hit.element;
        let first_instance = self.scene.compiled.geometry.first_instance;
        match hit.instance {
            NO_INSTANCE => HitId::new(item, 0),
            instance => HitId::new(first_instance + instance, item),
        }
    }
}

/// Traces the rays of `shade` as paths.
struct SpawnedPaths<'a> {
    tracer: &'a PathTracer<'a>,
    sample: u32,
    free: &'a RefCell<Vec<BatchMemory>>,
}

impl SpawnedRays for SpawnedPaths<'_> {
    fn radiance(
        &self,
        _: &Tracer<'_>,
        workspace: &mut Workspace,
        rays: &RayPacket,
        lanes: LaneMask,
        context: &mut LaneContext,
        depth: u32,
    ) -> PacketColors {
        let taken = self.free.borrow_mut().pop();
        let mut memory = taken.unwrap_or_else(|| BatchMemory::new(self.tracer.scene));
        let wavefront = &mut memory.wavefront;
        wavefront.paths.clear();
        wavefront.paths.extend(
            (0..LANES)
                .map(|lane| Path::from_ray(rays, lane, context.streams.keys()[lane], self.sample)),
        );
        wavefront.features.clear();
        wavefront.active.clear();
        wavefront.active.extend(lanes_of(lanes).map(|lane| lane as u32));
        let inner = PathTracer { with_features: false, ..*self.tracer };
        inner.trace_wavefront(&mut memory, depth);
        let colors = std::array::from_fn(|channel| {
            std::array::from_fn(|lane| memory.wavefront.paths[lane].radiance[channel])
        });
        let mut rays = std::mem::take(&mut memory.rays);
        // The spawning kernel has counted these rays.
        rays.traced = rays.traced.saturating_sub(u64::from(lanes.count_ones()));
        workspace.rays += rays;
        self.free.borrow_mut().push(memory);
        colors
    }
}
