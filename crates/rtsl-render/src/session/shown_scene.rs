//! The scene that a session shows, for work beside it.

use rtsl::{EngineOptions, Messages};
use rtsl_math::Transform;
use rtsl_scene::{Scene, SceneSource};

use super::options::SessionOptions;
use super::session::choose_renderer;
use crate::measure::{SceneLines, lines_of};
use crate::pixel::prints_of;

/// The scene that a session shows: its texts, the parameters that were set, and the camera. It is independent of the
/// session, so that other threads can work on it.
pub struct ShownScene {
    pub(super) source: SceneSource<'static>,
    pub(super) options: SessionOptions,
    pub(super) engine: EngineOptions,
    /// The camera if it was moved, from its space to the world's.
    pub(super) moved_camera: Option<Transform>,
}

impl ShownScene {
    /// Measures the cost of the lines of the shaders.
    ///
    /// # Errors
    /// Any error of the scene, its shaders, or the machine.
    pub fn lines(self) -> Result<SceneLines, Messages> {
        let (engine, threads) = (self.engine.clone(), self.options.threads);
        let (source, prepare) = self.into_parts();
        lines_of(source, engine, threads, prepare)
    }

    /// Returns the lines that shaders print for the first sample of a pixel, counted from the top left.
    ///
    /// # Errors
    /// As for [`lines`](Self::lines).
    pub fn prints(self, pixel: [usize; 2]) -> Result<Vec<String>, Messages> {
        let engine = self.engine.clone();
        let (source, prepare) = self.into_parts();
        prints_of(source, engine, pixel, prepare)
    }

    /// Returns the source, and what makes a scene loaded from it that which is shown.
    fn into_parts(self) -> (SceneSource<'static>, impl FnOnce(&mut Scene)) {
        let ShownScene { source, options, engine: _, moved_camera } = self;
        let selects_integrator = source.selected_integrator().is_some();
        let prepare = move |scene: &mut Scene| {
            options.apply(&mut scene.settings);
            choose_renderer(selects_integrator, scene);
            if let Some(camera) = moved_camera {
                (scene.camera_to_world, scene.camera_motion) = (camera, None);
            }
        };
        (source, prepare)
    }
}
