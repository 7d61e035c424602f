//! The whole way from a scene's file to an image: what `rtsl render` does.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use rtsl::{Backend, Diagnostic, Engine, EngineOptions, diagnostic_codes as codes};

use crate::compiled::{BuildStep, CompiledScene};
use crate::film::{Aov, AovImage, Image};
use crate::interactive::{RenderOptions, render};
use crate::messages::Messages;
use crate::progress::Progress;
use crate::reader::{DiskFiles, FileSource};
use crate::scene::{LoadOptions, Settings, load_scene};
use crate::statistics::{Statistics, peak_memory_bytes};

/// What to render, and how.
#[derive(Clone, Default)]
pub struct RenderRequest<'a> {
    /// The scene's file.
    pub scene: PathBuf,
    /// `name.parameter=value`, in order.
    pub defines: Vec<String>,
    /// Folders for `#include` besides the scene's.
    pub search_path: Vec<PathBuf>,
    /// Columns and rows, instead of the scene's.
    pub size: Option<(usize, usize)>,
    /// Samples a pixel, instead of the scene's.
    pub samples: Option<u32>,
    /// The sampler's seed, instead of the scene's.
    pub seed: Option<u64>,
    /// How many threads; all processors where `None`.
    pub threads: Option<usize>,
    /// Backend, width and the like.
    pub engine: EngineOptions,
    /// Ends the render early after this time.
    pub time_limit: Option<Duration>,
    /// Images of something else than colour.
    pub aovs: Vec<Aov>,
    /// Makes no kernels for the scene's values while rendering. Never changes the image.
    pub general_kernels_only: bool,
    /// Is told what the render is at, from any thread.
    pub progress: Option<&'a (dyn Fn(Progress) + Sync)>,
    /// Ends the render early when it becomes true.
    pub cancel: Option<&'a AtomicBool>,
}

impl RenderRequest<'_> {
    fn tell(&self, progress: Progress) {
        if let Some(listener) = self.progress {
            listener(progress);
        }
    }
}

/// What came of it.
#[derive(Debug)]
pub struct RenderResult {
    /// The image.
    pub image: Image,
    /// The images that were asked for besides, in that order.
    pub aovs: Vec<AovImage>,
    /// The settings it was made with.
    pub settings: Settings,
    /// What it took.
    pub statistics: Statistics,
    /// Warnings.
    pub warnings: Messages,
}

/// Renders a scene from the disk.
///
/// # Errors
/// What is wrong with the scene, its shaders, or the machine.
pub fn render_scene(request: &RenderRequest<'_>) -> Result<RenderResult, Messages> {
    render_scene_from(request, &DiskFiles)
}

/// Renders a scene whose files come from `files`.
///
/// # Errors
/// As for [`render_scene`].
pub fn render_scene_from(
    request: &RenderRequest<'_>,
    files: &dyn FileSource,
) -> Result<RenderResult, Messages> {
    let start = Instant::now();
    let prepared = std::thread::scope(|scope| {
        if request.engine.backend != Backend::Interpreter {
            // The compiler's library is paged in while the scene is read.
            scope.spawn(Engine::warm_up);
        }
        Prepared::new(request, files)
    })?;
    let cold_start = start.elapsed();
    let Prepared { scene, mut statistics, warnings, .. } = prepared;
    let tiles_done = |done, of| request.tell(Progress::Rendering { done, of });
    let rendered = render(
        &scene,
        RenderOptions {
            threads: request.threads,
            progress: request.progress.is_some().then_some(&tiles_done),
            cancel: request.cancel,
            time_limit: request.time_limit,
            aovs: &request.aovs,
            general_kernels_only: request.general_kernels_only,
        },
    )?;
    let settings = scene.settings;
    statistics = Statistics {
        cold_start_seconds: cold_start.as_secs_f64(),
        rays: rendered.rays,
        dropped_samples: rendered.dropped_samples,
        peak_memory_bytes: peak_memory_bytes(),
        size: [settings.width, settings.height],
        samples_per_pixel: settings.sampler.samples_per_pixel(),
        objects: scene.objects.len(),
        object_classes: rendered.object_classes,
        threads: rendered.threads,
        cancelled: rendered.cancelled,
        ..statistics
    };
    statistics.set_render_time(rendered.time);
    Ok(RenderResult { image: rendered.image, aovs: rendered.aovs, settings, statistics, warnings })
}

/// A scene, ready to be rendered.
pub(crate) struct Prepared {
    pub(crate) scene: CompiledScene,
    /// What preparing took, and what it was made for.
    pub(crate) statistics: Statistics,
    /// What rays can hit: shapes, and the elements of those that have any.
    pub(crate) primitives: u64,
    pub(crate) warnings: Messages,
}

impl Prepared {
    /// Loads and compiles.
    pub(crate) fn new(
        request: &RenderRequest<'_>,
        files: &dyn FileSource,
    ) -> Result<Prepared, Messages> {
        let start = Instant::now();
        request.tell(Progress::Reading);
        let (defines, search_path) = (request.defines.clone(), request.search_path.clone());
        let mut loaded = load_scene(&request.scene, files, &LoadOptions { defines, search_path })?;
        apply(request, &mut loaded.scene.settings);
        if let Some(problem) = loaded.scene.settings.size_problem() {
            return Err(Messages::one(Diagnostic::new(codes::SCENE_LIMIT, problem)));
        }
        let load_time = start.elapsed();

        let mut warnings = loaded.warnings;
        let start = Instant::now();
        let loop_budget = request.engine.loop_budget.or(Some(loaded.scene.settings.loop_budget));
        let options = EngineOptions { loop_budget, ..request.engine.clone() };
        let (engine, engine_warnings) = Engine::new(options).map_err(Messages::one)?;
        warnings.push(rtsl::SourceMap::new(), engine_warnings);
        let engine_time = start.elapsed();
        let elements = loaded.scene.objects.iter().map(|it| u64::from(it.elements.unwrap_or(1)));
        let primitives = elements.sum();
        let told = |step| match step {
            BuildStep::Kernels { shaders } => request.tell(Progress::Compiling { shaders }),
            BuildStep::Hierarchy => request.tell(Progress::Building { primitives }),
        };
        let scene = CompiledScene::with_progress(loaded.scene, &engine, &mut warnings, &told)?;
        let statistics = Statistics {
            load_seconds: load_time.as_secs_f64(),
            check_seconds: loaded.compile_time.as_secs_f64(),
            compile_seconds: (engine_time + scene.compile_time).as_secs_f64(),
            build_seconds: scene.build_time.as_secs_f64(),
            width: engine.width(),
            target: engine.llvm().map_or("interpreter".to_owned(), |llvm| {
                format!("{} {}", llvm.host().triple(), llvm.host().cpu())
            }),
            llvm: engine.llvm().map(|llvm| format!("{} {}", llvm.version(), llvm.path().display())),
            ..Statistics::default()
        };
        Ok(Prepared { scene, statistics, primitives, warnings })
    }
}

/// The command line wins over the scene.
fn apply(request: &RenderRequest<'_>, settings: &mut Settings) {
    if let Some((width, height)) = request.size {
        (settings.width, settings.height) = (width.max(1), height.max(1));
    }
    if let Some(samples) = request.samples {
        settings.set_samples_per_pixel(samples);
    }
    if let Some(seed) = request.seed {
        settings.sampler.seed = seed;
    }
}
