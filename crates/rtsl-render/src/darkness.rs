//! The reasons for which a picture can be black: nothing shines, nothing is there, or a material does nothing.

use std::collections::BTreeSet;

use rtsl::{Diagnostic, Method, Query, diagnostic_codes as codes};
use rtsl_image::Image;
use rtsl_scene::Scene;

/// The questions of an integrator about light.
const LIGHT: [Query; 5] =
    [Query::SampleLight, Query::LightEmission, Query::SkyEmission, Query::Emission, Query::Shade];

/// The questions that materials without methods answer with black.
const SCATTERING: [Query; 4] = [Query::Bsdf, Query::SampleBsdf, Query::Emission, Query::Shade];

/// The parts that a picture needs and its scene lacks.
pub(crate) struct Darkness {
    reasons: Vec<String>,
}

impl Darkness {
    /// Finds what the scene lacks for a picture by paths, by `shade`, or by its own integrator, which may need no light
    /// or no material.
    pub(crate) fn of(scene: &Scene) -> Darkness {
        let mut reasons = Vec::new();
        let asks = |queries: &[Query]| {
            scene.integrator.as_ref().is_none_or(|integrator| {
                let mut methods = integrator.class().methods.values();
                methods.any(|method| method.body.asks(|query| queries.contains(&query)))
            })
        };
        let needs_light = asks(&LIGHT);
        if scene.objects.is_empty() && scene.lights.is_empty() {
            let needs_anything = needs_light || asks(&[Query::NearestHit]);
            let reason = "the scene has neither shapes nor lights".to_owned();
            reasons.extend(needs_anything.then_some(reason));
        } else if needs_light && scene.lights.is_empty() && scene.ambient == [0.0; 3] {
            reasons.push(
                "the scene has no light source; only materials with `emission` could shine"
                    .to_owned(),
            );
        }
        let scatters = [Method::Shade, Method::Bsdf, Method::Emission];
        let materials = if asks(&SCATTERING) { scene.materials.as_slice() } else { &[] };
        let idle = materials
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
