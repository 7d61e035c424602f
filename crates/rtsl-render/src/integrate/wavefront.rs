//! Wavefronts of paths.

use rtsl_bvh::RayPacket;

use crate::film::features::FeatureValues;

/// The number of samples of each pixel in a wavefront: with 64 pixels these are a thousand paths, which fit into
/// caches.
pub const SAMPLES_IN_WAVEFRONT: u32 = 16;

/// Returns the number of tiles of a wavefront: several for pictures of few samples, so that vectors are filled well,
/// but some wavefronts for each thread, so that all threads end at about the same time.
pub fn tiles_of_wavefront(samples: u32, tiles: usize, threads: usize) -> usize {
    const WAVEFRONTS_OF_THREAD: usize = 8;
    let fitting = SAMPLES_IN_WAVEFRONT / samples.clamp(1, SAMPLES_IN_WAVEFRONT);
    (fitting as usize).min(tiles / (threads * WAVEFRONTS_OF_THREAD)).max(1)
}

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
    /// A bound of the weight of its radiance in the pixel.
    pub importance: f32,
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
        radiance: [0.0; 3],
        time: 0.0,
        width: 0.0,
        spread: 0.0,
        geometric_normal: [0.0, 0.0, 1.0],
        shading_normal: [0.0, 0.0, 1.0],
        key: 0,
        sample: 0,
        importance: 1.0,
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

/// The value for objects that no instance places.
pub const NO_INSTANCE: u32 = u32::MAX;

/// Paths that are traced together, with their hits.
#[derive(Default)]
pub struct Wavefront {
    /// The paths.
    pub paths: Vec<Path>,
    /// Their features, as far as they are kept.
    pub features: FeatureValues,
    /// The indices of paths whose rays are not traced yet.
    pub active: Vec<u32>,
    /// The indices of paths whose rays left the scene.
    pub left: Vec<u32>,
    /// The hits of the other paths, in the order found.
    pub hits: Vec<PathHit>,
}
