//! How long contenders take.

use std::time::{Duration, Instant};

use crate::arena::Arena;
use crate::contenders::Contender;
use crate::packet::RAYS;

/// How to measure.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// How often each contender is timed.
    pub repetitions: usize,
    /// How long each time takes, about.
    pub time: Duration,
}

/// The times of a contender, nanoseconds a ray.
#[derive(Clone, Copy, Debug)]
pub struct Timing {
    /// The median.
    pub median: f64,
    /// The least.
    pub least: f64,
    /// A tenth is slower.
    pub slow: f64,
}

/// Times contenders, in turn in every repetition, so that what else the machine does
/// troubles all alike.
pub fn measure(contenders: &[Contender], arena: &mut Arena, plan: Plan) -> Vec<Timing> {
    let times: Vec<u32> = contenders.iter().map(|it| calibrate(it, arena, plan.time)).collect();
    let mut samples = vec![Vec::new(); contenders.len()];
    let rays = (arena.packets.len() * RAYS) as f64;
    for _ in 0..plan.repetitions {
        for ((contender, times), samples) in contenders.iter().zip(&times).zip(&mut samples) {
            contender.run(arena, 1);
            let duration = time(contender, arena, *times);
            samples.push(duration.as_secs_f64() * 1e9 / (f64::from(*times) * rays));
        }
    }
    samples.into_iter().map(Timing::new).collect()
}

/// How often the contender does all packets in about that time.
fn calibrate(contender: &Contender, arena: &mut Arena, target: Duration) -> u32 {
    let mut times = 1;
    loop {
        let duration = time(contender, arena, times);
        if duration * 2 >= target || times >= 1 << 24 {
            let scale = target.as_secs_f64() / duration.as_secs_f64().max(1e-9);
            return (f64::from(times) * scale).max(1.0) as u32;
        }
        times *= 2;
    }
}

fn time(contender: &Contender, arena: &mut Arena, times: u32) -> Duration {
    let start = Instant::now();
    contender.run(arena, times);
    start.elapsed()
}

impl Timing {
    fn new(mut samples: Vec<f64>) -> Timing {
        samples.sort_by(f64::total_cmp);
        let at = |part: f64| samples[((samples.len() - 1) as f64 * part).round() as usize];
        Timing { median: at(0.5), least: at(0.0), slow: at(0.9) }
    }
}
