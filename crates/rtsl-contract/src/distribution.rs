//! Pearson's chi-square test of samples against their density.

use glam::Vec3;

use crate::partition::{Integral, Partition, Sample};
use crate::statistics::{chi_square_quantile, normal_quantile};

/// Cells that expect fewer samples are counted together.
const LEAST_EXPECTED: f64 = 5.0;
/// How far an integral may be off without a reason: sums of floats.
const ROUNDING: f64 = 2e-3;

/// Every so many samples one serves to find where samples are many.
const PILOTS: usize = 4;

/// Samples of one thing, for two purposes that must not have any in common.
#[derive(Default)]
pub struct Samples {
    /// Those that say where samples are many.
    pub pilots: Vec<Sample>,
    /// Those that are compared, as far as they have a density.
    pub tests: Vec<Sample>,
    /// How many might be compared.
    pub count: usize,
    /// How many there are in all.
    all: usize,
}

impl Samples {
    /// Adds a sample. One without a direction or a density counts, but stands for nothing.
    pub fn add(&mut self, direction: Vec3, density: f32) {
        let is_pilot = self.all.is_multiple_of(PILOTS);
        self.all += 1;
        self.count += usize::from(!is_pilot);
        let is_direction = direction.is_finite() && direction != Vec3::ZERO;
        if is_direction && density.is_finite() && density > 0.0 {
            let sample = Sample { direction, density };
            if is_pilot { self.pilots.push(sample) } else { self.tests.push(sample) }
        }
    }

    /// Whether any has a density.
    pub fn has_densities(&self) -> bool {
        !(self.pilots.is_empty() && self.tests.is_empty())
    }
}

/// Samples beside what their density says.
pub struct Comparison {
    /// The integral of the density, and how far it may be off.
    pub integral: Integral,
    /// The part of samples that have a density.
    pub part: f64,
    /// How far chance may move that part.
    pub chance: f64,
    /// Chi-square of the counts in cells, its limit and the number of cells.
    pub statistic: f64,
    pub limit: f64,
    pub cells: u32,
    /// The cell that adds most to it.
    pub worst: Worst,
}

/// A direction around which there are too many samples, or too few.
#[derive(Clone, Copy, Debug, Default)]
pub struct Worst {
    pub direction: Vec3,
    pub observed: f64,
    pub expected: f64,
    term: f64,
}

impl Comparison {
    /// Compares samples with integrals of their density.
    pub fn new(
        partition: &Partition,
        integrals: &[Integral],
        samples: &Samples,
        significance: f64,
    ) -> Comparison {
        let Samples { tests, count, .. } = samples;
        let count = (*count).max(1) as f64;
        let mut observed = vec![0.0; partition.len()];
        tests.iter().for_each(|sample| observed[partition.cell(sample.direction)] += 1.0);
        let integral = Integral {
            value: integrals.iter().map(|it| it.value).sum(),
            error: integrals.iter().map(|it| it.error).sum(),
        };
        let part = tests.len() as f64 / count;
        let chance = normal_quantile(significance) * (part * (1.0 - part) / count).sqrt();
        let mut comparison = Comparison {
            integral,
            part,
            chance,
            statistic: 0.0,
            limit: 0.0,
            cells: 0,
            worst: Worst::default(),
        };
        comparison.compare_cells(partition, integrals, &observed);
        let freedom = f64::from(comparison.cells.saturating_sub(1).max(1));
        comparison.limit = chi_square_quantile(freedom, significance);
        comparison
    }

    /// Whether the density's integral is the part of samples that have one, and at most 1.
    pub fn integral_holds(&self) -> bool {
        let allowed = ROUNDING + self.integral.error;
        let difference = (self.integral.value - self.part).abs();
        self.integral.value <= 1.0 + allowed && difference <= allowed + self.chance
    }

    /// Whether samples are distributed like their density.
    pub fn shape_holds(&self) -> bool {
        self.statistic <= self.limit
    }

    /// What is wrong with the integral; `those` says what the samples that count do.
    pub fn integral_message(&self, place: &str, those: &str) -> String {
        let Comparison { integral, part, .. } = self;
        format!(
            "{place}: the density's integral is {:.4}, where {part:.4} of the samples {those}",
            integral.value
        )
    }

    /// What is wrong with the distribution.
    pub fn shape_message(&self, place: &str) -> String {
        let Comparison { statistic, limit, cells, worst, .. } = self;
        let Vec3 { x, y, z } = worst.direction;
        format!(
            "{place}: chi-square is {statistic:.0} in {cells} cells, where chance stays below {limit:.0}; around ({x:.3}, {y:.3}, {z:.3}) there are {} samples instead of {:.1}",
            worst.observed, worst.expected
        )
    }

    /// Samples are expected by the part of the density that a cell has: the parts of the whole are
    /// compared apart.
    fn compare_cells(&mut self, partition: &Partition, integrals: &[Integral], observed: &[f64]) {
        let chosen: f64 = observed.iter().sum();
        let scale = if self.integral.value > 0.0 { chosen / self.integral.value } else { 0.0 };
        let mut pool = Worst::default();
        for (cell, (integral, observed)) in integrals.iter().zip(observed).enumerate() {
            let expected = integral.value * scale;
            let direction = partition.middle(cell);
            let found = Worst { direction, observed: *observed, expected, term: 0.0 };
            if expected < LEAST_EXPECTED {
                if pool.observed == 0.0 || *observed - expected > pool.term {
                    pool.direction = direction;
                    pool.term = *observed - expected;
                }
                pool.observed += observed;
                pool.expected += expected;
            } else {
                self.add(found, integral.error * scale);
            }
        }
        // Samples where the density says there should be none count in full.
        if pool.expected >= LEAST_EXPECTED || pool.observed > LEAST_EXPECTED {
            self.add(pool, 0.0);
        }
    }

    fn add(&mut self, found: Worst, error: f64) {
        let difference = ((found.observed - found.expected).abs() - error).max(0.0);
        let term = difference * difference / found.expected.max(1.0);
        self.statistic += term;
        self.cells += 1;
        if term > self.worst.term {
            self.worst = Worst { term, ..found };
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use glam::DVec3;

    use super::*;
    use crate::random::Stream;
    use crate::statistics::significance;

    fn compare(density: impl Fn(&Vec3) -> f32) -> Comparison {
        let mut samples = Samples::default();
        for item in 0..20_000 {
            samples.add(Stream::new(1).direction(item).as_vec3(), 0.25 / PI);
        }
        let partition = Partition::new(DVec3::Z, &samples.pilots);
        let integrals = partition
            .integrate(15_000, |directions| Ok(directions.iter().map(&density).collect()))
            .unwrap();
        Comparison::new(&partition, &integrals, &samples, significance(1))
    }

    #[test]
    fn right_densities_pass_and_wrong_ones_do_not() {
        let right = compare(|_| 0.25 / PI);
        assert!(right.integral_holds() && right.shape_holds());
        let large = compare(|_| 0.26 / PI);
        assert!(!large.integral_holds() && large.shape_holds());
        let leaning = compare(|it| (1.0 + 0.2 * it.x) * 0.25 / PI);
        assert!(leaning.integral_holds() && !leaning.shape_holds());
        let half = compare(|it| if it.y > 0.0 { 0.5 / PI } else { 0.0 });
        assert!(half.integral_holds() && !half.shape_holds());
        assert!(!compare(|_| 0.0).integral_holds());
    }
}
