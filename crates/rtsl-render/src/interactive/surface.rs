//! What is known of the surfaces that a packet hit, as materials read it: the methods of the
//! shapes in their own spaces, then everything in world space.

use rtsl::{Instances, Kernel, LaneBlock, LaneIndices, Method};

use crate::acceleration::{HitId, Hits, LANES, LaneMask, RayPacket, lanes_of, moved_packet};
use crate::math::{Affine, dot, normalize_or, reciprocal};

use super::compiled::{CompiledScene, Object};
use super::host::LaneContext;
use super::intersection::set_rays;
use super::object_class::ObjectClass;
use super::placed_objects::HitObject;
use super::shading::Tracer;
use super::variables::{number, set_number, set_vector, variables, vector};
use super::workspace::{KernelCall, Level};

/// Lanes that hit one object, whichever of its elements.
pub struct Run<'a> {
    /// The object.
    pub object: &'a Object,
    /// Its index among those of the scene.
    pub index: u32,
    /// The class that the traversal found it in.
    pub class: &'a ObjectClass,
    /// Which object it is, and by which instance it is placed.
    hit: HitObject,
    /// That instance, as maps from the group's space to the world's and back; `None` for the world.
    placement: Option<(Affine, Affine)>,
    /// The lanes.
    pub lanes: LaneMask,
}

/// The hits of a packet, object by object.
pub fn runs<'a>(scene: &'a CompiledScene, hits: &Hits, lanes: LaneMask) -> Vec<Run<'a>> {
    let mut rest = hits.lanes(lanes);
    let mut runs = Vec::new();
    while rest != 0 {
        let first = rest.trailing_zeros() as usize;
        rest &= rest - 1;
        let Some(mut run) = run(scene, hits.id[first], 1 << first) else { continue };
        for lane in lanes_of(rest) {
            let id = hits.id[lane];
            if id == hits.id[first] || run.class.has_elements() && run.has_element(scene, id) {
                run.lanes |= 1 << lane;
            }
        }
        rest &= !run.lanes;
        runs.push(run);
    }
    runs
}

fn run<'a>(scene: &'a CompiledScene, id: HitId, lanes: LaneMask) -> Option<Run<'a>> {
    let hit = HitObject::of(&scene.geometry, &scene.items, id)?;
    let placement = match hit.instance {
        None => None,
        Some(instance) => {
            let inverse = scene.geometry.instances.get(instance as usize)?.inverse;
            Some((*scene.instance_transforms.get(instance as usize)?, inverse))
        }
    };
    let index = hit.member.object;
    let object = &scene.objects[index as usize];
    let class = &scene.classes[hit.member.class as usize];
    Some(Run { object, index, class, hit, placement, lanes })
}

impl Run<'_> {
    /// Whether a hit is of an element of the same object, placed by the same instance.
    fn has_element(&self, scene: &CompiledScene, id: HitId) -> bool {
        let other = HitObject::of(&scene.geometry, &scene.items, id);
        other.is_some_and(|other| {
            other.member.object == self.hit.member.object && other.instance == self.hit.instance
        })
    }

    /// Sets the numbers by which kernels know what was hit.
    pub fn number(&self, scene: &CompiledScene, hits: &Hits, numbers: &mut LaneIndices) {
        let numbers = numbers.as_mut_slice();
        // All lanes have the number of some object, whether they take part or not.
        numbers.fill(self.class.number_of(self.hit.member.object, self.hit.element).unwrap_or(0));
        if self.class.has_elements() {
            for lane in lanes_of(self.lanes) {
                let hit = HitObject::of(&scene.geometry, &scene.items, hits.id[lane]);
                let number =
                    hit.and_then(|hit| self.class.number_of(hit.member.object, hit.element));
                numbers[lane] = number.unwrap_or(numbers[lane]);
            }
        }
    }

    /// What kernels that take the objects of hits are called for.
    fn objects<'a>(&'a self, numbers: &'a LaneIndices) -> Instances<'a> {
        if self.class.has_elements() {
            Instances::Many(&self.class.objects, numbers)
        } else {
            Instances::Object(&self.class.objects, numbers.as_slice()[0])
        }
    }

    /// The call of a method for its hits; `None` if its class has none.
    pub fn call<'a>(
        &'a self,
        tracer: &Tracer<'a>,
        method: Method,
        numbers: &'a LaneIndices,
    ) -> Option<KernelCall<'a>> {
        let Tracer { scene, problems } = *tracer;
        if !self.class.has_elements() {
            return scene.call(&self.object.primitive, method, problems);
        }
        let program = &scene.shader(&self.object.primitive).program;
        let kernel = self.class.surface_kernel(method)?;
        Some(KernelCall::new(program, kernel, method, self.objects(numbers), problems))
    }
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
    let scene = tracer.scene;
    run.number(scene, hits, &mut level.numbers);
    if let Some(kernel) = run.class.hit.as_deref() {
        find_again(tracer, kernel, run, rays, level, context);
    }
    let Level { blocks, kept_scratch, numbers } = level;
    set_local_hits(run, rays, hits, &mut blocks.state);
    let needs = scene.needs(run.object);
    let methods = [
        (Method::ComputeNormal, true),
        (Method::ComputeTextureCoordinates, needs.coordinates || needs.derivatives),
        (Method::ComputeDerivatives, needs.derivatives),
    ];
    let mut has_derivatives = false;
    for (method, _) in methods.into_iter().filter(|(_, is_needed)| *is_needed) {
        if let Some(call) = run.call(tracer, method, numbers) {
            blocks.call(&call, run.lanes, Some(&mut *kept_scratch), context);
            has_derivatives |= method == Method::ComputeDerivatives;
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
/// since it is given the same: rays in the space of the object's group.
fn find_again(
    tracer: &Tracer<'_>,
    kernel: &Kernel,
    run: &Run<'_>,
    rays: &RayPacket,
    level: &mut Level,
    context: &mut LaneContext,
) {
    let Level { blocks, kept_scratch, numbers } = level;
    match &run.placement {
        None => set_rays(&mut blocks.state, &Affine::IDENTITY, rays, run.lanes),
        Some((_, inverse)) => {
            let rays = moved_packet(rays, inverse);
            set_rays(&mut blocks.state, &Affine::IDENTITY, &rays, run.lanes);
        }
    }
    for lane in lanes_of(run.lanes) {
        set_number(&mut blocks.state, variables().hit_distance, lane, rays.limit[lane]);
    }
    let program = &tracer.scene.shader(&run.object.primitive).program;
    let instances = run.objects(numbers);
    let call = KernelCall::new(program, kernel, Method::Intersect, instances, tracer.problems);
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
