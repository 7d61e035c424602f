//! The reasons for which a picture can be black: nothing shines, nothing is there, or a material does nothing.

use std::collections::BTreeSet;

use rtsl::{Diagnostic, Method, diagnostic_codes as codes};
use rtsl_image::Image;
use rtsl_scene::Scene;

/// The parts that a picture needs and its scene lacks.
pub(crate) struct Darkness {
    reasons: Vec<String>,
}

impl Darkness {
    /// Finds what the scene lacks for a picture by paths or by `shade`. Integrators that the scene names may need no
    /// light.
    pub(crate) fn of(scene: &Scene) -> Darkness {
        let mut reasons = Vec::new();
        if scene.integrator.is_some() {
            return Darkness { reasons };
        }
        if scene.objects.is_empty() && scene.lights.is_empty() {
            reasons.push("the scene has neither shapes nor lights".to_owned());
        } else if scene.lights.is_empty() && scene.ambient == [0.0; 3] {
            reasons.push(
                "the scene has no light source; only materials with `emission` could shine"
                    .to_owned(),
            );
        }
        let scatters = [Method::Shade, Method::Bsdf, Method::Emission];
        let idle = scene
            .materials
            .iter()
            .map(|it| it.class())
            .filter(|class| scatters.iter().all(|method| !class.methods.contains_key(method)));
        let idle: BTreeSet<&str> = idle.map(|class| class.name.as_str()).collect();
        reasons.extend(idle.into_iter().map(|name| {
            format!("the material `{name}` has no `BSDF`, `emission` or `shade`: it is black")
        }));
        Darkness { reasons }
    }

    /// Returns the warning about a picture that is black for these reasons.
    pub(crate) fn warning(&self, image: &Image) -> Option<Diagnostic> {
        let is_black = image.pixels.iter().flatten().all(|value| *value == 0.0);
        if self.reasons.is_empty() || !is_black {
            return None;
        }
        let warning = Diagnostic::new(codes::BLACK_PICTURE, "the picture is black");
        Some(self.reasons.iter().fold(warning, |warning, reason| warning.note(reason.clone())))
    }
}
