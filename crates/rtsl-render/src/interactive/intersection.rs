//! Tests rays against objects by their classes' `intersect`.

use fearless_simd::Simd;
use rtsl::host::NoHost;
use rtsl::{
    CallArguments, CallStatus, Instances, Kernel, LaneBlock, LeafArguments, Method, new_state,
};

use crate::acceleration::{
    Block, BlockHead, LaneMask, Lanes, Objects, PacketSpace, RaySpace, Serial, WIDTH,
};
use crate::math::reciprocal;

use super::compiled::CompiledScene;
use super::mask_bits::bits;
use super::object_class::ObjectClass;
use super::variables::variables;
use super::workspace::{CallBlocks, Problems};

/// The memory of one thread for calls of `intersect`.
pub struct IntersectionBlocks {
    /// For packets.
    packet: CallBlocks,
    /// For single rays.
    ray: RayBlocks,
}

/// State and scratch of one ray.
struct RayBlocks {
    state: LaneBlock,
    scratch: LaneBlock,
}

impl IntersectionBlocks {
    /// For shaders with at most so many arrays of scratch.
    pub fn new(scratch_arrays: usize) -> Self {
        let state = new_state(1);
        IntersectionBlocks {
            packet: CallBlocks::new(scratch_arrays),
            ray: RayBlocks { state, scratch: LaneBlock::new(scratch_arrays, WIDTH) },
        }
    }
}

/// Runs `intersect`.
pub struct Intersector<'a> {
    scene: &'a CompiledScene,
    problems: &'a Problems,
    blocks: &'a mut IntersectionBlocks,
    /// The packet and the ray that the blocks hold.
    loaded_packet: Serial,
    /// Whether the packet's limits are where kernels read them: not after hits, which stand there then.
    has_limits: bool,
    loaded_ray: Serial,
}

impl<'a> Intersector<'a> {
    /// For one search.
    pub fn new(
        scene: &'a CompiledScene,
        blocks: &'a mut IntersectionBlocks,
        problems: &'a Problems,
    ) -> Self {
        Intersector { scene, problems, blocks, loaded_packet: 0, has_limits: false, loaded_ray: 0 }
    }

    fn class(&self, class: u32) -> &'a ObjectClass {
        &self.scene.classes[class as usize]
    }

    fn report(&self, class: &ObjectClass, status: CallStatus) {
        if status.budget_exhausted {
            self.problems.report(&class.name, Method::Intersect);
        }
    }

    #[inline(always)]
    fn load_ray(&mut self, ray: &RaySpace) {
        if self.loaded_ray != ray.serial {
            load_ray(&mut self.blocks.ray.state, ray);
            self.loaded_ray = ray.serial;
        }
    }

    #[cold]
    fn nearest_one_by_one(&mut self, ray: &RaySpace, block: &Block) -> Option<(usize, f32)> {
        let mut nearest: Option<(usize, f32)> = None;
        for index in 0..usize::from(block.count) {
            let found = self.ray_against_one(ray, block, index);
            let found = found.filter(|it| nearest.is_none_or(|(_, nearest)| *it < nearest));
            nearest = found.map(|distance| (index, distance)).or(nearest);
        }
        nearest
    }
}

impl Objects for Intersector<'_> {
    #[inline(always)]
    fn packet<S: Simd>(
        &mut self,
        simd: S,
        space: &PacketSpace<'_>,
        block: &Block,
        index: usize,
        lanes: LaneMask,
    ) -> LaneMask {
        let class = self.class(block.class);
        let v = variables();
        let packet = &mut self.blocks.packet;
        if self.loaded_packet != space.serial {
            load_packet(simd, &mut packet.state, space);
            self.loaded_packet = space.serial;
            self.has_limits = false;
        }
        if !self.has_limits {
            packet.state.floats_mut(v.hit_distance).copy_from_slice(&space.rays.limit);
        }
        let kernel = class.packet_kernel(space.common_origin.is_some());
        let instances = Instances::Object(&class.objects, ObjectClass::number(block, index));
        let (accepted, status) = packet.intersect(simd, kernel, lanes, instances);
        self.has_limits = accepted == 0;
        self.report(class, status);
        accepted
    }

    #[inline(always)]
    fn distance(&self) -> &Lanes {
        self.blocks.packet.state.floats_at(variables().hit_distance, 0)
    }

    #[inline(always)]
    fn ray(&mut self, ray: &RaySpace, head: &BlockHead, block: &Block) -> Option<(usize, f32)> {
        let class = self.class(head.class);
        let Some(kernel) = class.leaf_kernel() else { return self.nearest_one_by_one(ray, block) };
        self.load_ray(ray);
        let RayBlocks { state, scratch } = &mut self.blocks.ray;
        let first = ObjectClass::first_number(head.of_class);
        let status = kernel.call(LeafArguments {
            state,
            scratch,
            first,
            count: u32::from(head.count),
            host: &mut NoHost,
        });
        let nearest = status.nearest.map(|number| (number - first) as usize);
        let distance = take_distance(state, ray);
        let found = nearest.map(|index| (index, distance));
        self.report(class, status);
        found
    }

    #[cold]
    fn ray_against_one(&mut self, ray: &RaySpace, block: &Block, index: usize) -> Option<f32> {
        let class = self.class(block.class);
        self.load_ray(ray);
        let RayBlocks { state, scratch } = &mut self.blocks.ray;
        let accepted = &mut self.blocks.packet.accepted;
        let status = class.packet_kernel(false).call(CallArguments {
            state,
            scratch,
            count: 1,
            mask: None,
            accepted: Some(accepted),
            instances: Instances::Object(&class.objects, ObjectClass::number(block, index)),
            host: &mut NoHost,
        });
        let hit = accepted.get(0);
        let distance = take_distance(state, ray);
        self.report(class, status);
        hit.then_some(distance)
    }
}

impl CallBlocks {
    /// Calls `intersect` for `lanes`: those that accepted a hit.
    #[inline(always)]
    fn intersect<S: Simd>(
        &mut self,
        simd: S,
        kernel: &Kernel,
        lanes: LaneMask,
        instances: Instances<'_>,
    ) -> (LaneMask, CallStatus) {
        let count = self.prepare_mask(simd, lanes);
        let status = kernel.call(CallArguments {
            state: &mut self.state,
            scratch: &mut self.scratch,
            count,
            mask: self.is_masked.then_some(&self.mask),
            accepted: Some(&mut self.accepted),
            instances,
            host: &mut NoHost,
        });
        (bits(simd, &self.accepted, lanes), status)
    }
}

/// Sets the rays of all lanes, whether they take part or not.
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
    // Code for rays from one point reads it from the first lane, whether that takes part or not.
    if let Some(origin) = space.common_origin {
        (0..3).for_each(|axis| state.floats_mut(v.ray_origin + axis)[0] = origin[axis]);
    }
}

/// Sets the ray of a block for one, whose limit is where its hits end.
fn load_ray(state: &mut LaneBlock, ray: &RaySpace) {
    let v = variables();
    let mut set = |first: usize, vector: [f32; 3]| {
        let components = (first..).zip(vector);
        components.for_each(|(component, value)| *first_lane(state, component) = value);
    };
    set(v.ray_origin, ray.origin);
    set(v.ray_direction, ray.direction);
    set(v.inverse_ray_direction, reciprocal(ray.direction));
    *first_lane(state, v.epsilon) = ray.epsilon;
    *first_lane(state, v.time_seed) = ray.time;
    *first_lane(state, v.hit_distance) = ray.limit;
}

/// The parameter of the hit that the last call found. The ray's limit takes its place, for the next.
#[inline(always)]
fn take_distance(state: &mut LaneBlock, ray: &RaySpace) -> f32 {
    std::mem::replace(first_lane(state, variables().hit_distance), ray.limit)
}

#[inline(always)]
fn first_lane(state: &mut LaneBlock, component: usize) -> &mut f32 {
    let [lane] = state.floats_mut_at::<1>(component, 0);
    lane
}
