//! `rtsl render`: renders a scene to a picture.

mod cluster;

use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Duration;

use clap::{Args, ValueEnum};
use rtsl::{Diagnostic, diagnostic_codes as codes};
use rtsl_image::{
    Aov, DENOISER_AOVS, Denoiser, ExrOptions, ExrPrecision, ImageFormat, ImageMetadata,
    ImageOptions, ViewTransform, check_writable, denoised, denoiser_diagnostic, write_image_with,
};
use rtsl_render::{
    CheckpointRequest, Execution, Messages, Optimise, Progress, RenderRequest, RenderResult,
    render_scene,
};
use rtsl_scene::{LoadOptions, RENDERERS};

use super::pixel::{PixelArguments, render_one};
use crate::arguments::{EngineArguments, LoadArguments, SearchPath};
use crate::files::write_result;
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::progress_line::ProgressLine;
use crate::report::Reporter;
use crate::signals::told_to_end;

/// The default interval of writing checkpoints.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(30);

/// The command line of `rtsl render`.
#[derive(Debug, Args)]
pub struct RenderArguments {
    /// The scene, in the format of pbrt-v4 with RTSL's class names, a glTF file, or a mesh (PLY, OBJ or STL), which is
    /// shown in a studio.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// The picture: OUT.png or OUT.exr.
    #[arg(short, long, value_name = "OUT", required_unless_present = "pixel")]
    output: Option<PathBuf>,
    #[command(flatten)]
    pixel: PixelArguments,
    /// Render on a cluster of Ray, by the Python package: `auto` for one that runs on this machine, `HOST:PORT`,
    /// `ray://HOST:PORT`, or `local` for a new one on this machine. `--threads` is the number of each task's. The
    /// picture is the same. The environment variable RTSL_PYTHON names the interpreter.
    #[arg(
        long,
        value_name = "ADDRESS",
        conflicts_with_all =
            ["pixel", "denoise", "optimise", "interleave", "input_memory", "texture_memory"]
    )]
    cluster: Option<String>,
    #[command(flatten)]
    load: LoadArguments,
    /// The renderer, overriding the scene's integrator: `batch` traces paths by the materials' `BSDF`, `sampleBSDF` and
    /// `evaluatePDF`; `interactive` calls their `shade`, as `rtsl view` does.
    #[arg(long, value_name = "NAME", value_parser = RENDERERS, conflicts_with = "integrator")]
    renderer: Option<String>,
    /// Samples per pixel, overriding the scene's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Columns and rows, overriding the scene's.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(usize, usize)>,
    /// The number of threads; that of all processors if not given. Never changes the picture.
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    threads: Option<usize>,
    /// The seed of the sampler, overriding the scene's.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Stop after this time and write the picture as it is.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    time: Option<Duration>,
    /// Stop sampling tiles whose standard errors, relative to their brightness, are no greater than this, such as 0.02.
    /// Batch renderer.
    #[arg(long, value_name = "NOISE", value_parser = parse_noise)]
    noise: Option<f32>,
    /// Write checkpoints to this file while rendering, every half a minute, from which `--resume` continues after any
    /// interruption. Batch renderer.
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// The interval of writing the checkpoint.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, requires = "checkpoint")]
    checkpoint_every: Option<Duration>,
    /// Continue from the checkpoint: that of `--checkpoint`, or the one that Ctrl-C or a signal left next to the
    /// picture. The picture has the bits of one that was never interrupted. Without a checkpoint the render starts from
    /// the beginning.
    #[arg(long)]
    resume: bool,
    // Generated from the list of AOVs, so that it is complete.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = parse_aov, help = aov_help())]
    aov: Vec<Aov>,
    /// The time at which kernels are optimised. Never changes the picture.
    #[arg(long, value_name = "WHEN", value_enum, default_value_t = OptimiseWhen::Background)]
    optimise: OptimiseWhen,
    /// Write statistics of the render as JSON.
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// The exposure of a PNG in stops, added to the scene's.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    /// The view transform from linear colours to those of a PNG.
    #[arg(long, value_enum, default_value_t = View::Standard)]
    view: View,
    /// Denoise the picture with Open Image Denoise, if it is installed. The result depends on the library and the
    /// machine.
    #[arg(long)]
    denoise: bool,
    /// The precision of colours in an EXR. All other channels are float.
    #[arg(long, value_enum, default_value_t = Precision::Float)]
    exr: Precision,
    /// Write each image of an EXR as a separate part.
    #[arg(long)]
    exr_parts: bool,
    #[command(flatten)]
    engine: EngineArguments,
}

/// View transforms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum View {
    /// sRGB, clamped at white.
    Standard,
    /// A filmic curve, on which bright colours desaturate towards white.
    Filmic,
    /// Linear.
    Raw,
}

impl From<View> for ViewTransform {
    fn from(view: View) -> Self {
        match view {
            View::Standard => ViewTransform::Standard,
            View::Filmic => ViewTransform::Filmic,
            View::Raw => ViewTransform::Raw,
        }
    }
}

/// Precisions of numbers in an EXR.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Precision {
    /// 16 bits.
    Half,
    /// 32 bits.
    Float,
}

impl From<Precision> for ExrPrecision {
    fn from(precision: Precision) -> Self {
        match precision {
            Precision::Half => ExrPrecision::Half,
            Precision::Float => ExrPrecision::Float,
        }
    }
}

/// The time at which kernels are optimised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum OptimiseWhen {
    /// In the background of a render that is long enough to repay it.
    Background,
    /// Before the render: it begins later, and has its full speed at once.
    First,
    /// Never.
    Never,
}

impl From<OptimiseWhen> for Optimise {
    fn from(when: OptimiseWhen) -> Self {
        match when {
            OptimiseWhen::Background => Optimise::Background,
            OptimiseWhen::First => Optimise::First,
            OptimiseWhen::Never => Optimise::Never,
        }
    }
}

/// Renders and writes the picture.
pub fn run(arguments: &RenderArguments, reporter: &Reporter) -> CommandResult {
    if let Some(problem) = arguments.pixel.misplaced() {
        return Err(Failure::Usage(problem));
    }
    let Some(output) = &arguments.output else {
        let search_path = arguments.load.search_path.beside(&arguments.scene, reporter)?;
        return render_one(&request(arguments, &search_path), &arguments.pixel, reporter);
    };
    if let Some(address) = &arguments.cluster {
        return cluster::render_on(address, arguments, reporter);
    }
    check_output(output)?;
    // Checked before the render, not after it.
    let denoiser = match arguments.denoise.then(Denoiser::load).transpose() {
        Ok(denoiser) => denoiser,
        Err(error) => return Ok(refused(denoiser_diagnostic(&error), reporter)),
    };
    let search_path = arguments.load.search_path.beside(&arguments.scene, reporter)?;
    let interrupted = told_to_end();
    let bar = ProgressLine::new(reporter);
    let progress = |progress: Progress| bar.show(progress);
    let early_warnings = |messages: &Messages| bar.suspend(|| report(messages, reporter));
    let request = RenderRequest {
        execution: Execution {
            threads: arguments.threads,
            cancel: Some(interrupted),
            time_limit: arguments.time,
            optimise: arguments.optimise.into(),
        },
        aovs: arguments.aov.clone(),
        for_denoiser: arguments.denoise,
        noise_target: arguments.noise,
        checkpoint: Some(checkpoint(arguments, output)),
        progress: Some(&progress),
        early_warnings: Some(&early_warnings),
        ..request(arguments, &search_path)
    };
    let rendered = render_scene(&request);
    bar.clear();
    let mut rendered = match rendered {
        Ok(rendered) => rendered,
        Err(messages) => {
            report(&messages, reporter);
            return Ok(Outcome::InputAtFault);
        }
    };
    report(&rendered.warnings, reporter);
    let mut outcome = Outcome::Done;
    if let Some(denoiser) = &denoiser {
        match denoised(denoiser, &rendered.image, &rendered.aovs) {
            Ok(image) => rendered.image = image,
            // The render is kept even if it cannot be denoised.
            Err(error) => outcome = refused(denoiser_diagnostic(&error), reporter),
        }
        let is_asked = |aov: &Aov| arguments.aov.contains(aov) || !DENOISER_AOVS.contains(aov);
        rendered.aovs.retain(|image| is_asked(&image.aov));
    }
    let options = image_options(arguments, &rendered);
    let written = write_image_with(&rendered.image, &rendered.aovs, output, &options);
    if let Err(error) = written {
        return Ok(refused(error.diagnostic(), reporter));
    }
    if let Some(path) = &arguments.stats {
        write_result(Some(path), (rendered.statistics.to_json() + "\n").as_bytes())?;
    }
    if rendered.statistics.cancelled {
        say_how_to_go_on(arguments, output, &rendered, reporter);
    }
    // For example a checkpoint that could not be written.
    let is_done = !rendered.warnings.has_errors() && !interrupted.load(Ordering::Relaxed);
    Ok(if is_done { outcome } else { Outcome::InputAtFault })
}

/// The request for the scene and its settings.
fn request(arguments: &RenderArguments, search_path: &SearchPath) -> RenderRequest<'static> {
    let load = arguments.load.options(search_path);
    let integrator = arguments.renderer.clone().or(load.integrator);
    RenderRequest {
        scene: arguments.scene.clone(),
        load: LoadOptions { integrator, ..load },
        size: arguments.size,
        samples: arguments.spp,
        seed: arguments.seed,
        engine: arguments.engine.options(),
        ..RenderRequest::default()
    }
}

/// Reports an error.
fn refused(diagnostic: Diagnostic, reporter: &Reporter) -> Outcome {
    report(&Messages::one(diagnostic), reporter);
    Outcome::InputAtFault
}

/// The checkpoint options of the render.
fn checkpoint(arguments: &RenderArguments, output: &Path) -> CheckpointRequest {
    let every = arguments.checkpoint_every.unwrap_or(CHECKPOINT_EVERY);
    CheckpointRequest {
        path: checkpoint_path(arguments, output),
        every: arguments.checkpoint.is_some().then_some(every),
        resume: arguments.resume,
    }
}

/// The path of the checkpoint: next to the picture unless another is given.
fn checkpoint_path(arguments: &RenderArguments, output: &Path) -> PathBuf {
    arguments.checkpoint.clone().unwrap_or_else(|| {
        let mut name = output.to_owned().into_os_string();
        name.push(".checkpoint");
        PathBuf::from(name)
    })
}

/// Reports the state of an unfinished picture, and the way to finish it.
fn say_how_to_go_on(
    arguments: &RenderArguments,
    output: &Path,
    rendered: &RenderResult,
    reporter: &Reporter,
) {
    let Some(samples) = rendered.statistics.mean_samples else { return };
    let message = format!(
        "`{}` has {samples:.1} samples a pixel of {}",
        output.display(),
        rendered.statistics.samples_per_pixel,
    );
    let path = checkpoint_path(arguments, output);
    let note = Diagnostic::new(codes::UNFINISHED_PICTURE, message)
        .help(format!("the same command with `--resume` continues from `{}`", path.display()));
    report(&Messages::one(note), reporter);
}

/// The options for writing the picture.
fn image_options(arguments: &RenderArguments, rendered: &RenderResult) -> ImageOptions {
    let sampler = &rendered.settings.sampler;
    ImageOptions {
        exposure: rendered.settings.exposure + arguments.exposure,
        view: arguments.view.into(),
        exr: ExrOptions { precision: arguments.exr.into(), multi_part: arguments.exr_parts },
        metadata: ImageMetadata {
            samples: Some(sampler.samples_per_pixel()),
            seed: Some(sampler.seed),
        },
    }
}

/// Checks before the render that the picture can be written.
fn check_output(output: &Path) -> Result<(), Failure> {
    ImageFormat::from_path(output).map_err(|error| Failure::Usage(error.to_string()))?;
    let folder = output.parent().filter(|folder| !folder.as_os_str().is_empty());
    match folder {
        Some(folder) if !folder.is_dir() => {
            Err(Failure::Usage(format!("there is no folder `{}`", folder.display())))
        }
        Some(_) | None => check_writable(output).map_err(|error| Failure::Usage(error.to_string())),
    }
}

/// Reports the messages of a scene.
pub fn report(messages: &Messages, reporter: &Reporter) {
    for (sources, diagnostic) in messages.iter() {
        reporter.diagnostics(sources, [diagnostic]);
    }
    messages.notes().for_each(|note| reporter.message("note", note));
}

/// The greatest number of columns or rows of a picture.
const MAX_SIDE: usize = 65_536;

/// Parses columns and rows.
pub fn parse_size(text: &str) -> Result<(usize, usize), String> {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|it| it.is_ascii_digit());
    let sides =
        text.split_once(['x', 'X']).filter(|(width, height)| is_number(width) && is_number(height));
    let (width, height) = sides.ok_or("expected columns and rows, such as 1024x768")?;
    let side = |text: &str| text.parse().ok().filter(|side| (1..=MAX_SIDE).contains(side));
    let size = side(width).zip(side(height));
    size.ok_or_else(|| format!("a picture has 1 to {MAX_SIDE} columns and rows"))
}

/// Parses a number of threads.
pub fn parse_threads(text: &str) -> Result<usize, String> {
    let threads = text.parse().ok().filter(|threads| (1..=1024).contains(threads));
    threads.ok_or_else(|| "expected a number from 1 to 1024".to_owned())
}

fn aov_help() -> String {
    let names = Aov::ALL;
    let names = names.each_ref().map(Aov::name).join(", ");
    format!(
        "Besides the picture, what its pixels show and take, with commas between: {names}; outputs of the integrator \
         by their names. In an EXR as further channels, beside a PNG as files of their own"
    )
}

/// Any name may be that of an output of the integrator, which is known once the scene is loaded.
fn parse_aov(text: &str) -> Result<Aov, Infallible> {
    Ok(Aov::from_name(text))
}

fn parse_noise(text: &str) -> Result<f32, String> {
    let noise = text.parse().ok().filter(|noise: &f32| *noise > 0.0 && noise.is_finite());
    noise.ok_or_else(|| "expected a positive number, such as 0.02".to_owned())
}

fn parse_seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().filter(|seconds: &f64| *seconds >= 0.0);
    let duration = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    duration.ok_or_else(|| "expected a number of seconds, 0 or more".to_owned())
}
