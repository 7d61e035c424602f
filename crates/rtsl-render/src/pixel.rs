//! One pixel of a picture, sample by sample, with a trace of the methods that it calls.
//!
//! The interpreter evaluates the samples one after another, so that a trace is in the order of their execution. The
//! value of the pixel has the bits that a render gives it.

use std::time::Duration;

use rtsl::{Diagnostic, Engine, EngineOptions, Recording, Trace, diagnostic_codes as codes};
use rtsl_scene::reader::{DiskFiles, FileSource};
use rtsl_scene::{Loaded, Scene, SceneSource};

use crate::Messages;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::{RuntimeErrors, exhausted_budgets};
use crate::film::aov_plan::outputs_of;
use crate::film::sample_film::SampleFilm;
use crate::integrate::memory::ThreadMemory;
use crate::integrate::path_tracer::PathTracer;
use crate::request::{LoadedScene, Prepared, RenderRequest, choose_pixel};
use crate::schedule::tile_samples::TileSamples;

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
    /// The named outputs of the integrator that were asked for, with their components.
    pub outputs: Vec<(String, Vec<f32>)>,
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
    choose_pixel(&mut loaded.scene.settings, pixel.pixel)?;
    let Prepared { scene, warnings, .. } = Prepared::new(&request, loaded)?;
    traced_pixel(&scene, pixel, trace, warnings)
}

/// Evaluates the chosen samples of the only pixel of a scene.
fn traced_pixel(
    scene: &RenderScene,
    pixel: PixelRequest,
    trace: &Trace,
    warnings: Messages,
) -> Result<TracedPixel, Messages> {
    let all = check_sample(scene, pixel.first)?;
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
    let aovs = outputs_of(scene.integrator().class());
    let scene = RenderScene::new(&scene, engine, &aovs, &mut warnings, &|_| {})?;
    traced_pixel(&scene, pixel, trace, warnings)
}

/// Returns the number of a pixel's samples.
///
/// # Errors
/// If this sample is not among them.
fn check_sample(scene: &RenderScene, sample: u32) -> Result<u32, Messages> {
    let all = scene.compiled.settings.sampler.samples_per_pixel();
    if sample < all {
        return Ok(all);
    }
    let message = format!("there is no sample {sample}: a pixel has {all}");
    Err(Messages::one(Diagnostic::new(codes::NO_SUCH_PIXEL, message)))
}

/// The choice of a sample of a pixel, and what is kept of it.
pub(crate) struct SampleRequest<'a> {
    /// The column and the row, from the top left.
    pub pixel: [usize; 2],
    /// The sample.
    pub sample: u32,
    /// True if the outputs of the integrator are kept.
    pub outputs: bool,
    /// The detail and the limits of the recording.
    pub trace: &'a Trace,
}

/// Evaluates a sample of a pixel of a scene, and returns it with the scene. `prepare` makes the scene what a picture of
/// it shows.
///
/// # Errors
/// As for [`render_pixel`].
pub(crate) fn sample_of(
    source: &mut SceneSource<'_>,
    engine: EngineOptions,
    request: &SampleRequest<'_>,
    prepare: impl FnOnce(&mut Scene),
) -> Result<TracedSample, Messages> {
    let Loaded { mut scene, origins, .. } = source.load()?;
    prepare(&mut scene);
    choose_pixel(&mut scene.settings, request.pixel)?;
    let options = EngineOptions { trace: Some(request.trace.clone()), ..engine };
    let (engine, _) = Engine::new(options).map_err(Messages::one)?;
    let aovs = if request.outputs { outputs_of(scene.integrator().class()) } else { Vec::new() };
    let mut warnings = Messages::default();
    let mut batch = RenderScene::new(&scene, &engine, &aovs, &mut warnings, &|_| {})?;
    batch.titles = origins.objects.iter().map(|object| source.title(*object)).collect();
    check_sample(&batch, request.sample)?;
    let samples = request.sample..request.sample + 1;
    let (_, mut samples) = trace_pixel(&batch, samples, request.trace)?;
    Ok(samples.swap_remove(0))
}

/// Evaluates samples of the only pixel of a scene.
fn trace_pixel(
    scene: &RenderScene,
    samples: std::ops::Range<u32>,
    trace: &Trace,
) -> Result<([f32; 3], Vec<TracedSample>), Messages> {
    let no_memory = |error: rtsl_memory::OutOfMemory| Messages::one(error.diagnostic());
    let film = SampleFilm::new((1, 1), scene.features().clone(), None).map_err(no_memory)?;
    let film = film.with_imaging(scene.compiled.settings.imaging);
    let errors = RuntimeErrors::default();
    let tracer = PathTracer::new(scene, &errors);
    let mut memory = ThreadMemory::new(scene);
    let (tile, first) = (film.tiles()[0], samples.start);
    let mut traced = Vec::new();
    for index in samples {
        trace.start();
        tracer.trace_samples(
            &mut memory,
            &[TileSamples { tile, first: index, count: 1 }],
            Some(scene.features()),
        );
        let recording = trace.take();
        if errors.any() {
            return Err(exhausted_budgets(&scene.compiled, &errors));
        }
        let radiance = memory.samples.radiance.each_ref().map(|channel| channel[0]);
        let results = memory.samples.of_tile(0..memory.samples.radiance[0].len());
        let outputs =
            scene.features().outputs().iter().map(|output| {
                (output.name.to_string(), results.outputs[output.components()].to_vec())
            });
        let outputs = outputs.collect();
        film.add(0, index - first, results, Duration::ZERO);
        traced.push(TracedSample { index, radiance, outputs, recording });
    }
    Ok((film.image().map_err(no_memory)?.pixels[0], traced))
}
