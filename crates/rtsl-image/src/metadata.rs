//! What a file says of how its image was made.

/// How an image was made.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImageMetadata {
    /// Samples a pixel.
    pub samples: Option<u32>,
    /// The sampler's seed.
    pub seed: Option<u64>,
}

impl ImageMetadata {
    /// The program that made it.
    pub fn software(&self) -> String {
        format!("RTSL {}", env!("CARGO_PKG_VERSION"))
    }

    /// The rest, as one line.
    pub fn comment(&self) -> Option<String> {
        let samples = self.samples.map(|samples| format!("samples {samples}"));
        let seed = self.seed.map(|seed| format!("seed {seed}"));
        let parts: Vec<String> = [samples, seed].into_iter().flatten().collect();
        (!parts.is_empty()).then(|| parts.join(", "))
    }
}
