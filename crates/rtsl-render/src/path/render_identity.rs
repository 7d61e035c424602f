//! The inputs by which renders are told apart.

use rtsl::{Engine, Math};
use rtsl_scene::Settings;
use rtsl_scene::reader::Digest;

use super::features::Features;
use crate::checkpoint::Fingerprint;

/// The inputs of a render besides its settings. Checkpoints and sums of one render are refused by others.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RenderIdentity {
    /// The files that were read, with digests of their contents.
    pub files: Vec<(String, Digest)>,
    /// The mode of arithmetic; if its results vary between machines, the properties that they depend on too.
    pub arithmetic: String,
    /// The definitions `name.parameter=value`, in order.
    pub defines: Vec<String>,
    /// The integrator that was given in place of the scene's.
    pub integrator: Option<String>,
    /// The camera that was chosen among several.
    pub camera: Option<String>,
    /// True if a studio lights the scene besides its own lights.
    pub studio: bool,
}

impl RenderIdentity {
    /// Returns the identity of a render of these files with an engine in this mode.
    pub fn new(files: Vec<(String, Digest)>, math: Math, engine: &Engine) -> Self {
        RenderIdentity { files, arithmetic: arithmetic(math, engine), ..RenderIdentity::default() }
    }

    fn add_to(&self, fingerprint: &mut Fingerprint) {
        for (name, digest) in &self.files {
            fingerprint.set_digest(name, *digest);
        }
        fingerprint.set("arithmetic", &self.arithmetic);
        fingerprint.set("parameters set", self.defines.join(" "));
        if let Some(integrator) = &self.integrator {
            fingerprint.set("integrator", integrator);
        }
        if let Some(camera) = &self.camera {
            fingerprint.set("camera", camera);
        }
        if self.studio {
            fingerprint.set("studio", "added");
        }
    }
}

/// Returns the fingerprint of a render with these settings, noise target and features. Without an identity its host
/// answers for the scene.
pub fn fingerprint(
    settings: &Settings,
    identity: Option<&RenderIdentity>,
    noise_target: Option<f32>,
    features: &Features,
) -> Fingerprint {
    let mut fingerprint = Fingerprint::of_settings(settings);
    fingerprint.set("version of the program", env!("CARGO_PKG_VERSION"));
    if let Some(identity) = identity {
        identity.add_to(&mut fingerprint);
    }
    let noise = noise_target.map_or("none".to_owned(), |target| target.to_string());
    fingerprint.set("noise target", noise);
    fingerprint.set("first hits", if features.first_hits { "kept" } else { "not kept" });
    let outputs: Vec<&str> = features.outputs().iter().map(|output| &*output.name).collect();
    let outputs = if outputs.is_empty() { "none".to_owned() } else { outputs.join(", ") };
    fingerprint.set("outputs", outputs);
    fingerprint
}

fn arithmetic(math: Math, engine: &Engine) -> String {
    match math {
        Math::Strict => "strict".to_owned(),
        Math::Contract => "contract".to_owned(),
        Math::Fast => {
            let machine = engine.llvm().map_or("the interpreter", |llvm| llvm.host().cpu());
            format!("fast for {} rays at a time on {machine}", engine.width())
        }
    }
}
