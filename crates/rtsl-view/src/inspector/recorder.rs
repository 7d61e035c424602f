//! Samples of pixels, evaluated and recorded by a thread, so that the window never waits.

use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::thread;

use egui::Context;
use rtsl::{SteppedLines, Trace, TraceDetail, TraceLimits};
use rtsl_render::TracedSample;
use rtsl_render::session::{Probe, ProbedPixel};

/// The greatest number of entries of a recording, about 150 MB.
pub const KEPT: usize = 1 << 20;

/// The stack of the thread: each level of `trace` uses some of it.
const STACK_BYTES: usize = 128 << 20;

/// The evaluation of samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Job {
    /// The value of a sample and what shaders print for it.
    Facts(ProbedPixel),
    /// All that happens in a sample, step by step.
    Steps(ProbedPixel),
    /// The first operations whose results are not finite in these samples.
    Causes(Vec<ProbedPixel>),
}

/// A sample with its recording.
pub struct Recorded {
    /// The sample.
    pub pixel: ProbedPixel,
    /// Its value, outputs and recording.
    pub sample: TracedSample,
    /// The lines of statements of the texts that take part.
    pub lines: SteppedLines,
}

/// The result of a job: the samples, or an error as text.
pub type Outcome = Result<Vec<Recorded>, String>;

/// A thread that evaluates samples.
#[derive(Default)]
pub struct Recorder {
    running: Option<(Job, Receiver<Outcome>)>,
}

impl Recorder {
    /// Starts a job. The answer to an earlier one is not waited for.
    pub fn start(&mut self, context: &Context, mut probe: Probe, job: Job) {
        let (sender, receiver) = mpsc::channel();
        let (context, work) = (context.clone(), job.clone());
        let run = move || {
            // The receiver is gone if another job has been started, or the window is closed.
            let _ = sender.send(done(&mut probe, &work));
            context.request_repaint();
        };
        let started = thread::Builder::new().stack_size(STACK_BYTES).spawn(run);
        // Without a thread the receiver has no sender, which is told as the end of one.
        drop(started);
        self.running = Some((job, receiver));
    }

    /// Returns the job that is running.
    pub fn running(&self) -> Option<&Job> {
        self.running.as_ref().map(|(job, _)| job)
    }

    /// Returns the outcome of the job, if it is done.
    pub fn take(&mut self) -> Option<(Job, Outcome)> {
        let outcome = match self.running.as_ref()?.1.try_recv() {
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => {
                Err("the sample could not be evaluated: its thread has ended".to_owned())
            }
            Ok(outcome) => outcome,
        };
        let (job, _) = self.running.take()?;
        Some((job, outcome))
    }
}

fn done(probe: &mut Probe, job: &Job) -> Outcome {
    let (pixels, detail) = match job {
        Job::Facts(pixel) => (std::slice::from_ref(pixel), TraceDetail::Calls),
        Job::Steps(pixel) => (std::slice::from_ref(pixel), TraceDetail::Steps),
        Job::Causes(pixels) => (pixels.as_slice(), TraceDetail::Calls),
    };
    let recorded = pixels.iter().map(|pixel| {
        let trace = Trace::with_limits(detail, TraceLimits { skip: 0, keep: KEPT });
        let sample = probe.sample(*pixel, &trace).map_err(|messages| messages.to_text(false))?;
        Ok(Recorded { pixel: *pixel, sample, lines: trace.stepped_lines() })
    });
    recorded.collect()
}
