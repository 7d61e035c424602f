//! Energy conservation.
//!
//! Transmitted radiance may be scaled: on entering a denser medium it grows by the square of the ratio of indices, and
//! it shrinks on its way out. Light transmitted from one side may therefore be multiplied by a factor, the same for all
//! directions, if it is divided by it from the other side.

use glam::{DVec3, Vec3};

use super::meeting::Meeting;
use super::path_methods::ONLY_SHADES;
use crate::contract::Contract;
use crate::report::{Failure, Finding, Outcome};
use crate::statistics::{Mean, normal_quantile};
use crate::values::is_color;

/// The tolerance for rounding in sums of floats.
const ROUNDING: f64 = 2e-3;
/// An upper bound of the squared ratio of refractive indices.
const MAX_SCALE: f64 = 16.0;

/// The weights of samples for one geometry.
pub struct Weights {
    meeting: Meeting,
    /// By component, reflected and transmitted.
    reflected: [Mean; 3],
    transmitted: [Mean; 3],
}

impl Weights {
    pub fn new(meeting: &Meeting) -> Weights {
        Weights {
            meeting: *meeting,
            reflected: Default::default(),
            transmitted: Default::default(),
        }
    }

    /// Adds a sample: a delta if the density is 0. An invalid sample is ignored here, because it breaks another
    /// contract.
    pub fn add(&mut self, direction: Vec3, value: Vec3, density: f32) {
        if !(is_color(value) && direction.is_finite() && density.is_finite() && density >= 0.0) {
            return;
        }
        let direction: DVec3 = direction.as_dvec3();
        let normal = self.meeting.normal;
        let factor =
            if density > 0.0 { direction.dot(normal).abs() / f64::from(density) } else { 1.0 };
        let passes = direction.dot(normal) * self.meeting.view().dot(normal) < 0.0;
        for component in 0..3 {
            let weight = f64::from(value[component]) * factor;
            self.reflected[component].add(if passes { 0.0 } else { weight });
            self.transmitted[component].add(if passes { weight } else { 0.0 });
        }
    }
}

/// The results for all geometries.
#[derive(Default)]
pub struct Throughput {
    measured: Vec<Measured>,
}

/// One component for one geometry.
struct Measured {
    meeting: Meeting,
    reflected: f64,
    transmitted: f64,
    /// The statistical error of the sum.
    chance: f64,
}

impl Throughput {
    pub fn add(&mut self, weights: Weights, significance: f64) {
        let deviations = normal_quantile(significance / 3.0);
        let components = weights.reflected.iter().zip(&weights.transmitted);
        for (reflected, transmitted) in components.filter(|(it, _)| it.count() > 0.0) {
            self.measured.push(Measured {
                meeting: weights.meeting,
                reflected: reflected.mean(),
                transmitted: transmitted.mean(),
                chance: deviations * (reflected.deviation() + transmitted.deviation()) + ROUNDING,
            });
        }
    }

    /// Returns the finding: the contract holds if a scale of transmitted light exists with which no geometry scatters
    /// too much.
    pub fn finish(self, is_sampled: bool) -> Finding {
        let contract = Contract::Energy;
        if self.measured.is_empty() {
            let reason = if is_sampled { "no sample has a value to measure" } else { ONLY_SHADES };
            return Finding { contract, outcome: Outcome::NotApplicable(reason.to_owned()) };
        }
        // Light from outside is divided by the scale, light from behind is multiplied by it.
        let (mut least, mut greatest) = (1.0 / MAX_SCALE, MAX_SCALE);
        for it in self.measured.iter().filter(|it| it.transmitted > 0.0) {
            let left = (1.0 + it.chance - it.reflected).max(0.0);
            if it.meeting.is_behind() {
                greatest = f64::min(greatest, left / it.transmitted);
            } else {
                least = f64::max(least, it.transmitted / left);
            }
        }
        let scale = if least <= 1.0 && 1.0 <= greatest { 1.0 } else { (least * greatest).sqrt() };
        let scaled = |it: &Measured| {
            let scale = if it.meeting.is_behind() { scale } else { 1.0 / scale };
            it.reflected + it.transmitted * scale
        };
        let excess = |it: &Measured| scaled(it) - 1.0 - it.chance;
        let is_broken = |it: &&Measured| excess(it) > 1e-9 || excess(it).is_nan();
        let broken = self.measured.iter().filter(is_broken).count() as u64;
        let worst = self.measured.iter().max_by(|a, b| excess(a).total_cmp(&excess(b)));
        let most = self.measured.iter().map(scaled).fold(0.0, f64::max);
        let outcome = match worst {
            Some(worst) if broken > 0 => Outcome::Broken(Failure {
                message: format!(
                    "{}: of white light, {:.4} is reflected and {:.4} goes through; chance explains {:.4}",
                    worst.meeting, worst.reflected, worst.transmitted, worst.chance
                ),
                inputs: None,
                broken,
                tested: self.measured.len() as u64,
            }),
            _ => Outcome::Held(Some(note(most, scale))),
        };
        Finding { contract, outcome }
    }
}

fn note(most: f64, scale: f64) -> String {
    if scale == 1.0 {
        format!("at most {most:.3} of white light")
    } else {
        format!(
            "at most {most:.3} of white light, what goes through being scaled by {scale:.2} and its inverse"
        )
    }
}
