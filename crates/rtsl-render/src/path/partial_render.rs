//! Renders that a host advances part by part.

use std::ops::Range;
use std::sync::atomic::AtomicUsize;
use std::time::{Duration, Instant};

use rtsl::{Diagnostic, Messages, diagnostic_codes as codes};
use rtsl_memory::OutOfMemory;

use super::checkpoints::{CheckpointWriter, from_bytes, to_bytes};
use super::film::BatchFilm;
use super::render::{BatchOptions, BatchRendered, Job};
use super::scene::BatchScene;
use crate::checkpoint::Fingerprint;
use crate::compiled::object_classes::ObjectClasses;
use crate::compiled::runtime_errors::{RuntimeErrors, exhausted_budgets};
use crate::execution::Rendered;
use crate::statistics::RayCounts;
use crate::tiles::RenderThreads;

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
    film: BatchFilm,
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
        scene: &BatchScene,
        first: u32,
        noise_target: Option<f32>,
    ) -> Result<Self, Messages> {
        let settings = &scene.compiled.settings;
        let features = scene.aovs.features.clone();
        let film = BatchFilm::new((settings.width, settings.height), features, noise_target)
            .map_err(|error| Messages::one(error.diagnostic()))?
            .with_imaging(settings.imaging)
            .beginning_with(first);
        Ok(PartialRender {
            film,
            rays: RayCounts::default(),
            errors: RuntimeErrors::default(),
            time: Duration::ZERO,
            threads: 0,
            cancelled: false,
        })
    }

    /// Returns the film.
    pub(super) fn film(&self) -> &BatchFilm {
        &self.film
    }

    /// The time that its parts took.
    pub fn time(&self) -> Duration {
        self.time
    }

    /// Returns the part that is all of a picture.
    pub fn whole(&self, scene: &BatchScene) -> Part {
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
        scene: &BatchScene,
        part: &Part,
        options: BatchOptions<'_>,
    ) -> Result<bool, Messages> {
        let threads = RenderThreads::new(options.execution.threads)?;
        self.render_on(&threads, scene, part, options, None)
    }

    /// Renders a part on these threads.
    pub(super) fn render_on(
        &mut self,
        threads: &RenderThreads,
        scene: &BatchScene,
        part: &Part,
        options: BatchOptions<'_>,
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
    pub fn rendered(&self, scene: &BatchScene) -> Result<BatchRendered, Messages> {
        let PartialRender { film, errors, .. } = self;
        let (scene, aovs) = (&scene.compiled, &scene.aovs.aovs);
        let classes = ObjectClasses::of(scene);
        let class_indices: Vec<f32> = scene.objects.iter().map(|it| classes.index(it)).collect();
        let aovs = aovs.iter().map(|(aov, ty)| film.aov((aov, *ty), &class_indices));
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
        Ok(BatchRendered { rendered, mean_samples, checkpoint_error: None })
    }

    /// Adds the sums of another render of the same scene, whose samples follow those of this one, of a range of tiles.
    /// The sums depend on how the samples were parted, but not on who rendered them.
    ///
    /// # Errors
    /// If the samples of a tile do not follow, or the pictures do not have the same tiles.
    pub fn add(&mut self, later: &PartialRender, tiles: Range<usize>) -> Result<(), Messages> {
        let (own, other) = (self.film.tiles().len(), later.film.tiles().len());
        let problem =
            |message: String| Messages::one(Diagnostic::new(codes::BAD_CHECKPOINT, message));
        if own != other || tiles.end > own || self.film.features() != later.film.features() {
            return Err(problem("the renders are not of one picture".to_owned()));
        }
        for tile in tiles {
            if !self.film.append(tile, &later.film) {
                let first = later.film.first();
                let message = format!("tile {tile} has not all samples before sample {first}");
                return Err(problem(message));
            }
        }
        self.rays += later.rays;
        self.time += later.time;
        Ok(())
    }

    /// Returns the sums of the samples so far, for [`PartialRender::restore`] in another process.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn sums(&self, scene: &BatchScene) -> Result<Vec<u8>, Messages> {
        to_bytes(&self.film, self.fingerprint(scene))
            .map_err(|error| Messages::one(error.diagnostic()))
    }

    /// Continues with the sums of a render of the same scene.
    ///
    /// # Errors
    /// If they are damaged, or of other settings.
    pub fn restore(&mut self, scene: &BatchScene, sums: &[u8]) -> Result<(), Messages> {
        let restored = from_bytes(&self.film, &self.fingerprint(scene), sums);
        restored.map_err(|reason| {
            let message = format!("sums of samples cannot be used: {reason}");
            Messages::one(Diagnostic::new(codes::BAD_CHECKPOINT, message))
        })
    }

    /// The settings of the sums, and what they are of. The host answers for the scene.
    fn fingerprint(&self, scene: &BatchScene) -> Fingerprint {
        let mut fingerprint = Fingerprint::of_settings(&scene.compiled.settings);
        fingerprint.set("version of the program", env!("CARGO_PKG_VERSION"));
        fingerprint.set("first sample", self.film.first().to_string());
        let features = self.film.features();
        let outputs: Vec<&str> = features.outputs().iter().map(|output| &*output.name).collect();
        fingerprint.set("outputs", outputs.join(", "));
        fingerprint
    }
}
