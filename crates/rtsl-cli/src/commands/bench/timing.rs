//! Timing of calls.

use std::time::{Duration, Instant};

/// Nanoseconds per ray, over repetitions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Times {
    /// The median.
    pub median: f64,
    /// The 10th percentile.
    pub tenth: f64,
    /// The 90th percentile.
    pub ninetieth: f64,
}

/// A subject of repeated timing.
pub trait Subject {
    /// Prepares a call; not timed.
    fn prepare(&mut self);

    /// Calls once.
    fn call(&mut self);

    /// Returns the number of rays of a call.
    fn lanes(&self) -> usize;

    /// True if calls may follow each other without [`Subject::prepare`].
    fn is_repeatable(&self) -> bool;
}

/// The least time of a measurement of repeatable calls, so that the overhead and resolution of the clock do not matter.
const MIN_STRETCH: Duration = Duration::from_micros(20);
/// The least number of repetitions, however short the time.
const MIN_REPETITIONS: usize = 11;

/// Times all subjects in turn, repeatedly, for about `time` each: disturbances of the machine then affect all of them
/// alike, so that ratios are reliable.
pub fn time_in_turn(subjects: &mut [impl Subject], time: Duration) -> Vec<Times> {
    let clock = clock_cost();
    let calls: Vec<u32> = subjects.iter_mut().map(|subject| calls_in_stretch(subject)).collect();
    let mut samples: Vec<Vec<f64>> = vec![Vec::new(); subjects.len()];
    let (begun, total) = (Instant::now(), time * subjects.len() as u32);
    while samples.iter().any(|it| it.len() < MIN_REPETITIONS) || begun.elapsed() < total {
        for ((subject, calls), samples) in subjects.iter_mut().zip(&calls).zip(&mut samples) {
            let stretch = time_stretch(subject, *calls).saturating_sub(clock);
            let rays = subject.lanes() as f64 * f64::from(*calls);
            samples.push(stretch.as_secs_f64() * 1e9 / rays);
        }
    }
    samples.into_iter().map(Times::of).collect()
}

impl Times {
    fn of(mut samples: Vec<f64>) -> Times {
        samples.sort_by(f64::total_cmp);
        let at = |part: f64| samples[(part * (samples.len() - 1) as f64).round() as usize];
        Times { median: at(0.5), tenth: at(0.1), ninetieth: at(0.9) }
    }
}

fn time_stretch(subject: &mut impl Subject, calls: u32) -> Duration {
    subject.prepare();
    let start = Instant::now();
    for _ in 0..calls {
        subject.call();
    }
    start.elapsed()
}

/// Returns the number of calls in a measurement; includes the first call, which takes longer.
fn calls_in_stretch(subject: &mut impl Subject) -> u32 {
    time_stretch(subject, 1);
    if !subject.is_repeatable() {
        return 1;
    }
    let mut calls = 1;
    while time_stretch(subject, calls) < MIN_STRETCH {
        calls *= 2;
    }
    calls
}

/// Returns the overhead of querying the clock twice.
fn clock_cost() -> Duration {
    let mut costs: Vec<Duration> = (0..101).map(|_| Instant::now().elapsed()).collect();
    costs.sort();
    costs[costs.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_the_middle_and_the_tenths() {
        let samples = (0..=100).rev().map(f64::from).collect();
        assert_eq!(Times::of(samples), Times { median: 50.0, tenth: 10.0, ninetieth: 90.0 });
        assert_eq!(Times::of(vec![3.0]), Times { median: 3.0, tenth: 3.0, ninetieth: 3.0 });
    }
}
