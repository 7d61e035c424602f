//! Transforms of the objects that the lanes of a batch hit.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};
use rtsl_math::Affine;

use super::shading_batch::{BATCH_LANES, Row};
use super::wavefront::{NO_INSTANCE, PathHit};
use crate::compiled::CompiledScene;
use crate::compiled::compiled_scene::Object;
use crate::lanes::eight::{Eight, Vectors, scaled};
use crate::lanes::fours::fours;
use crate::lanes::lane_maps::LaneMaps;
use crate::lanes::surface_offset::sums;

/// The transforms of the objects of one traversal class. If all lanes have the same object, its transforms are loaded
/// once.
pub struct InstanceTransforms<'a> {
    scene: &'a CompiledScene,
    /// The object, if all lanes have the same.
    object: Option<&'a Object>,
    /// The extents of the bounding box that was hit, if all lanes have the same.
    extents: Option<[f32; 3]>,
    /// True if the objects have transforms to their group's space.
    is_placed: bool,
    /// True if no instance places them.
    is_in_world: bool,
}

/// The hits of the lanes, and their times within the shutter.
pub type SurfacePoints<'a> = (&'a [PathHit; BATCH_LANES], &'a Row);

impl<'a> InstanceTransforms<'a> {
    /// Returns the transforms of the objects of these hits.
    pub fn new(scene: &'a CompiledScene, class: u32, hits: &[PathHit]) -> Self {
        let (first, element) = hits.first().map_or((0, 0), |hit| (hit.object, hit.element));
        let is_one = hits.iter().all(|hit| hit.object == first);
        let is_one_element = is_one && hits.iter().all(|hit| hit.element == element);
        InstanceTransforms {
            scene,
            object: is_one.then(|| &scene.objects[first as usize]),
            extents: is_one_element.then(|| scene.extents.lengths(first, element)),
            is_placed: scene.classes[class as usize].is_placed(),
            is_in_world: scene.geometry.instances.is_empty()
                || hits.iter().all(|hit| hit.instance == NO_INSTANCE),
        }
    }

    /// Returns the scene.
    pub fn scene(&self) -> &'a CompiledScene {
        self.scene
    }

    /// True if the objects have transforms to their group's space.
    pub fn is_placed(&self) -> bool {
        self.is_placed
    }

    /// True if no instance places them.
    pub fn is_in_world(&self) -> bool {
        self.is_in_world
    }

    fn object_of(&self, hit: &PathHit) -> &'a Object {
        &self.scene.objects[hit.object as usize]
    }

    /// Returns the transforms from the world's space to those of the objects' groups.
    #[inline(always)]
    pub fn group_inverses<S: Simd>(
        &self,
        eight: Eight<S>,
        (hits, times): SurfacePoints<'_>,
    ) -> LaneMaps<S> {
        LaneMaps::each(eight, |lane| {
            let instance = hits[lane].instance;
            match self.scene.placement(instance).filter(|_| instance != NO_INSTANCE) {
                None => Affine::IDENTITY,
                Some(placement) => placement.inverse_at(times[lane]),
            }
        })
    }

    /// The transforms from the spaces of the objects' groups to the world's.
    #[inline(always)]
    fn group_maps<S: Simd>(
        &self,
        eight: Eight<S>,
        (hits, times): SurfacePoints<'_>,
    ) -> LaneMaps<S> {
        LaneMaps::each(eight, |lane| {
            let instance = hits[lane].instance;
            match self.scene.placement(instance).filter(|_| instance != NO_INSTANCE) {
                None => Affine::IDENTITY,
                Some(placement) => placement.map_at(times[lane]),
            }
        })
    }

    /// Returns the transforms from the spaces of the objects' groups to their own.
    #[inline(always)]
    pub fn inverses<S: Simd>(&self, eight: Eight<S>, (hits, _): SurfacePoints<'_>) -> LaneMaps<S> {
        match self.object {
            Some(object) => LaneMaps::same(eight, &object.inverse),
            None => LaneMaps::gathered(eight, |lane| &self.object_of(&hits[lane]).inverse),
        }
    }

    /// The transforms from the objects' own spaces to those of their groups.
    #[inline(always)]
    fn maps<S: Simd>(&self, eight: Eight<S>, (hits, _): SurfacePoints<'_>) -> LaneMaps<S> {
        match self.object {
            Some(object) => LaneMaps::same(eight, &object.forward),
            None => LaneMaps::gathered(eight, |lane| &self.object_of(&hits[lane]).forward),
        }
    }

    /// Returns the magnitudes that bound the rounding errors of hit points in the world, given those of the rays: on
    /// the way to the objects' spaces, and back.
    #[inline(always)]
    pub fn sizes_of_points<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: SurfacePoints<'_>,
        of_rays: &Vectors<S>,
    ) -> Vectors<S> {
        let (hits, _) = lanes;
        let extents = match self.extents {
            Some(extents) => eight.splat_vector(extents),
            None => {
                let [x, y, z, _] = fours(eight.simd(), |lane| {
                    let PathHit { object, element, .. } = hits[eight.start() + lane];
                    let [x, y, z] = self.scene.extents.lengths(object, element);
                    [x, y, z, 0.0]
                });
                [x, y, z]
            }
        };
        if self.is_in_world {
            return self.sizes_in_group(eight, lanes, &sums(of_rays, &extents));
        }
        let in_group = self.group_inverses(eight, lanes).of_sizes().points(of_rays);
        let in_group = self.sizes_in_group(eight, lanes, &sums(&in_group, &extents));
        sums(of_rays, &self.group_maps(eight, lanes).of_sizes().vectors(&in_group))
    }

    /// The magnitudes in the groups' spaces that result from these magnitudes through the objects' spaces, and from
    /// these themselves.
    #[inline(always)]
    fn sizes_in_group<S: Simd>(
        &self,
        eight: Eight<S>,
        (hits, _): SurfacePoints<'_>,
        sizes: &Vectors<S>,
    ) -> Vectors<S> {
        if !self.is_placed {
            return *sizes;
        }
        let maps = match self.object {
            Some(object) => LaneMaps::same(eight, &object.sizes),
            None => LaneMaps::gathered(eight, |lane| &self.object_of(&hits[lane]).sizes),
        };
        sums(sizes, &maps.points(sizes))
    }

    /// Transforms points of the world to the objects' spaces.
    #[inline(always)]
    pub fn local_points<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: SurfacePoints<'_>,
        points: &Vectors<S>,
    ) -> Vectors<S> {
        let mut points = *points;
        if !self.is_in_world {
            points = self.group_inverses(eight, lanes).points(&points);
        }
        if self.is_placed {
            points = self.inverses(eight, lanes).points(&points);
        }
        points
    }

    /// Transforms points of the objects' spaces to the world's.
    #[inline(always)]
    pub fn points<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: SurfacePoints<'_>,
        points: &Vectors<S>,
    ) -> Vectors<S> {
        let mut points = *points;
        if self.is_placed {
            points = self.maps(eight, lanes).points(&points);
        }
        if !self.is_in_world {
            points = self.group_maps(eight, lanes).points(&points);
        }
        points
    }

    /// Transforms vectors of the objects' spaces to the world's.
    #[inline(always)]
    pub fn vectors<S: Simd>(
        &self,
        eight: Eight<S>,
        lanes: SurfacePoints<'_>,
        vectors: &Vectors<S>,
    ) -> Vectors<S> {
        let mut vectors = *vectors;
        if self.is_placed {
            vectors = self.maps(eight, lanes).vectors(&vectors);
        }
        if !self.is_in_world {
            vectors = self.group_maps(eight, lanes).vectors(&vectors);
        }
        vectors
    }

    /// Transforms normals of the objects' spaces to the world's, of any length, with the orientation of the objects.
    #[inline(always)]
    pub fn normals<S: Simd, const N: usize>(
        &self,
        eight: Eight<S>,
        lanes: SurfacePoints<'_>,
        mut normals: [Vectors<S>; N],
    ) -> [Vectors<S>; N] {
        if self.is_placed {
            let maps = self.inverses(eight, lanes);
            for normals in &mut normals {
                *normals = maps.transposed_vectors(normals);
            }
        }
        let side = self.sides(eight, lanes);
        for normals in &mut normals {
            *normals = scaled(normals, side);
        }
        if !self.is_in_world {
            let maps = self.group_inverses(eight, lanes);
            for normals in &mut normals {
                *normals = maps.transposed_vectors(normals);
            }
        }
        normals
    }

    /// -1 for objects with reversed orientation, else 1.
    #[inline(always)]
    fn sides<S: Simd>(&self, eight: Eight<S>, (hits, _): SurfacePoints<'_>) -> f32x8<S> {
        let side = |object: &Object| if object.reverse_orientation { -1.0 } else { 1.0 };
        match self.object {
            Some(object) => eight.splat(side(object)),
            None => numbers(eight, |lane| side(self.object_of(&hits[lane]))),
        }
    }

    /// Returns the factors by which volumes of the objects' spaces are scaled to the world's.
    #[inline(always)]
    pub fn volume_scales<S: Simd>(
        &self,
        eight: Eight<S>,
        (hits, times): SurfacePoints<'_>,
    ) -> f32x8<S> {
        let own = match self.object {
            Some(object) => eight.splat(object.volume_scale),
            None => numbers(eight, |lane| self.object_of(&hits[lane]).volume_scale),
        };
        if self.is_in_world {
            return own;
        }
        let of_group = numbers(eight, |lane| {
            let placement = self.scene.placement(hits[lane].instance);
            placement.map_or(1.0, |it| it.volume_scale(times[lane]) as f32)
        });
        own * of_group
    }
}

/// Evaluates a function for each of eight lanes.
#[inline(always)]
fn numbers<S: Simd>(eight: Eight<S>, number: impl Fn(usize) -> f32) -> f32x8<S> {
    let numbers: [f32; 8] = std::array::from_fn(|lane| number(eight.start() + lane));
    f32x8::from_slice(eight.simd(), &numbers)
}
