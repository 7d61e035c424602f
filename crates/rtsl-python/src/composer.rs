//! Scenes made of parts that Python gives, prepared for renders.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use rtsl::{Diagnostic, Engine, Instance, Messages, diagnostic_codes as codes};
use rtsl_image::Aov;
use rtsl_math::Transform;
use rtsl_render::PixelRequest;
use rtsl_render::compiled::{RenderScene, RenderSceneBuilder, integrator_of};
use rtsl_scene::{
    ComposedShape, Composer, Composition, PlacedLight, RENDERERS, Scene, Settings,
    class_of_renderer,
};

use crate::detached::detached;
use crate::engine::PyEngine;
use crate::error::Exception;
use crate::instance::PyInstance;
use crate::looking::{self, Costs, Inspected};
use crate::partial_render::PyPartialRender;
use crate::scene_text::{PySceneText, with_extent};

/// A matrix, row by row.
type Rows = [[f64; 4]; 4];

/// A shape: the primitive, its material, a material whose emission it gives off, its alpha texture, its place, and
/// whether its normals are flipped.
type ShapeParts = (
    Py<PyInstance>,
    Option<Py<PyInstance>>,
    Option<Py<PyInstance>>,
    Option<Py<PyInstance>>,
    Rows,
    bool,
);

/// The settings that Python gives, in place of those of the scene.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct GivenSettings {
    size: Option<(usize, usize)>,
    spp: Option<u32>,
    seed: Option<u64>,
    max_depth: Option<u32>,
    renderer: Option<String>,
    aovs: Vec<String>,
    noise: Option<f32>,
    /// The sample of each pixel with which the render begins.
    first_sample: u32,
}

/// The parts of a scene.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct GivenParts {
    text: Option<Py<PySceneText>>,
    camera: Option<(Py<PyInstance>, Rows)>,
    integrator: Option<Py<PyInstance>>,
    shapes: Vec<ShapeParts>,
    lights: Vec<(Py<PyInstance>, Rows)>,
    ambient: [f32; 3],
}

impl GivenParts {
    /// True if nothing was added to the scene of a text.
    fn are_of_text(&self) -> bool {
        let GivenParts { text, camera, integrator, shapes, lights, ambient } = self;
        let has_own = camera.is_some() || integrator.is_some() || *ambient != [0.0; 3];
        text.is_some() && !has_own && shapes.is_empty() && lights.is_empty()
    }
}

/// Makes scenes of parts and prepares them. What did not change since the last one is used again.
#[pyclass(name = "Composer", module = "rtsl._rtsl", frozen)]
pub struct PyComposer {
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    composer: Composer,
    last: Option<Last>,
}

/// The scene that was prepared last.
struct Last {
    engine: Py<PyEngine>,
    scene: Scene,
    prepared: Arc<RenderScene>,
    aovs: Vec<Aov>,
}

#[pymethods]
impl PyComposer {
    #[new]
    fn new() -> PyComposer {
        PyComposer { state: Mutex::default() }
    }

    /// Prepares a scene for a render. Returns the render and warnings.
    fn begin(
        &self,
        py: Python<'_>,
        engine: Py<PyEngine>,
        parts: GivenParts,
        settings: GivenSettings,
    ) -> PyResult<(PyPartialRender, String)> {
        let aovs: Vec<Aov> = settings.aovs.iter().map(|name| Aov::from_name(name)).collect();
        let (first_sample, noise) = (settings.first_sample, settings.noise);
        let text = parts.text.as_ref().filter(|_| parts.are_of_text());
        let identity = text.map(|text| text.bind(py).get().identity(engine.get())).transpose()?;
        let composition = composition(py, parts, settings)?;
        let made = engine.get().engine.clone();
        let is_same = |last: &&Last| last.engine.is(&engine);
        let scene = self.compose(py, engine.get(), composition)?;
        let prepared = detached(py, || {
            let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            let mut messages = Messages::default();
            let last = state.last.as_ref().filter(is_same);
            let prepared = prepare(&made, &scene, &aovs, last, &mut messages)?;
            let render = PyPartialRender::new(prepared.clone(), first_sample, noise, identity)?;
            Ok((prepared, render, messages))
        })?;
        let prepared = prepared.map_err(|it: Messages| Exception::Scene.of_messages(&it))?;
        let (prepared, render, messages) = prepared;
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.last = Some(Last { engine, scene, prepared, aovs });
        Ok((render, messages.to_text(false)))
    }

    /// Renders samples of a pixel on an engine with a trace. Returns the colour; the index, the radiance and the recording
    /// of each sample; and warnings.
    fn inspect(
        &self,
        py: Python<'_>,
        engine: &PyEngine,
        parts: GivenParts,
        settings: GivenSettings,
        pixel: [usize; 2],
        samples: (u32, Option<u32>),
    ) -> PyResult<Inspected> {
        let scene = self.compose(py, engine, composition(py, parts, settings)?)?;
        let request = PixelRequest { pixel, first: samples.0, count: samples.1 };
        looking::inspect(py, engine, scene, request)
    }

    /// Measures the costs of lines on an engine that records them. Returns the texts with their lines, the number of
    /// paths, rays at a time, and warnings.
    fn costs(
        &self,
        py: Python<'_>,
        engine: &PyEngine,
        parts: GivenParts,
        settings: GivenSettings,
        threads: Option<usize>,
    ) -> PyResult<Costs> {
        let scene = self.compose(py, engine, composition(py, parts, settings)?)?;
        looking::costs(py, engine, &scene, threads)
    }
}

impl PyComposer {
    /// Composes a scene and chooses its renderer.
    fn compose(
        &self,
        py: Python<'_>,
        engine: &PyEngine,
        composition: Composition,
    ) -> PyResult<Scene> {
        let composed = detached(py, || {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            let mut scene = state.composer.compose(composition)?;
            scene.settings.integrator = Some(integrator_of(&engine.engine, &scene));
            match scene.settings.size_problem() {
                Some(problem) => Err(Messages::one(Diagnostic::new(codes::SCENE_LIMIT, problem))),
                None => Ok(scene),
            }
        })?;
        composed.map_err(|messages| Exception::Scene.of_messages(&messages))
    }
}

/// Prepares a scene, or returns the last one if it is the same.
fn prepare(
    engine: &Engine,
    scene: &Scene,
    aovs: &[Aov],
    last: Option<&Last>,
    messages: &mut Messages,
) -> Result<Arc<RenderScene>, Messages> {
    let is_same = |last: &&Last| {
        last.aovs == aovs
            && last.scene.settings == scene.settings
            && last.scene.camera_to_world == scene.camera_to_world
            && last.scene.has_same_integrator(scene)
            && last.scene.has_same_shapes(scene)
            && last.scene.has_same_shading(scene)
    };
    if let Some(last) = last.filter(is_same) {
        return Ok(last.prepared.clone());
    }
    let earlier = last.map(|last| (&*last.prepared, &last.scene));
    let builder = RenderSceneBuilder::of_changing(engine, scene, earlier).aovs(aovs);
    builder.build(scene, messages).map(Arc::new)
}

fn composition(py: Python<'_>, parts: GivenParts, given: GivenSettings) -> PyResult<Composition> {
    let GivenParts { text, camera, integrator, shapes, lights, ambient } = parts;
    let mut base = text.map(|text| text.bind(py).get().scene()).transpose()?;
    if let Some(base) = base.as_mut().filter(|_| given.renderer.is_some()) {
        // A renderer takes the place of the scene's integrator.
        base.integrator = None;
    }
    if given.max_depth.is_some() {
        let own = integrator.as_ref().map(|it| it.bind(py).get().instance.as_ref());
        let of_base = || base.as_ref().and_then(|base| base.integrator.as_deref());
        refuse_depth(own.or_else(of_base))?;
    }
    let settings = base.as_ref().map_or_else(Settings::default, |base| base.settings.clone());
    let instance = |it: &Py<PyInstance>| it.bind(py).get().instance.clone();
    let optional =
        |it: &Option<Py<PyInstance>>| -> Option<Arc<Instance>> { it.as_ref().map(instance) };
    let shape =
        |(primitive, material, emitter, alpha, place, flipped): &ShapeParts| ComposedShape {
            primitive: instance(primitive),
            material: optional(material),
            emitter: optional(emitter),
            alpha: optional(alpha),
            transform: transform(place),
            reverse_orientation: *flipped,
        };
    let light = |(light, place): &(Py<PyInstance>, Rows)| PlacedLight {
        light: instance(light),
        transform: transform(place),
    };
    Ok(Composition {
        settings: with_given(settings, given)?,
        integrator: optional(&integrator),
        camera: camera.map(|(camera, place)| (instance(&camera), transform(&place))),
        shapes: shapes.iter().map(shape).collect(),
        lights: lights.iter().map(light).collect(),
        base,
        ambient,
    })
}

/// Refuses `max_depth` for an integrator written in RTSL, whose depth is a parameter of its own, if it has one: as `-D
/// integrator.maxdepth` of the command line does, whose name is that of the format too.
fn refuse_depth(integrator: Option<&Instance>) -> PyResult<()> {
    let Some(class) = integrator.map(Instance::class) else { return Ok(()) };
    let depth = class.parameters.iter().find(|it| it.name.eq_ignore_ascii_case("maxdepth"));
    let name = &class.name;
    let what_to_do = match depth {
        Some(depth) => format!("set the integrator's parameter `{}`", depth.name),
        None => "it has no parameter of this meaning".to_owned(),
    };
    let message = format!("`max_depth` has no effect on the integrator `{name}`: {what_to_do}");
    Err(Exception::Scene.with_text(&message))
}

fn with_given(settings: Settings, given: GivenSettings) -> PyResult<Settings> {
    let mut settings = with_extent(settings, given.size, given.spp);
    settings.sampler.seed = given.seed.unwrap_or(settings.sampler.seed);
    settings.max_depth = given.max_depth.unwrap_or(settings.max_depth);
    if let Some(name) = given.renderer {
        let Some(class) = class_of_renderer(&name) else {
            let message = format!("there is no renderer `{name}`: {}", RENDERERS.join(", "));
            return Err(Exception::Scene.with_text(&message));
        };
        settings.integrator = Some(class);
    }
    Ok(settings)
}

fn transform(rows: &Rows) -> Transform {
    let mut columns = [0.0; 16];
    for (row, numbers) in rows.iter().enumerate() {
        for (column, number) in numbers.iter().enumerate() {
            columns[4 * column + row] = *number;
        }
    }
    Transform::from_columns(&columns)
}
