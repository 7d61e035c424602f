//! The execution of renders, and their results.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rtsl::Diagnostic;
use rtsl_image::{AovImage, Image};

use crate::compiled::runtime_errors::dropped_samples;
use crate::statistics::{NotFinite, RayCounts, Statistics};

/// Options that affect the course of a render, but none of the samples that it takes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Execution<'a> {
    /// The number of threads; that of all processors if `None`.
    pub threads: Option<usize>,
    /// Ends the render early when it becomes true.
    pub cancel: Option<&'a AtomicBool>,
    /// Ends the render early after this time.
    pub time_limit: Option<Duration>,
    /// The time at which kernels are optimised.
    pub optimise: Optimise,
}

/// The time at which the kernels of integrators and materials are optimised. Until then they are those that were
/// compiled without optimisation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Optimise {
    /// In the background of renders that are long enough to repay it.
    #[default]
    Background,
    /// Before the render begins.
    First,
    /// Never.
    Never,
}

impl Execution<'_> {
    /// The defaults, with this number of threads.
    pub fn on_threads(threads: usize) -> Self {
        Execution { threads: Some(threads), ..Execution::default() }
    }

    /// True if a render that began at `start` has to end early.
    pub(crate) fn must_stop(&self, start: Instant) -> bool {
        let cancelled = self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed));
        cancelled || self.time_limit.is_some_and(|limit| start.elapsed() >= limit)
    }
}

/// An image with statistics of its render.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The image. If the render ended early, it has the samples taken so far; pixels without samples are black.
    pub image: Image,
    /// The AOVs, in the order of the options.
    pub aovs: Vec<AovImage>,
    /// The names of object classes, by their indices in the AOV.
    pub object_classes: Vec<String>,
    /// The number of rays traced.
    pub rays: RayCounts,
    /// The number of samples that were not finite.
    pub dropped_samples: u64,
    /// The methods whose values were not finite.
    pub not_finite: Vec<NotFinite>,
    /// The duration.
    pub time: Duration,
    /// The number of threads.
    pub threads: usize,
    /// True if the render ended early.
    pub cancelled: bool,
}

impl Rendered {
    /// Returns statistics with those of the render added.
    pub fn added_to(&self, statistics: Statistics) -> Statistics {
        let mut statistics = Statistics {
            rays: self.rays,
            dropped_samples: self.dropped_samples,
            not_finite: self.not_finite.clone(),
            object_classes: self.object_classes.clone(),
            threads: self.threads,
            cancelled: self.cancelled,
            ..statistics
        };
        statistics.set_render_time(self.time);
        statistics
    }

    /// Returns the warning about samples that were not finite, if there were any.
    pub fn dropped_warning(&self) -> Option<Diagnostic> {
        dropped_samples(self.dropped_samples, &self.not_finite)
    }
}
