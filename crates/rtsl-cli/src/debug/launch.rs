//! The arguments of `launch`: what is debugged.

use std::path::{Path, PathBuf};

use rtsl::TraceLimits;
use rtsl_render::RenderRequest;
use rtsl_scene::{LoadOptions, RENDERERS};
use serde::Deserialize;
use serde_json::Value as Json;

use super::target::{DEFAULT_KEPT, MAX_KEPT, PixelTarget, Target};
use crate::arguments::SearchPath;
use crate::eval::{Request, parse_setting};
use crate::project_file::ProjectFile;

/// The arguments of `launch`, without those of clients.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct LaunchArguments {
    /// The folder of relative paths; that of the adapter if not given.
    cwd: Option<PathBuf>,
    /// True if the debugger stops at the first statement.
    pub stop_on_entry: bool,
    /// The filters of exceptions, until the client sets others.
    pub exceptions: Vec<String>,
    /// The scene of a pixel, or of an integrator's method.
    scene: Option<PathBuf>,
    pixel: Option<[usize; 2]>,
    sample: u32,
    renderer: Option<String>,
    integrator: Option<String>,
    /// Definitions `name.parameter=value`.
    define: Vec<String>,
    /// Columns and rows.
    size: Option<(usize, usize)>,
    samples: Option<u32>,
    seed: Option<u64>,
    /// The shader of a method.
    file: Option<PathBuf>,
    class: Option<String>,
    method: Option<String>,
    params: Settings,
    args: Settings,
    state: Settings,
    scratch: Settings,
    /// Folders for `#include` and `import`.
    include: Vec<PathBuf>,
    skip: u64,
    keep: Option<usize>,
}

/// Values by their names: an object, or texts `name=value` as on command lines.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
enum Settings {
    Object(serde_json::Map<String, Json>),
    Texts(Vec<String>),
}

impl Default for Settings {
    fn default() -> Settings {
        Settings::Texts(Vec::new())
    }
}

impl Settings {
    fn values(&self) -> Result<serde_json::Map<String, Json>, String> {
        match self {
            // A text stands for what it does on a command line: `1,0,0`.
            Settings::Object(values) => {
                let value = |(name, value): (&String, &Json)| match value {
                    Json::String(text) => parse_setting(&format!("{name}={text}")),
                    value => Ok((name.clone(), value.clone())),
                };
                values.iter().map(value).collect()
            }
            Settings::Texts(texts) => texts.iter().map(|text| parse_setting(text)).collect(),
        }
    }
}

/// Makes numbers of texts, since some editors ask their users for texts alone.
fn make_numbers(value: &mut Json) {
    match value {
        Json::String(text) => {
            if let Ok(number) = text.trim().parse::<u64>() {
                *value = number.into();
            }
        }
        Json::Array(values) => values.iter_mut().for_each(make_numbers),
        _ => {}
    }
}

impl LaunchArguments {
    /// Reads the arguments.
    ///
    /// # Errors
    /// If one of them is wrong.
    pub fn read(arguments: &Json) -> Result<LaunchArguments, String> {
        let mut arguments =
            if arguments.is_null() { serde_json::json!({}) } else { arguments.clone() };
        for name in ["pixel", "sample", "size", "samples", "seed", "skip", "keep"] {
            arguments.get_mut(name).into_iter().for_each(make_numbers);
        }
        serde_json::from_value(arguments).map_err(|error| format!("`launch`: {error}"))
    }

    /// Returns what is debugged.
    ///
    /// # Errors
    /// If arguments are missing or don't fit together.
    pub fn target(&self) -> Result<(Target, SearchPath), String> {
        match (&self.scene, &self.file) {
            (Some(scene), None) => self.pixel_of(scene),
            (_, Some(file)) => self.method_of(file),
            (None, None) => {
                Err("`launch` needs `scene` and `pixel`, or `file` and `method`".to_owned())
            }
        }
    }

    /// Returns the limits of the recording.
    ///
    /// # Errors
    /// If they are too great.
    pub fn limits(&self) -> Result<TraceLimits, String> {
        let keep = self.keep.unwrap_or(DEFAULT_KEPT);
        if !(1..=MAX_KEPT).contains(&keep) {
            return Err(format!("`keep` is a number from 1 to {MAX_KEPT}"));
        }
        Ok(TraceLimits { skip: self.skip, keep })
    }

    fn pixel_of(&self, scene: &Path) -> Result<(Target, SearchPath), String> {
        let pixel =
            self.pixel.ok_or("`scene` needs `pixel`: a column and a row, such as [320, 240]")?;
        let renderer = self.renderer.as_deref();
        if let Some(other) = renderer.filter(|name| !RENDERERS.contains(name)) {
            return Err(format!("there is no renderer `{other}`: {}", RENDERERS.join(", ")));
        }
        let scene = self.absolute(scene);
        let search_path = self.search_path();
        let folders = search_path.with(project_beside(&scene, &search_path)?).folders();
        let request = RenderRequest {
            scene,
            load: LoadOptions {
                integrator: self.renderer.clone().or_else(|| self.integrator.clone()),
                defines: self.define.clone(),
                search_path: folders,
                ..LoadOptions::default()
            },
            size: self.size,
            samples: self.samples,
            seed: self.seed,
            ..RenderRequest::default()
        };
        let target = PixelTarget { request, pixel, sample: self.sample };
        Ok((Target::Pixel(Box::new(target)), search_path))
    }

    fn method_of(&self, file: &Path) -> Result<(Target, SearchPath), String> {
        let Some(method) = &self.method else {
            return Err("`file` needs `method`: a method or another function of it".to_owned());
        };
        let request = Request {
            file: Some(self.absolute(file)),
            scene: self.scene.as_ref().map(|scene| self.absolute(scene)),
            class: self.class.clone(),
            method: Some(method.clone()),
            params: self.params.values()?,
            args: self.args.values()?,
            state: self.state.values()?,
            scratch: self.scratch.values()?,
            ..Request::default()
        };
        Ok((Target::Method(Box::new(request)), self.search_path()))
    }

    fn search_path(&self) -> SearchPath {
        SearchPath::of(self.include.iter().map(|folder| self.absolute(folder)).collect())
    }

    fn absolute(&self, path: &Path) -> PathBuf {
        self.cwd.as_ref().map_or_else(|| path.to_owned(), |folder| folder.join(path))
    }
}

fn project_beside(file: &Path, search_path: &SearchPath) -> Result<ProjectFile, String> {
    let project = ProjectFile::beside(file, &search_path.folders());
    match project.diagnostics.has_errors() {
        true => {
            let faults = project.diagnostics.iter();
            Err(rtsl::render::all_to_text(&project.sources, faults, false))
        }
        false => Ok(project),
    }
}
