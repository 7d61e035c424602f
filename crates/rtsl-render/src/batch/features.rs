//! What the camera rays of a wave meet besides light: features of pixels.

use rtsl_bvh::LANES;
use rtsl_image::Aov;

/// What the first surface of a path is.
#[derive(Clone, Copy, Debug)]
pub struct PathFeatures {
    /// What it reflects of white light from all around, by one sample; of a light what it emits, at most 1.
    pub albedo: [f32; 3],
    /// Its normal for shading, in world space; zero where nothing is hit.
    pub normal: [f32; 3],
    /// Its distance; infinite where nothing is hit.
    pub distance: f32,
    /// The number of the object; -1 for none.
    pub object: f32,
}

impl PathFeatures {
    /// Nothing is hit.
    pub const NONE: PathFeatures =
        PathFeatures { albedo: [0.0; 3], normal: [0.0; 3], distance: f32::INFINITY, object: -1.0 };
}

/// Sums of the features of a tile's samples.
#[derive(Clone, Debug)]
pub struct FeatureSums {
    /// Of albedo.
    pub albedo: [[f64; 3]; LANES],
    /// Of normals.
    pub normal: [[f64; 3]; LANES],
    /// Of the distances of those that hit anything.
    pub distance: [f64; LANES],
    /// How many of them do.
    pub hits: [u32; LANES],
    /// The object of the first sample.
    pub object: [f32; LANES],
}

impl FeatureSums {
    /// No samples.
    pub const NONE: FeatureSums = FeatureSums {
        albedo: [[0.0; 3]; LANES],
        normal: [[0.0; 3]; LANES],
        distance: [0.0; LANES],
        hits: [0; LANES],
        object: [-1.0; LANES],
    };

    /// Adds those of one sample of each pixel.
    pub fn add(&mut self, features: &[PathFeatures], is_first: bool) {
        for (lane, features) in features.iter().enumerate().take(LANES) {
            let PathFeatures { albedo, normal, distance, object } = features;
            for channel in 0..3 {
                let albedo = f64::from(albedo[channel]);
                self.albedo[lane][channel] += if albedo.is_finite() { albedo } else { 0.0 };
                self.normal[lane][channel] += f64::from(normal[channel]);
            }
            if distance.is_finite() {
                self.distance[lane] += f64::from(*distance);
                self.hits[lane] += 1;
            }
            if is_first {
                self.object[lane] = *object;
            }
        }
    }
}

/// Whether an image of something else than colour is made of features.
pub fn is_feature(aov: Aov) -> bool {
    match aov {
        Aov::Albedo | Aov::Distance | Aov::Normal | Aov::Object | Aov::Class => true,
        Aov::Samples | Aov::Variance | Aov::Time | Aov::Nodes | Aov::Lanes => false,
    }
}
