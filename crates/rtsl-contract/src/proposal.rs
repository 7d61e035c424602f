//! A density that approximates that of a class, for comparison with it.

use glam::Vec3;

use crate::partition::{Cell, MIN_AREA, Partition, Place};
use crate::random::Stream;
use crate::stop::Stop;

/// The number of refinement levels of a cell that is not smooth: a corner may reach into it between the first points.
const MIN_LEVEL: u32 = 2;
/// The greatest number of function values for an integral over all cells.
const MAX_VALUES: usize = 1_500_000;
/// The fraction of uniform proposals, for places where the density was not found.
const UNIFORM_PART: f64 = 0.1;

/// A density that is constant in each of many pieces of the sphere.
pub struct Proposal {
    /// The indices in its leaves are those of pieces.
    partition: Partition,
    pieces: Vec<Piece>,
    /// The integral of the function over each cell.
    integrals: Vec<Integral>,
}

/// An integral over a cell, and its error, estimated by taking more points.
#[derive(Clone, Copy, Debug, Default)]
pub struct Integral {
    pub value: f64,
    pub error: f64,
}

/// A proposed direction.
#[derive(Clone, Copy, Debug)]
pub struct Proposed {
    pub direction: Vec3,
    /// The cell in which it lies.
    pub cell: usize,
    /// Its density.
    pub density: f64,
}

/// A part of a cell.
#[derive(Clone, Copy, Debug)]
struct Piece {
    place: Cell,
    cell: usize,
    /// The probability of a proposal in it.
    mass: f64,
}

impl Proposal {
    /// Approximates a function, which takes many directions at a time, so closely that comparisons with so many samples
    /// have little variance.
    ///
    /// # Errors
    /// Those of the function.
    pub fn new(
        partition: Partition,
        sample_count: usize,
        function: impl FnMut(&[Vec3]) -> Result<Vec<f32>, Stop>,
    ) -> Result<Proposal, Stop> {
        let mut refinement = Refinement {
            integrals: vec![Integral::default(); partition.len()],
            partition,
            pieces: Vec::new(),
            function,
        };
        refinement.run(sample_count)?;
        let Refinement { partition, mut pieces, integrals, .. } = refinement;
        let total: f64 = pieces.iter().map(|it| it.mass).sum();
        let sphere: f64 = pieces.iter().map(|it| it.place.area()).sum();
        let uniform = if total > 0.0 { UNIFORM_PART } else { 1.0 };
        for piece in &mut pieces {
            let share = if total > 0.0 { piece.mass / total } else { 0.0 };
            piece.mass = (1.0 - uniform) * share + uniform * piece.place.area() / sphere;
        }
        Ok(Proposal { partition, pieces, integrals })
    }

    /// Returns the partition's cells, with the integral of the function over each.
    pub fn integrals(&self) -> &[Integral] {
        &self.integrals
    }

    /// Returns the cell that contains a direction, and the density with which it is proposed.
    pub fn at(&self, direction: Vec3) -> (usize, f64) {
        let piece = &self.pieces[self.partition.cell(direction)];
        (piece.cell, piece.density())
    }

    /// Returns a direction in the middle of a cell.
    pub fn middle(&self, cell: usize) -> Vec3 {
        self.partition.middle(cell)
    }

    /// Returns stratified directions.
    pub fn directions(&self, stream: Stream, count: usize) -> Vec<Proposed> {
        let mut directions = Vec::with_capacity(count);
        let mut pieces = self.pieces.iter();
        let Some(mut piece) = pieces.next() else { return directions };
        let mut passed = piece.mass;
        for item in 0..count as u64 {
            let number = |dimension| f64::from(stream.number(item, dimension));
            let mass = (item as f64 + number(0)) / count as f64;
            while passed <= mass {
                // The sum of all masses is 1 except for rounding.
                let Some(next) = pieces.next() else { break };
                piece = next;
                passed += piece.mass;
            }
            directions.push(Proposed {
                direction: self.partition.direction(piece.place.at(number(1), number(2))),
                cell: piece.cell,
                density: piece.density(),
            });
        }
        directions
    }
}

impl Piece {
    fn density(&self) -> f64 {
        self.mass / self.place.area()
    }
}

/// Gauss's three points in [0,1], and their weights.
const GAUSS: [(f64, f64); 3] = [
    (0.112_701_665_379_258_3, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.887_298_334_620_741_7, 5.0 / 18.0),
];

/// The permitted error of the integral over a cell: small compared with the statistical error of a count of samples.
fn tolerance(integral: f64, sample_count: usize) -> f64 {
    let count = sample_count.max(1) as f64;
    0.03 * (integral / count).sqrt() + 0.01 / count
}

/// The refinement of cells to pieces.
struct Refinement<F> {
    partition: Partition,
    function: F,
    pieces: Vec<Piece>,
    integrals: Vec<Integral>,
}

/// A part of a cell with its quadrature sum.
struct Patch {
    cell: usize,
    place: Cell,
    leaf: usize,
    level: u32,
    sum: Sum,
    samples: Vec<Place>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    integral: f64,
    /// The greatest value in the sum.
    greatest: f64,
}

impl<F: FnMut(&[Vec3]) -> Result<Vec<f32>, Stop>> Refinement<F> {
    fn run(&mut self, sample_count: usize) -> Result<(), Stop> {
        let mut values_left = MAX_VALUES;
        let mut patches = self.whole_cells()?;
        let tolerances: Vec<f64> =
            patches.iter().map(|it| tolerance(it.sum.integral, sample_count)).collect();
        while !patches.is_empty() {
            let quarters: Vec<Cell> = patches.iter().flat_map(|it| it.place.quarters()).collect();
            values_left = values_left.saturating_sub(quarters.len() * GAUSS.len() * GAUSS.len());
            let sums = self.sums(&quarters)?;
            let mut unfinished = Vec::new();
            for (patch, sums) in patches.into_iter().zip(sums.chunks(4)) {
                let allowed = tolerances[patch.cell] / f64::from(1_u32 << patch.level.min(30));
                let finer: f64 = sums.iter().map(|it| it.integral).sum();
                let (cell, level) = (patch.cell, patch.level);
                let error = (finer - patch.sum.integral).abs();
                let parts = self.quarters(patch, sums);
                let is_missed = parts.iter().any(|it| it.has_missed_spike(allowed));
                let is_settled = error <= allowed && !is_missed;
                let is_thorough = level == 0 || level >= MIN_LEVEL;
                if is_settled && is_thorough || values_left == 0 {
                    self.integrals[cell].value += finer;
                    self.integrals[cell].error += error;
                    parts.into_iter().for_each(|it| self.settle(&it));
                } else {
                    unfinished.extend(parts);
                }
            }
            patches = unfinished;
        }
        Ok(())
    }

    fn whole_cells(&mut self) -> Result<Vec<Patch>, Stop> {
        let cells = self.partition.cells().to_vec();
        let sums = self.sums(&cells)?;
        let cells = cells.iter().zip(self.partition.leaves()).zip(sums);
        let patches = cells.zip(self.partition.samples_by_cell()).enumerate().map(
            |(cell, (((place, leaf), sum), samples))| Patch {
                cell,
                place: *place,
                leaf,
                level: 0,
                sum,
                samples,
            },
        );
        Ok(patches.collect())
    }

    /// Splits a patch and distributes its samples among the quarters.
    fn quarters(&mut self, patch: Patch, sums: &[Sum]) -> Vec<Patch> {
        let leaves = self.partition.quarter(patch.leaf, &patch.place);
        let quarters = patch.place.quarters().into_iter().zip(leaves).zip(sums);
        let quarters = quarters.map(|((place, leaf), sum)| Patch {
            cell: patch.cell,
            place,
            leaf,
            level: patch.level + 1,
            sum: *sum,
            samples: patch.samples.iter().copied().filter(|it| place.contains(it)).collect(),
        });
        quarters.collect()
    }

    fn settle(&mut self, patch: &Patch) {
        self.partition.set_leaf(patch.leaf, self.pieces.len());
        let mass = patch.sum.integral;
        self.pieces.push(Piece { place: patch.place, cell: patch.cell, mass });
    }

    /// Gauss's product rule on each of the cells.
    fn sums(&mut self, cells: &[Cell]) -> Result<Vec<Sum>, Stop> {
        let points = cells.iter().flat_map(|cell| {
            GAUSS.iter().flat_map(move |(x, _)| GAUSS.iter().map(move |(y, _)| cell.at(*x, *y)))
        });
        let directions: Vec<Vec3> = points.map(|it| self.partition.direction(it)).collect();
        let values = (self.function)(&directions)?;
        let sums = cells.iter().zip(values.chunks(GAUSS.len() * GAUSS.len()));
        let sums = sums.map(|(cell, values)| {
            let weights = GAUSS.iter().flat_map(|(_, x)| GAUSS.iter().map(move |(_, y)| x * y));
            let mean: f64 = values.iter().zip(weights).map(|(it, w)| f64::from(*it) * w).sum();
            let greatest = values.iter().fold(0.0, |most: f64, it| most.max(f64::from(*it)));
            Sum { integral: mean * cell.area(), greatest }
        });
        Ok(sums.collect())
    }
}

impl Patch {
    /// True if samples show that the density is far higher somewhere than at the quadrature points.
    fn has_missed_spike(&self, allowed: f64) -> bool {
        let densest = self.samples.iter().fold(0.0, |most: f64, it| most.max(it.density));
        let area = self.place.area();
        densest > 4.0 * self.sum.greatest && densest * area > allowed && area > MIN_AREA
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::DVec3;

    use super::*;
    use crate::partition::Sample;
    use crate::random::on_sphere;

    fn whole(proposal: &Proposal) -> f64 {
        proposal.integrals().iter().map(|it| it.value).sum()
    }

    /// The density of a narrow lobe around the axis: `n + 1` over the turn times the cosine to the nth.
    fn lobe(axis: DVec3, n: f64, direction: Vec3) -> f32 {
        let cosine = axis.dot(direction.as_dvec3().normalize()).max(0.0);
        ((n + 1.0) / TAU * libm::pow(cosine, n)) as f32
    }

    #[test]
    fn narrow_lobes_are_found_by_their_samples() {
        let axis = DVec3::new(0.48, 0.6, 0.64);
        for n in [1.0, 100.0, 1e6] {
            let partition_axis = DVec3::new(0.0, 0.6, 0.8);
            let sample = |item| {
                let stream = Stream::new(7);
                let cosine = libm::pow(f64::from(stream.number(item, 0)), 1.0 / (n + 1.0));
                let local = on_sphere(cosine, f64::from(stream.number(item, 1)));
                let (x, y) = axis.any_orthonormal_pair();
                let direction = (local.x * x + local.y * y + local.z * axis).as_vec3();
                Sample { direction, density: lobe(axis, n, direction) }
            };
            let samples: Vec<Sample> = (0..5000).map(sample).collect();
            let partition = Partition::new(partition_axis, &samples);
            let density =
                |directions: &[Vec3]| Ok(directions.iter().map(|it| lobe(axis, n, *it)).collect());
            let proposal = Proposal::new(partition, 20_000, density).unwrap();
            assert!((whole(&proposal) - 1.0).abs() < 1e-3, "{n}: {}", whole(&proposal));
            assert!(proposal.integrals().iter().map(|it| it.error).sum::<f64>() < 1e-2);
        }
    }

    /// The integral over a distant triangle, whose corners reach into cells without samples.
    #[test]
    fn corners_are_found() {
        let corners =
            [DVec3::new(-0.5, 0.0, 0.2), DVec3::new(1.3, 0.2, -0.1), DVec3::new(-0.4, 1.1, 0.5)];
        let from = DVec3::new(2.637_352_2, 3.269_918_4, -2.414_631_4);
        let [a, b, c] = corners.map(|it| it - from);
        let normal = (b - a).cross(c - a);
        let density = |direction: Vec3| {
            let d = direction.as_dvec3().normalize();
            let inside = [(a, b), (b, c), (c, a)].map(|(x, y)| x.cross(y).dot(d));
            let t = a.dot(normal) / d.dot(normal);
            let hit =
                t > 0.0 && (inside.iter().all(|it| *it > 0.0) || inside.iter().all(|it| *it < 0.0));
            if hit { (2.0 * t * t / d.dot(normal).abs()) as f32 } else { 0.0 }
        };
        let stream = Stream::new(11);
        let sample = |item| {
            let root = f64::from(stream.number(item, 0)).sqrt();
            let v = f64::from(stream.number(item, 1));
            let point = a + root * (1.0 - v) * (b - a) + root * v * (c - a);
            Sample { direction: point.as_vec3(), density: density(point.as_vec3()) }
        };
        let samples: Vec<Sample> = (0..2000).map(sample).collect();
        let partition = Partition::new((DVec3::new(0.45, 0.55, 0.2) - from).normalize(), &samples);
        let density = |directions: &[Vec3]| Ok(directions.iter().map(|it| density(*it)).collect());
        let proposal = Proposal::new(partition, 6000, density).unwrap();
        assert!((whole(&proposal) - 1.0).abs() < 2e-3, "{}", whole(&proposal));
    }

    #[test]
    fn directions_are_proposed_with_their_density() {
        let density = |directions: &[Vec3]| {
            Ok(directions.iter().map(|it| if it.x > 0.2 { it.x } else { 0.0 }).collect())
        };
        let partition = Partition::new(DVec3::Z, &[]);
        let proposal = Proposal::new(partition, 1000, density).unwrap();
        let proposed = proposal.directions(Stream::new(5), 40_000);
        // The mean of the reciprocal density is the sphere's area.
        let mean = proposed.iter().map(|it| 1.0 / it.density).sum::<f64>() / 40_000.0;
        assert!((mean / (2.0 * TAU) - 1.0).abs() < 0.02, "{mean}");
        let beyond = proposed.iter().filter(|it| it.direction.x > 0.2).count();
        assert!((35_000..38_000).contains(&beyond), "{beyond}");
        for it in &proposed[..1000] {
            let (cell, density) = proposal.at(it.direction);
            assert!(cell == it.cell && (density / it.density - 1.0).abs() < 1e-9);
        }
    }
}
