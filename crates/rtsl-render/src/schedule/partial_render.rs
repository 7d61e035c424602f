//! Renders that a host advances part by part.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicUsize;
use std::time::{Duration, Instant};

use rtsl::{Diagnostic, Messages, Method, diagnostic_codes as codes};
use rtsl_memory::OutOfMemory;

use super::checkpoints::{CheckpointWriter, Checkpoints, from_bytes, restore, to_bytes, write};
use super::render::{Job, RenderOptions, RenderedImage};
use super::render_identity::{RenderIdentity, fingerprint};
use super::render_threads::RenderThreads;
use crate::checkpoint::{Checkpoint, CheckpointError, Fingerprint};
use crate::compiled::object_classes::ObjectClasses;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::{RuntimeErrors, exhausted_budgets};
use crate::execution::Rendered;
use crate::film::sample_film::SampleFilm;
use crate::statistics::{NotFinite, RayCounts};

/// A range of samples of a range of tiles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The tiles, in the order of rows.
    pub tiles: Range<usize>,
    /// The indices of the samples of each pixel.
    pub samples: Range<u32>,
}

/// A render that a host advances part by part, in any order of tiles and in the order of samples. When all parts are
/// done the picture has the bits of one that was rendered at once.
pub struct PartialRender {
    film: SampleFilm,
    identity: Option<RenderIdentity>,
    rays: RayCounts,
    errors: RuntimeErrors,
    time: Duration,
    threads: usize,
    cancelled: bool,
}

impl PartialRender {
    /// Begins to render a scene with the sample `first` of each pixel: 0 for a whole picture.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn new(
        scene: &RenderScene,
        first: u32,
        noise_target: Option<f32>,
    ) -> Result<Self, Messages> {
        let settings = &scene.compiled.settings;
        let features = scene.aovs.features.clone();
        let film = SampleFilm::new((settings.width, settings.height), features, noise_target)
            .map_err(|error| Messages::one(error.diagnostic()))?
            .with_imaging(settings.imaging)
            .beginning_with(first);
        Ok(PartialRender {
            film,
            identity: None,
            rays: RayCounts::default(),
            errors: RuntimeErrors::default(),
            time: Duration::ZERO,
            threads: 0,
            cancelled: false,
        })
    }

    /// Tells the render apart from those of other scenes. Without an identity, its host does not mix up the sums of
    /// several scenes.
    #[must_use]
    pub fn identified(self, identity: RenderIdentity) -> Self {
        PartialRender { identity: Some(identity), ..self }
    }

    /// Returns the film.
    pub(crate) fn film(&self) -> &SampleFilm {
        &self.film
    }

    /// The time that its parts took.
    pub fn time(&self) -> Duration {
        self.time
    }

    /// Returns the part that is all of a picture.
    pub fn whole(&self, scene: &RenderScene) -> Part {
        let samples = scene.compiled.settings.sampler.samples_per_pixel();
        Part { tiles: 0..self.film.tiles().len(), samples: 0..samples }
    }

    /// Renders a part; returns true if it ended early. The scene is the one with which it began. Checkpoints are not
    /// written.
    ///
    /// # Errors
    /// If a shader exceeds its budget of loop iterations, or threads cannot be started.
    ///
    /// # Panics
    /// If the picture does not have the tiles.
    pub fn render(
        &mut self,
        scene: &RenderScene,
        part: &Part,
        options: RenderOptions<'_>,
    ) -> Result<bool, Messages> {
        let threads = RenderThreads::new(options.execution.threads)?;
        self.render_on(&threads, scene, part, options, None)
    }

    /// Renders a part on these threads.
    pub(super) fn render_on(
        &mut self,
        threads: &RenderThreads,
        scene: &RenderScene,
        part: &Part,
        options: RenderOptions<'_>,
        writer: Option<&CheckpointWriter<'_>>,
    ) -> Result<bool, Messages> {
        let _span = tracing::debug_span!("render", threads = threads.count()).entered();
        let start = Instant::now();
        let (film, errors) = (&self.film, &self.errors);
        let (done, skipped) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let job = Job { scene, options, film, errors, writer, done, skipped };
        let (cancelled, rays) = job.run(part, threads, start);
        self.rays += rays;
        self.time += start.elapsed();
        self.threads = threads.count();
        self.cancelled = cancelled;
        match self.errors.any() {
            true => Err(exhausted_budgets(&scene.compiled, &self.errors)),
            false => Ok(cancelled),
        }
    }

    /// Returns the picture of the samples so far.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn rendered(&self, scene: &RenderScene) -> Result<RenderedImage, Messages> {
        let PartialRender { film, errors, .. } = self;
        let (scene, aovs) = (&scene.compiled, &scene.aovs.aovs);
        let classes = ObjectClasses::of(scene);
        let class_indices: Vec<f32> = scene.objects.iter().map(|it| classes.index(it)).collect();
        let aovs = aovs.iter().map(|(aov, ty)| film.aov(aov, *ty, &class_indices));
        let no_memory = |error: OutOfMemory| Messages::one(error.diagnostic());
        let rendered = Rendered {
            image: film.image().map_err(no_memory)?,
            aovs: aovs.collect::<Result<_, _>>().map_err(no_memory)?,
            object_classes: classes.names,
            rays: self.rays,
            dropped_samples: film.dropped(),
            not_finite: errors.not_finite(),
            time: self.time,
            threads: self.threads,
            cancelled: self.cancelled,
        };
        let mean_samples = film.mean_samples();
        Ok(RenderedImage { rendered, mean_samples, checkpoint_error: None })
    }

    /// Adds the sums of another render of the same scene, whose samples follow those of this one, of a range of tiles.
    /// The sums depend on how the samples were parted, but not on who rendered them.
    ///
    /// # Errors
    /// If the samples of a tile do not follow, or the pictures do not have the same tiles.
    pub fn add(&mut self, later: &PartialRender, tiles: Range<usize>) -> Result<(), Messages> {
        let (own, other) = (self.film.tiles().len(), later.film.tiles().len());
        if own != other || tiles.end > own || self.film.features() != later.film.features() {
            return Err(refused("the renders are not of one picture".to_owned()));
        }
        for tile in tiles {
            if !self.film.append(tile, &later.film) {
                let first = later.film.first();
                let message = format!("tile {tile} has not all samples before sample {first}");
                return Err(refused(message));
            }
        }
        self.rays += later.rays;
        self.time += later.time;
        Ok(())
    }

    /// Returns the sums of all samples of tiles so far, for [`PartialRender::restore`] in another process.
    ///
    /// # Errors
    /// If the picture does not have the tiles, or there is not enough memory.
    pub fn sums(&self, scene: &RenderScene, tiles: Range<usize>) -> Result<Vec<u8>, Messages> {
        self.check_tiles(&tiles)?;
        let fingerprint = self.fingerprint_of(scene, &tiles);
        to_bytes(&self.film, tiles, fingerprint).map_err(|error| Messages::one(error.diagnostic()))
    }

    /// Sets tiles to the sums of a render of the same scene, which take the place of those that they have.
    ///
    /// # Errors
    /// If the sums are damaged, or of other tiles or settings. Nothing changes then.
    pub fn restore(
        &mut self,
        scene: &RenderScene,
        tiles: Range<usize>,
        sums: &[u8],
    ) -> Result<(), Messages> {
        self.check_tiles(&tiles)?;
        let fingerprint = self.fingerprint_of(scene, &tiles);
        let restored = from_bytes(&self.film, tiles, &fingerprint, sums);
        restored.map_err(|reason| refused(format!("sums of samples cannot be used: {reason}")))
    }

    /// Forgets the samples of tiles.
    ///
    /// # Errors
    /// If the picture does not have the tiles.
    pub fn clear(&mut self, tiles: Range<usize>) -> Result<(), Messages> {
        self.check_tiles(&tiles)?;
        tiles.for_each(|tile| self.film.clear(tile));
        Ok(())
    }

    /// Returns the least number of samples of those tiles that need more than they have; `None` if none does.
    ///
    /// # Errors
    /// If the picture does not have the tiles.
    pub fn taken(&self, scene: &RenderScene, tiles: Range<usize>) -> Result<Option<u32>, Messages> {
        self.check_tiles(&tiles)?;
        let all = self.whole(scene).samples.end;
        Ok(tiles.filter_map(|tile| self.film.taken(tile)).filter(|taken| *taken < all).min())
    }

    /// Takes what was counted since this was called last.
    pub fn take_counts(&mut self) -> WorkCounts {
        WorkCounts {
            rays: std::mem::take(&mut self.rays),
            not_finite: self.errors.take_not_finite(),
            time: std::mem::take(&mut self.time),
        }
    }

    /// Adds what another render counted.
    pub fn add_counts(&mut self, counts: &WorkCounts) {
        self.rays += counts.rays;
        self.time += counts.time;
        for NotFinite { class, method, count } in &counts.not_finite {
            if let Some(method) = Method::from_name(method) {
                self.errors.report_not_finite(class, method, *count);
            }
        }
    }

    /// Writes a checkpoint, from which a render of the same scene can be resumed: by this or by
    /// [`render`](crate::schedule::render::render()).
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write_checkpoint(&self, scene: &RenderScene, path: PathBuf) -> Result<(), Messages> {
        write(&self.film, &self.checkpoints(scene, path)).map_err(of_checkpoint)
    }

    /// Checks that a checkpoint can be written.
    ///
    /// # Errors
    /// If it cannot.
    pub fn check_checkpoint(&self, scene: &RenderScene, path: &Path) -> Result<(), Messages> {
        Checkpoint::check_place(path, &self.fingerprint(scene)).map_err(of_checkpoint)
    }

    /// Continues from a checkpoint. Returns false if there is none.
    ///
    /// # Errors
    /// If it cannot be read, is damaged, or belongs to another render.
    pub fn resume(&mut self, scene: &RenderScene, path: PathBuf) -> Result<bool, Messages> {
        restore(&self.film, &self.checkpoints(scene, path)).map_err(of_checkpoint)
    }

    fn checkpoints(&self, scene: &RenderScene, path: PathBuf) -> Checkpoints {
        let fingerprint = self.fingerprint(scene);
        Checkpoints { path, every: None, resume: true, fingerprint }
    }

    fn check_tiles(&self, tiles: &Range<usize>) -> Result<(), Messages> {
        match tiles.start <= tiles.end && tiles.end <= self.film.tiles().len() {
            true => Ok(()),
            false => Err(refused("the picture does not have these tiles".to_owned())),
        }
    }

    /// The inputs of the picture.
    fn fingerprint(&self, scene: &RenderScene) -> Fingerprint {
        let (settings, film) = (&scene.compiled.settings, &self.film);
        let mut fingerprint =
            fingerprint(settings, self.identity.as_ref(), film.noise_target(), film.features());
        if film.first() > 0 {
            fingerprint.set("first sample", film.first());
        }
        fingerprint
    }

    /// The inputs of the sums of tiles.
    fn fingerprint_of(&self, scene: &RenderScene, tiles: &Range<usize>) -> Fingerprint {
        let mut fingerprint = self.fingerprint(scene).condensed();
        fingerprint.set("tiles", format!("{}..{}", tiles.start, tiles.end));
        fingerprint
    }
}

/// The counts of a render besides its sums.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WorkCounts {
    /// The number of rays.
    pub rays: RayCounts,
    /// The values that were not finite.
    pub not_finite: Vec<NotFinite>,
    /// The time that its parts took.
    pub time: Duration,
}

fn refused(message: String) -> Messages {
    Messages::one(Diagnostic::new(codes::BAD_CHECKPOINT, message))
}

fn of_checkpoint(error: CheckpointError) -> Messages {
    Messages::one(error.diagnostic())
}
