//! Intersection tests by the objects' `intersect`.

use fearless_simd::{Level, Simd, dispatch};
use rtsl::host::NoHost;
use rtsl::{CallArguments, Instances, Kernel, LaneBlock, LeafArguments, LeafTest, Method};
use rtsl_bvh::{
    LANES, LaneMask, Lanes, Leaf, LeafHead, LoadedRay, Objects, PacketSpace, Pair, PairHit,
    RayFrame, RayLeafTest, RayStream, Serial, TraversalRay,
};
use rtsl_math::{SIMD_LANES, reciprocal};

use super::calls::{CallBlocks, Callee};
use super::compiled_scene::CompiledScene;
use super::mask_bits::bits;
use super::object_class::ObjectClass;
use super::pair_blocks::PairBlocks;
use super::runtime_errors::RuntimeErrors;
use super::variables::variables;

/// The memory of one thread for calls of `intersect`.
pub struct IntersectionBlocks {
    /// For rays in the space of their packet.
    packet: CallBlocks,
    /// For rays that are alone in a space.
    alone: CallBlocks,
    /// For rays of streams, allocated at their first use.
    pairs: Option<PairBlocks>,
    /// The arguments of one call for leaves.
    tests: Vec<LeafTest>,
    scratch_arrays: usize,
}

impl IntersectionBlocks {
    /// Allocates the memory for shaders with at most so many scratch arrays.
    pub fn new(scratch_arrays: usize) -> Self {
        let blocks = || CallBlocks::new(scratch_arrays);
        let (packet, alone, tests) = (blocks(), blocks(), Vec::new());
        IntersectionBlocks { packet, alone, pairs: None, tests, scratch_arrays }
    }

    #[inline(always)]
    fn of(&mut self, frame: RayFrame) -> &mut CallBlocks {
        match frame {
            RayFrame::Packet => &mut self.packet,
            RayFrame::Alone => &mut self.alone,
        }
    }
}

/// Calls `intersect` for a search.
pub struct Intersector<'a> {
    scene: &'a CompiledScene,
    errors: &'a RuntimeErrors,
    blocks: &'a mut IntersectionBlocks,
    /// The packet that is loaded in the blocks.
    loaded_packet: Serial,
    /// True if the packet's limits are loaded: hits overwrite them.
    has_limits: bool,
}

impl<'a> Intersector<'a> {
    /// Prepares a search.
    pub fn new(
        scene: &'a CompiledScene,
        blocks: &'a mut IntersectionBlocks,
        errors: &'a RuntimeErrors,
    ) -> Self {
        Intersector { scene, errors, blocks, loaded_packet: 0, has_limits: false }
    }

    fn class(&self, class: u32) -> &'a ObjectClass {
        self.scene.class(class)
    }

    fn intersect_of(&self, class: &'a ObjectClass) -> Callee<'a> {
        Callee { class: &class.name, method: Method::Intersect, errors: self.errors }
    }

    /// Performs tests for objects of one class.
    #[inline(always)]
    fn test_class(&mut self, rays: &[LoadedRay], leaves: &[Leaf], tests: &mut [RayLeafTest]) {
        let Some(RayLeafTest { head, ray, .. }) = tests.first() else { return };
        let class = self.class(head.class);
        let Some(kernel) = class.leaf_kernel() else {
            for test in tests {
                self.nearest_one_by_one(&rays[test.ray as usize], leaves, test);
            }
            return;
        };
        let intersect = self.intersect_of(class);
        let IntersectionBlocks { packet, alone, tests: calls, .. } = &mut *self.blocks;
        let blocks = match rays[*ray as usize].frame {
            RayFrame::Packet => packet,
            RayFrame::Alone => alone,
        };
        calls.clear();
        calls.extend(tests.iter().map(|test| {
            let first = ObjectClass::first_index(test.head.index_in_class);
            LeafTest::new(rays[test.ray as usize].lane as u32, first)
        }));
        let arguments = LeafArguments {
            state: &mut blocks.state,
            scratch: &mut blocks.scratch,
            // Missing objects repeat the first one, so that kernels need no mask.
            count: SIMD_LANES as u32,
            tests: calls,
            host: &mut NoHost,
        };
        intersect.call_for_leaves(kernel, arguments);
        // Nothing here depends on whether there is a hit, which no processor could predict.
        let distances = blocks.state.floats_mut(variables().hit_distance);
        for (test, call) in tests.iter_mut().zip(&*calls) {
            let ray = &rays[test.ray as usize];
            let of_ray = &mut distances[ray.lane % LANES];
            test.distance = std::mem::replace(of_ray, ray.limit);
            test.nearest =
                call.nearest().map_or(RayLeafTest::NO_ITEM, |nearest| nearest - call.first);
        }
    }

    #[cold]
    fn nearest_one_by_one(&mut self, ray: &LoadedRay, leaves: &[Leaf], test: &mut RayLeafTest) {
        for index in 0..u32::from(test.head.count) {
            let leaf = &leaves[test.leaf as usize];
            let Some(found) = self.ray_against_one(ray, leaf, index as usize) else { continue };
            if test.nearest == RayLeafTest::NO_ITEM || found < test.distance {
                (test.nearest, test.distance) = (index, found);
            }
        }
    }
}

impl Objects for Intersector<'_> {
    #[inline(always)]
    fn packet<S: Simd>(
        &mut self,
        simd: S,
        space: &PacketSpace<'_>,
        leaf: &Leaf,
        index: usize,
        lanes: LaneMask,
    ) -> LaneMask {
        let class = self.class(leaf.class);
        self.load_packet(simd, space);
        let kernel = class.packet_kernel(space.common_origin.is_some());
        let instances = Instances::Object(&class.objects, ObjectClass::item_index(leaf, index));
        let callee = self.intersect_of(class);
        let accepted = self.blocks.packet.intersect(simd, kernel, callee, lanes, instances);
        self.has_limits = accepted == 0;
        accepted
    }

    #[inline(always)]
    fn distance(&self) -> &Lanes {
        self.blocks.packet.state.floats_at(variables().hit_distance, 0)
    }

    #[inline(always)]
    fn load_packet<S: Simd>(&mut self, simd: S, space: &PacketSpace<'_>) {
        let packet = &mut self.blocks.packet;
        if self.loaded_packet != space.serial {
            load_packet(simd, &mut packet.state, space);
            self.loaded_packet = space.serial;
            self.has_limits = false;
        }
        if !self.has_limits {
            packet.state.floats_mut(variables().hit_distance).copy_from_slice(&space.rays.limit);
            self.has_limits = true;
        }
    }

    fn pairs(&mut self, stream: &RayStream, class: u32, pairs: &[Pair], found: &mut Vec<PairHit>) {
        let class = self.class(class);
        let intersect = self.intersect_of(class);
        let IntersectionBlocks { pairs: blocks, scratch_arrays, .. } = &mut *self.blocks;
        let blocks = blocks.get_or_insert_with(|| PairBlocks::new(*scratch_arrays));
        blocks.test(class, intersect, stream, pairs, found);
    }

    fn load_ray(&mut self, ray: &TraversalRay) {
        load_ray(&mut self.blocks.alone.state, ray);
    }

    #[inline(always)]
    fn leaves(&mut self, rays: &[LoadedRay], leaves: &[Leaf], tests: &mut [RayLeafTest]) {
        for tests in tests.chunk_by_mut(|one, other| one.head.class == other.head.class) {
            self.test_class(rays, leaves, tests);
        }
    }

    #[inline(always)]
    fn prefetch(&self, head: &LeafHead) {
        // Instances have no class.
        if let Some(class) = self.scene.classes.get(head.class as usize) {
            class.objects.prefetch(ObjectClass::first_index(head.index_in_class));
        }
    }

    #[cold]
    fn ray_against_one(&mut self, ray: &LoadedRay, leaf: &Leaf, index: usize) -> Option<f32> {
        let class = self.class(leaf.class);
        let instances = Instances::Object(&class.objects, ObjectClass::item_index(leaf, index));
        let (kernel, callee) = (class.packet_kernel(false), self.intersect_of(class));
        let blocks = self.blocks.of(ray.frame);
        let hit = dispatch!(Level::new(), simd => {
            blocks.intersect(simd, kernel, callee, 1 << ray.lane, instances)
        });
        let distance = blocks.take_distance(ray);
        (hit != 0).then_some(distance)
    }
}

impl CallBlocks {
    /// Calls `intersect` for `lanes`; returns those that accepted a hit.
    #[inline(always)]
    fn intersect<S: Simd>(
        &mut self,
        simd: S,
        kernel: &Kernel,
        callee: Callee<'_>,
        lanes: LaneMask,
        instances: Instances<'_>,
    ) -> LaneMask {
        let count = self.prepare_mask(simd, lanes);
        let arguments = CallArguments {
            state: &mut self.state,
            scratch: &mut self.scratch,
            count,
            mask: self.is_masked.then_some(&self.mask),
            accepted: Some(&mut self.accepted),
            instances,
            host: &mut NoHost,
        };
        callee.call(kernel, arguments);
        bits(simd, &self.accepted, lanes)
    }

    /// Returns the distance of a ray's hit from the last call, and restores the ray's limit in its place for the next
    /// call.
    #[inline(always)]
    fn take_distance(&mut self, ray: &TraversalRay) -> f32 {
        let distance = &mut self.state.floats_mut(variables().hit_distance)[ray.lane];
        std::mem::replace(distance, ray.limit)
    }
}

/// Sets the rays of all lanes, including inactive ones.
#[inline(always)]
fn load_packet<S: Simd>(_: S, state: &mut LaneBlock, space: &PacketSpace<'_>) {
    let v = variables();
    let rays = space.rays;
    for axis in 0..3 {
        state.floats_mut(v.ray_origin + axis).copy_from_slice(&rays.origin[axis]);
        state.floats_mut(v.ray_direction + axis).copy_from_slice(&rays.direction[axis]);
        let inverse = state.floats_mut(v.inverse_ray_direction + axis);
        for (inverse, component) in inverse.iter_mut().zip(&rays.direction[axis]) {
            *inverse = 1.0 / component;
        }
    }
    state.floats_mut(v.epsilon).copy_from_slice(&rays.epsilon);
    state.floats_mut(v.time_seed).copy_from_slice(&rays.time);
    // Common-origin kernels read the origin from the first lane, which may be inactive.
    if let Some(origin) = space.common_origin {
        (0..3).for_each(|axis| state.floats_mut(v.ray_origin + axis)[0] = origin[axis]);
    }
}

/// Sets the ray of one lane.
fn load_ray(state: &mut LaneBlock, ray: &TraversalRay) {
    let v = variables();
    let mut set = |component: usize, value: f32| state.floats_mut(component)[ray.lane] = value;
    let mut set_vector = |first: usize, vector: [f32; 3]| {
        (first..).zip(vector).for_each(|(component, value)| set(component, value));
    };
    set_vector(v.ray_origin, ray.origin);
    set_vector(v.ray_direction, ray.direction);
    set_vector(v.inverse_ray_direction, reciprocal(ray.direction));
    set(v.epsilon, ray.epsilon);
    set(v.time_seed, ray.time);
    set(v.hit_distance, ray.limit);
}
