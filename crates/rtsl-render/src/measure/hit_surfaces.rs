//! The surfaces of a packet's hits, for measurements of rays that leave them.

use rtsl::QueryColumns;
use rtsl_bvh::{Hits, LANES, LaneMask, RayPacket, lanes_of};
use rtsl_math::sampling::NUMBERS_OF_SHAPES;

use crate::compiled::placed_objects::HitObject;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::integrate::memory::ThreadMemory;
use crate::integrate::rows::get;
use crate::integrate::shaded_surface::ShadedSurface;
use crate::integrate::shading_batch::ShadingBatch;
use crate::integrate::wavefront::{NO_INSTANCE, Path, PathHit};
use crate::lights::Weights;

/// The surfaces that the rays of a packet hit, by lanes.
pub type HitSurfaces = [Option<ShadedSurface>; LANES];

/// Computes the surfaces of the hits of a packet.
pub fn surfaces_of_hits(
    scene: &RenderScene,
    errors: &RuntimeErrors,
    batch: &mut ShadingBatch,
    rays: &RayPacket,
    lanes: LaneMask,
    hits: &Hits,
) -> HitSurfaces {
    let path =
        |lane: usize| Path { distance: hits.distance[lane], ..Path::from_ray(rays, lane, 0, 0) };
    let paths: [Path; LANES] = std::array::from_fn(path);
    let hit = |lane: usize| {
        let compiled = &scene.compiled;
        let hit = HitObject::of(&compiled.geometry, &compiled.items, hits.id[lane])?;
        let instance = hit.instance.unwrap_or(NO_INSTANCE);
        let HitObject { member, element, .. } = hit;
        Some(PathHit { path: lane as u32, object: member.object, element, instance })
    };
    let mut found: Vec<PathHit> = lanes_of(hits.lanes(lanes)).filter_map(hit).collect();
    let group = |hit: &PathHit| scene.objects[hit.object as usize].group;
    found.sort_by_key(group);
    let mut surfaces = [None; LANES];
    let groups = scene.full_groups();
    for hits in found.chunk_by(|one, other| group(one) == group(other)) {
        batch.load(&paths, hits, NUMBERS_OF_SHAPES);
        groups[group(&hits[0]) as usize].prepare_surfaces(scene, errors, batch);
        for (place, hit) in hits.iter().enumerate() {
            surfaces[hit.path as usize] = Some(ShadedSurface::of_lane(batch, place));
        }
    }
    surfaces
}

/// Samples a light for the surfaces of lanes. Returns for each lane the direction, and the length of a ray that ends
/// before the light; `None` where the sample is black.
pub fn light_rays(
    scene: &RenderScene,
    errors: &RuntimeErrors,
    memory: &mut ThreadMemory,
    light: u32,
    surfaces: &HitSurfaces,
    time: &[f32; LANES],
) -> [Option<([f32; 3], f32)>; LANES] {
    let lanes: Vec<usize> = (0..LANES).filter(|lane| surfaces[*lane].is_some()).collect();
    let ThreadMemory { batch, light: of_lights, .. } = memory;
    batch.count = lanes.len();
    let mut found = [None; LANES];
    for (place, lane) in lanes.iter().copied().enumerate() {
        let Some(surface) = &surfaces[lane] else { continue };
        let [geometric, shading] = surface.lit_normals(1.0);
        batch.surfaces.set_vector(QueryColumns::POINT, place, surface.point());
        batch.surfaces.set_vector(QueryColumns::GEOMETRIC_NORMAL, place, geometric);
        batch.surfaces.set_vector(QueryColumns::SHADING_NORMAL, place, shading);
        batch.surfaces.column_mut(QueryColumns::OFFSET)[place] = surface.offset;
        batch.side[place] = 1.0;
        batch.surfaces.column_mut(QueryColumns::TIME)[place] = time[lane];
        (batch.keys[place], batch.samples[place]) = (lane as u32, 0);
    }
    of_lights.sample_chosen(scene, errors, batch, &vec![light; lanes.len()], Weights::Divided);
    for (place, lane) in lanes.iter().enumerate() {
        let is_lit = get(&batch.light.color, place) != [0.0; 3];
        let ray = (get(&batch.light.direction, place), batch.light.distance[place]);
        found[*lane] = is_lit.then_some(ray);
    }
    found
}
