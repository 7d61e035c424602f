//! One pixel of a picture, sample by sample, with a trace of the methods that it calls.
//!
//! The interpreter evaluates the samples one after another, so that a trace is in the order of their execution. The
//! value of the pixel has the bits that a render gives it.

use std::time::Duration;

use rtsl::{
    Diagnostic, Engine, EngineOptions, Recording, Trace, TraceDetail, diagnostic_codes as codes,
};
use rtsl_scene::reader::{DiskFiles, FileSource};
use rtsl_scene::{Scene, SceneSource};

use crate::Messages;
use crate::compiled::runtime_errors::{RuntimeErrors, exhausted_budgets};
use crate::path::{BatchFilm, BatchMemory, BatchScene, PathTracer};
use crate::request::{LoadedScene, Prepared, RenderRequest, choose_pixel};
use crate::tiles::TileSamples;

/// The choice of a pixel and of its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelRequest {
    /// The column and the row, from the top left.
    pub pixel: [usize; 2],
    /// The first sample.
    pub first: u32,
    /// The greatest number of samples; all of the pixel's from the first on if `None`.
    pub count: Option<u32>,
}

/// A pixel.
#[derive(Clone, Debug)]
pub struct TracedPixel {
    /// The mean of the samples, linear RGB. A sample that is not finite counts as black.
    pub color: [f32; 3],
    /// The samples.
    pub samples: Vec<TracedSample>,
    /// Warnings of the scene.
    pub warnings: Messages,
}

/// A sample of a pixel.
#[derive(Clone, Debug)]
pub struct TracedSample {
    /// The index of the sample in the pixel.
    pub index: u32,
    /// The radiance.
    pub radiance: [f32; 3],
    /// The prints and the calls of methods.
    pub recording: Recording,
}

/// Renders one pixel of a scene from the disk, and records what `trace` asks for.
///
/// # Errors
/// Those of [`render_scene`](crate::render_scene), and if the picture has no such pixel, or the pixel no such sample.
pub fn render_pixel(
    request: &RenderRequest<'_>,
    pixel: PixelRequest,
    trace: &Trace,
) -> Result<TracedPixel, Messages> {
    render_pixel_from(request, pixel, trace, &DiskFiles)
}

/// Renders one pixel of a scene whose files come from `files`.
///
/// # Errors
/// As for [`render_pixel`].
pub fn render_pixel_from(
    request: &RenderRequest<'_>,
    pixel: PixelRequest,
    trace: &Trace,
    files: &dyn FileSource,
) -> Result<TracedPixel, Messages> {
    let engine = EngineOptions { trace: Some(trace.clone()), ..request.engine.clone() };
    let request = RenderRequest { engine, ..request.clone() };
    let mut loaded = LoadedScene::new(&request, files)?;
    loaded.choose_renderer();
    loaded.choose_pixel(pixel.pixel)?;
    let Prepared { scene, warnings, .. } = Prepared::new(&request, loaded)?;
    traced_pixel(&scene, pixel, trace, warnings)
}

/// Evaluates the chosen samples of the only pixel of a scene.
fn traced_pixel(
    scene: &BatchScene,
    pixel: PixelRequest,
    trace: &Trace,
    warnings: Messages,
) -> Result<TracedPixel, Messages> {
    let all = scene.compiled.settings.sampler.samples_per_pixel();
    if pixel.first >= all {
        let message = format!("there is no sample {}: a pixel has {all}", pixel.first);
        return Err(Messages::one(Diagnostic::new(codes::NO_SUCH_PIXEL, message)));
    }
    let end = pixel.count.map_or(all, |count| all.min(pixel.first.saturating_add(count)));
    let (color, samples) = trace_pixel(scene, pixel.first..end, trace)?;
    Ok(TracedPixel { color, samples, warnings })
}

/// Renders a pixel of a scene whose classes are [traced](rtsl::CompilerOptions::traced), on an engine with this trace.
///
/// # Errors
/// As for [`render_pixel`].
pub fn render_pixel_of(
    mut scene: Scene,
    engine: &Engine,
    pixel: PixelRequest,
    trace: &Trace,
) -> Result<TracedPixel, Messages> {
    choose_pixel(&mut scene.settings, pixel.pixel)?;
    let mut warnings = Messages::default();
    let scene = BatchScene::new(&scene, engine, &[], &mut warnings, &|_| {})?;
    traced_pixel(&scene, pixel, trace, warnings)
}

/// Returns the lines that shaders print for the first sample of a pixel of a scene. `prepare` makes the
/// scene what a picture of it shows.
///
/// # Errors
/// As for [`render_pixel`].
pub(crate) fn prints_of(
    mut source: SceneSource<'_>,
    engine: EngineOptions,
    pixel: [usize; 2],
    prepare: impl FnOnce(&mut Scene),
) -> Result<Vec<String>, Messages> {
    let mut scene = source.load()?.scene;
    prepare(&mut scene);
    scene.settings.set_pixel(pixel);
    let trace = Trace::new(TraceDetail::Prints);
    let options = EngineOptions { trace: Some(trace.clone()), ..engine };
    let (engine, _) = Engine::new(options).map_err(Messages::one)?;
    let scene = BatchScene::new(&scene, &engine, &[], &mut Messages::default(), &|_| {})?;
    let (_, samples) = trace_pixel(&scene, 0..1, &trace)?;
    let entries = samples.iter().flat_map(|sample| &sample.recording.entries);
    Ok(entries.map(ToString::to_string).collect())
}

/// Evaluates samples of the only pixel of a scene.
fn trace_pixel(
    scene: &BatchScene,
    samples: std::ops::Range<u32>,
    trace: &Trace,
) -> Result<([f32; 3], Vec<TracedSample>), Messages> {
    let no_memory = |error: rtsl_memory::OutOfMemory| Messages::one(error.diagnostic());
    let film = BatchFilm::new((1, 1), scene.features().clone(), None).map_err(no_memory)?;
    let film = film.with_imaging(scene.compiled.settings.imaging);
    let errors = RuntimeErrors::default();
    let tracer = PathTracer::new(scene, &errors).with_features();
    let mut memory = BatchMemory::new(scene);
    let (tile, first) = (film.tiles()[0], samples.start);
    let mut traced = Vec::new();
    for index in samples {
        trace.start();
        tracer.trace_samples(&mut memory, &[TileSamples { tile, first: index, count: 1 }]);
        let recording = trace.take();
        if errors.any() {
            return Err(exhausted_budgets(&scene.compiled, &errors));
        }
        let radiance = memory.samples.radiance.each_ref().map(|channel| channel[0]);
        let results = memory.samples.of_tile(0..memory.samples.radiance[0].len());
        film.add(0, index - first, results, Duration::ZERO);
        traced.push(TracedSample { index, radiance, recording });
    }
    Ok((film.image().map_err(no_memory)?.pixels[0], traced))
}
