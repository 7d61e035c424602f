//! Pixel features: AOVs of the first surfaces of a wavefront's paths.

use rtsl_bvh::LANES;
use rtsl_image::Aov;

/// The features of a path's first surface.
#[derive(Clone, Copy, Debug)]
pub struct PathFeatures {
    /// The reflectance of uniform white light, estimated by one sample; for a light its emission, at most 1.
    pub albedo: [f32; 3],
    /// The shading normal in world space; zero without a hit.
    pub normal: [f32; 3],
    /// The distance; infinite without a hit.
    pub distance: f32,
    /// The index of the object; -1 without a hit.
    pub object: f32,
}

impl PathFeatures {
    /// The features without a hit.
    pub const NONE: PathFeatures =
        PathFeatures { albedo: [0.0; 3], normal: [0.0; 3], distance: f32::INFINITY, object: -1.0 };
}

/// Sums of the features of a tile's samples.
#[derive(Clone, Debug)]
pub struct FeatureSums {
    /// The sums of albedo.
    pub albedo: [[f64; 3]; LANES],
    /// The sums of normals.
    pub normal: [[f64; 3]; LANES],
    /// The sums of distances over samples with a hit.
    pub distance: [f64; LANES],
    /// The number of samples with a hit.
    pub hits: [u32; LANES],
    /// The object of the first sample.
    pub object: [f32; LANES],
}

impl FeatureSums {
    /// Without samples.
    pub const NONE: FeatureSums = FeatureSums {
        albedo: [[0.0; 3]; LANES],
        normal: [[0.0; 3]; LANES],
        distance: [0.0; LANES],
        hits: [0; LANES],
        object: [-1.0; LANES],
    };

    /// Adds the features of successive samples of the pixel of a lane.
    pub fn add(&mut self, lane: usize, features: &[PathFeatures], are_first: bool) {
        for PathFeatures { albedo, normal, distance, .. } in features {
            for channel in 0..3 {
                let albedo = f64::from(albedo[channel]);
                self.albedo[lane][channel] += if albedo.is_finite() { albedo } else { 0.0 };
                self.normal[lane][channel] += f64::from(normal[channel]);
            }
            if distance.is_finite() {
                self.distance[lane] += f64::from(*distance);
                self.hits[lane] += 1;
            }
        }
        if let (true, Some(first)) = (are_first, features.first()) {
            self.object[lane] = first.object;
        }
    }
}

/// True if an AOV is computed from features.
pub fn is_feature(aov: Aov) -> bool {
    match aov {
        Aov::Albedo | Aov::Distance | Aov::Normal | Aov::Object | Aov::Class => true,
        Aov::Samples | Aov::Variance | Aov::Time | Aov::Nodes | Aov::Lanes => false,
    }
}
