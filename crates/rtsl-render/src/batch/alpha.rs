//! Shapes that textures cut out: where a texture is 0 rays pass, where it is 1 they end, and in between by
//! chance.

use rtsl::Method;

use super::numbers::lone_number;
use super::scatter::NUMBERS_OF_SHAPES;
use super::shading_batch::{BATCH_LANES, Callee, ShadingBatch};
use super::surface::ChunkSurfaces;
use super::surface_group::SurfaceGroup;
use super::tracer::PathTracer;
use super::wavefront::{PathHit, Wavefront};
use crate::compiled::variables::variables;

/// What a path's numbers are for: whether it passes. Each hit on its way has one of its own.
const NUMBERS_OF_CUT_OUTS: u32 = 0x106;

/// What the numbers of textures that cut out are for.
const NUMBERS_OF_TEXTURES: u32 = 0x109;

impl PathTracer<'_> {
    /// Takes back those of a wave's hits from `first` on that rays pass: these rays are active again, from there on.
    pub fn pass_cut_outs(&self, wave: &mut Wavefront, first: usize, chunk: &mut ShadingBatch) {
        let mut candidates = wave.hits.split_off(first);
        let is_solid =
            |(group, _): &mut (u32, PathHit)| self.scene.groups[*group as usize].cut_out.is_none();
        wave.hits.extend(candidates.extract_if(.., is_solid));
        candidates.sort_by_key(|(group, _)| *group);
        for hits in candidates.chunk_by(|one, other| one.0 == other.0) {
            let group = &self.scene.groups[hits[0].0 as usize];
            for hits in hits.chunks(BATCH_LANES) {
                self.cut(group, hits, wave, chunk);
            }
        }
    }

    fn cut(
        &self,
        group: &SurfaceGroup,
        hits: &[(u32, PathHit)],
        wave: &mut Wavefront,
        chunk: &mut ShadingBatch,
    ) {
        let only: Vec<PathHit> = hits.iter().map(|(_, hit)| *hit).collect();
        chunk.load(&wave.paths, &only, NUMBERS_OF_SHAPES);
        ChunkSurfaces::new(self, group, chunk).prepare(chunk);
        // Each hit on the way has its own, as below.
        for (key, distance) in chunk.keys.iter_mut().zip(&chunk.distance) {
            *key ^= distance.to_bits();
        }
        chunk.start_numbers(NUMBERS_OF_TEXTURES);
        let Some((kernel, (class, of))) = group.cut_out.as_ref().zip(group.key.cut_out) else {
            return;
        };
        let textures = &self.scene.alpha.classes[class as usize];
        let name = &textures.program.class().name;
        let callee = Callee { class: name, method: Method::Lookup, problems: self.problems };
        let ShadingBatch { count, state, scratch, alpha, numbers, .. } = chunk;
        let instances = of.instances(&textures.objects, alpha);
        callee.call(kernel, *count, instances, (state, scratch), None, numbers);
        let values = chunk.state.floats(variables().float_texture_value);
        for ((group, hit), value) in hits.iter().zip(values) {
            let path = &mut wave.paths[hit.path as usize];
            let key = path.key ^ path.distance.to_bits();
            // What is no number is solid.
            if *value <= lone_number(key, NUMBERS_OF_CUT_OUTS, path.sample) {
                path.epsilon = path.distance;
                path.distance = path.limit;
                wave.active.push(hit.path);
            } else {
                wave.hits.push((*group, *hit));
            }
        }
    }
}
