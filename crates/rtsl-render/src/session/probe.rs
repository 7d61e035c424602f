//! Looks into a session's scene, apart from the session: samples of pixels, and the costs of lines.

use rtsl::{EngineOptions, Messages, Trace};
use rtsl_math::Transform;
use rtsl_scene::{Scene, SceneSource};

use super::options::SessionOptions;
use super::session::choose_renderer;
use crate::measure::{SceneLines, lines_of};
use crate::pixel::{SampleRequest, TracedSample, sample_of};

/// A copy of a session's scene, with its parameters and its camera, whose samples are evaluated by the interpreter:
/// they have the bits of the picture, and can be recorded. The session can change meanwhile.
pub struct Probe {
    pub(super) source: SceneSource<'static>,
    pub(super) options: SessionOptions,
    pub(super) engine: EngineOptions,
    /// The transform of the camera, if it is not that of the scene.
    pub(super) camera: Option<Transform>,
}

/// A sample of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProbedPixel {
    /// The column, from the left.
    pub x: usize,
    /// The row, from the top.
    pub y: usize,
    /// The sample, from 0.
    pub sample: u32,
}

impl Probe {
    /// Evaluates a sample, and records what `trace` asks for. The sample has the named outputs of the integrator.
    ///
    /// # Errors
    /// Any error of the scene, its shaders, or the machine, and if a pixel has no such sample.
    pub fn sample(&mut self, of: ProbedPixel, trace: &Trace) -> Result<TracedSample, Messages> {
        let ProbedPixel { x, y, sample } = of;
        self.evaluate(&SampleRequest { pixel: [x, y], sample, outputs: true, trace })
    }

    pub(super) fn evaluate(
        &mut self,
        request: &SampleRequest<'_>,
    ) -> Result<TracedSample, Messages> {
        let (source, engine, prepare) = self.parts();
        sample_of(source, engine, request, prepare)
    }

    /// Measures the costs of the lines of the shaders, for the rays of the picture.
    ///
    /// # Errors
    /// Any error of the scene, its shaders, or the machine.
    pub fn lines(&mut self) -> Result<SceneLines, Messages> {
        let threads = self.options.threads;
        let (source, engine, prepare) = self.parts();
        lines_of(source, engine, threads, prepare)
    }

    /// Returns the source, the engine's options, and what makes a scene of the source that which the session shows.
    fn parts(
        &mut self,
    ) -> (&mut SceneSource<'static>, EngineOptions, impl FnOnce(&mut Scene) + use<'_>) {
        let Probe { source, options, engine, camera } = self;
        let selected = source.selected_integrator().is_some();
        let prepare = move |scene: &mut Scene| {
            options.apply(&mut scene.settings);
            choose_renderer(selected, scene);
            if let Some(camera) = camera {
                (scene.camera_to_world, scene.camera_motion) = (*camera, None);
            }
        };
        (source, engine.clone(), prepare)
    }
}
