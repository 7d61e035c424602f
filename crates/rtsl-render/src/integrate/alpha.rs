//! Alpha textures: rays pass a surface with alpha 0, stop at one with alpha 1, and stop at random for values between
//! them.

use rtsl::{Method, QueryColumns};
use rtsl_math::sampling::NUMBERS_OF_SHAPES;

use super::random_numbers::lone_random_number;
use super::rows::BATCH_LANES;
use super::shading_batch::ShadingBatch;
use super::wavefront::{PathHit, Wavefront};
use crate::compiled::calls::Callee;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::surface_group::SurfaceGroup;
use crate::compiled::variables::variables;

/// Selects the random numbers that decide if a ray passes. Each hit along a path has a different one.
const NUMBERS_OF_ALPHA: u32 = 0x106;

/// Selects the random numbers of alpha textures.
const NUMBERS_OF_TEXTURES: u32 = 0x109;

impl Wavefront {
    /// Removes the hits from `first` on that rays pass and continues these rays behind them.
    pub fn pass_transparent_hits(
        &mut self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        first: usize,
        batch: &mut ShadingBatch,
    ) {
        let mut candidates = self.hits.split_off(first);
        let group = |hit: &PathHit| scene.objects[hit.object as usize].group as usize;
        let is_solid = |hit: &mut PathHit| scene.groups[group(hit)].alpha.is_none();
        self.hits.extend(candidates.extract_if(.., is_solid));
        candidates.sort_by_key(group);
        for hits in candidates.chunk_by(|one, other| group(one) == group(other)) {
            for hits in hits.chunks(BATCH_LANES) {
                self.cut(&scene.groups[group(&hits[0])], hits, scene, errors, batch);
            }
        }
    }

    fn cut(
        &mut self,
        group: &SurfaceGroup,
        hits: &[PathHit],
        scene: &RenderScene,
        errors: &RuntimeErrors,
        batch: &mut ShadingBatch,
    ) {
        batch.load(&self.paths, hits, NUMBERS_OF_SHAPES);
        group.prepare_surfaces(scene, errors, batch);
        // Each hit along the path has a different sequence, as below.
        let distances = batch.surfaces.column(QueryColumns::DISTANCE);
        for (key, distance) in batch.keys.iter_mut().zip(distances) {
            *key ^= distance.to_bits();
        }
        batch.start_random_numbers(NUMBERS_OF_TEXTURES);
        let Some((kernel, (class, of))) = group.alpha.as_ref().zip(group.key.alpha) else {
            return;
        };
        let textures = &scene.alpha[class];
        let name = &textures.program.class().name;
        let callee = Callee { class: name, method: Method::Lookup, errors };
        let ShadingBatch { count, state, scratch, alpha, random, .. } = batch;
        let instances = of.instances(&textures.objects, alpha);
        callee.call_for_first(kernel, *count, instances, state, scratch, random);
        let values = batch.state.floats(variables().float_texture_value);
        for (hit, value) in hits.iter().zip(values) {
            let path = &mut self.paths[hit.path as usize];
            let key = path.key ^ path.distance.to_bits();
            // NaN is opaque.
            if *value <= lone_random_number(key, NUMBERS_OF_ALPHA, path.sample) {
                path.epsilon = path.distance;
                path.distance = path.limit;
                self.active.push(hit.path);
            } else {
                self.hits.push(*hit);
            }
        }
    }
}
