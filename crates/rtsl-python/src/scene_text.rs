//! Scenes in files, whose parameters Python changes.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use rtsl::{Diagnostic, Messages, diagnostic_codes as codes};
use rtsl_render::schedule::{RenderIdentity, TILE};
use rtsl_render::session::{Control, ControlKind};
use rtsl_scene::reader::{Digest, DiskFiles, FilesRef, MovedFiles, RecordedFiles};
use rtsl_scene::{EntityId, LoadOptions, Loaded, Scene, SceneSource, Settings};

use crate::detached::{check_fork, detached};
use crate::engine::PyEngine;
use crate::error::Exception;

/// A scene of a file.
#[pyclass(name = "SceneText", module = "rtsl._rtsl", frozen)]
pub struct PySceneText {
    text: Mutex<Text>,
}

struct Text {
    path: PathBuf,
    /// The options by which it was loaded.
    options: LoadOptions,
    files: Arc<RecordedFiles<'static>>,
    /// The parameters that were set since.
    changes: Vec<Change>,
    source: SceneSource<'static>,
    /// The scene with the parameters that were set since.
    scene: Scene,
    warnings: Messages,
}

/// A parameter that was set: the number of the part, the name, and the numbers.
type Change = (usize, String, Vec<f64>);

#[pymethods]
impl PySceneText {
    /// Loads a file of a format that its name tells. `files` has the places of files by their paths, if they do not lie
    /// where the scene says.
    #[new]
    #[pyo3(signature = (path, defines, search_path, camera=None, integrator=None, studio=false, files=None))]
    #[allow(clippy::too_many_arguments, reason = "the keywords of one call of Python")]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        defines: Vec<String>,
        search_path: Vec<PathBuf>,
        camera: Option<String>,
        integrator: Option<String>,
        studio: bool,
        files: Option<BTreeMap<PathBuf, PathBuf>>,
    ) -> PyResult<PySceneText> {
        let options = LoadOptions {
            defines,
            search_path,
            camera,
            integrator,
            studio,
            traced: true,
            ..LoadOptions::default()
        };
        let files = Arc::new(match files {
            Some(places) => RecordedFiles::keeping(MovedFiles(places)),
            None => RecordedFiles::new(&DiskFiles),
        });
        let loaded = detached(py, || {
            let files = FilesRef::Shared(files.clone());
            let mut source = SceneSource::read_from(&path, files, &options);
            source.load().map(|loaded| (source, loaded))
        })?;
        let (source, Loaded { scene, warnings, .. }) =
            loaded.map_err(|it| Exception::Scene.of_messages(&it))?;
        let changes = Vec::new();
        let text = Text { path, options, files, changes, source, scene, warnings };
        Ok(PySceneText { text: Mutex::new(text) })
    }

    /// The warnings of loading, as text.
    #[getter]
    fn warnings(&self) -> PyResult<String> {
        self.with(|text| text.warnings.to_text(false))
    }

    /// Columns and rows, samples of a pixel, and the seed.
    #[getter]
    fn settings(&self) -> PyResult<(usize, usize, u32, u64)> {
        self.with(|text| {
            let settings = &text.scene.settings;
            let sampler = &settings.sampler;
            (settings.width, settings.height, sampler.samples_per_pixel(), sampler.seed)
        })
    }

    /// The paths of the files that were read.
    fn files(&self) -> PyResult<Vec<PathBuf>> {
        self.with(|text| text.files.paths())
    }

    /// The parameters that were set since it was loaded: numbers of parts, names and numbers.
    fn changes(&self) -> PyResult<Vec<Change>> {
        self.with(|text| text.changes.clone())
    }

    /// The tiles of the picture and the samples of a pixel, if these are given in place of the scene's.
    #[pyo3(signature = (size=None, spp=None))]
    fn extent(&self, size: Option<(usize, usize)>, spp: Option<u32>) -> PyResult<(usize, u32)> {
        self.with(|text| {
            let settings = with_extent(text.scene.settings.clone(), size, spp);
            let tiles = settings.width.div_ceil(TILE) * settings.height.div_ceil(TILE);
            (tiles, settings.sampler.samples_per_pixel())
        })
    }

    /// The iterations of loops after which a method ends with an error.
    #[getter]
    fn loop_budget(&self) -> PyResult<u32> {
        self.with(|text| text.scene.settings.loop_budget)
    }

    /// The parts that have parameters: the number, the kind, the title and the class of each.
    fn things(&self) -> PyResult<Vec<(usize, &'static str, String, String)>> {
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
        let controls = self.with(|text| text.controls(EntityId(thing)))?;
        controls.iter().map(|control| describe(py, control)).collect()
    }

    /// Sets a parameter of a part to numbers; if the scene does not take them, nothing changes.
    fn set(&self, py: Python<'_>, thing: usize, name: &str, numbers: Vec<f64>) -> PyResult<()> {
        let set = || self.with(|text| text.set(EntityId(thing), name, &numbers));
        let set = detached(py, set)??;
        set.map_err(|messages| Exception::Scene.of_messages(&messages))
    }
}

impl PySceneText {
    /// Returns the scene as it is now.
    pub fn scene(&self) -> PyResult<Scene> {
        self.with(|text| text.scene.clone())
    }

    /// Returns what tells a render of the scene as it is now from others.
    pub fn identity(&self, engine: &PyEngine) -> PyResult<RenderIdentity> {
        self.with(|text| {
            let defines = text.options.defines.iter().cloned();
            let changes = text.changes.iter();
            let changes = changes.map(|(thing, name, to)| format!("{thing}.{name}={to:?}"));
            RenderIdentity {
                options: LoadOptions {
                    defines: defines.chain(changes).collect(),
                    ..text.options.clone()
                },
                ..RenderIdentity::new(text.files.digests(&text.path), engine.math, &engine.engine)
            }
        })
    }

    fn with<T>(&self, use_text: impl FnOnce(&mut Text) -> T) -> PyResult<T> {
        check_fork()?;
        Ok(use_text(&mut self.text.lock().unwrap_or_else(PoisonError::into_inner)))
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
                self.changes.retain(|(of, set, _)| (*of, &**set) != (thing.0, name));
                self.changes.push((thing.0, name.to_owned(), numbers.to_vec()));
                Ok(())
            }
            Err(messages) => {
                self.source.restore_parameter(thing, name, earlier);
                Err(messages)
            }
        }
    }
}

/// Returns settings with a size and samples of a pixel in place of theirs.
pub fn with_extent(
    mut settings: Settings,
    size: Option<(usize, usize)>,
    samples: Option<u32>,
) -> Settings {
    if let Some((width, height)) = size {
        settings.set_size(width.max(1), height.max(1));
    }
    if let Some(samples) = samples {
        settings.set_samples_per_pixel(samples);
    }
    settings
}

/// Returns the digest of a file in hexadecimal digits, and its size in bytes.
#[pyfunction]
pub fn file_digest(py: Python<'_>, path: PathBuf) -> PyResult<(String, u64)> {
    let (digest, size) = detached(py, || Digest::of_file(&path))??;
    Ok((digest.to_string(), size))
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
