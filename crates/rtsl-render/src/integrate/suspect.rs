//! The causes of radiance that is infinite or NaN, and of loops that run for too long.
//!
//! Stages that are linked with materials and lights do not tell which of them returned what. A path whose radiance is
//! not finite, or whose stage exceeded its loop budget, is therefore evaluated again on the interpreter, which has the
//! same bits and asks the host for each value.

use rtsl::host::{LaneSet, LaneWords};
use rtsl::{Method, Query};

use super::host::SceneHost;
use crate::compiled::material::shading_method;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;

/// A method whose values were not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Suspect {
    /// A method of the material of an object.
    Material { object: u32, method: Method },
    /// `emission` of the area light that an object is.
    AreaLight { object: u32 },
    /// The method that computes the samples of a light, by its entry.
    LightSample { entry: u32 },
    /// A method of an environment light, by its index.
    Sky { sky: u32, method: Method },
    /// A call of `shade`, which reports what it calls by itself.
    Shade,
}

/// Reports a suspect; the integrator if there is none.
pub fn report_suspect(scene: &RenderScene, errors: &RuntimeErrors, suspect: Option<Suspect>) {
    let material = |object: u32| {
        let key = &scene.keys[scene.objects[object as usize].group as usize];
        (key, scene.classes().material_of(key).class().name.as_str())
    };
    let (class, method) = match suspect {
        None => (scene.integrator.name(), Method::Radiance),
        Some(Suspect::Shade) => return,
        Some(Suspect::Material { object, method }) => (material(object).1, method),
        Some(Suspect::AreaLight { object }) => {
            let (key, own) = material(object);
            let emitter = key.emitter.map(|(class, _)| &scene.materials[class].program);
            (emitter.map_or(own, |it| &it.class().name), Method::Emission)
        }
        Some(Suspect::LightSample { entry }) => {
            scene.lights.sampled_method(entry, &scene.materials)
        }
        Some(Suspect::Sky { sky, method }) => {
            (scene.lights.skies[sky as usize].program.class().name.as_str(), method)
        }
    };
    errors.report_not_finite(class, method, 1);
}

impl SceneHost<'_> {
    /// Notes the suspects among the answers to a query, for rays that have none yet.
    pub fn note_suspects(
        &mut self,
        lanes: LaneSet,
        query: Query,
        operands: &[LaneWords],
        results: &[LaneWords],
    ) {
        for (place, lane) in lanes.iter().enumerate() {
            let ray = self.ray_of(lanes, lane);
            if !are_usable(query, results, lane) && self.rays[ray].suspect.is_none() {
                self.rays[ray].suspect = self.suspect(query, operands[0][lane], place);
            }
        }
    }

    /// Returns the method that shades an object.
    pub fn shading_suspect(&self, object: u32) -> Suspect {
        let scene = self.tracer.scene;
        let key = scene.objects.get(object as usize).map(|entry| &scene.keys[entry.group as usize]);
        let program = key.map(|key| scene.classes().material_of(key));
        let method = program.and_then(|program| shading_method(program));
        Suspect::Material { object, method: method.unwrap_or(Method::Shade) }
    }

    /// Returns who answered a query whose first operand is `first`, the `place`th of a call.
    fn suspect(&self, query: Query, first: u32, place: usize) -> Option<Suspect> {
        let material = |method: Method| Some(Suspect::Material { object: first, method });
        match query {
            Query::Emission => {
                let scene = self.tracer.scene;
                let entry = scene.objects.get(first as usize)?;
                let is_shaded = scene.keys[entry.group as usize].is_shaded(&scene.classes());
                if is_shaded { Some(Suspect::Shade) } else { material(Method::Emission) }
            }
            Query::Shade => Some(Suspect::Shade),
            Query::OwnShade => Some(self.shading_suspect(first)),
            Query::LightEmission => Some(Suspect::AreaLight { object: first }),
            Query::Bsdf => material(Method::Bsdf),
            Query::BsdfPdf => material(Method::EvaluatePdf),
            Query::SampleBsdf => material(Method::SampleBsdf),
            Query::SampleLight | Query::UnshadowedLight => {
                Some(Suspect::LightSample { entry: self.queries.light.chosen(place) })
            }
            Query::SkyEmission => Some(Suspect::Sky { sky: first, method: Method::Emission }),
            Query::SkyPdf => Some(Suspect::Sky { sky: first, method: Method::EvaluatePdf }),
            Query::NearestHit
            | Query::SurfaceProperties
            | Query::LightPdf
            | Query::SkyCount
            | Query::Contribute
            | Query::Spawn
            | Query::SpawnPath
            | Query::Sample
            | Query::SamplePair => None,
        }
    }
}

/// True if the colours among a lane's results are finite and the densities are numbers. Distances may be infinite.
fn are_usable(query: Query, results: &[LaneWords], lane: usize) -> bool {
    let mut left = results.iter().map(|words| f32::from_bits(words[lane]));
    query.results().all(|(name, _, count)| {
        let numbers = left.by_ref().take(count as usize);
        match name {
            "color" => numbers.fold(true, |are_finite, number| are_finite & number.is_finite()),
            "density" => !numbers.fold(false, |is_nan, number| is_nan | number.is_nan()),
            _ => numbers.count() > 0,
        }
    })
}
