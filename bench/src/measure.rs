//! How long contenders take.

use std::time::{Duration, Instant};

/// How to measure.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// How often each contender is timed.
    pub repetitions: usize,
    /// How long each time takes, about.
    pub time: Duration,
}

/// What can be timed; `A` is the memory that all who are compared share.
pub trait Subject<A> {
    /// Does its work `times` times.
    fn run(&self, arena: &mut A, times: u32);
}

/// The times of a contender, nanoseconds a ray.
#[derive(Clone, Debug)]
pub struct Timing {
    /// The median.
    pub median: f64,
    /// The least.
    pub least: f64,
    /// A tenth is slower.
    pub slow: f64,
    /// In the order of the repetitions.
    samples: Vec<f64>,
}

/// Times subjects, in turn in every repetition, so that what else the machine does troubles all
/// alike. One time of each does `rays` rays.
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

/// How often the subject does its work in about that time.
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

/// Runs `work` so many bytes further down the stack. Compilers align vectors there to 16 bytes only, and where
/// they lie across cache lines kernels are up to a tenth slower: by chance of where the stack
/// starts, were both alignments not given equal parts.
#[inline(never)]
fn deeper<const BYTES: usize>(work: impl FnOnce() -> Duration) -> Duration {
    let room = std::hint::black_box([0_u8; BYTES]);
    let duration = work();
    std::hint::black_box(&room);
    duration
}

/// The time of a second run: the first brings the caches and predictors back.
fn time<A>(subject: &impl Subject<A>, arena: &mut A, times: u32) -> Duration {
    subject.run(arena, 1);
    let start = Instant::now();
    subject.run(arena, times);
    start.elapsed()
}

impl Timing {
    /// Of one sample for each repetition, at least one.
    pub fn new(samples: Vec<f64>) -> Timing {
        let sorted = sorted(samples.iter().copied());
        let [median, least, slow] = [0.5, 0.0, 0.9].map(|part| quantile(&sorted, part));
        Timing { median, least, slow, samples }
    }

    /// How much longer than `other` it takes: the median over the repetitions, in which both had the machine
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
