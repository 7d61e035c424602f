//! Metadata in image files about how the image was made.

/// The parameters of a render.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImageMetadata {
    /// Samples per pixel.
    pub samples: Option<u32>,
    /// The sampler's seed.
    pub seed: Option<u64>,
}

impl ImageMetadata {
    /// Returns the name of the program that made it.
    pub fn software(&self) -> String {
        format!("RTSL {}", env!("CARGO_PKG_VERSION"))
    }

    /// Returns the parameters as one line.
    pub fn comment(&self) -> Option<String> {
        let samples = self.samples.map(|samples| format!("samples {samples}"));
        let seed = self.seed.map(|seed| format!("seed {seed}"));
        let parts: Vec<String> = [samples, seed].into_iter().flatten().collect();
        (!parts.is_empty()).then(|| parts.join(", "))
    }
}
