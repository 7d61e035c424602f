//! Samples beside their density.
//!
//! Let `f` be the density with which a class samples, `p` what it says of it, `q` a density of this crate's own
//! ([`Proposal`]), and `r = p / (p + q)`. The mean of `r` over directions that `q` proposes and that of `1 - r` over samples
//! are the same integral, that of `pq / (p + q)`, if `f` is `p`. No term of either mean is less than 0 or more than 1, however
//! narrow or high `p` is, so what chance may do is bounded without knowing `p`: a spike that few points find is
//! no outlier. (Bennett, "Efficient Estimation of Free Energy Differences from Monte Carlo Data", 1976.)

use std::ops::Range;

use glam::{DVec3, Vec3};

use crate::partition::{Partition, Sample};
use crate::proposal::{Integral, Proposal};
use crate::random::Stream;
use crate::statistics::{Mean, bernstein_bound, chi_square_quantile, normal_quantile};
use crate::stop::Stop;

/// Cells with less of the integral, as a number of samples, are counted together.
const MIN_EXPECTED: f64 = 4.0;
/// How far an integral may be off without a reason: sums of floats.
const ROUNDING: f64 = 2e-3;
/// Every so many samples one serves to find where samples are many.
const PILOTS: usize = 4;
/// So many directions are proposed for one sample, so that chance is all but the samples',
const PROPOSALS: usize = 8;
/// but no more than these.
const MAX_PROPOSALS: usize = 1 << 20;
/// Where an integral seems to be wrong and chance might explain it, so many times as many samples decide,
const MORE_SAMPLES: u64 = 16;
/// but no more than these.
const MAX_MORE_SAMPLES: u64 = 1 << 20;

/// What is compared.
pub trait Source {
    /// Adds the samples with these numbers.
    ///
    /// # Errors
    /// If a method has no code, or does not end.
    fn draw(&mut self, numbers: Range<u64>, samples: &mut Samples) -> Result<(), Stop>;

    /// The densities towards directions, finite and not negative.
    ///
    /// # Errors
    /// If a method has no code, or does not end.
    fn densities(&mut self, directions: &[Vec3]) -> Result<Vec<f32>, Stop>;
}

/// Samples of one thing, for two purposes that must not have any in common.
#[derive(Default)]
pub struct Samples {
    /// Those that say where samples are many.
    pilots: Vec<Sample>,
    /// Those that are compared, as far as they have a density.
    tests: Vec<Sample>,
    /// How many might be compared.
    count: usize,
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
    integral: Integral,
    /// The part of samples that have a density.
    part: f64,
    /// How far chance may move that part.
    chance: f64,
    /// Whether chance and rounding explain how far the density as a whole is from what is sampled.
    is_explained: bool,
    /// Chi-square of the cells, its limit and the number of cells.
    statistic: f64,
    limit: f64,
    cells: u32,
    /// The cell that adds most to it.
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
    /// Compares samples with the density of their source, cell by cell of a partition around an axis. Where these samples
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
            // Two looks share what is allowed.
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

    /// Whether the density's integral is the part of samples that have one.
    pub fn integral_holds(&self) -> bool {
        self.is_explained
    }

    /// Whether samples are distributed like their density.
    pub fn shape_holds(&self) -> bool {
        self.statistic <= self.limit
    }

    /// The direction in which samples and density differ most.
    pub fn worst_direction(&self) -> Vec3 {
        self.worst.direction
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

    /// Whether the sum over points that were chosen for it makes the integral that of the samples, as it mostly does if it
    /// is. Of a density with edges or spikes such a sum may be off by more than its error says.
    fn seems_whole(&self) -> bool {
        let allowed = ROUNDING + self.integral.error;
        let difference = (self.integral.value - self.part).abs();
        self.integral.value <= 1.0 + allowed && difference <= allowed + self.chance
    }

    /// Compares each cell, the density being scaled to what is sampled: the wholes are compared apart.
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
        // Samples where the density says there should be none count in full.
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

/// What a density says of directions, beside the density with which these are proposed.
struct Meeting {
    proposed: Vec<Ratio>,
    /// Samples that have a density.
    samples: Vec<Ratio>,
    /// How many samples there are, with those that have none.
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
    /// The part that the stated density, divided by `scale`, has of the sum of both.
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

    /// Whether chance and rounding explain the difference of both means.
    fn is_explained(&self, significance: f64) -> bool {
        let (mut stated, mut sampled) = (Mean::default(), Mean::default());
        self.proposed.iter().for_each(|it| stated.add(it.stated_part(1.0)));
        self.samples.iter().for_each(|it| sampled.add(1.0 - it.stated_part(1.0)));
        (self.samples.len()..self.count).for_each(|_| sampled.add(0.0));
        // Either mean may be off to either side.
        let chance = [&stated, &sampled].map(|it| bernstein_bound(it, 0.5 * significance));
        let difference = (stated.mean() - sampled.mean()).abs();
        difference <= chance[0] + chance[1] + 0.5 * ROUNDING
    }

    /// What the density is to be divided by for both means to be the same: Newton's method, in the logarithm.
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

/// Sums of a cell: of proposed directions the parts `r`, their squares, and products of `r` and `1 - r`; of samples `1 - r` and
/// the same products.
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

    /// The cell's part of the integral by the proposed directions, as a number of samples.
    fn expected(&self, meeting: &Meeting) -> f64 {
        self.proposed / meeting.proposed.len() as f64 * meeting.count as f64
    }

    /// The square of how many standard deviations the cell's two integrals are apart.
    fn square(&self, meeting: &Meeting) -> f64 {
        let (proposals, count) = (meeting.proposed.len() as f64, meeting.count as f64);
        let (stated, sampled) = (self.proposed / proposals, self.samples / count);
        // The variances of both integrals, as proposed directions tell them. Where these have missed a spike, samples know
        // how far that moves their integral.
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

    /// A source by two functions: the direction of a sample's number, and the density towards a direction.
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
        // The samples' own densities are these, too.
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

    /// A cap with this cosine at its edge, around (0.6, 0, 0.8), with half of the samples; the others are anywhere.
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

    /// Edges and spikes that a sum over chosen points does not resolve are no alarm; factors are.
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
