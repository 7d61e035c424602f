//! The surface properties that materials read for the hits of a packet: the shapes' methods run in object space, then
//! everything is transformed to world space.

use fearless_simd::{Level as SimdLevel, Simd, dispatch};
use rtsl::{Instances, Kernel, LaneBlock, LaneIndices, Method};
use rtsl_bvh::{HitId, Hits, LaneMask, RayPacket, lanes_of};

use super::workspace::Level;
use crate::compiled::calls::KernelCall;
use crate::compiled::compiled_scene::{CompiledScene, Object};
use crate::compiled::object_class::ObjectClass;
use crate::compiled::placed_objects::HitObject;
use crate::compiled::placement::Placement;
use crate::compiled::shaders::SurfaceNeeds;
use crate::compiled::tracer::Tracer;
use crate::compiled::variables::variables;
use crate::lanes::eight::{Eight, Vectors, eights, points_on_rays};
use crate::lanes::surface_offset::{sizes_on_rays, sums, surface_offsets};
use crate::lanes::surface_state::{
    EightRays, find_scratch, normalize_normals, set_hits, set_inverse_directions, set_tangents,
};
use crate::tiles::LaneContext;

/// The lanes that hit one object, or any of its elements.
pub struct HitGroup<'a> {
    /// The object.
    pub object: &'a Object,
    /// Its index among those of the scene.
    pub index: u32,
    /// The traversal class of the hit.
    pub class: &'a ObjectClass,
    /// The object, and the instance that places it.
    hit: HitObject,
    /// The placement of the instance; `None` for the world.
    placement: Option<Placement<'a>>,
    /// The lanes.
    pub lanes: LaneMask,
}

/// Groups the hits of a packet by object.
pub fn runs<'a>(scene: &'a CompiledScene, hits: &Hits, lanes: LaneMask) -> Vec<HitGroup<'a>> {
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

fn run<'a>(scene: &'a CompiledScene, id: HitId, lanes: LaneMask) -> Option<HitGroup<'a>> {
    let hit = HitObject::of(&scene.geometry, &scene.items, id)?;
    let placement = match hit.instance {
        None => None,
        Some(instance) => Some(scene.placement(instance)?),
    };
    let index = hit.member.object;
    let object = &scene.objects[index as usize];
    let class = &scene.classes[hit.member.class as usize];
    Some(HitGroup { object, index, class, hit, placement, lanes })
}

impl HitGroup<'_> {
    /// True if a hit is of an element of the same object, placed by the same instance.
    fn has_element(&self, scene: &CompiledScene, id: HitId) -> bool {
        let other = HitObject::of(&scene.geometry, &scene.items, id);
        other.is_some_and(|other| {
            other.member.object == self.hit.member.object && other.instance == self.hit.instance
        })
    }

    /// Sets the indices by which kernels know the objects that were hit.
    pub fn number(&self, scene: &CompiledScene, hits: &Hits, numbers: &mut LaneIndices) {
        let numbers = numbers.as_mut_slice();
        // All lanes need valid indices, including inactive ones.
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

    /// Returns the extents of the bounding boxes hit by eight lanes. Lanes outside the group are undefined.
    // In registers: copying an array for all lanes took 600 instructions for each group.
    #[inline(always)]
    fn extents<S: Simd>(&self, eight: Eight<S>, scene: &CompiledScene, hits: &Hits) -> Vectors<S> {
        let own = eight.splat_vector(scene.extents.lengths(self.index, self.hit.element));
        if !self.class.has_elements() {
            return own;
        }
        eight.each(&own, |lane, _| {
            let hit = HitObject::of(&scene.geometry, &scene.items, hits.id[lane]);
            scene.extents.lengths(self.index, hit.map_or(0, |hit| hit.element))
        })
    }

    /// Returns the objects for kernels that take those of hits.
    fn objects<'a>(&'a self, numbers: &'a LaneIndices) -> Instances<'a> {
        if self.class.has_elements() {
            Instances::Many(&self.class.objects, numbers)
        } else {
            Instances::Object(&self.class.objects, numbers.as_slice()[0])
        }
    }

    /// Returns the call of a method for its hits; `None` if its class has none.
    pub fn call<'a>(
        &'a self,
        tracer: &Tracer<'a>,
        method: Method,
        numbers: &'a LaneIndices,
    ) -> Option<KernelCall<'a>> {
        let Tracer { scene, errors } = *tracer;
        if !self.class.has_elements() {
            return scene.call(&self.object.primitive, method, errors);
        }
        let program = &scene.shader(&self.object.primitive).program;
        let kernel = self.class.surface_kernel(method)?;
        Some(KernelCall::new(program, kernel, method, self.objects(numbers), errors))
    }
}

/// Runs the methods of one object for its hits. Stores the inputs of materials in the state, and the inputs of lights
/// in `context`.
pub fn prepare(
    tracer: &Tracer<'_>,
    run: &HitGroup<'_>,
    rays: &RayPacket,
    hits: &Hits,
    level: &mut Level,
    context: &mut LaneContext,
) {
    let surface = SurfaceOfRun { tracer, run, rays, hits };
    dispatch!(SimdLevel::new(), simd => surface.prepare(simd, level, context));
}

/// The hits of a group.
struct SurfaceOfRun<'a> {
    tracer: &'a Tracer<'a>,
    run: &'a HitGroup<'a>,
    rays: &'a RayPacket,
    hits: &'a Hits,
}

impl SurfaceOfRun<'_> {
    #[inline(always)]
    fn prepare<S: Simd>(&self, simd: S, level: &mut Level, context: &mut LaneContext) {
        let SurfaceOfRun { tracer, run, .. } = *self;
        run.number(tracer.scene, self.hits, &mut level.numbers);
        let in_group = self.rays_in_group();
        let group_rays = in_group.as_ref().unwrap_or(self.rays);
        if let Some(kernel) = run.class.hit.as_deref() {
            self.find_scratch(simd, kernel, group_rays, level);
        }
        let needs = tracer.scene.needs(run.object);
        self.set_local_hits(simd, group_rays, needs, &mut level.blocks.state);
        let has_derivatives = self.run_methods(simd, needs, level, context);
        let has_tangents = needs.derivatives && has_derivatives;
        self.to_world(simd, needs, has_tangents, &mut level.blocks.state, context);
        if needs.derivatives && !has_derivatives {
            for eight in eights(simd, run.lanes) {
                let normal = context.geometric_normals(eight);
                set_tangents(eight, &mut level.blocks.state, &normal);
            }
        }
    }

    /// The rays in the space of the object's group, if that is not the world.
    #[inline(always)]
    fn rays_in_group(&self) -> Option<RayPacket> {
        let placement = self.run.placement.as_ref()?;
        Some(placement.rays_in_group(self.rays, self.run.lanes))
    }

    /// Recomputes the scratch of `intersect` for the hits, with rays in the space of the object's group.
    #[inline(always)]
    fn find_scratch<S: Simd>(&self, simd: S, kernel: &Kernel, rays: &RayPacket, level: &mut Level) {
        let Level { blocks, kept_scratch, numbers } = level;
        let lanes = self.run.lanes;
        let program = &self.tracer.scene.shader(&self.run.object.primitive).program;
        let (instances, errors) = (self.run.objects(numbers), self.tracer.errors);
        let call = KernelCall::new(program, kernel, Method::Intersect, instances, errors);
        find_scratch(
            eights(simd, lanes),
            (blocks, kept_scratch),
            call.scratch_arrays,
            |eight| (eight_rays(eight, rays), eight.numbers(&rays.limit)),
            |blocks, scratch, host| {
                blocks.call(&call, lanes, Some(scratch), host);
            },
        );
    }

    /// Sets the inputs of the shapes' methods, and default results for methods that the class lacks.
    #[inline(always)]
    fn set_local_hits<S: Simd>(
        &self,
        simd: S,
        rays: &RayPacket,
        needs: SurfaceNeeds,
        state: &mut LaneBlock,
    ) {
        let inverse = &self.run.object.inverse;
        // As in the traversal, an object without a transform gets its group's rays unchanged.
        let has_own_space = !inverse.is_identity();
        for eight in eights(simd, self.run.lanes) {
            let mut local = eight_rays(eight, rays);
            if has_own_space {
                local.origin = eight.point(inverse, &local.origin);
                local.direction = eight.vector(inverse, &local.direction);
            }
            set_hits(eight, state, &local, eight.numbers(&self.hits.distance), needs);
        }
    }

    /// Runs the methods of the shape whose results are needed; returns true if it computed derivatives.
    #[inline(always)]
    fn run_methods<S: Simd>(
        &self,
        simd: S,
        needs: SurfaceNeeds,
        level: &mut Level,
        context: &mut LaneContext,
    ) -> bool {
        let Level { blocks, kept_scratch, numbers } = level;
        let methods = [
            (Method::ComputeNormal, true),
            (Method::ComputeTextureCoordinates, needs.coordinates || needs.derivatives),
            (Method::ComputeDerivatives, needs.derivatives),
        ];
        let mut has_derivatives = false;
        for (method, _) in methods.into_iter().filter(|(_, is_needed)| *is_needed) {
            if let Some(call) = self.run.call(self.tracer, method, numbers) {
                blocks.call(&call, self.run.lanes, Some(&mut *kept_scratch), context);
                has_derivatives |= method == Method::ComputeDerivatives;
            }
            // The last normal written is normalised when it is transformed to the world.
            if method == Method::ComputeNormal && (needs.coordinates || needs.derivatives) {
                normalize_normals(eights(simd, self.run.lanes), &mut blocks.state);
            }
        }
        has_derivatives
    }

    /// Transforms rays and surfaces from the object's space to the world's.
    #[inline(always)]
    fn to_world<S: Simd>(
        &self,
        simd: S,
        needs: SurfaceNeeds,
        has_tangents: bool,
        state: &mut LaneBlock,
        context: &mut LaneContext,
    ) {
        let SurfaceOfRun { run, rays, hits, .. } = *self;
        let v = variables();
        let is_elsewhere = run.placement.is_some() || !run.object.inverse.is_identity();
        for eight in eights(simd, run.lanes) {
            let world = eight_rays(eight, rays);
            let EightRays { origin, direction, .. } = world;
            if is_elsewhere {
                world.store(eight, state);
                if needs.inverse_directions {
                    set_inverse_directions(eight, state, &direction);
                }
            }
            let distance = eight.numbers(&hits.distance);
            let point = points_on_rays(&origin, &direction, distance);
            eight.store_vectors(state, v.hit_point, &point);
            let up = eight.splat_vector([0.0, 0.0, 1.0]);
            let geometric = eight.load_vectors(state, v.geometric_normal);
            let shading = eight.load_vectors(state, v.shading_normal);
            let geometric = self.normals_to_world(eight, &geometric, &up);
            let shading = self.normals_to_world(eight, &shading, &geometric);
            eight.store_vectors(state, v.geometric_normal, &geometric);
            eight.store_vectors(state, v.shading_normal, &shading);
            context.set_normals(eight, &geometric, &shading, &direction);
            let sizes = sizes_on_rays(&origin, &direction, distance);
            let extents = run.extents(eight, self.tracer.scene, hits);
            let sizes = self.sizes_of_points(eight, &sizes, &extents);
            context.set_points(eight, &point, surface_offsets(eight, &geometric, &sizes));
            if has_tangents {
                self.tangents_to_world(eight, state);
            }
        }
    }

    /// Returns the magnitudes that bound the rounding errors of hit points in the world, given those of the rays and
    /// the extents of the boxes: on the way to the object's space, and back.
    #[inline(always)]
    fn sizes_of_points<S: Simd>(
        &self,
        eight: Eight<S>,
        of_rays: &Vectors<S>,
        extents: &Vectors<S>,
    ) -> Vectors<S> {
        let SurfaceOfRun { run, rays, .. } = *self;
        let placement = run.placement.as_ref();
        let in_group = placement.map(|it| it.sizes_to_group(eight, of_rays, &rays.time));
        let mut sizes = sums(in_group.as_ref().unwrap_or(of_rays), extents);
        if !run.object.inverse.is_identity() {
            sizes = sums(&sizes, &eight.point(&run.object.sizes, &sizes));
        }
        match placement {
            None => sizes,
            Some(placement) => sums(of_rays, &placement.sizes_to_world(eight, &sizes, &rays.time)),
        }
    }

    #[inline(always)]
    fn normals_to_world<S: Simd>(
        &self,
        eight: Eight<S>,
        normals: &Vectors<S>,
        otherwise: &Vectors<S>,
    ) -> Vectors<S> {
        let mut normals = self.run.object.normals_to_group(eight, normals);
        if let Some(placement) = &self.run.placement {
            normals = placement.normals_to_world(eight, &normals, &self.rays.time);
        }
        eight.normalized_or(&normals, otherwise)
    }

    #[inline(always)]
    fn tangents_to_world<S: Simd>(&self, eight: Eight<S>, state: &mut LaneBlock) {
        let v = variables();
        for variable in [v.dpdu, v.dpdv] {
            let local = eight.load_vectors(state, variable);
            let mut tangents = eight.vector(&self.run.object.forward, &local);
            if let Some(placement) = &self.run.placement {
                tangents = placement.vectors_to_world(eight, &tangents, &self.rays.time);
            }
            eight.store_vectors(state, variable, &tangents);
        }
    }
}

/// Eight rays of a packet.
#[inline(always)]
fn eight_rays<S: Simd>(eight: Eight<S>, rays: &RayPacket) -> EightRays<S> {
    EightRays {
        origin: eight.vectors(&rays.origin),
        direction: eight.vectors(&rays.direction),
        epsilon: eight.numbers(&rays.epsilon),
        time: eight.numbers(&rays.time),
    }
}
