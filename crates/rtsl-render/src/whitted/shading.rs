//! The radiance along the rays of a packet: closest hits, surfaces, materials, and the emission of environment lights
//! for rays that leave the scene.

use fearless_simd::{Level as SimdLevel, Simd, dispatch};
use rtsl::{LaneBlock, Method};
use rtsl_bvh::{Hits, LANES, LaneMask, RayPacket};

use super::host::ShadingHost;
use super::surface::{HitGroup, hit_groups, prepare};
use super::workspace::{Level, Workspace};
use crate::compiled::calls::CallBlocks;
use crate::compiled::light::Light;
use crate::compiled::tracer::Tracer;
use crate::compiled::variables::variables;
use crate::lanes::eight::{LaneVectors, eights, eights_alone, is_finite};
use crate::lanes::surface_offset::sums;
use crate::tiles::LaneContext;

/// A colour for each lane, channel by channel.
pub type PacketColors = LaneVectors;

/// Returns the radiance along the rays of `lanes`, whose depth is `depth`. Hits of secondary rays are shaded
/// recursively.
pub fn radiance(
    tracer: &Tracer<'_>,
    workspace: &mut Workspace,
    rays: &RayPacket,
    lanes: LaneMask,
    context: &mut LaneContext,
    depth: u32,
) -> PacketColors {
    let mut colors = [[0.0; LANES]; 3];
    let hits = tracer.nearest(&mut workspace.search, rays, lanes);
    add_sky(tracer, workspace, rays, lanes & !hits.lanes(lanes), context, &mut colors);
    let mut host = ShadingHost { tracer, workspace, context, depth };
    shade_hits(rays, &hits, lanes, &mut host, &mut colors);
    colors
}

/// Shades the hits of the rays of `lanes`.
fn shade_hits(
    rays: &RayPacket,
    hits: &Hits,
    lanes: LaneMask,
    host: &mut ShadingHost<'_>,
    colors: &mut PacketColors,
) {
    let tracer = host.tracer;
    let mut level = host.workspace.take_level();
    let groups = hit_groups(tracer.scene, hits, lanes);
    for group in &groups {
        prepare(tracer, group, rays, hits, &mut level, host.context);
    }
    level.set_depth(host.depth);
    for shading in shadings(&groups) {
        shade(&shading, hits, &mut level, host, colors);
    }
    host.workspace.return_level(level);
}

/// Adds the emission of lights towards rays that leave the scene.
fn add_sky(
    tracer: &Tracer<'_>,
    workspace: &mut Workspace,
    rays: &RayPacket,
    lanes: LaneMask,
    context: &mut LaneContext,
    colors: &mut PacketColors,
) {
    if lanes == 0 {
        return;
    }
    let v = variables();
    let blocks = &mut workspace.light;
    for light in &tracer.scene.lights {
        let call = tracer.scene.call(&light.instance, Method::Emission, tracer.errors);
        let Some(call) = call else { continue };
        dispatch!(SimdLevel::new(), simd => set_sky_rays(simd, light, rays, lanes, blocks));
        blocks.call(&call, lanes, None, context);
        call.report_not_finite(add_colors(&blocks.state, v.emission_color, lanes, colors));
    }
}

/// Sets the inputs of a light's `emission` for rays that leave the scene.
#[inline(always)]
fn set_sky_rays<S: Simd>(
    simd: S,
    light: &Light,
    rays: &RayPacket,
    lanes: LaneMask,
    blocks: &mut CallBlocks,
) {
    let v = variables();
    for eight in eights_alone(simd, lanes) {
        let up = eight.splat_vector([0.0, 0.0, 1.0]);
        let direction = eight.vector(&light.inverse, &eight.vectors(&rays.direction));
        let origin = eight.point(&light.inverse, &eight.vectors(&rays.origin));
        eight.store_vectors(&mut blocks.state, v.ray_origin, &origin);
        eight.store_vectors(
            &mut blocks.state,
            v.ray_direction,
            &eight.normalized_or(&direction, &up),
        );
        eight.store(&mut blocks.state, v.time_seed, eight.floats(&rays.time));
    }
}

/// Adds the colour at component `first` of the state to `sum`. Returns the lanes whose colours are not finite.
fn add_colors(
    state: &LaneBlock,
    first: usize,
    lanes: LaneMask,
    sum: &mut PacketColors,
) -> LaneMask {
    dispatch!(SimdLevel::new(), simd => add_in_vectors(simd, state, first, lanes, sum))
}

#[inline(always)]
fn add_in_vectors<S: Simd>(
    simd: S,
    state: &LaneBlock,
    first: usize,
    lanes: LaneMask,
    sum: &mut PacketColors,
) -> LaneMask {
    let mut lost = 0;
    for eight in eights(simd, lanes) {
        let (old, new) = (eight.vectors(sum), eight.load_vectors(state, first));
        eight.blend_vectors(&sums(&old, &new), sum);
        lost |= eight.lanes(!is_finite(&new));
    }
    lost
}

/// A call of a material for the lanes that it shades.
struct Shading<'a> {
    what: Surface<'a>,
    method: Method,
    lanes: LaneMask,
}

/// The shader of a surface.
#[derive(Clone, Copy)]
enum Surface<'a> {
    /// A material, by its index.
    Material(u32),
    /// A shape that is its own material.
    Own(&'a HitGroup<'a>),
}

impl Surface<'_> {
    fn is(&self, other: &Surface<'_>) -> bool {
        match (self, other) {
            (Surface::Material(one), Surface::Material(other)) => one == other,
            (Surface::Own(one), Surface::Own(other)) => std::ptr::eq(*one, *other),
            (Surface::Material(_), Surface::Own(_)) | (Surface::Own(_), Surface::Material(_)) => {
                false
            }
        }
    }
}

/// Groups lanes by shader: one call for each material.
fn shadings<'a>(groups: &'a [HitGroup<'a>]) -> Vec<Shading<'a>> {
    let mut shadings: Vec<Shading<'a>> = Vec::new();
    let mut add = |what: Surface<'a>, method: Method, lanes: LaneMask| {
        let same = |shading: &&mut Shading<'a>| shading.method == method && shading.what.is(&what);
        match shadings.iter_mut().find(same) {
            Some(shading) => shading.lanes |= lanes,
            None => shadings.push(Shading { what, method, lanes }),
        }
    };
    for group in groups {
        let surface = match group.object.material {
            Some(material) => Surface::Material(material),
            None => Surface::Own(group),
        };
        add(surface, Method::Shade, group.lanes);
        if let Some(emitter) = group.object.emitter {
            add(Surface::Material(emitter), Method::Emission, group.lanes);
        }
    }
    shadings
}

fn shade(
    shading: &Shading<'_>,
    hits: &Hits,
    level: &mut Level,
    host: &mut ShadingHost<'_>,
    colors: &mut PacketColors,
) {
    let tracer = host.tracer;
    // A material that only emits has no `shade`.
    let methods = match shading.method {
        Method::Shade => [Method::Shade, Method::Emission],
        other => [other, other],
    };
    if let Surface::Own(group) = shading.what {
        group.set_indices(tracer.scene, hits, &mut level.indices);
    }
    let Level { blocks, kept_scratch, indices } = level;
    let call = methods.into_iter().find_map(|method| match shading.what {
        Surface::Material(index) => {
            let material = &tracer.scene.materials[index as usize];
            tracer.scene.call(material, method, tracer.errors)
        }
        Surface::Own(group) => group.call(tracer, method, indices),
    });
    let Some(call) = call else { return };
    if let Some(counts) = &mut host.workspace.search.counts {
        counts.add_call(shading.lanes);
    }
    let v = variables();
    let result =
        if call.callee.method == Method::Shade { v.sample_color } else { v.emission_color };
    match shading.what {
        // The shape's own methods read the scratch of its `intersect`.
        Surface::Own(_) => blocks.call(&call, shading.lanes, Some(kept_scratch), host),
        Surface::Material(_) => {
            blocks.clear_scratch(call.scratch_arrays);
            blocks.call(&call, shading.lanes, None, host)
        }
    };
    let not_finite = add_colors(&blocks.state, result, shading.lanes, colors);
    call.report_not_finite(host.context.lit_by_finite(not_finite));
}
