//! Calls of `shade`, as in the interactive renderer.

use rtsl_bvh::{HitId, Hits, LANES, LaneMask, RayPacket};
use rtsl_math::sampling::hash;

use super::path_tracer::PathTracer;
use super::wavefront::{NO_INSTANCE, Path, PathHit};
use crate::compiled::tracer::Tracer;
use crate::lanes::lane_streams::LaneStreams;
use crate::tiles::LaneContext;
use crate::whitted::{Emitters, PacketColors, ShadingHost, SpawnedRays, Workspace, shade_hits};

/// Selects the random numbers of `shade` and of its rays' paths.
const NUMBERS_OF_SHADE: u32 = 0x107;

impl PathTracer<'_> {
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
