//! Comparison of samples with their density.
//!
//! Let `f` be the density with which a class samples, `p` the density that it states, `q` an independent density of
//! this crate ([`Proposal`]), and `r = p / (p + q)`. The mean of `r` over directions that `q` proposes and that of `1 -
//! r` over samples are the same integral, that of `pq / (p + q)`, if `f` is `p`. No term of either mean is less than 0
//! or more than 1, however narrow or high `p` is, so the statistical error is bounded without knowing `p`: a spike that
//! few points hit is not an outlier. (Bennett, "Efficient Estimation of Free Energy Differences from Monte Carlo Data",
//! 1976.)

use std::ops::Range;

use glam::{DVec3, Vec3};

use crate::partition::{Partition, Sample};
use crate::proposal::{Integral, Proposal};
use crate::random::Stream;
use crate::statistics::{Mean, bernstein_bound, chi_square_quantile, normal_quantile};
use crate::stop::Stop;

/// Cells with a smaller expected number of samples are merged.
const MIN_EXPECTED: f64 = 4.0;
/// The tolerance of an integral: rounding in sums of floats.
const ROUNDING: f64 = 2e-3;
/// One of this many samples is used to find where samples are dense.
const PILOTS: usize = 4;
/// The number of proposed directions for each sample, so that the samples dominate the statistical error.
const PROPOSALS: usize = 8;
/// The greatest number of proposed directions.
const MAX_PROPOSALS: usize = 1 << 20;
/// If an integral seems wrong but could be so by chance, this many times as many samples decide.
const MORE_SAMPLES: u64 = 16;
/// The greatest number of these samples.
const MAX_MORE_SAMPLES: u64 = 1 << 20;

/// The source of samples and of their density.
pub trait Source {
    /// Adds the samples with these indices.
    ///
    /// # Errors
    /// If a method cannot be compiled or does not terminate.
    fn draw(&mut self, numbers: Range<u64>, samples: &mut Samples) -> Result<(), Stop>;

    /// Returns the densities of directions, finite and not negative.
    ///
    /// # Errors
    /// If a method cannot be compiled or does not terminate.
    fn densities(&mut self, directions: &[Vec3]) -> Result<Vec<f32>, Stop>;
}

/// Samples of one source, divided into two disjoint sets.
#[derive(Default)]
pub struct Samples {
    /// The samples that show where samples are dense.
    pilots: Vec<Sample>,
    /// The samples with a density that are compared.
    tests: Vec<Sample>,
    /// The number of samples for comparison, including those without a density.
    count: usize,
    /// The number of all samples.
    all: usize,
}

impl Samples {
    /// Adds a sample. A sample without a direction or a density is only counted.
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

    /// True if any sample has a density.
    pub fn has_densities(&self) -> bool {
        !(self.pilots.is_empty() && self.tests.is_empty())
    }
}

/// The result of comparing samples with their density.
pub struct Comparison {
    /// The integral of the density, with its error.
    integral: Integral,
    /// The fraction of samples that have a density.
    part: f64,
    /// The statistical error of that fraction.
    chance: f64,
    /// True if chance and rounding explain the difference of the integral and the fraction.
    is_explained: bool,
    /// Chi-square of the cells, its limit and the number of cells.
    statistic: f64,
    limit: f64,
    cells: u32,
    /// The cell that contributes most to chi-square.
    worst: Worst,
}

/// A direction around which there are too many samples, or too few.
#[derive(Clone, Copy, Debug, Default)]
struct Worst {
    direction: Vec3,
    observed: f64,
    expected: f64,
    term: f64,
}

impl Comparison {
    /// Compares samples with the density of their source, cell by cell of a partition around an axis. If these samples
    /// cannot decide on the integral, more are drawn.
    ///
    /// # Errors
    /// Those of the source.
    pub fn new(
        source: &mut impl Source,
        samples: &Samples,
        axis: DVec3,
        stream: Stream,
        significance: f64,
    ) -> Result<Comparison, Stop> {
        let partition = Partition::new(axis, &samples.pilots);
        let count = samples.count.max(1);
        let proposal = Proposal::new(partition, count, |directions| source.densities(directions))?;
        let meeting = Meeting::new(source, samples, &proposal, stream)?;
        let integrals = proposal.integrals();
        let part = samples.tests.len() as f64 / count as f64;
        let mut comparison = Comparison {
            integral: Integral {
                value: integrals.iter().map(|it| it.value).sum(),
                error: integrals.iter().map(|it| it.error).sum(),
            },
            part,
            chance: normal_quantile(significance) * (part * (1.0 - part) / count as f64).sqrt(),
            is_explained: true,
            statistic: 0.0,
            limit: 0.0,
            cells: 0,
            worst: Worst::default(),
        };
        if !samples.tests.is_empty() {
            comparison.compare_cells(&proposal, &meeting);
        }
        let freedom = f64::from(comparison.cells.saturating_sub(1).max(1));
        comparison.limit = chi_square_quantile(freedom, significance);
        if !comparison.seems_whole() {
            // The two comparisons share the probability of a false alarm.
            let significance = 0.5 * significance;
            comparison.is_explained = meeting.is_explained(significance) && {
                let first = samples.all as u64;
                let more = (MORE_SAMPLES * first).min(MAX_MORE_SAMPLES).max(first);
                let mut samples = Samples::default();
                source.draw(first..first + more, &mut samples)?;
                Meeting::new(source, &samples, &proposal, stream.at(1))?.is_explained(significance)
            };
        }
        Ok(comparison)
    }

    /// True if the density's integral is the fraction of samples that have one.
    pub fn integral_holds(&self) -> bool {
        self.is_explained
    }

    /// True if samples are distributed like their density.
    pub fn shape_holds(&self) -> bool {
        self.statistic <= self.limit
    }

    /// Returns the direction in which samples and density differ most.
    pub fn worst_direction(&self) -> Vec3 {
        self.worst.direction
    }

    /// Returns the message for a wrong integral; `those` describes the samples that count.
    pub fn integral_message(&self, place: &str, those: &str) -> String {
        let Comparison { integral, part, .. } = self;
        format!(
            "{place}: the density's integral is {:.4}, where {part:.4} of the samples {those}",
            integral.value
        )
    }

    /// Returns the message for a wrong distribution.
    pub fn shape_message(&self, place: &str) -> String {
        let Comparison { statistic, limit, cells, worst, .. } = self;
        let Vec3 { x, y, z } = worst.direction;
        format!(
            "{place}: chi-square is {statistic:.0} in {cells} cells, where chance stays below {limit:.0}; around ({x:.3}, {y:.3}, {z:.3}) there are {} samples instead of {:.1}",
            worst.observed, worst.expected
        )
    }

    /// True if the sum over quadrature points gives the fraction of the samples, as it usually does for a correct
    /// density. For a density with edges or spikes, the error of such a sum may be underestimated.
    fn seems_whole(&self) -> bool {
        let allowed = ROUNDING + self.integral.error;
        let difference = (self.integral.value - self.part).abs();
        self.integral.value <= 1.0 + allowed && difference <= allowed + self.chance
    }

    /// Compares each cell, with the density scaled to the samples, because the integrals are compared separately.
    fn compare_cells(&mut self, proposal: &Proposal, meeting: &Meeting) {
        let scale = meeting.scale();
        let cells = meeting.cells(scale, proposal.integrals().len());
        let chosen: f64 = cells.iter().map(|it| it.observed).sum();
        let samples_of_whole =
            if self.integral.value > 0.0 { chosen / self.integral.value } else { 0.0 };
        let mut pool = (Tallied::default(), Worst::default());
        for (cell, (tallied, integral)) in cells.iter().zip(proposal.integrals()).enumerate() {
            let found = Worst {
                direction: proposal.middle(cell),
                observed: tallied.observed,
                expected: integral.value * samples_of_whole,
                term: 0.0,
            };
            if tallied.expected(meeting) < MIN_EXPECTED {
                pool.0.add(tallied);
                let excess = found.observed - found.expected;
                if pool.1.observed == 0.0 || excess > pool.1.term {
                    pool.1.direction = found.direction;
                    pool.1.term = excess;
                }
                pool.1.observed += found.observed;
                pool.1.expected += found.expected;
            } else {
                self.add(tallied.square(meeting), found);
            }
        }
        // Samples in places where the density is 0 count in full.
        let (tallied, found) = pool;
        if tallied.expected(meeting).max(tallied.samples) > MIN_EXPECTED {
            self.add(tallied.square(meeting), found);
        }
    }

    fn add(&mut self, term: f64, found: Worst) {
        self.statistic += term;
        self.cells += 1;
        if term > self.worst.term {
            self.worst = Worst { term, ..found };
        }
    }
}

/// The stated density of directions, with the density of proposing them.
struct Meeting {
    proposed: Vec<Ratio>,
    /// The samples that have a density.
    samples: Vec<Ratio>,
    /// The number of samples, including those without a density.
    count: usize,
}

/// Both densities of a direction.
#[derive(Clone, Copy)]
struct Ratio {
    cell: usize,
    stated: f64,
    proposed: f64,
}

impl Ratio {
    /// The stated density, divided by `scale`, as a fraction of the sum of both.
    fn stated_part(self, scale: f64) -> f64 {
        self.stated / (self.stated + scale * self.proposed)
    }
}

impl Meeting {
    fn new(
        source: &mut impl Source,
        samples: &Samples,
        proposal: &Proposal,
        stream: Stream,
    ) -> Result<Meeting, Stop> {
        let count = (PROPOSALS * samples.count).clamp(1, MAX_PROPOSALS);
        let proposed = proposal.directions(stream, count);
        let directions: Vec<Vec3> = proposed.iter().map(|it| it.direction).collect();
        let stated = source.densities(&directions)?;
        let proposed = proposed.iter().zip(stated).map(|(it, stated)| Ratio {
            cell: it.cell,
            stated: f64::from(stated),
            proposed: it.density,
        });
        let of_samples = samples.tests.iter().map(|sample| {
            let (cell, proposed) = proposal.at(sample.direction);
            Ratio { cell, stated: f64::from(sample.density), proposed }
        });
        Ok(Meeting {
            proposed: proposed.collect(),
            samples: of_samples.collect(),
            count: samples.count.max(1),
        })
    }

    /// True if chance and rounding explain the difference of both means.
    fn is_explained(&self, significance: f64) -> bool {
        let (mut stated, mut sampled) = (Mean::default(), Mean::default());
        self.proposed.iter().for_each(|it| stated.add(it.stated_part(1.0)));
        self.samples.iter().for_each(|it| sampled.add(1.0 - it.stated_part(1.0)));
        (self.samples.len()..self.count).for_each(|_| sampled.add(0.0));
        // Either mean may be wrong in either direction.
        let chance = [&stated, &sampled].map(|it| bernstein_bound(it, 0.5 * significance));
        let difference = (stated.mean() - sampled.mean()).abs();
        difference <= chance[0] + chance[1] + 0.5 * ROUNDING
    }

    /// The factor by which the density must be divided for both means to be equal: Newton's method, in the logarithm.
    fn scale(&self) -> f64 {
        let mut logarithm = 0.0_f64;
        for _ in 0..30 {
            let scale = libm::exp(logarithm);
            let sums = |list: &[Ratio]| {
                list.iter().fold((0.0, 0.0), |(parts, slopes), it| {
                    let part = it.stated_part(scale);
                    (parts + part, slopes + part * (1.0 - part))
                })
            };
            let (parts, slopes) = sums(&self.proposed);
            let (sample_parts, sample_slopes) = sums(&self.samples);
            let (proposals, count) = (self.proposed.len() as f64, self.count as f64);
            let stated = parts / proposals;
            let sampled = (self.samples.len() as f64 - sample_parts) / count;
            let slope = slopes / proposals + sample_slopes / count;
            let step = ((stated - sampled) / slope.max(1e-12)).clamp(-1.0, 1.0);
            logarithm += step;
            if step.abs() < 1e-6 {
                break;
            }
        }
        libm::exp(logarithm)
    }

    fn cells(&self, scale: f64, count: usize) -> Vec<Tallied> {
        let mut cells = vec![Tallied::default(); count];
        for ratio in &self.proposed {
            let (cell, part) = (&mut cells[ratio.cell], ratio.stated_part(scale));
            cell.proposed += part;
            cell.proposed_squares += part * part;
            cell.proposed_products += part * (1.0 - part);
        }
        for ratio in &self.samples {
            let (cell, part) = (&mut cells[ratio.cell], ratio.stated_part(scale));
            cell.samples += 1.0 - part;
            cell.sample_products += part * (1.0 - part);
            cell.observed += 1.0;
        }
        cells
    }
}

/// Sums over a cell: for proposed directions `r`, its square, and the product of `r` and `1 - r`; for samples `1 - r`
/// and the same product.
#[derive(Clone, Copy, Default)]
struct Tallied {
    observed: f64,
    proposed: f64,
    proposed_squares: f64,
    proposed_products: f64,
    samples: f64,
    sample_products: f64,
}

impl Tallied {
    fn add(&mut self, other: &Tallied) {
        self.observed += other.observed;
        self.proposed += other.proposed;
        self.proposed_squares += other.proposed_squares;
        self.proposed_products += other.proposed_products;
        self.samples += other.samples;
        self.sample_products += other.sample_products;
    }

    /// The cell's share of the integral, estimated from the proposed directions, as a number of samples.
    fn expected(&self, meeting: &Meeting) -> f64 {
        self.proposed / meeting.proposed.len() as f64 * meeting.count as f64
    }

    /// The squared difference of the cell's two integrals, in standard deviations.
    fn square(&self, meeting: &Meeting) -> f64 {
        let (proposals, count) = (meeting.proposed.len() as f64, meeting.count as f64);
        let (stated, sampled) = (self.proposed / proposals, self.samples / count);
        // The variances of both integrals, estimated from the proposed directions. If these missed a spike, the samples
        // show its effect on the integral.
        let told = (self.proposed_squares / proposals + self.proposed_products / count) / proposals;
        let variance = told.max(self.sample_products / (proposals * count));
        let difference = ((stated - sampled).abs() - ROUNDING * stated).max(0.0);
        if variance > 0.0 { difference * difference / variance } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;
    use crate::random::on_sphere;
    use crate::statistics::significance;

    /// A source given by two functions: the direction of the sample with an index, and the density of a direction.
    struct Made<D, S>(D, S);

    impl<D: Fn(Vec3) -> f32, S: Fn(u64) -> Vec3> Source for Made<D, S> {
        fn draw(&mut self, numbers: Range<u64>, samples: &mut Samples) -> Result<(), Stop> {
            numbers.map(&self.1).for_each(|it| samples.add(it, (self.0)(it)));
            Ok(())
        }

        fn densities(&mut self, directions: &[Vec3]) -> Result<Vec<f32>, Stop> {
            Ok(directions.iter().map(|it| (self.0)(*it)).collect())
        }
    }

    fn compare(mut source: impl Source, seed: u64) -> Comparison {
        let mut samples = Samples::default();
        let Ok(()) = source.draw(0..20_000, &mut samples) else { panic!("it draws") };
        let stream = Stream::new(seed).at(77);
        let found = Comparison::new(&mut source, &samples, DVec3::Z, stream, significance(1));
        let Ok(found) = found else { panic!("it has densities") };
        found
    }

    fn uniform(density: impl Fn(Vec3) -> f32) -> Comparison {
        compare(Made(density, |item| Stream::new(1).direction(item).as_vec3()), 1)
    }

    #[test]
    fn right_densities_pass_and_wrong_ones_do_not() {
        let right = uniform(|_| 0.25 / PI);
        assert!(right.integral_holds() && right.shape_holds());
        // For this density the samples' own densities are also wrong.
        let large = uniform(|_| 0.26 / PI);
        assert!(!large.integral_holds() && large.shape_holds());
        let slightly_large = uniform(|_| 0.2515 / PI);
        assert!(!slightly_large.integral_holds() && slightly_large.shape_holds());
        let leaning = uniform(|it| (1.0 + 0.25 * it.x) * 0.25 / PI);
        let message = leaning.integral_message("", "are") + &leaning.shape_message("");
        assert!(leaning.integral_holds() && !leaning.shape_holds(), "{message}");
        let half = uniform(|it| if it.y > 0.0 { 0.5 / PI } else { 1e-12 });
        assert!(half.integral_holds() && !half.shape_holds());
        assert!(uniform(|_| 0.0).integral_holds(), "no sample has a density, and there is none");
    }

    /// Half of the samples in a cap around (0.6, 0, 0.8), whose edge has this cosine; the others anywhere.
    fn cap(cosine: f64, factor: f32, seed: u64) -> Comparison {
        let axis = DVec3::new(0.6, 0.0, 0.8);
        let density = move |direction: Vec3| {
            let is_inside = direction.as_dvec3().normalize().dot(axis) >= cosine;
            let cap = if is_inside { factor * (0.5 / (1.0 - cosine)) as f32 } else { 0.0 };
            (cap + 0.25) / (2.0 * PI)
        };
        let stream = Stream::new(seed);
        let sample = move |item| {
            if stream.number(item, 0) < 0.5 {
                return stream.direction(item).as_vec3();
            }
            let z = 1.0 - (1.0 - cosine) * f64::from(stream.number(item, 1));
            let local = on_sphere(z, f64::from(stream.number(item, 2)));
            let (x, y) = axis.any_orthonormal_pair();
            (local.x * x + local.y * y + local.z * axis).as_vec3()
        };
        compare(Made(density, sample), seed)
    }

    /// Edges and spikes that a quadrature sum does not resolve cause no alarm; wrong factors do.
    #[test]
    fn sharp_caps_are_judged_rightly() {
        for cosine in [0.9, 0.999, 0.999_99, 0.999_999_9] {
            for seed in 0..8 {
                let right = cap(cosine, 1.0, seed);
                let text = format!("{cosine}, {seed}: {}", right.integral_message("", "are"));
                assert!(right.integral_holds() && right.shape_holds(), "{text}");
                let wrong = cap(cosine, 1.1, seed);
                assert!(!wrong.integral_holds(), "{cosine}, {seed}");
            }
        }
    }
}
