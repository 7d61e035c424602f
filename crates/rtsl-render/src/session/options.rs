//! Options for opening a session.

use std::path::PathBuf;

use rtsl::EngineOptions;
use rtsl_memory::Amount;
use rtsl_scene::Settings;

/// The host's options, which override the scene.
#[derive(Clone, Debug, Default)]
pub struct SessionOptions {
    /// Definitions `name.parameter=value`, in order.
    pub defines: Vec<String>,
    /// Folders for `#include` besides the scene's.
    pub search_path: Vec<PathBuf>,
    /// The camera of a glTF file, by its name or index; its first one if `None`.
    pub camera: Option<String>,
    /// True if a studio lights the scene besides its own lights.
    pub studio: bool,
    /// The integrator, by a name of the format or a class, overriding the scene's. It takes over the parameters of the
    /// scene's that it has, too.
    pub integrator: Option<String>,
    /// The memory budget of the scene's files; three quarters of the available memory if `None`.
    pub input_memory: Option<Amount>,
    /// The memory of textures from images; an eighth of the budget if `None`. Further ones are in temporary files.
    pub texture_memory: Option<Amount>,
    /// Columns and rows, overriding the scene's.
    pub size: Option<(usize, usize)>,
    /// Samples per pixel, overriding the scene's.
    pub samples: Option<u32>,
    /// The number of threads; that of all processors if `None`.
    pub threads: Option<usize>,
    /// Options of the engine, such as backend and width.
    pub engine: EngineOptions,
    /// The exposure of the display in stops, added to the scene's.
    pub exposure: f32,
}

impl SessionOptions {
    /// Applies the options, which override the scene.
    pub fn apply(&self, settings: &mut Settings) {
        if let Some((width, height)) = self.size {
            settings.set_size(width.max(1), height.max(1));
        }
        if let Some(samples) = self.samples {
            settings.set_samples_per_pixel(samples);
        }
    }

    /// Returns the engine options for a scene with these settings.
    pub fn engine_for(&self, settings: &Settings) -> EngineOptions {
        let loop_budget = self.engine.loop_budget.or(Some(settings.loop_budget));
        EngineOptions { loop_budget, ..self.engine.clone() }
    }
}
