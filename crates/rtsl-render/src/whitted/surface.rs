//! Surface properties of the hits of a packet, and their grouping by object.

use fearless_simd::{Level as SimdLevel, Simd, dispatch, f32x8};
use rtsl::host::NoHost;
use rtsl::{Instances, LaneBlock, LaneIndices, Method};
use rtsl_bvh::{HitId, Hits, LaneMask, RayPacket, lanes_of};

use super::workspace::Level;
use crate::compiled::calls::KernelCall;
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::object::Object;
use crate::compiled::object_class::ObjectClass;
use crate::compiled::placed_objects::HitObject;
use crate::compiled::tracer::Tracer;
use crate::lanes::eight::{Eight, Eights, eights};
use crate::surfaces::{
    EightRays, EightSurfaces, HitLanes, ObjectHit, SurfaceLanes, SurfaceTransforms, Surfaces,
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
    /// The lanes.
    pub lanes: LaneMask,
}

/// Groups the hits of a packet by object.
pub fn hit_groups<'a>(scene: &'a CompiledScene, hits: &Hits, lanes: LaneMask) -> Vec<HitGroup<'a>> {
    let mut rest = hits.lanes(lanes);
    let mut groups = Vec::new();
    while rest != 0 {
        let first = rest.trailing_zeros() as usize;
        rest &= rest - 1;
        let Some(mut group) = hit_group(scene, hits.id[first], 1 << first) else { continue };
        for lane in lanes_of(rest) {
            let id = hits.id[lane];
            if id == hits.id[first] || group.class.has_elements() && group.has_element(scene, id) {
                group.lanes |= 1 << lane;
            }
        }
        rest &= !group.lanes;
        groups.push(group);
    }
    groups
}

fn hit_group<'a>(scene: &'a CompiledScene, id: HitId, lanes: LaneMask) -> Option<HitGroup<'a>> {
    let hit = HitObject::of(&scene.geometry, &scene.items, id)?;
    let index = hit.member.object;
    let object = &scene.objects[index as usize];
    let class = scene.class(hit.member.class);
    Some(HitGroup { object, index, class, hit, lanes })
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
    pub fn set_indices(&self, scene: &CompiledScene, hits: &Hits, indices: &mut LaneIndices) {
        let indices = indices.as_mut_slice();
        // All lanes need valid indices, including inactive ones.
        indices.fill(self.class.index_of(self.hit.member.object, self.hit.element).unwrap_or(0));
        if self.class.has_elements() {
            for lane in lanes_of(self.lanes) {
                let hit = HitObject::of(&scene.geometry, &scene.items, hits.id[lane]);
                let index = hit.and_then(|hit| self.class.index_of(hit.member.object, hit.element));
                indices[lane] = index.unwrap_or(indices[lane]);
            }
        }
    }

    /// Returns the objects for kernels that take those of hits.
    fn objects<'a>(&'a self, indices: &'a LaneIndices) -> Instances<'a> {
        if self.class.has_elements() {
            Instances::Many(&self.class.objects, indices)
        } else {
            Instances::Object(&self.class.objects, indices.as_slice()[0])
        }
    }

    /// Returns the call of a method for its hits; `None` if its class has none.
    pub fn call<'a>(
        &'a self,
        tracer: &Tracer<'a>,
        method: Method,
        indices: &'a LaneIndices,
    ) -> Option<KernelCall<'a>> {
        let Tracer { scene, errors } = *tracer;
        if !self.class.has_elements() {
            return scene.call(&self.object.primitive, method, errors);
        }
        let program = &scene.shader(&self.object.primitive).program;
        let kernel = self.class.surface_kernel(method)?;
        Some(KernelCall::new(program, kernel, method, self.objects(indices), errors))
    }

    /// Returns the call of `intersect` for its hits, if other methods read its scratch.
    fn intersect<'a>(
        &'a self,
        tracer: &Tracer<'a>,
        indices: &'a LaneIndices,
    ) -> Option<KernelCall<'a>> {
        let Tracer { scene, errors } = *tracer;
        let program = &scene.shader(&self.object.primitive).program;
        let (kernel, instances) = (self.class.hit.as_deref()?, self.objects(indices));
        Some(KernelCall::new(program, kernel, Method::Intersect, instances, errors))
    }

    /// Returns the object, and the element that the first lane hit.
    #[inline(always)]
    fn object_hit(&self) -> ObjectHit {
        let HitObject { element, instance, .. } = self.hit;
        ObjectHit { object: self.index, element, instance }
    }
}

/// Runs the methods of one object for its hits. Stores the inputs of materials in the state, and the inputs of lights
/// in `context`.
pub fn prepare(
    tracer: &Tracer<'_>,
    group: &HitGroup<'_>,
    rays: &RayPacket,
    hits: &Hits,
    level: &mut Level,
    context: &mut LaneContext,
) {
    let scene = tracer.scene;
    group.set_indices(scene, hits, &mut level.indices);
    let needs = scene.needs(group.object);
    let surfaces = Surfaces {
        transforms: SurfaceTransforms::of_object(
            scene,
            group.object_hit(),
            group.class.has_elements(),
        ),
        needs,
        shapes_read_normals: needs.coordinates || needs.derivatives,
    };
    let mut lanes = PacketSurfaces { tracer, group, rays, hits, level, context };
    dispatch!(SimdLevel::new(), simd => surfaces.prepare(simd, &mut lanes));
}

/// The lanes of a packet that hit one object.
struct PacketSurfaces<'a> {
    tracer: &'a Tracer<'a>,
    group: &'a HitGroup<'a>,
    rays: &'a RayPacket,
    hits: &'a Hits,
    level: &'a mut Level,
    context: &'a mut LaneContext,
}

impl HitLanes for PacketSurfaces<'_> {
    #[inline(always)]
    fn hit(&self, lane: usize) -> ObjectHit {
        let scene = self.tracer.scene;
        let hit = HitObject::of(&scene.geometry, &scene.items, self.hits.id[lane]);
        ObjectHit { element: hit.map_or(0, |hit| hit.element), ..self.group.object_hit() }
    }

    #[inline(always)]
    fn time(&self, lane: usize) -> f32 {
        self.rays.time[lane]
    }
}

impl SurfaceLanes for PacketSurfaces<'_> {
    type Eights<S: Simd> = Eights<S>;

    #[inline(always)]
    fn eights<S: Simd>(&self, simd: S) -> Eights<S> {
        eights(simd, self.group.lanes)
    }

    #[inline(always)]
    fn rays<S: Simd>(&self, eight: Eight<S>) -> EightRays<S> {
        EightRays {
            origin: eight.vectors(&self.rays.origin),
            direction: eight.vectors(&self.rays.direction),
            epsilon: eight.floats(&self.rays.epsilon),
            time: eight.floats(&self.rays.time),
        }
    }

    #[inline(always)]
    fn limits<S: Simd>(&self, eight: Eight<S>) -> f32x8<S> {
        eight.floats(&self.rays.limit)
    }

    #[inline(always)]
    fn distances<S: Simd>(&self, eight: Eight<S>) -> f32x8<S> {
        eight.floats(&self.hits.distance)
    }

    #[inline(always)]
    fn state(&mut self) -> &mut LaneBlock {
        &mut self.level.blocks.state
    }

    fn scratch(&mut self) -> (&mut LaneBlock, usize) {
        let program = &self.tracer.scene.shader(&self.group.object.primitive).program;
        (&mut self.level.kept_scratch, program.layout().scratch_arrays as usize)
    }

    fn needs(&self, method: Method) -> bool {
        match method {
            Method::Intersect => self.group.class.hit.is_some(),
            // Area lights are sampled point by point, and light that rays find is not weighted.
            Method::SamplePdf => false,
            _ => self.group.call(self.tracer, method, &self.level.indices).is_some(),
        }
    }

    fn call(&mut self, method: Method) {
        let PacketSurfaces { tracer, group, .. } = *self;
        let Level { blocks, kept_scratch, indices } = &mut *self.level;
        if method == Method::Intersect {
            if let Some(call) = group.intersect(tracer, indices) {
                blocks.call(&call, group.lanes, Some(kept_scratch), &mut NoHost);
            }
        } else if let Some(call) = group.call(tracer, method, indices) {
            blocks.call(&call, group.lanes, Some(kept_scratch), self.context);
        }
    }

    fn keep_light_densities<S: Simd>(&mut self, _: Eight<S>, _: f32x8<S>) {}

    #[inline(always)]
    fn keep<S: Simd>(&mut self, eight: Eight<S>, surfaces: &EightSurfaces<S>) {
        let EightSurfaces { direction, point, offset, geometric_normal, shading_normal } = surfaces;
        self.context.set_normals(eight, geometric_normal, shading_normal, direction);
        self.context.set_points(eight, point, *offset);
    }
}
