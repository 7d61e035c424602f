//! How a session is opened.

use std::path::PathBuf;

use rtsl::EngineOptions;
use rtsl_memory::Amount;
use rtsl_scene::Settings;

/// What the host says instead of the scene.
#[derive(Clone, Debug, Default)]
pub struct SessionOptions {
    /// `name.parameter=value`, in order.
    pub defines: Vec<String>,
    /// Folders for `#include` besides the scene's.
    pub search_path: Vec<PathBuf>,
    /// The memory that the scene's files may take; 4 GiB, or what there is, where `None`.
    pub input_memory: Option<Amount>,
    /// Columns and rows, instead of the scene's.
    pub size: Option<(usize, usize)>,
    /// Samples a pixel, instead of the scene's.
    pub samples: Option<u32>,
    /// How many threads; all processors where `None`.
    pub threads: Option<usize>,
    /// Backend, width and the like.
    pub engine: EngineOptions,
    /// Brightens what is shown by so many stops, on top of the scene's exposure.
    pub exposure: f32,
}

impl SessionOptions {
    /// The host wins over the scene.
    pub fn apply(&self, settings: &mut Settings) {
        if let Some((width, height)) = self.size {
            (settings.width, settings.height) = (width.max(1), height.max(1));
        }
        if let Some(samples) = self.samples {
            settings.set_samples_per_pixel(samples);
        }
    }

    /// The options of the engine for a scene of these settings.
    pub fn engine_for(&self, settings: &Settings) -> EngineOptions {
        let loop_budget = self.engine.loop_budget.or(Some(settings.loop_budget));
        EngineOptions { loop_budget, ..self.engine.clone() }
    }
}
