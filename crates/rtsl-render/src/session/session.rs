//! The type `Session`.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rtsl::{
    Diagnostic, Engine, Messages, SourceMap, Trace, TraceDetail, diagnostic_codes as codes,
};
use rtsl_image::exposure_scale;
use rtsl_math::Transform;
use rtsl_memory::{Amount, Need, check_render};
use rtsl_scene::reader::DiskFiles;
use rtsl_scene::{EntityId, Loaded, Origins, PATH_TRACER, Scene, SceneSource, Settings, WHITTED};

use super::control::{Control, Thing};
use super::enlargement::Enlargement;
use super::film::{Film, SampleWork};
use super::options::SessionOptions;
use super::picked::Picked;
use super::probe::Probe;
use super::renderer::SessionRenderer;
use super::resolution::Resolution;
use super::status::Status;
use super::view_mode::{Display, ViewMode};
use crate::compiled::object::is_own_material;
use crate::compiled::placed_objects::HitObject;
use crate::compiled::runtime_errors::{RuntimeErrors, exhausted_budgets};
use crate::compiled::tracer::Tracer;
use crate::integrate::memory::ThreadMemory;
use crate::pixel::SampleRequest;
use crate::schedule::render_threads::RenderThreads;
use crate::schedule::tile::{TILE, Tile};
use crate::schedule::tile_samples::TileSamples;
use crate::statistics::{LaneUse, RayCounts};

/// The time without changes after which the kernels are optimised in the background. Before, it would slow down the
/// compilation of the next change.
const OPTIMISED_AFTER: Duration = Duration::from_millis(500);

/// A scene that is rendered while it changes.
///
/// ```
/// use std::time::Duration;
///
/// use rtsl_render::session::{Session, SessionOptions};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("scene.pbrt");
/// # let text = "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"Pinhole\"\n\
/// #     Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 12\n\
/// #     Sampler \"stratified\" \"integer pixelsamples\" 1\nWorldBegin\nShape \"Sphere\"\n";
/// # std::fs::write(&path, text)?;
/// let opened = Session::open(&path, SessionOptions::default());
/// let (mut session, _warnings) = opened.expect("the scene has no errors");
/// // A viewer shows the film after each slice of time.
/// while session.advance(Duration::from_millis(20)) {}
/// assert_eq!(session.film().size(), (16, 12));
/// # Ok::<(), std::io::Error>(())
/// ```
pub struct Session {
    source: SceneSource<'static>,
    options: SessionOptions,
    engine: Engine,
    threads: RenderThreads,
    scene: Scene,
    origins: Origins,
    renderer: SessionRenderer,
    film: Film,
    /// The film of the frame being rendered, which is displayed when it is complete.
    frame: Film,
    display: Display,
    camera_to_world: Transform,
    errors: RuntimeErrors,
    phase: Phase,
    /// The time of the last change.
    changed_at: Instant,
    /// The tiles that wait for a sample, each once, and the number of them that were started.
    waiting: Vec<usize>,
    begun: usize,
    /// The resolution of frames.
    resolution: Resolution,
    /// The use of lanes in calls since the first sample.
    lane_use: Mutex<LaneUse>,
    status: Status,
}

/// The next task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Render a whole frame.
    Frame,
    /// Add samples to the waiting tiles.
    Refinement,
    /// Nothing: all samples are taken.
    Rest,
    /// Nothing: a shader exceeded its budget.
    Stopped,
}

/// The result of reading the files again.
#[derive(Debug)]
pub struct Reloaded {
    /// True if anything changed.
    pub changed: bool,
    /// Warnings.
    pub warnings: Messages,
}

impl Session {
    /// Opens the scene in the file `path`. Also returns warnings.
    ///
    /// # Errors
    /// Any error of the scene, its shaders, or the machine.
    pub fn open(path: &Path, options: SessionOptions) -> Result<(Session, Messages), Messages> {
        let mut source = SceneSource::read(path, &DiskFiles, &options.load);
        let Loaded { mut scene, origins, mut warnings, .. } = source.load()?;
        options.apply(&mut scene.settings);
        check_size(&scene, options.threads)?;
        let (engine, engine_warnings) =
            Engine::new(options.engine_for(&scene.settings)).map_err(Messages::one)?;
        warnings.push(SourceMap::new(), engine_warnings);
        choose_renderer(source.selected_integrator().is_some(), &mut scene);
        let renderer = SessionRenderer::new(&scene, &engine, None, &mut warnings)?;
        let threads = RenderThreads::new(options.threads)?;
        let settings = &scene.settings;
        let exposure = exposure_scale(settings.exposure + options.exposure);
        let session = Session {
            status: Status {
                width: engine.width(),
                target: engine.llvm().map_or("interpreter", |llvm| llvm.host().cpu()).to_owned(),
                threads: threads.count(),
                reduction: 1,
                ..Status::default()
            },
            film: film(settings.width, settings.height)?,
            frame: film(1, 1)?,
            display: Display::new(ViewMode::Image, exposure),
            camera_to_world: scene.camera_to_world,
            errors: RuntimeErrors::default(),
            phase: Phase::Frame,
            changed_at: Instant::now(),
            waiting: Vec::new(),
            begun: 0,
            resolution: Resolution::UNKNOWN,
            lane_use: Mutex::default(),
            source,
            options,
            engine,
            threads,
            scene,
            origins,
            renderer,
        };
        Ok((session, warnings))
    }

    /// Renders for about `budget`: the pending frame, or more samples. Returns true if the displayed pixels changed.
    pub fn advance(&mut self, budget: Duration) -> bool {
        let start = Instant::now();
        let rays = match self.phase {
            Phase::Frame => self.render_frame(),
            Phase::Refinement => self.refine(start + budget),
            Phase::Rest | Phase::Stopped => return false,
        };
        self.count(rays, start.elapsed());
        if self.errors.any() {
            self.phase = Phase::Stopped;
            let problem = exhausted_budgets(self.renderer.compiled(), &self.errors);
            self.status.problem = Some(problem.to_text(false));
        }
        true
    }

    /// True if [`Session::advance`] has work to do.
    pub fn is_busy(&self) -> bool {
        matches!(self.phase, Phase::Frame | Phase::Refinement)
    }

    /// Returns the film.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Returns the status.
    pub fn status(&self) -> Status {
        let samples_wanted = self.samples_wanted();
        let samples = match self.phase {
            Phase::Frame | Phase::Stopped => 0,
            Phase::Refinement => self.film.mean_samples(),
            Phase::Rest => samples_wanted,
        };
        let integrator = self.integrator().to_owned();
        let size = self.film.size();
        Status { size, samples, samples_wanted, integrator, ..self.status.clone() }
    }

    fn samples_wanted(&self) -> u32 {
        self.renderer.compiled().settings.sampler.samples_per_pixel()
    }

    /// Returns the names of integrators for [`Session::set_integrator`]: that of the interactive renderer, the scene's
    /// own, and those of the library.
    pub fn integrators(&self) -> Vec<String> {
        self.source.integrators()
    }

    /// Returns the class of the integrator that makes the picture, or the name of the interactive renderer.
    pub fn integrator(&self) -> &str {
        self.renderer.name()
    }

    /// Shows the scene by another integrator: the interactive renderer, or a class. The scene's own has the parameters
    /// that the scene gives it.
    ///
    /// # Errors
    /// If there is no such integrator, or it cannot be compiled; nothing changes then.
    pub fn set_integrator(&mut self, name: &str) -> Result<Reloaded, Messages> {
        let earlier = self.source.selected_integrator().map(str::to_owned);
        self.source.select_integrator(Some(name));
        let done = self.source.load().and_then(|loaded| self.take_over(loaded));
        if done.is_err() {
            self.source.select_integrator(earlier.as_deref());
        }
        done
    }

    /// Returns the transform from the camera's space to the world's.
    pub fn camera(&self) -> Transform {
        self.camera_to_world
    }

    /// Returns the transform from the camera's space to the world's in the scene's text.
    pub fn scene_camera(&self) -> Transform {
        self.scene.camera_to_world
    }

    /// Moves the camera. At the scene's camera position at shutter open, it has the scene's camera motion; elsewhere it
    /// does not move during the shutter interval.
    pub fn set_camera(&mut self, camera_to_world: Transform) {
        if camera_to_world != self.camera_to_world {
            self.camera_to_world = camera_to_world;
            self.place_camera();
            self.restart();
        }
    }

    fn place_camera(&mut self) {
        let is_of_scene = self.camera_to_world == self.scene.camera_to_world;
        let motion = self.scene.camera_motion.as_ref().filter(|_| is_of_scene);
        let (motion, map) = (motion.cloned(), self.camera_to_world.affine());
        self.renderer.change_view(|compiled| {
            (compiled.camera_motion, compiled.camera_to_world) = (motion, map);
        });
    }

    /// Changes columns and rows. Invalid sizes, and sizes without enough memory, are ignored.
    pub fn resize(&mut self, width: usize, height: usize) {
        let mut scene = Scene { ..self.scene.clone() };
        scene.settings.set_size(width, height);
        let is_possible =
            width > 0 && height > 0 && check_size(&scene, self.options.threads).is_ok();
        if (width, height) == self.film.size() || !is_possible {
            return;
        }
        let Ok(film) = Film::new(width, height) else { return };
        self.options.size = Some((width, height));
        self.scene = scene;
        self.renderer.change_view(|compiled| compiled.settings.set_size(width, height));
        film.show_scaled(&self.film);
        self.film = film;
        self.restart();
    }

    /// Returns the view mode.
    pub fn view_mode(&self) -> ViewMode {
        self.display.mode()
    }

    /// Changes the view mode. Quantities that are only counted on demand need new samples.
    pub fn set_view_mode(&mut self, mode: ViewMode) {
        let starts_to_count = mode.is_counted() && mode != self.display.mode();
        let exposure = self.scene.settings.exposure + self.options.exposure;
        self.display = Display::new(mode, exposure_scale(exposure));
        if starts_to_count {
            self.restart();
        } else {
            self.film.show(&self.display);
        }
    }

    /// Returns the parts of the scene that have parameters, in the order of its text.
    pub fn things(&self) -> Vec<Thing> {
        let entities = self.source.description().entities.iter().enumerate();
        let things = entities.filter_map(|(index, entity)| {
            let id = EntityId(index);
            let class = self.source.instance(id)?.class().name.clone();
            Some(Thing { entity: id, kind: entity.kind, title: self.source.title(id), class })
        });
        things.collect()
    }

    /// Returns the parameters of a part of the scene with their current values.
    pub fn controls(&self, entity: EntityId) -> Vec<Control> {
        let Some(instance) = self.source.instance(entity) else { return Vec::new() };
        let controls = instance.class().parameters.iter().filter_map(|parameter| {
            let given = self.source.given_values(entity, &parameter.name);
            Control::new(instance, parameter, given.as_ref())
        });
        controls.collect()
    }

    /// Sets a parameter of a part of the scene. Nothing is compiled.
    ///
    /// # Errors
    /// If the value is not valid; nothing changes then.
    pub fn set_control(
        &mut self,
        entity: EntityId,
        name: &str,
        numbers: &[f64],
    ) -> Result<(), Messages> {
        let control = self.controls(entity).into_iter().find(|control| control.name == name);
        let control = control.ok_or_else(|| {
            let message = format!("there is no parameter `{name}` to set");
            Messages::one(Diagnostic::new(codes::UNKNOWN_PARAMETER, message))
        })?;
        let earlier = self.source.set_parameter(entity, name, control.scene_values(numbers));
        let done = self.source.load().and_then(|loaded| self.take_over(loaded));
        if let Err(messages) = done {
            self.source.restore_parameter(entity, name, earlier);
            return Err(messages);
        }
        Ok(())
    }

    /// Reads the scene's files again if they changed, including shaders. Parameters that were set are kept unless the
    /// scene's text changed; the camera is kept unless the text moves it.
    ///
    /// # Errors
    /// Any error of the files; the scene stays unchanged.
    pub fn reload(&mut self) -> Result<Reloaded, Messages> {
        if self.source.text_changed() {
            let mut source = self.source.read_again();
            let loaded = source.load()?;
            let reloaded = self.take_over(loaded)?;
            self.source = source;
            Ok(reloaded)
        } else {
            self.source.refresh_shaders();
            let loaded = self.source.load()?;
            self.take_over(loaded)
        }
    }

    /// Returns the files from which the scene was read, including shaders but not those of the library.
    pub fn source_files(&self) -> Vec<PathBuf> {
        self.source.source_files()
    }

    /// Returns the folders for `#include` besides the scene's.
    pub fn search_path(&self) -> &[PathBuf] {
        &self.options.load.search_path
    }

    /// Returns the object under a pixel, counted from the top left.
    pub fn pick(&self, x: usize, y: usize) -> Option<Picked> {
        let (width, height) = self.film.size();
        if x >= width || y >= height {
            return None;
        }
        let errors = RuntimeErrors::default();
        let compiled = self.renderer.compiled();
        let tracer = Tracer { scene: compiled, errors: &errors };
        let mut memory = ThreadMemory::new(self.renderer.scene());
        let tile = Tile { x: x - x % TILE, y: y - y % TILE };
        let lane = Tile::lane(x, y);
        // With one sample of each pixel, lanes of packets are those of tiles.
        let samples = TileSamples { tile, first: 0, count: 1 };
        let rays = &self.renderer.camera_packet(&errors, &mut memory, &samples).rays;
        let hits = tracer.nearest(&mut memory.searcher.memory, rays, 1 << lane);
        if hits.lanes(1 << lane) == 0 {
            return None;
        }
        let hit = HitObject::of(&compiled.geometry, &compiled.items, hits.id[lane])?;
        let index = hit.member.object as usize;
        let object = &self.scene.objects[index];
        let [origin, direction] =
            [rays.origin_of(lane), rays.direction_of(lane)].map(|it| it.map(f64::from));
        let t = f64::from(hits.distance[lane]);
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        let shape = *self.origins.objects.get(index)?;
        let material = (!is_own_material(object)).then_some(object.material);
        let shading = match material {
            Some(material) => &self.scene.materials[material as usize],
            None => &object.primitive,
        };
        Some(Picked {
            shape,
            title: self.source.title(shape),
            class: object.primitive.class().name.clone(),
            material: material.and_then(|material| self.origins.materials[material as usize]),
            material_class: shading.class().name.clone(),
            distance: t * length,
            position: std::array::from_fn(|axis| origin[axis] + t * direction[axis]),
        })
    }

    /// Returns the lines that shaders print for the first sample of a pixel, counted from the top left. The scene is
    /// compiled once more for that if a shader may print.
    ///
    /// # Errors
    /// Any error of the scene, its shaders, or the machine.
    pub fn prints(&self, x: usize, y: usize) -> Result<Vec<String>, Messages> {
        let (width, height) = self.film.size();
        // Most scenes print nothing, and need not be compiled again.
        if x >= width || y >= height || !self.source.has_prints() {
            return Ok(Vec::new());
        }
        let trace = Trace::new(TraceDetail::Prints);
        let request = SampleRequest { pixel: [x, y], sample: 0, outputs: false, trace: &trace };
        let sample = self.probe().evaluate(&request)?;
        Ok(sample.recording.entries.iter().map(ToString::to_string).collect())
    }

    /// Returns a probe of the scene as it is now, whose samples any thread can evaluate.
    pub fn probe(&self) -> Probe {
        let is_moved = self.camera_to_world != self.scene.camera_to_world;
        Probe {
            source: self.source.traced(),
            options: SessionOptions { size: Some(self.film.size()), ..self.options.clone() },
            engine: self.options.engine_for(&self.scene.settings),
            camera: is_moved.then_some(self.camera_to_world),
        }
    }

    /// Continues with a scene that was loaded again, keeping everything that did not change.
    fn take_over(&mut self, loaded: Loaded) -> Result<Reloaded, Messages> {
        let Loaded { mut scene, origins, mut warnings, .. } = loaded;
        self.options.apply(&mut scene.settings);
        check_size(&scene, self.options.threads)?;
        choose_renderer(self.source.selected_integrator().is_some(), &mut scene);
        let same_integrator =
            scene.has_same_integrator(&self.scene) && scene.settings == self.scene.settings;
        let same_shapes = scene.has_same_shapes(&self.scene);
        if same_integrator && same_shapes && scene.has_same_shading(&self.scene) {
            return Ok(Reloaded { changed: false, warnings });
        }
        let engine = match scene.settings.loop_budget == self.scene.settings.loop_budget {
            true => self.engine.clone(),
            false => {
                let options = self.options.engine_for(&scene.settings);
                Engine::new(options).map_err(Messages::one)?.0
            }
        };
        let earlier = Some((&self.renderer, &self.scene));
        self.renderer = SessionRenderer::new(&scene, &engine, earlier, &mut warnings)?;
        self.engine = engine;
        self.adopt(scene, origins)?;
        Ok(Reloaded { changed: true, warnings })
    }

    fn adopt(&mut self, scene: Scene, origins: Origins) -> Result<(), Messages> {
        let size = (scene.settings.width, scene.settings.height);
        if size != self.film.size() {
            let film = film(size.0, size.1)?;
            film.show_scaled(&self.film);
            self.film = film;
        }
        if scene.camera_to_world != self.scene.camera_to_world {
            self.camera_to_world = scene.camera_to_world;
        }
        let exposure = exposure_scale(scene.settings.exposure + self.options.exposure);
        self.display = Display::new(self.display.mode(), exposure);
        self.scene = scene;
        self.origins = origins;
        self.place_camera();
        self.restart();
        Ok(())
    }

    fn restart(&mut self) {
        self.film.clear();
        self.lane_use = Mutex::default();
        self.errors = RuntimeErrors::default();
        self.status.problem = None;
        self.phase = Phase::Frame;
        self.changed_at = Instant::now();
    }

    /// Renders one sample of every pixel, at lower resolution if it takes too long.
    fn render_frame(&mut self) -> RayCounts {
        let start = Instant::now();
        let (width, height) = self.film.size();
        let reduction = self.resolution.reduction((width, height));
        let size = (width.div_ceil(reduction), height.div_ceil(reduction));
        if self.frame.size() != size {
            match film(size.0, size.1) {
                Ok(film) => self.frame = film,
                Err(problem) => {
                    self.status.problem = Some(problem.to_text(false));
                    self.phase = Phase::Stopped;
                    return RayCounts::default();
                }
            }
        }
        self.frame.clear();
        let whole = self.renderer.compiled().settings.clone();
        self.renderer.change_view(|compiled| compiled.settings.set_size(size.0, size.1));
        let all: Vec<usize> = (0..self.frame.tiles().len()).collect();
        let visit = Visit { tiles: &all, first: 0, deadline: None, keeps_objects: reduction > 1 };
        let (_, rays) = self.render_tiles(&self.frame, visit);
        self.renderer.change_view(|compiled| compiled.settings = whole);
        if self.errors.any() {
            return rays;
        }
        if reduction == 1 {
            std::mem::swap(&mut self.film, &mut self.frame);
        } else {
            self.show_enlarged_frame();
        }
        self.choose_tiles();
        self.status.frame_time = start.elapsed();
        self.status.reduction = reduction;
        self.resolution.note(reduction, size, start.elapsed());
        rays
    }

    /// Displays the frame at the size of the film.
    fn show_enlarged_frame(&self) {
        let enlargement = Enlargement::new(self.frame.preview(), self.film.size());
        let film = &self.film;
        let show = |(): &mut (), index| film.show_enlarged(index, &enlargement);
        self.threads.for_each_tile(0..film.tiles().len(), || (), || true, show);
    }

    /// Adds samples until the deadline.
    fn refine(&mut self, deadline: Instant) -> RayCounts {
        if self.changed_at.elapsed() > OPTIMISED_AFTER {
            self.renderer.scene().optimise();
        }
        let mut sum = RayCounts::default();
        while let Phase::Refinement = self.phase {
            let visit = Visit {
                tiles: &self.waiting,
                first: self.begun,
                deadline: Some(deadline),
                keeps_objects: false,
            };
            let (begun, rays) = self.render_tiles(&self.film, visit);
            sum += rays;
            self.begun = begun;
            if begun == self.waiting.len() {
                self.choose_tiles();
            }
            if Instant::now() >= deadline || self.errors.any() {
                break;
            }
        }
        sum
    }

    /// Selects the tiles that get the next sample.
    fn choose_tiles(&mut self) {
        self.waiting = self.film.most_in_need(self.samples_wanted());
        self.begun = 0;
        self.phase = if self.waiting.is_empty() { Phase::Rest } else { Phase::Refinement };
    }

    /// Takes the next samples of tiles, of those without any one each, so that the whole picture is soon complete;
    /// returns the position of the first that was not started.
    fn render_tiles(&self, film: &Film, visit: Visit<'_>) -> (usize, RayCounts) {
        let Session { renderer, errors, display, lane_use: sum, .. } = self;
        let Visit { tiles, first, deadline, keeps_objects } = visit;
        // At least one tile is rendered, however short the time.
        let begun = AtomicBool::new(false);
        let in_time = || {
            deadline.is_none_or(|deadline| Instant::now() < deadline)
                || !begun.swap(true, Ordering::Relaxed)
        };
        let takes_one = tiles.get(first).is_some_and(|tile| film.taken(*tile) == 0);
        let (count, threads) = (tiles.len(), self.threads.count());
        let together = if takes_one { renderer.tiles_of_visit(count, threads) } else { 1 };
        let (next, memories) = self.threads.for_each_tile(
            first.div_ceil(together)..count.div_ceil(together),
            || ThreadMemory::new(renderer.scene()),
            || !errors.any() && in_time(),
            |memory, place| {
                let tiles = &tiles[place * together..count.min((place + 1) * together)];
                let samples = next_samples(renderer, film, tiles, takes_one);
                let start = Instant::now();
                let taken = renderer.take_samples(errors, memory, &samples, keeps_objects);
                let time = start.elapsed() / samples.len() as u32;
                for ((index, samples), taken) in tiles.iter().zip(samples).zip(taken) {
                    let lane_use = taken.lane_use;
                    let mut work = SampleWork { time, lane_use, ..SampleWork::NONE };
                    *lock(sum) += lane_use;
                    if display.mode() == ViewMode::Nodes {
                        work.visited = renderer.visits(errors, memory, samples);
                    }
                    // Samples that were aborted are not added.
                    if !errors.any() {
                        film.add(*index, &taken.samples, &work, display);
                        taken.objects.into_iter().for_each(|it| film.set_objects(*index, it));
                    }
                }
            },
        );
        let mut rays = RayCounts::default();
        memories.iter().for_each(|memory| rays += memory.rays);
        (count.min(next * together), rays)
    }

    /// Updates the ray rate as a moving average, and the use of lanes.
    fn count(&mut self, rays: RayCounts, time: Duration) {
        const MEMORY: f64 = 0.3;
        let seconds = time.as_secs_f64().max(1e-9);
        let now = rays.total() as f64 / seconds;
        let before = self.status.rays_per_second;
        let part = if before == 0.0 { 1.0 } else { (seconds / MEMORY).min(1.0) };
        self.status.rays_per_second = before + (now - before) * part;
        let lanes = lock(&self.lane_use).part();
        self.status.lane_utilisation = lanes.or(self.status.lane_utilisation);
    }
}

/// Tiles that take samples, in their order.
struct Visit<'a> {
    tiles: &'a [usize],
    /// The position of the first one.
    first: usize,
    /// The time at which no further tile begins; `None` for all tiles.
    deadline: Option<Instant>,
    /// True if the film keeps the objects that are visible.
    keeps_objects: bool,
}

/// Returns the samples that tiles take next.
fn next_samples(
    renderer: &SessionRenderer,
    film: &Film,
    tiles: &[usize],
    takes_one: bool,
) -> Vec<TileSamples> {
    let of_tile = |index: &usize| {
        let first = film.taken(*index);
        let count = if takes_one { 1 } else { renderer.samples_of_visit(first) };
        TileSamples { tile: film.tiles()[*index], first, count }
    };
    tiles.iter().map(of_tile).collect()
}

fn lock(lane_use: &Mutex<LaneUse>) -> MutexGuard<'_, LaneUse> {
    lane_use.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Creates a film, or returns the error that there is not enough memory.
fn film(width: usize, height: usize) -> Result<Film, Messages> {
    Film::new(width, height).map_err(|error| Messages::one(error.diagnostic()))
}

/// Selects the renderer: names of the format leave the choice to the viewer, which prefers the interactive renderer,
/// unless one was selected.
pub(super) fn choose_renderer(selects_integrator: bool, scene: &mut Scene) {
    let traces_paths = selects_integrator && scene.settings.integrator == Some(PATH_TRACER);
    if scene.integrator.is_none() && !traces_paths {
        scene.settings.integrator = Some(WHITTED);
    }
}

fn check_size(scene: &Scene, threads: Option<usize>) -> Result<(), Messages> {
    let Settings { width, height, .. } = scene.settings;
    if let Some(problem) = scene.settings.size_problem() {
        return Err(Messages::one(Diagnostic::new(codes::SCENE_LIMIT, problem)));
    }
    // The displayed film, the frame being rendered, and its pixels here and in the host's copies.
    let bytes = Film::memory(width, height).times(2) + Amount::of::<[u32; 3]>(width * height);
    let need = Need { bytes, addresses: RenderThreads::stacks(threads) };
    check_render((width, height), need).map_err(Messages::one)
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;

#[cfg(test)]
#[path = "integrator_tests.rs"]
mod integrator_tests;
