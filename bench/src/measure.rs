//! Timing of contenders.

use std::time::{Duration, Instant};

/// The plan of a measurement.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// The number of times that each contender is timed.
    pub repetitions: usize,
    /// The approximate duration of each.
    pub time: Duration,
}

/// A subject of timing; `A` is the memory that all compared subjects share.
pub trait Subject<A> {
    /// Performs its work `times` times.
    fn run(&self, arena: &mut A, times: u32);
}

/// The times of a contender, in nanoseconds per ray.
#[derive(Clone, Debug)]
pub struct Timing {
    /// The median.
    pub median: f64,
    /// The minimum.
    pub least: f64,
    /// The 90th percentile.
    pub slow: f64,
    /// In the order of the repetitions.
    samples: Vec<f64>,
}

/// Times subjects, in turn in every repetition, so that disturbances of the machine affect all alike. One run of each
/// processes `rays` rays.
pub fn measure<A, S: Subject<A>>(
    subjects: &[S],
    arena: &mut A,
    rays: usize,
    plan: Plan,
) -> Vec<Timing> {
    let times: Vec<u32> = subjects.iter().map(|it| calibrate(it, arena, plan.time)).collect();
    let mut samples = vec![Vec::new(); subjects.len()];
    for repetition in 0..plan.repetitions {
        for ((subject, times), samples) in subjects.iter().zip(&times).zip(&mut samples) {
            let duration = match repetition % 2 {
                0 => deeper::<16>(|| time(subject, arena, *times)),
                _ => deeper::<32>(|| time(subject, arena, *times)),
            };
            samples.push(duration.as_secs_f64() * 1e9 / (f64::from(*times) * rays as f64));
        }
    }
    samples.into_iter().map(Timing::new).collect()
}

/// Returns the number of runs that take about the target time.
fn calibrate<A>(subject: &impl Subject<A>, arena: &mut A, target: Duration) -> u32 {
    let mut times = 1;
    loop {
        let duration = time(subject, arena, times);
        if duration * 2 >= target || times >= 1 << 24 {
            let scale = target.as_secs_f64() / duration.as_secs_f64().max(1e-9);
            return (f64::from(times) * scale).max(1.0) as u32;
        }
        times *= 2;
    }
}

/// Runs `work` with the stack pointer moved by so many bytes. Compilers align vectors on the stack to 16 bytes only,
/// and kernels whose vectors cross cache lines are up to a tenth slower; using both alignments equally removes this
/// dependence on the start of the stack.
#[inline(never)]
fn deeper<const BYTES: usize>(work: impl FnOnce() -> Duration) -> Duration {
    let room = std::hint::black_box([0_u8; BYTES]);
    let duration = work();
    std::hint::black_box(&room);
    duration
}

/// Returns the time of a second run: the first warms up caches and predictors.
fn time<A>(subject: &impl Subject<A>, arena: &mut A, times: u32) -> Duration {
    subject.run(arena, 1);
    let start = Instant::now();
    subject.run(arena, times);
    start.elapsed()
}

impl Timing {
    /// Creates the timing from one sample for each repetition, at least one.
    pub fn new(samples: Vec<f64>) -> Timing {
        let sorted = sorted(samples.iter().copied());
        let [median, least, slow] = [0.5, 0.0, 0.9].map(|part| quantile(&sorted, part));
        Timing { median, least, slow, samples }
    }

    /// Returns the ratio of its time to that of `other`: the median over the repetitions, in which both had the machine
    /// at the same speed.
    pub fn ratio(&self, other: &Timing) -> f64 {
        let pairs = self.samples.iter().zip(&other.samples);
        quantile(&sorted(pairs.map(|(own, other)| own / other)), 0.5)
    }
}

fn sorted(numbers: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut numbers: Vec<f64> = numbers.collect();
    numbers.sort_by(f64::total_cmp);
    numbers
}

fn quantile(sorted: &[f64], part: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * part).round() as usize]
}
