//! Transforms of the objects that some lanes hit.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};
use rtsl_math::Affine;

use super::hit_lanes::{HitLanes, ObjectHit};
use crate::compiled::CompiledScene;
use crate::compiled::object::Object;
use crate::compiled::placement::Placement;
use crate::lanes::eight::{Eight, Vectors, scaled};
use crate::lanes::fours::fours;
use crate::lanes::lane_maps::LaneMaps;
use crate::lanes::surface_offset::sums;

/// The transforms of objects of one traversal class. Transforms that all lanes share are loaded once.
pub struct SurfaceTransforms<'a> {
    scene: &'a CompiledScene,
    /// The object, if all lanes have the same.
    object: Option<&'a Object>,
    /// The extents of the bounding box that was hit, if all lanes have the same.
    extents: Option<[f32; 3]>,
    /// True if the objects have transforms to their group's space.
    is_placed: bool,
    instances: Instances<'a>,
}

/// The instances that place the objects.
enum Instances<'a> {
    /// None: the objects are in the world.
    World,
    /// One for all lanes.
    Same(Placement<'a>),
    /// One for each lane, or none.
    Each,
}

impl<'a> Instances<'a> {
    #[inline(always)]
    fn one(scene: &'a CompiledScene, instance: Option<u32>) -> Self {
        let placement = instance.and_then(|instance| scene.placement(instance));
        placement.map_or(Instances::World, Instances::Same)
    }
}

impl<'a> SurfaceTransforms<'a> {
    /// Returns the transforms of the objects of these hits, all of one class.
    #[inline(always)]
    pub fn new(
        scene: &'a CompiledScene,
        class: u32,
        mut hits: impl Iterator<Item = ObjectHit> + Clone,
    ) -> Self {
        let nothing = ObjectHit { object: 0, element: 0, instance: None };
        let first = hits.clone().next().unwrap_or(nothing);
        let is_one = hits.clone().all(|hit| hit.object == first.object);
        let is_one_element = is_one && hits.clone().all(|hit| hit.element == first.element);
        let is_in_world = scene.geometry.instances.is_empty();
        let instances = if is_in_world || hits.all(|hit| hit.instance == first.instance) {
            Instances::one(scene, first.instance)
        } else {
            Instances::Each
        };
        SurfaceTransforms {
            scene,
            object: is_one.then(|| &scene.objects[first.object as usize]),
            extents: is_one_element.then(|| scene.extents.lengths(first.object, first.element)),
            is_placed: scene.class(class).is_placed(),
            instances,
        }
    }

    /// Returns the transforms from world space to those of the objects' groups; `None` if it is the same.
    #[inline(always)]
    pub fn world_to_group<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: &impl HitLanes,
    ) -> Option<LaneMaps<S>> {
        self.group_maps(eight, lanes, Placement::inverse_at)
    }

    /// Returns the transforms from the spaces of the objects' groups to world space; `None` if it is the same.
    #[inline(always)]
    fn group_to_world<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: &impl HitLanes,
    ) -> Option<LaneMaps<S>> {
        self.group_maps(eight, lanes, Placement::map_at)
    }

    #[inline(always)]
    fn group_maps<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: &impl HitLanes,
        map_at: impl Fn(&Placement<'a>, f32) -> Affine,
    ) -> Option<LaneMaps<S>> {
        Some(match &self.instances {
            Instances::World => return None,
            Instances::Same(placement) if !placement.moves() => {
                LaneMaps::same(eight, &map_at(placement, 0.0))
            }
            Instances::Same(placement) => {
                LaneMaps::each(eight, |lane| map_at(placement, lanes.time(lane)))
            }
            Instances::Each => LaneMaps::each(eight, |lane| {
                let instance = lanes.hit(lane).instance;
                let placement = instance.and_then(|instance| self.scene.placement(instance));
                placement.map_or(Affine::IDENTITY, |it| map_at(&it, lanes.time(lane)))
            }),
        })
    }

    /// Returns the transforms from the spaces of the objects' groups to their own; `None` if they are the same.
    #[inline(always)]
    pub fn group_to_object<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: &impl HitLanes,
    ) -> Option<LaneMaps<S>> {
        self.object_maps(eight, lanes, |object| &object.inverse)
    }

    /// Returns the transforms from the objects' own spaces to those of their groups; `None` if they are the same.
    #[inline(always)]
    fn object_to_group<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: &impl HitLanes,
    ) -> Option<LaneMaps<S>> {
        self.object_maps(eight, lanes, |object| &object.forward)
    }

    #[inline(always)]
    fn object_maps<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: &impl HitLanes,
        map: impl Fn(&'a Object) -> &'a Affine,
    ) -> Option<LaneMaps<S>> {
        // Without a closure around it, so that the maps stay in registers.
        if !self.is_placed {
            return None;
        }
        Some(match self.object {
            Some(object) => LaneMaps::same(eight, map(object)),
            None => LaneMaps::gathered(eight, |lane| map(self.object_of(lanes, lane))),
        })
    }

    #[inline(always)]
    fn object_of(&self, lanes: &impl HitLanes, lane: usize) -> &'a Object {
        &self.scene.objects[lanes.hit(lane).object as usize]
    }

    /// Returns the extents of the bounding boxes that were hit, in the spaces of the objects' groups.
    #[inline(always)]
    fn extents<S: Simd>(&self, eight: Eight<S>, lanes: &impl HitLanes) -> Vectors<S> {
        match self.extents {
            Some(extents) => eight.splat_vector(extents),
            None => {
                let [x, y, z, _] = fours(eight.simd(), |lane| {
                    let ObjectHit { object, element, .. } = lanes.hit(eight.start() + lane);
                    let [x, y, z] = self.scene.extents.lengths(object, element);
                    [x, y, z, 0.0]
                });
                [x, y, z]
            }
        }
    }

    /// Returns the magnitudes that bound the rounding errors of hit points in the world, given those of the rays: on
    /// the way to the objects' spaces, and back; with the extents of the shapes or without.
    #[inline(always)]
    pub fn sizes_of_points<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: &impl HitLanes,
        of_rays: &Vectors<S>,
        has_extents: bool,
    ) -> Vectors<S> {
        let to_group = self.world_to_group(eight, lanes);
        let mut in_group = to_group.map_or(*of_rays, |maps| maps.of_sizes().points(of_rays));
        if has_extents {
            in_group = sums(&in_group, &self.extents(eight, lanes));
        }
        let in_group = self.sizes_in_group(eight, lanes, &in_group);
        match self.group_to_world(eight, lanes) {
            None => in_group,
            Some(maps) => sums(of_rays, &maps.of_sizes().vectors(&in_group)),
        }
    }

    /// Returns the magnitudes in the groups' spaces that result from these magnitudes through the objects' spaces, and
    /// from these themselves.
    #[inline(always)]
    fn sizes_in_group<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: &impl HitLanes,
        sizes: &Vectors<S>,
    ) -> Vectors<S> {
        match self.object_maps(eight, lanes, |object| &object.sizes) {
            None => *sizes,
            Some(maps) => sums(sizes, &maps.points(sizes)),
        }
    }

    /// Transforms points of the world to the objects' spaces.
    #[inline(always)]
    pub fn local_points<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: &impl HitLanes,
        points: &Vectors<S>,
    ) -> Vectors<S> {
        let mut points = *points;
        if let Some(maps) = self.world_to_group(eight, lanes) {
            points = maps.points(&points);
        }
        if let Some(maps) = self.group_to_object(eight, lanes) {
            points = maps.points(&points);
        }
        points
    }

    /// Transforms points of the objects' spaces to the world's.
    #[inline(always)]
    pub fn points<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: &impl HitLanes,
        points: &Vectors<S>,
    ) -> Vectors<S> {
        let mut points = *points;
        if let Some(maps) = self.object_to_group(eight, lanes) {
            points = maps.points(&points);
        }
        if let Some(maps) = self.group_to_world(eight, lanes) {
            points = maps.points(&points);
        }
        points
    }

    /// Transforms normals of the objects' spaces to the world's, of any length, with the orientation of the objects.
    #[inline(always)]
    pub fn normals<S: Simd, const N: usize>(
        &self,
        eight: Eight<S>,
        lanes: &impl HitLanes,
        mut normals: [Vectors<S>; N],
    ) -> [Vectors<S>; N] {
        // Loops instead of `map`, whose closure may stay a call outside of the caller's instruction set.
        if let Some(maps) = self.group_to_object(eight, lanes) {
            for normal in &mut normals {
                *normal = maps.transposed_vectors(normal);
            }
        }
        let side = self.sides(eight, lanes);
        for normal in &mut normals {
            *normal = scaled(normal, side);
        }
        if let Some(maps) = self.world_to_group(eight, lanes) {
            for normal in &mut normals {
                *normal = maps.transposed_vectors(normal);
            }
        }
        normals
    }

    /// Returns -1 for objects with reversed orientation, else 1.
    #[inline(always)]
    fn sides<S: Simd>(&self, eight: Eight<S>, lanes: &impl HitLanes) -> f32x8<S> {
        let side = |object: &Object| if object.reverse_orientation { -1.0 } else { 1.0 };
        match self.object {
            Some(object) => eight.splat(side(object)),
            None => by_lane(eight, |lane| side(self.object_of(lanes, lane))),
        }
    }

    /// Returns the factors by which volumes of the objects' spaces are scaled to the world's.
    #[inline(always)]
    pub fn volume_scales<S: Simd>(&self, eight: Eight<S>, lanes: &impl HitLanes) -> f32x8<S> {
        let own = match self.object {
            Some(object) => eight.splat(object.volume_scale),
            None => by_lane(eight, |lane| self.object_of(lanes, lane).volume_scale),
        };
        if let Instances::World = self.instances {
            return own;
        }
        let of_group = by_lane(eight, |lane| {
            let instance = lanes.hit(lane).instance;
            let placement = instance.and_then(|instance| self.scene.placement(instance));
            placement.map_or(1.0, |it| it.volume_scale(lanes.time(lane)) as f32)
        });
        own * of_group
    }
}

/// Evaluates a function for each of eight lanes.
#[inline(always)]
fn by_lane<S: Simd>(eight: Eight<S>, value: impl Fn(usize) -> f32) -> f32x8<S> {
    let values: [f32; 8] = std::array::from_fn(|lane| value(eight.start() + lane));
    f32x8::from_slice(eight.simd(), &values)
}
