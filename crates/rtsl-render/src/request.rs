//! The whole process from a scene's file to an image: the implementation of `rtsl render`.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rtsl::{
    Backend, Diagnostic, Engine, EngineOptions, Instance, Messages, diagnostic_codes as codes,
};
use rtsl_image::{Aov, AovImage, Image};
use rtsl_memory::{Amount, Need, check_render};
use rtsl_scene::reader::{DiskFiles, FileSource, RecordedFiles};
use rtsl_scene::{LoadOptions, PATH_TRACER, Scene, SceneSource, Settings, WHITTED};

use crate::checkpoint::{Checkpoint, Fingerprint};
use crate::compiled::render_scene::RenderScene;
use crate::compiled::{BuildStep, CompiledScene, integrator_of};
use crate::darkness::Darkness;
use crate::execution::{Execution, Optimise, Rendered};
use crate::film::aov_plan::AovPlan;
use crate::film::features::Features;
use crate::film::sample_film::SampleFilm;
use crate::progress::Progress;
use crate::schedule;
use crate::schedule::checkpoints::Checkpoints;
use crate::schedule::render::{RenderOptions, RenderedImage};
use crate::schedule::render_identity::RenderIdentity;
use crate::schedule::render_threads::RenderThreads;
use crate::statistics::{Statistics, peak_memory_bytes};

/// The scene and the options of a render.
#[derive(Clone, Default)]
pub struct RenderRequest<'a> {
    /// The scene's file.
    pub scene: PathBuf,
    /// The options of loading it. If neither it nor they select an integrator, paths are traced if all surfaces support it.
    pub load: LoadOptions,
    /// Columns and rows, overriding the scene's.
    pub size: Option<(usize, usize)>,
    /// Samples per pixel, overriding the scene's.
    pub samples: Option<u32>,
    /// The sampler's seed, overriding the scene's.
    pub seed: Option<u64>,
    /// The course of the render.
    pub execution: Execution<'a>,
    /// Options of the engine, such as backend and width.
    pub engine: EngineOptions,
    /// The AOVs to render: images that the renderer makes, and [outputs](Aov::Output) of the integrator by their names.
    pub aovs: Vec<Aov>,
    /// True if the AOVs that help a denoiser are made, too, after those requested, if the integrator has such outputs.
    pub for_denoiser: bool,
    /// The noise, relative to their luminance, at which tiles take no more samples.
    pub noise_target: Option<f32>,
    /// The checkpoint, to resume the render later.
    pub checkpoint: Option<CheckpointRequest>,
    /// Called with the progress, from any thread.
    pub progress: Option<&'a (dyn Fn(Progress) + Sync)>,
    /// Called before the render begins with warnings that the user should see by then.
    pub early_warnings: Option<&'a (dyn Fn(&Messages) + Sync)>,
}

/// The requested checkpoints.
#[derive(Clone, Debug)]
pub struct CheckpointRequest {
    /// The file.
    pub path: PathBuf,
    /// The interval of writing; if `None`, only a render that ends early writes one.
    pub every: Option<Duration>,
    /// True if the render resumes from the file. If there is no such file, it starts from the beginning.
    pub resume: bool,
}

impl RenderRequest<'_> {
    /// Resolves the AOVs for the integrator of the scene.
    fn aov_plan(&self, scene: &Scene) -> Result<AovPlan, Messages> {
        let class = scene.integrator().class();
        let plan = AovPlan::new(&self.aovs, class).map_err(Messages::one)?;
        Ok(if self.for_denoiser { plan.with_denoiser(class) } else { plan })
    }

    fn tell(&self, progress: Progress) {
        if let Some(listener) = self.progress {
            listener(progress);
        }
    }
}

/// The result of a render.
#[derive(Debug)]
pub struct RenderResult {
    /// The image.
    pub image: Image,
    /// The AOVs in the order of the request, each once, then those for a denoiser.
    pub aovs: Vec<AovImage>,
    /// The settings of the image.
    pub settings: Settings,
    /// Statistics of the render.
    pub statistics: Statistics,
    /// Warnings.
    pub warnings: Messages,
}

/// Renders a scene from the disk.
///
/// # Errors
/// Any error of the scene, its shaders, or the machine.
pub fn render_scene(request: &RenderRequest<'_>) -> Result<RenderResult, Messages> {
    render_scene_from(request, &DiskFiles)
}

/// Renders a scene whose files come from `files`.
///
/// ```
/// use std::path::PathBuf;
///
/// use rtsl_render::RenderRequest;
/// use rtsl_render::request::render_scene_from;
/// use rtsl_scene::reader::MemoryFiles;
///
/// let text = "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"Pinhole\"\nWorldBegin\n\
///     LightSource \"infinite\" \"rgb L\" [1 1 1]\nShape \"Sphere\"\n";
/// let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text.to_owned())].into());
/// let request = RenderRequest {
///     scene: "scene.pbrt".into(),
///     size: Some((16, 12)),
///     samples: Some(1),
///     ..RenderRequest::default()
/// };
/// let rendered = render_scene_from(&request, &files).expect("the scene has no errors");
/// assert_eq!(rendered.image.pixels.len(), 16 * 12);
/// assert!(rendered.statistics.rays.camera >= 16 * 12);
/// ```
///
/// # Errors
/// As for [`render_scene`].
pub fn render_scene_from(
    request: &RenderRequest<'_>,
    files: &dyn FileSource,
) -> Result<RenderResult, Messages> {
    let start = Instant::now();
    let files = RecordedFiles::new(files);
    let mut loaded = std::thread::scope(|scope| {
        if request.engine.backend != Backend::Interpreter {
            // The compiler's library is loaded while the scene is read.
            scope.spawn(Engine::warm_up);
        }
        LoadedScene::new(request, &files)
    })?;
    loaded.choose_renderer();
    let Settings { width, height, .. } = loaded.scene.settings;
    let plan = request.aov_plan(&loaded.scene)?;
    let need = need(request, (width, height), &plan);
    check_render((width, height), need).map_err(Messages::one)?;
    let checkpoints = request.checkpoint.as_ref().map(|checkpoint| Checkpoints {
        path: checkpoint.path.clone(),
        every: checkpoint.every,
        resume: checkpoint.resume,
        fingerprint: fingerprint_of(request, &loaded, &files, &plan.features),
    });
    if let Some(checkpoints) = &checkpoints {
        check_place(request, checkpoints)?;
    }
    render_loaded(request, loaded, checkpoints.as_ref(), start)
}

/// Renders a scene whose files come from `files`, with an integrator in the place of the scene's own.
///
/// # Errors
/// As for [`render_scene`].
pub fn render_integrator(
    request: &RenderRequest<'_>,
    files: &dyn FileSource,
    integrator: &Arc<Instance>,
) -> Result<RenderResult, Messages> {
    let start = Instant::now();
    let loaded = LoadedScene::new(request, files)?.with_integrator(integrator);
    render_loaded(request, loaded, None, start)
}

/// The peak memory of a render besides the scene: the film and all images while they are made, or the images and their
/// encoded form while they are written.
fn need(request: &RenderRequest<'_>, size: (usize, usize), plan: &AovPlan) -> Need {
    let image = Amount::of::<[f32; 3]>(size.0.saturating_mul(size.1));
    let channel = Amount::of::<f32>(size.0.saturating_mul(size.1));
    let images = image + channel.times(plan.channels());
    let keeps = request.checkpoint.as_ref().is_some_and(|it| it.resume || it.every.is_some());
    let checkpoint = match keeps {
        true => Checkpoints::memory(size, &plan.features, plan.counts_work()),
        false => Amount::default(),
    };
    let film = SampleFilm::memory(size, &plan.features) + checkpoint.max(images);
    let helps = if request.for_denoiser { plan.denoiser_aovs() } else { 0 };
    let denoised = image.times(1 + helps);
    // An encoder reorders the numbers, for an EXR all of them.
    let written = images + images.max(denoised);
    Need { bytes: film.max(written), addresses: RenderThreads::stacks(request.execution.threads) }
}

/// Checks before the render that its checkpoint can be written. A checkpoint that is only written if the render ends
/// early may not be needed: an error is then a warning.
fn check_place(request: &RenderRequest<'_>, checkpoints: &Checkpoints) -> Result<(), Messages> {
    // The checkpoint to resume from is checked completely when it is read.
    if checkpoints.resume && checkpoints.path.exists() {
        return Ok(());
    }
    match Checkpoint::check_place(&checkpoints.path, &checkpoints.fingerprint) {
        Ok(()) => Ok(()),
        Err(error) if checkpoints.every.is_some() => Err(Messages::one(error.diagnostic())),
        Err(error) => {
            if let Some(listener) = request.early_warnings {
                listener(&Messages::one(error.early_warning()));
            }
            Ok(())
        }
    }
}

/// The fingerprint of an image of the path renderer.
fn fingerprint_of(
    request: &RenderRequest<'_>,
    loaded: &LoadedScene,
    files: &RecordedFiles<'_>,
    features: &Features,
) -> Fingerprint {
    let files = files.digests(&request.scene);
    let identity = RenderIdentity {
        options: request.load.clone(),
        ..RenderIdentity::new(files, request.engine.math, &loaded.engine)
    };
    schedule::render_identity::fingerprint(
        &loaded.scene.settings,
        Some(&identity),
        request.noise_target,
        features,
    )
}

fn render_loaded(
    request: &RenderRequest<'_>,
    loaded: LoadedScene,
    checkpoints: Option<&Checkpoints>,
    start: Instant,
) -> Result<RenderResult, Messages> {
    let darkness = Darkness::of(&loaded.scene);
    let Prepared { scene, statistics, mut warnings, .. } = Prepared::new(request, loaded)?;
    Engine::cool_down();
    let cold_start_seconds = start.elapsed().as_secs_f64();
    let waves_done = |tiles| request.tell(Progress::Rendering(tiles));
    let rendered = schedule::render(
        &scene,
        RenderOptions {
            execution: request.execution,
            progress: request.progress.is_some().then_some(&waves_done),
            noise_target: request.noise_target,
            checkpoints,
        },
    )?;
    let RenderedImage { rendered, mean_samples, checkpoint_error } = rendered;
    if let Some(problem) = &checkpoint_error {
        warnings.push_one(problem.diagnostic());
    }
    darkness.warning(&rendered.image).into_iter().for_each(|warning| warnings.push_one(warning));
    let mean_samples = Some(mean_samples);
    let statistics = Statistics { cold_start_seconds, mean_samples, ..statistics };
    let statistics = of_scene(statistics, &scene.compiled);
    Ok(result(rendered, scene.compiled.settings, statistics, warnings))
}

/// Returns the result, with the statistics of the render added to those of the scene.
fn result(
    rendered: Rendered,
    settings: Settings,
    statistics: Statistics,
    mut warnings: Messages,
) -> RenderResult {
    rendered.dropped_warning().into_iter().for_each(|warning| warnings.push_one(warning));
    let statistics = rendered.added_to(statistics);
    RenderResult { image: rendered.image, aovs: rendered.aovs, settings, statistics, warnings }
}

/// Adds statistics of the scene and the process.
fn of_scene(statistics: Statistics, scene: &CompiledScene) -> Statistics {
    Statistics {
        peak_memory_bytes: peak_memory_bytes(),
        size: [scene.settings.width, scene.settings.height],
        samples_per_pixel: scene.settings.sampler.samples_per_pixel(),
        objects: scene.objects.len(),
        ..statistics
    }
}

/// A loaded scene with an engine for its kernels.
pub(crate) struct LoadedScene {
    pub(crate) scene: Scene,
    engine: Engine,
    warnings: Messages,
    load_time: Duration,
    check_time: Duration,
    engine_time: Duration,
    /// The titles of objects in the scene's text, for traces.
    titles: Vec<String>,
}

impl LoadedScene {
    /// Loads the scene.
    pub(crate) fn new(
        request: &RenderRequest<'_>,
        files: &dyn FileSource,
    ) -> Result<LoadedScene, Messages> {
        let start = Instant::now();
        request.tell(Progress::Reading);
        let traced = request.engine.trace.is_some() || request.engine.costs.is_some();
        let options = LoadOptions { traced, ..request.load.clone() };
        let mut source = SceneSource::read(&request.scene, files, &options);
        let mut loaded = source.load()?;
        let objects = loaded.origins.objects.iter().filter(|_| options.traced);
        let titles = objects.map(|object| source.title(*object)).collect();
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
        let (scene, check_time, engine_time) = (loaded.scene, loaded.compile_time, start.elapsed());
        Ok(LoadedScene { scene, engine, warnings, load_time, check_time, engine_time, titles })
    }

    /// Puts an integrator in the place of the scene's own.
    pub(crate) fn with_integrator(mut self, integrator: &Arc<Instance>) -> LoadedScene {
        self.scene.integrator = Some(integrator.clone());
        self.scene.settings.integrator = Some(PATH_TRACER);
        self
    }

    /// Chooses the interactive renderer unless the scene names an integrator by its class, as the viewer does.
    pub(crate) fn prefer_interactive(&mut self) {
        self.scene.settings.integrator = Some(WHITTED);
    }

    /// Chooses the renderer, if neither the scene nor the request does: paths are traced if all surfaces support it.
    pub(crate) fn choose_renderer(&mut self) {
        let integrator = integrator_of(&self.engine, &self.scene);
        self.scene.settings.integrator = Some(integrator);
    }
}

/// Makes a picture one of its pixels.
///
/// # Errors
/// If the picture does not have it.
pub(crate) fn choose_pixel(settings: &mut Settings, [x, y]: [usize; 2]) -> Result<(), Messages> {
    let (width, height) = (settings.width, settings.height);
    if x < width && y < height {
        settings.set_pixel([x, y]);
        return Ok(());
    }
    let message = format!("there is no pixel {x},{y} in a picture of {width} by {height} pixels");
    let help = "columns and rows count from 0, from the top left";
    Err(Messages::one(Diagnostic::new(codes::NO_SUCH_PIXEL, message).help(help)))
}

/// A scene prepared for rendering.
pub(crate) struct Prepared {
    pub(crate) scene: RenderScene,
    /// Statistics of the preparation.
    pub(crate) statistics: Statistics,
    /// The number of primitives: shapes, and the elements of those that have any.
    pub(crate) primitives: u64,
    pub(crate) warnings: Messages,
}

impl Prepared {
    /// Prepares the scene.
    pub(crate) fn new(request: &RenderRequest<'_>, loaded: LoadedScene) -> Result<Self, Messages> {
        let LoadedScene { scene, engine, mut warnings, load_time, check_time, engine_time, titles } =
            loaded;
        let elements = scene.objects.iter().map(|it| u64::from(it.elements.unwrap_or(1)));
        let primitives = elements.sum();
        let told = |step| match step {
            BuildStep::Kernels { shaders } => request.tell(Progress::Compiling { shaders }),
            BuildStep::Hierarchy => request.tell(Progress::Building { primitives }),
        };
        let aovs = request.aov_plan(&scene)?.names();
        let mut scene = RenderScene::new(&scene, &engine, &aovs, &mut warnings, &told)?;
        scene.titles = titles;
        let optimise_time = optimise_first(&scene, request.execution.optimise);
        let statistics = Statistics {
            load_seconds: load_time.as_secs_f64(),
            check_seconds: check_time.as_secs_f64(),
            compile_seconds: (engine_time + scene.compile_time + optimise_time).as_secs_f64(),
            build_seconds: scene.compiled.build_time.as_secs_f64(),
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

/// Optimises the kernels before the render if the request says so. Returns the time that it took.
fn optimise_first(scene: &RenderScene, optimise: Optimise) -> Duration {
    let start = Instant::now();
    if optimise == Optimise::First {
        scene.wait_for_optimised();
    }
    start.elapsed()
}

/// The command line overrides the scene.
fn apply(request: &RenderRequest<'_>, settings: &mut Settings) {
    if let Some((width, height)) = request.size {
        settings.set_size(width.max(1), height.max(1));
    }
    if let Some(samples) = request.samples {
        settings.set_samples_per_pixel(samples);
    }
    if let Some(seed) = request.seed {
        settings.sampler.seed = seed;
    }
}
