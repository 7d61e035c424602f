//! Options for opening a session.

use rtsl::EngineOptions;
use rtsl_scene::{LoadOptions, Settings};

/// The host's options, which override the scene.
#[derive(Clone, Debug, Default)]
pub struct SessionOptions {
    /// The options of loading the scene.
    pub load: LoadOptions,
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
