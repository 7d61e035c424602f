//! Wavefronts of paths.

use rtsl_bvh::RayPacket;

use super::features::PathFeatures;
use crate::surfaces::ObjectHit;

/// The number of samples of each pixel in a wavefront: with 64 pixels these are a thousand paths, which fit into
/// caches.
pub const SAMPLES_IN_WAVEFRONT: u32 = 16;

/// The state of a path between surfaces. It occupies two cache lines; numbers that are read together are grouped in
/// fours.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Path {
    /// The origin of its ray, in world space.
    pub origin: [f32; 3],
    /// The least parameter of a hit (exclusive).
    pub epsilon: f32,
    /// The direction of its ray; of unit length except for camera rays.
    pub direction: [f32; 3],
    /// The greatest parameter of a hit (exclusive); once a hit is found, its parameter.
    pub distance: f32,
    /// The greatest parameter of a hit, which does not change.
    pub limit: f32,
    /// The weight of radiance along its ray.
    pub throughput: [f32; 3],
    /// The density of its direction per solid angle; 0 if it was not chosen by a density.
    pub density: f32,
    /// The radiance so far.
    pub radiance: [f32; 3],
    /// The time within the shutter.
    pub time: f32,
    /// The width of its ray at the origin.
    pub width: f32,
    /// The increase of width per unit of length.
    pub spread: f32,
    /// The key of its random sequence.
    pub key: u32,
    /// The index of its sample.
    pub sample: u32,
    /// The geometric normal at the ray's origin, on the side from which the previous ray came, in world space.
    pub geometric_normal: [f32; 3],
    /// The shading normal there.
    pub shading_normal: [f32; 3],
    /// True if the cause of values that are not finite was reported for this path.
    pub is_blamed: bool,
}

impl Path {
    /// A path that hits nothing.
    pub const NOWHERE: Path = Path {
        origin: [0.0; 3],
        epsilon: 0.0,
        direction: [0.0, 0.0, 1.0],
        distance: f32::INFINITY,
        limit: f32::INFINITY,
        throughput: [1.0; 3],
        density: 0.0,
        radiance: [0.0; 3],
        time: 0.0,
        width: 0.0,
        spread: 0.0,
        geometric_normal: [0.0, 0.0, 1.0],
        shading_normal: [0.0, 0.0, 1.0],
        key: 0,
        sample: 0,
        is_blamed: false,
    };
}

impl Path {
    /// Creates a path that begins with a lane's ray.
    pub fn from_ray(rays: &RayPacket, lane: usize, key: u32, sample: u32) -> Self {
        Path {
            origin: rays.origin_of(lane),
            epsilon: rays.epsilon[lane],
            direction: rays.direction_of(lane),
            distance: rays.limit[lane],
            limit: rays.limit[lane],
            time: rays.time[lane],
            key,
            sample,
            ..Path::NOWHERE
        }
    }
}

/// A hit in terms of the scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct PathHit {
    /// The index of the path.
    pub path: u32,
    /// The object.
    pub object: u32,
    /// The index of its element.
    pub element: u32,
    /// The instance that places it; [`NO_INSTANCE`] for the world.
    pub instance: u32,
}

impl PathHit {
    /// Returns the object that was hit.
    #[inline(always)]
    pub fn object_hit(&self) -> ObjectHit {
        let PathHit { object, element, instance, .. } = *self;
        ObjectHit { object, element, instance: (instance != NO_INSTANCE).then_some(instance) }
    }
}

/// The value for objects that no instance places.
pub const NO_INSTANCE: u32 = u32::MAX;

/// Paths that are traced together, with their hits.
#[derive(Default)]
pub struct Wavefront {
    /// The paths.
    pub paths: Vec<Path>,
    /// The features of their first surfaces, if they are needed; else empty.
    pub features: Vec<PathFeatures>,
    /// The indices of paths whose rays are not traced yet.
    pub active: Vec<u32>,
    /// The indices of paths whose rays left the scene.
    pub left: Vec<u32>,
    /// The group and the hit of each other path, in the order found.
    pub hits: Vec<(u32, PathHit)>,
    /// The hits sorted by group.
    pub sorted: Vec<PathHit>,
    /// For each group the end of its hits in `sorted`.
    pub ends: Vec<usize>,
}

impl Wavefront {
    /// Sorts the hits by group; within a group they keep their order.
    pub fn sort(&mut self, groups: usize) {
        self.ends.clear();
        self.ends.resize(groups, 0);
        for (group, _) in &self.hits {
            self.ends[*group as usize] += 1;
        }
        let mut next = 0;
        for end in &mut self.ends {
            (*end, next) = (next, next + *end);
        }
        self.sorted.clear();
        self.sorted.resize(self.hits.len(), PathHit::default());
        for (group, hit) in &self.hits {
            let place = &mut self.ends[*group as usize];
            self.sorted[*place] = *hit;
            *place += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hits_are_sorted_by_group_and_keep_their_order() {
        let hits = [2, 0, 2, 1, 0].into_iter().zip(0..);
        let hits = hits.map(|(group, path)| (group, PathHit { path, ..PathHit::default() }));
        let mut wavefront = Wavefront { hits: hits.collect(), ..Wavefront::default() };
        wavefront.sort(4);
        let paths: Vec<u32> = wavefront.sorted.iter().map(|hit| hit.path).collect();
        assert_eq!(
            (paths.as_slice(), wavefront.ends.as_slice()),
            ([1, 4, 3, 0, 2].as_slice(), [2, 3, 5, 5].as_slice())
        );
        assert_eq!(size_of::<Path>(), 128);
    }
}
