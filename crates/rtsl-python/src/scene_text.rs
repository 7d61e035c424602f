//! Scenes in files, whose parameters Python changes.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use rtsl::{Diagnostic, Messages, diagnostic_codes as codes};
use rtsl_render::session::{Control, ControlKind};
use rtsl_scene::reader::DiskFiles;
use rtsl_scene::{EntityId, LoadOptions, Scene, SceneSource};

use crate::error::Exception;

/// A scene of a file.
#[pyclass(name = "SceneText", module = "rtsl._rtsl", frozen)]
pub struct PySceneText {
    text: Mutex<Text>,
}

struct Text {
    source: SceneSource<'static>,
    /// The scene with the parameters that were set since.
    scene: Scene,
    warnings: Messages,
}

#[pymethods]
impl PySceneText {
    /// Loads a file of a format that its name tells.
    #[new]
    #[pyo3(signature = (path, defines, search_path, camera=None, integrator=None))]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        defines: Vec<String>,
        search_path: Vec<PathBuf>,
        camera: Option<String>,
        integrator: Option<String>,
    ) -> PyResult<PySceneText> {
        let options = LoadOptions {
            defines,
            search_path,
            camera,
            integrator,
            traced: true,
            ..LoadOptions::default()
        };
        let loaded = py.detach(|| {
            let mut source = SceneSource::read(&path, &DiskFiles, &options);
            source.load().map(|loaded| (source, loaded))
        });
        let (source, loaded) = loaded.map_err(|it| Exception::Scene.of_messages(&it))?;
        let text = Text { source, scene: loaded.scene, warnings: loaded.warnings };
        Ok(PySceneText { text: Mutex::new(text) })
    }

    /// The warnings of loading, as text.
    #[getter]
    fn warnings(&self) -> String {
        self.with(|text| text.warnings.to_text(false))
    }

    /// Columns and rows, samples of a pixel, and the seed.
    #[getter]
    fn settings(&self) -> (usize, usize, u32, u64) {
        self.with(|text| {
            let settings = &text.scene.settings;
            let sampler = &settings.sampler;
            (settings.width, settings.height, sampler.samples_per_pixel(), sampler.seed)
        })
    }

    /// The parts that have parameters: the number, the kind, the title and the class of each.
    fn things(&self) -> Vec<(usize, &'static str, String, String)> {
        self.with(|text| {
            let entities = text.source.description().entities.iter().enumerate();
            let things = entities.filter_map(|(index, entity)| {
                let class = text.source.instance(EntityId(index))?.class().name.clone();
                Some((index, entity.kind.word(), text.source.title(EntityId(index)), class))
            });
            things.collect()
        })
    }

    /// The parameters of a part that can be set, as dictionaries.
    fn controls<'py>(&self, py: Python<'py>, thing: usize) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let controls = self.with(|text| text.controls(EntityId(thing)));
        controls.iter().map(|control| describe(py, control)).collect()
    }

    /// Sets a parameter of a part to numbers; if the scene does not take them, nothing changes.
    fn set(&self, py: Python<'_>, thing: usize, name: &str, numbers: Vec<f64>) -> PyResult<()> {
        let set = py.detach(|| self.with(|text| text.set(EntityId(thing), name, &numbers)));
        set.map_err(|messages| Exception::Scene.of_messages(&messages))
    }
}

impl PySceneText {
    /// Returns the scene as it is now.
    pub fn scene(&self) -> Scene {
        self.with(|text| text.scene.clone())
    }

    fn with<T>(&self, use_text: impl FnOnce(&mut Text) -> T) -> T {
        use_text(&mut self.text.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Text {
    fn controls(&self, thing: EntityId) -> Vec<Control> {
        let Some(instance) = self.source.instance(thing) else { return Vec::new() };
        let parameters = instance.class().parameters.iter();
        let controls = parameters.filter_map(|parameter| {
            let given = self.source.given_values(thing, &parameter.name);
            Control::new(instance, parameter, given.as_ref())
        });
        controls.collect()
    }

    fn set(&mut self, thing: EntityId, name: &str, numbers: &[f64]) -> Result<(), Messages> {
        let control = self.controls(thing).into_iter().find(|control| control.name == name);
        let control = control.ok_or_else(|| {
            let message = format!("there is no parameter `{name}` to set");
            Messages::one(Diagnostic::new(codes::UNKNOWN_PARAMETER, message))
        })?;
        let earlier = self.source.set_parameter(thing, name, control.scene_values(numbers));
        match self.source.load() {
            Ok(loaded) => {
                self.scene = loaded.scene;
                Ok(())
            }
            Err(messages) => {
                self.source.restore_parameter(thing, name, earlier);
                Err(messages)
            }
        }
    }
}

fn describe<'py>(py: Python<'py>, control: &Control) -> PyResult<Bound<'py, PyDict>> {
    let values = PyDict::new(py);
    values.set_item("name", &control.name)?;
    values.set_item("label", &control.label)?;
    values.set_item("doc", &control.doc)?;
    values.set_item("unit", &control.unit)?;
    let kind = match control.kind {
        ControlKind::Real => "real",
        ControlKind::Whole => "whole",
        ControlKind::Truth => "truth",
        ControlKind::Color => "color",
    };
    values.set_item("kind", kind)?;
    values.set_item("min", control.min)?;
    values.set_item("max", control.max)?;
    values.set_item("choices", &control.choices)?;
    values.set_item("values", &control.values)?;
    Ok(values)
}
