//! Fingerprints: the inputs that a render depends on, as named entries that identify the render of a checkpoint.

use std::collections::BTreeMap;
use std::fmt;

use rtsl_math::sampling::{FilterShape, PixelFilter, Sampler, SamplerKind};
use rtsl_scene::reader::Digest;
use rtsl_scene::{Crop, Settings};

/// The inputs of a render.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Fingerprint {
    entries: BTreeMap<String, FingerprintValue>,
}

/// The value of an entry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FingerprintValue {
    /// A short, readable value.
    Text(String),
    /// The digest of a long value.
    Digest(Digest),
}

impl Fingerprint {
    /// Returns the entries for the settings that affect the image.
    pub fn of_settings(settings: &Settings) -> Self {
        let Settings {
            width,
            height,
            crop,
            imaging,
            // These do not affect the image.
            filename: _,
            exposure: _,
            filter,
            sampler,
            integrator,
            max_depth,
            cutoff,
            roulette_threshold,
            regularize,
            epsilon,
            loop_budget,
        } = settings;
        let mut fingerprint = Fingerprint::default();
        fingerprint.set("size", format!("{width}x{height}"));
        if let Some(Crop { whole, origin }) = crop {
            fingerprint.set("crop", format!("at {origin:?} of {whole:?}"));
        }
        if !imaging.is_radiance() {
            fingerprint.set("film's response", format!("{imaging:?}"));
        }
        fingerprint.set("filter", filter_text(filter));
        fingerprint.set("renderer", integrator.unwrap_or("not chosen"));
        fingerprint.set("depth", max_depth);
        fingerprint.set("roulette threshold", roulette_threshold);
        fingerprint.set("regularization", regularize);
        fingerprint.set("cutoff", cutoff);
        fingerprint
            .set("epsilon", epsilon.map_or("auto".to_owned(), |epsilon| epsilon.to_string()));
        fingerprint.set("loop budget", loop_budget);
        let Sampler { kind, columns, rows, seed } = sampler;
        fingerprint.set("seed", seed);
        let name = match kind {
            SamplerKind::Independent => "independent".to_owned(),
            SamplerKind::Sobol => "sobol".to_owned(),
            // The strata depend on the final number of samples.
            SamplerKind::Stratified { jitter } => {
                let jitter = if *jitter { "" } else { " without jitter" };
                format!("stratified in {columns}x{rows}{jitter}")
            }
        };
        fingerprint.set("sampler", name);
        fingerprint
    }

    /// Sets an entry. Names are short words, because messages contain them.
    pub fn set(&mut self, name: impl Into<String>, value: impl fmt::Display) {
        self.set_value(name, FingerprintValue::Text(value.to_string()));
    }

    /// Sets an entry to the digest of a long value.
    pub fn set_digest(&mut self, name: impl Into<String>, digest: Digest) {
        self.set_value(name, FingerprintValue::Digest(digest));
    }

    /// Sets an entry.
    pub fn set_value(&mut self, name: impl Into<String>, value: FingerprintValue) {
        self.entries.insert(name.into(), value);
    }

    /// Returns all entries, sorted by name.
    pub fn entries(&self) -> impl ExactSizeIterator<Item = (&str, &FingerprintValue)> {
        self.entries.iter().map(|(name, value)| (name.as_str(), value))
    }

    /// Returns the fingerprint with one digest in the place of those of files, for sums that are small and many.
    #[must_use]
    pub fn condensed(&self) -> Fingerprint {
        let mut condensed = Fingerprint::default();
        let mut files = Vec::new();
        for (name, value) in self.entries() {
            match value {
                FingerprintValue::Text(text) => condensed.set(name, text),
                FingerprintValue::Digest(Digest(bytes)) => {
                    files.extend((name.len() as u64).to_le_bytes());
                    files.extend(name.as_bytes());
                    files.extend(bytes);
                }
            }
        }
        if !files.is_empty() {
            condensed.set_digest("a file of the scene", Digest::of(&files));
        }
        condensed
    }

    /// Returns the first entry that differs between a checkpoint's fingerprint and that of the render to be resumed.
    pub fn difference(&self, render: &Fingerprint) -> Option<Difference> {
        let names = self.entries.keys().chain(render.entries.keys());
        let differs = |name: &&String| self.entries.get(*name) != render.entries.get(*name);
        let name = names.filter(differs).min()?;
        Some(Difference {
            checkpoint: self.entries.get(name).cloned(),
            render: render.entries.get(name).cloned(),
            name: name.clone(),
        })
    }
}

/// A difference between two fingerprints.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The entry's name.
    pub name: String,
    /// The value in the checkpoint.
    pub checkpoint: Option<FingerprintValue>,
    /// The value in the render.
    pub render: Option<FingerprintValue>,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = &self.name;
        match (&self.checkpoint, &self.render) {
            (Some(FingerprintValue::Text(checkpoint)), Some(FingerprintValue::Text(render))) => {
                write!(f, "the checkpoint has {name} {checkpoint}, the render {name} {render}")
            }
            (Some(_), Some(_)) => write!(f, "{name} has changed since the checkpoint"),
            (Some(_), None) => write!(f, "the checkpoint has {name}, but the render does not"),
            (None, Some(_)) => write!(f, "the render has {name}, but the checkpoint does not"),
            (None, None) => write!(f, "neither has {name}"),
        }
    }
}

fn filter_text(filter: &PixelFilter) -> String {
    let shape = match filter.shape() {
        FilterShape::Box => "box".to_owned(),
        FilterShape::Triangle => "triangle".to_owned(),
        FilterShape::Gaussian { sigma } => format!("gaussian of sigma {sigma}"),
        FilterShape::Mitchell { b, c } => format!("mitchell of B {b} and C {c}"),
        FilterShape::BlackmanHarris => "blackmanharris".to_owned(),
        FilterShape::Sinc { tau } => format!("sinc of tau {tau}"),
    };
    let [x, y] = filter.radius();
    format!("{shape}, radius {x} by {y}")
}

#[cfg(test)]
mod tests {
    use rtsl_scene::Imaging;

    use super::*;

    fn fingerprint(seed: u64) -> Fingerprint {
        let mut settings = Settings::default();
        settings.sampler.seed = seed;
        Fingerprint::of_settings(&settings)
    }

    #[test]
    fn a_difference_names_its_entry() {
        assert_eq!(fingerprint(3).difference(&fingerprint(3)), None);
        let said = |a: &Fingerprint, b: &Fingerprint| a.difference(b).unwrap().to_string();
        let three = fingerprint(3);
        assert_eq!(said(&three, &fingerprint(4)), "the checkpoint has seed 3, the render seed 4");
        let mut with_file = three.clone();
        with_file.set_digest("scene.pbrt", Digest::of(b"Shape \"Sphere\""));
        assert_eq!(
            said(&with_file, &three),
            "the checkpoint has scene.pbrt, but the render does not"
        );
        assert_eq!(
            said(&three, &with_file),
            "the render has scene.pbrt, but the checkpoint does not"
        );
        let mut edited = with_file.clone();
        edited.set_digest("scene.pbrt", Digest::of(b"Shape \"Disk\""));
        assert_eq!(said(&with_file, &edited), "scene.pbrt has changed since the checkpoint");
    }

    #[test]
    fn every_setting_that_counts_is_in_it() {
        let plain = Settings::default();
        let filter = PixelFilter::new(FilterShape::Triangle, [1.0; 2]);
        let crop = Some(Crop { whole: [2000, 1000], origin: [3, 0] });
        let imaging = Imaging { scale: 2.0, ..Imaging::default() };
        let changed: [(&str, Settings); 8] = [
            ("crop", Settings { crop, ..plain.clone() }),
            ("film's response", Settings { imaging, ..plain.clone() }),
            ("size", Settings { width: 3, ..plain.clone() }),
            ("filter", Settings { filter, ..plain.clone() }),
            ("depth", Settings { max_depth: 9, ..plain.clone() }),
            ("cutoff", Settings { cutoff: 0.5, ..plain.clone() }),
            ("epsilon", Settings { epsilon: Some(0.1), ..plain.clone() }),
            ("loop budget", Settings { loop_budget: 7, ..plain.clone() }),
        ];
        for (name, settings) in changed {
            let (a, b) = (Fingerprint::of_settings(&plain), Fingerprint::of_settings(&settings));
            assert_eq!(a.difference(&b).unwrap().name, name);
        }
        let elsewhere =
            Settings { filename: Some("b.png".to_owned()), exposure: 2.0, ..plain.clone() };
        assert_eq!(Fingerprint::of_settings(&plain), Fingerprint::of_settings(&elsewhere));
    }
}
