//! The inputs by which renders are told apart.

use rtsl::{Engine, Math};
use rtsl_scene::reader::Digest;
use rtsl_scene::{LoadOptions, RENDERERS, Settings};

use crate::checkpoint::Fingerprint;
use crate::film::features::Features;

/// The inputs of a render besides its settings. Checkpoints and sums of one render are refused by others.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RenderIdentity {
    /// The files that were read, with digests of their contents.
    pub files: Vec<(String, Digest)>,
    /// The mode of arithmetic; if its results vary between machines, the properties that they depend on too.
    pub arithmetic: String,
    /// The options of loading the scene.
    pub options: LoadOptions,
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
        let LoadOptions { defines, camera, studio, integrator, .. } = &self.options;
        fingerprint.set("parameters set", defines.join(" "));
        // The settings tell renderers.
        if let Some(integrator) = integrator.as_deref().filter(|it| !RENDERERS.contains(it)) {
            fingerprint.set("integrator", integrator);
        }
        if let Some(camera) = camera {
            fingerprint.set("camera", camera);
        }
        if *studio {
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
