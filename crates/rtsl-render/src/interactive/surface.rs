//! What is known of the surfaces that a packet hit, as materials read it: the methods of the
//! shapes in their own spaces, then everything in world space.

use rtsl::{Kernel, LaneBlock, Method};

use crate::acceleration::{HitId, Hits, LANES, LaneMask, RayPacket, lanes_of, moved_packet};
use crate::math::{Affine, dot, normalize_or, reciprocal};

use super::compiled::{CompiledScene, Object};
use super::host::LaneContext;
use super::intersection::set_rays;
use super::placed_objects::HitObject;
use super::shading::Tracer;
use super::variables::{number, set_number, set_vector, variables, vector};
use super::workspace::{KernelCall, Level};

/// Lanes that hit one object.
pub struct Run<'a> {
    /// The object.
    pub object: &'a Object,
    /// Its index among those of the scene.
    pub index: u32,
    /// Its instance, as maps from the group's space to the world's and back; `None` for the world.
    placement: Option<(Affine, Affine)>,
    /// The lanes.
    pub lanes: LaneMask,
}

/// The hits of a packet, object by object.
pub fn runs<'a>(scene: &'a CompiledScene, hits: &Hits, lanes: LaneMask) -> Vec<Run<'a>> {
    let mut rest = hits.lanes(lanes);
    let mut runs = Vec::new();
    while rest != 0 {
        let id = hits.id[rest.trailing_zeros() as usize];
        let lanes = lanes_of(rest).filter(|lane| hits.id[*lane] == id);
        let lanes = lanes.fold(0, |lanes, lane| lanes | 1 << lane);
        rest &= !lanes;
        runs.extend(run(scene, id, lanes));
    }
    runs
}

fn run<'a>(scene: &'a CompiledScene, id: HitId, lanes: LaneMask) -> Option<Run<'a>> {
    let HitObject { object, instance } = HitObject::of(&scene.geometry, &scene.items, id)?;
    let placement = match instance {
        None => None,
        Some(instance) => {
            let inverse = scene.geometry.instances.get(instance as usize)?.inverse;
            Some((*scene.instance_transforms.get(instance as usize)?, inverse))
        }
    };
    Some(Run { object: &scene.objects[object as usize], index: object, placement, lanes })
}

/// Runs the methods of one object for its hits and leaves in the state what materials read,
/// and in `context` what lights read.
pub fn prepare(
    tracer: &Tracer<'_>,
    run: &Run<'_>,
    rays: &RayPacket,
    hits: &Hits,
    level: &mut Level,
    context: &mut LaneContext,
) {
    let Tracer { scene, problems } = tracer;
    let needs = scene.needs(run.object);
    if let Some(kernel) = scene.shader(&run.object.primitive).hit_kernel() {
        find_again(tracer, kernel, run, rays, level, context);
    }
    let Level { blocks, kept_scratch } = level;
    set_local_hits(run, rays, hits, &mut blocks.state);
    let mut methods = vec![Method::ComputeNormal];
    if needs.coordinates || needs.derivatives {
        methods.push(Method::ComputeTextureCoordinates);
    }
    let mut has_derivatives = false;
    if needs.derivatives {
        methods.push(Method::ComputeDerivatives);
        let shader = scene.shader(&run.object.primitive);
        has_derivatives = shader.kernel(Method::ComputeDerivatives).is_some();
    }
    for method in methods {
        if let Some(call) = scene.call(&run.object.primitive, method, problems) {
            blocks.call(&call, run.lanes, Some(&mut *kept_scratch), context);
        }
        if method == Method::ComputeNormal {
            normalize_normals(run.lanes, &mut blocks.state);
        }
    }
    for lane in lanes_of(run.lanes) {
        to_world(run, rays, hits, lane, &mut blocks.state, context);
        if !has_derivatives {
            set_tangents(lane, &mut blocks.state, context);
        }
    }
}

/// Runs `intersect` once more, for the scratch that it leaves. It answers as it did in the traversal,
/// since it is given the same.
fn find_again(
    tracer: &Tracer<'_>,
    kernel: &Kernel,
    run: &Run<'_>,
    rays: &RayPacket,
    level: &mut Level,
    context: &mut LaneContext,
) {
    let Level { blocks, kept_scratch } = level;
    set_local_rays(run, rays, &mut blocks.state);
    for lane in lanes_of(run.lanes) {
        set_number(&mut blocks.state, variables().hit_distance, lane, rays.limit[lane]);
    }
    let instance = &run.object.primitive;
    let class = &tracer.scene.shader(instance).program.class().name;
    let method = Method::Intersect;
    let call = KernelCall { kernel, method, instance, class, problems: tracer.problems };
    blocks.call(&call, run.lanes, Some(kept_scratch), context);
}

fn set_local_rays(run: &Run<'_>, rays: &RayPacket, state: &mut LaneBlock) {
    match &run.placement {
        None => set_rays(state, &run.object.inverse, rays, run.lanes),
        Some((_, inverse)) => {
            let rays = moved_packet(rays, inverse);
            set_rays(state, &run.object.inverse, &rays, run.lanes);
        }
    }
}

fn set_local_hits(run: &Run<'_>, rays: &RayPacket, hits: &Hits, state: &mut LaneBlock) {
    let v = variables();
    set_local_rays(run, rays, state);
    for lane in lanes_of(run.lanes) {
        let t = hits.distance[lane];
        let direction = vector(state, v.ray_direction, lane);
        let point = along(vector(state, v.ray_origin, lane), direction, t);
        set_number(state, v.hit_distance, lane, t);
        set_vector(state, v.hit_point, lane, point);
        // What stands where the class lacks a method.
        let facing = direction.map(|x| -x);
        set_vector(state, v.geometric_normal, lane, facing);
        set_vector(state, v.shading_normal, lane, facing);
        set_vector(state, v.texture_uvw, lane, point);
        for (variable, value) in [(v.dsdu, 1.0), (v.dsdv, 0.0), (v.dtdu, 0.0), (v.dtdv, 1.0)] {
            set_number(state, variable, lane, value);
        }
        for variable in [v.texture_uv, v.texture_uv + 1, v.du, v.dv] {
            set_number(state, variable, lane, 0.0);
        }
    }
}

fn along(origin: [f32; 3], direction: [f32; 3], t: f32) -> [f32; 3] {
    std::array::from_fn(|axis| origin[axis] + t * direction[axis])
}

fn normalize_normals(lanes: LaneMask, state: &mut LaneBlock) {
    let v = variables();
    for lane in lanes_of(lanes) {
        let geometric = normalize_or(vector(state, v.geometric_normal, lane), [0.0, 0.0, 1.0]);
        let shading = normalize_or(vector(state, v.shading_normal, lane), geometric);
        set_vector(state, v.geometric_normal, lane, geometric);
        set_vector(state, v.shading_normal, lane, shading);
    }
}

fn to_world(
    run: &Run<'_>,
    rays: &RayPacket,
    hits: &Hits,
    lane: usize,
    state: &mut LaneBlock,
    context: &mut LaneContext,
) {
    let v = variables();
    let (origin, direction) = (rays.origin_of(lane), rays.direction_of(lane));
    set_vector(state, v.ray_origin, lane, origin);
    set_vector(state, v.ray_direction, lane, direction);
    set_vector(state, v.inverse_ray_direction, lane, reciprocal(direction));
    set_vector(state, v.hit_point, lane, along(origin, direction, hits.distance[lane]));
    let mut geometric = [0.0, 0.0, 1.0];
    for (variable, is_geometric) in [(v.geometric_normal, true), (v.shading_normal, false)] {
        let mut normal = run.object.normal_to_group(vector(state, variable, lane));
        if let Some((_, inverse)) = &run.placement {
            normal = inverse.transposed_vector(normal);
        }
        let normal = normalize_or(normal, geometric);
        set_vector(state, variable, lane, normal);
        if is_geometric {
            geometric = normal;
            context.set_geometric_normal(lane, normal);
            context.set_seen_from_behind(lane, dot(direction, normal) > 0.0);
        } else {
            context.set_shading_normal(lane, normal);
        }
    }
    for variable in [v.dpdu, v.dpdv] {
        let mut tangent = run.object.forward.vector(vector(state, variable, lane));
        if let Some((forward, _)) = &run.placement {
            tangent = forward.vector(tangent);
        }
        set_vector(state, variable, lane, tangent);
    }
}

/// Tangents of a class that computes none: any frame of the normal.
fn set_tangents(lane: usize, state: &mut LaneBlock, context: &LaneContext) {
    let v = variables();
    let n = context.geometric_normal(lane);
    let least = if n[0].abs() <= n[1].abs() && n[0].abs() <= n[2].abs() {
        [1.0, 0.0, 0.0]
    } else if n[1].abs() <= n[2].abs() {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let along = dot(n, least);
    let across = std::array::from_fn(|axis| least[axis] - along * n[axis]);
    let first = normalize_or(across, [1.0, 0.0, 0.0]);
    let second = [
        n[1] * first[2] - n[2] * first[1],
        n[2] * first[0] - n[0] * first[2],
        n[0] * first[1] - n[1] * first[0],
    ];
    set_vector(state, v.dpdu, lane, first);
    set_vector(state, v.dpdv, lane, second);
}

/// The colour of each lane that a call left at component `first`, added to `sum`.
pub fn add_colors(state: &LaneBlock, first: usize, lanes: LaneMask, sum: &mut [[f32; LANES]; 3]) {
    for (channel, sum) in sum.iter_mut().enumerate() {
        for lane in lanes_of(lanes) {
            sum[lane] += number(state, first + channel, lane);
        }
    }
}
