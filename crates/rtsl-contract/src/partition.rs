//! Cells of the sphere of directions, small where samples are many, and integrals over them.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use crate::random::on_sphere;
use crate::stop::Stop;

/// Cells have at most this part of the samples that they are made of, or
const GREATEST_PART: f64 = 1.0 / 192.0;
/// are as small as this solid angle: narrower lobes would not fit a float's directions.
const LEAST_AREA: f64 = 1e-12;
/// A cell is at most so many times as large as what its samples stand for: else they fill a corner of it.
const SPARSE: f64 = 8.0;
/// No cell is larger, whether it has samples or not.
const GREATEST_AREA: f64 = 4.0 * PI / 64.0;
/// A cell that is not smooth is looked at in so many steps of quarters everywhere: a corner may reach into it
/// between the points at first.
const LEAST_LEVEL: u32 = 2;
/// An integral over all cells may take so many values of its function.
const MOST_VALUES: usize = 1_500_000;

/// A direction and the density with which it was chosen, more than 0.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub direction: Vec3,
    pub density: f32,
}

/// A partition of the sphere.
pub struct Partition {
    /// The axis is the third. The plane at right angles to it lies between cells.
    axes: [DVec3; 3],
    tree: Vec<Node>,
    cells: Vec<Cell>,
    samples: Vec<Place>,
}

/// An integral over a cell, and how far it may be off.
#[derive(Clone, Copy, Debug, Default)]
pub struct Integral {
    pub value: f64,
    pub error: f64,
}

/// A part of the sphere by height (0 and 1 at the poles) and part of the turn. Equal steps of both are equal
/// solid angles.
#[derive(Clone, Copy, Debug)]
struct Cell {
    height: [f64; 2],
    turn: [f64; 2],
}

#[derive(Clone, Copy, Debug)]
enum Node {
    Leaf(usize),
    /// Below the value of height (or turn) lies the first child, else the second.
    Split {
        by_height: bool,
        at: f64,
        children: [usize; 2],
    },
}

/// A sample on the map.
#[derive(Clone, Copy, Debug)]
struct Place {
    height: f64,
    turn: f64,
    density: f64,
}

impl Partition {
    /// Cells for what is distributed like these samples.
    pub fn new(axis: DVec3, samples: &[Sample]) -> Partition {
        let (first, second) = axis.any_orthonormal_pair();
        let mut partition = Partition {
            axes: [first, second, axis],
            tree: vec![Node::Leaf(0)],
            cells: Vec::new(),
            samples: Vec::new(),
        };
        partition.samples = samples.iter().map(|sample| partition.place(sample)).collect();
        let most = (samples.len() as f64 * GREATEST_PART).max(2.0) as usize;
        let all = Cell { height: [0.0, 1.0], turn: [0.0, 1.0] };
        partition.grow(0, all, partition.samples.clone(), most);
        partition
    }

    /// How many cells there are.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// The cell that a direction lies in.
    pub fn cell(&self, direction: Vec3) -> usize {
        let (height, turn) = self.coordinates(direction);
        let mut node = 0;
        loop {
            match self.tree[node] {
                Node::Leaf(cell) => return cell,
                Node::Split { by_height, at, children } => {
                    let value = if by_height { height } else { turn };
                    node = children[usize::from(value >= at)];
                }
            }
        }
    }

    /// A direction in the middle of a cell.
    pub fn middle(&self, cell: usize) -> Vec3 {
        let Cell { height, turn } = self.cells[cell];
        self.direction(0.5 * (height[0] + height[1]), 0.5 * (turn[0] + turn[1]))
    }

    /// The integral over each cell of a function that is given many directions at a time, exact enough for
    /// comparisons with so many samples.
    ///
    /// # Errors
    /// Those of the function.
    pub fn integrate(
        &self,
        sample_count: usize,
        mut function: impl FnMut(&[Vec3]) -> Result<Vec<f32>, Stop>,
    ) -> Result<Vec<Integral>, Stop> {
        let mut integrals = vec![Integral::default(); self.cells.len()];
        let mut values_left = MOST_VALUES;
        let mut patches: Vec<Patch> = Vec::new();
        let sampled = self.samples_by_cell();
        for ((leaf, cell), samples) in self.cells.iter().enumerate().zip(sampled) {
            patches.push(Patch { leaf, cell: *cell, level: 0, sum: Sum::default(), samples });
        }
        let cells: Vec<Cell> = patches.iter().map(|it| it.cell).collect();
        for (patch, sum) in patches.iter_mut().zip(self.sums(&cells, &mut function)?) {
            patch.sum = sum;
        }
        let tolerances: Vec<f64> =
            patches.iter().map(|it| tolerance(it.sum.integral, sample_count)).collect();
        while !patches.is_empty() {
            let quarters: Vec<Cell> = patches.iter().flat_map(|it| it.cell.quarters()).collect();
            values_left = values_left.saturating_sub(quarters.len() * GAUSS.len() * GAUSS.len());
            let sums = self.sums(&quarters, &mut function)?;
            let mut unfinished = Vec::new();
            for (index, patch) in patches.into_iter().enumerate() {
                let range = 4 * index..4 * index + 4;
                let (quarters, sums) = (&quarters[range.clone()], &sums[range]);
                let allowed = tolerances[patch.leaf] / f64::from(1_u32 << patch.level.min(30));
                let finer: f64 = sums.iter().map(|it| it.integral).sum();
                let level = patch.level;
                let error = (finer - patch.sum.integral).abs();
                let parts = patch.into_quarters(quarters, sums);
                let is_missed = parts.iter().any(|it| it.has_missed_spike(allowed));
                let is_settled = error <= allowed && !is_missed;
                let is_thorough = level == 0 || level >= LEAST_LEVEL;
                if is_settled && is_thorough || values_left == 0 {
                    let leaf = &mut integrals[parts[0].leaf];
                    leaf.value += finer;
                    leaf.error += error;
                } else {
                    unfinished.extend(parts);
                }
            }
            patches = unfinished;
        }
        Ok(integrals)
    }

    fn grow(&mut self, node: usize, cell: Cell, samples: Vec<Place>, most: usize) {
        let area = cell.area();
        let is_sparse = area > SPARSE * self.area_of(&samples);
        let is_fine = samples.len() <= most && (samples.is_empty() || !is_sparse);
        if area <= GREATEST_AREA && (is_fine || area <= LEAST_AREA) {
            self.tree[node] = Node::Leaf(self.cells.len());
            self.cells.push(cell);
            return;
        }
        let (by_height, at, halves) = cell.halves();
        let is_above =
            |place: &Place| if by_height { place.height >= at } else { place.turn >= at };
        let (above, below) = samples.into_iter().partition(is_above);
        let children = [self.tree.len(), self.tree.len() + 1];
        self.tree.extend([Node::Leaf(0); 2]);
        self.tree[node] = Node::Split { by_height, at, children };
        self.grow(children[0], halves[0], below, most);
        self.grow(children[1], halves[1], above, most);
    }

    /// The solid angle that samples stand for by their densities.
    fn area_of(&self, samples: &[Place]) -> f64 {
        samples.iter().map(|it| 1.0 / it.density).sum::<f64>() / self.samples.len().max(1) as f64
    }

    fn samples_by_cell(&self) -> Vec<Vec<Place>> {
        let mut sorted = vec![Vec::new(); self.cells.len()];
        for place in &self.samples {
            sorted[self.cell(self.direction(place.height, place.turn))].push(*place);
        }
        sorted
    }

    /// Gauss's product rule on each of the cells.
    fn sums(
        &self,
        cells: &[Cell],
        function: &mut impl FnMut(&[Vec3]) -> Result<Vec<f32>, Stop>,
    ) -> Result<Vec<Sum>, Stop> {
        let points = cells.iter().flat_map(|cell| {
            GAUSS.iter().flat_map(move |(x, _)| GAUSS.iter().map(move |(y, _)| cell.at(*x, *y)))
        });
        let directions: Vec<Vec3> =
            points.map(|(height, turn)| self.direction(height, turn)).collect();
        let values = function(&directions)?;
        let sums = cells.iter().zip(values.chunks(GAUSS.len() * GAUSS.len()));
        let sums = sums.map(|(cell, values)| {
            let weights = GAUSS.iter().flat_map(|(_, x)| GAUSS.iter().map(move |(_, y)| x * y));
            let mean: f64 = values.iter().zip(weights).map(|(it, w)| f64::from(*it) * w).sum();
            let greatest = values.iter().fold(0.0, |most: f64, it| most.max(f64::from(*it)));
            Sum { integral: mean * cell.area(), greatest }
        });
        Ok(sums.collect())
    }

    fn place(&self, sample: &Sample) -> Place {
        let (height, turn) = self.coordinates(sample.direction);
        Place { height, turn, density: f64::from(sample.density) }
    }

    /// The height above the lower pole and the part of the turn, both from 0 to 1.
    fn coordinates(&self, direction: Vec3) -> (f64, f64) {
        let direction = direction.as_dvec3().normalize();
        let [x, y, z] = self.axes.map(|axis| axis.dot(direction));
        let turn = libm::atan2(y, x) / TAU;
        (0.5 + 0.5 * z, if turn < 0.0 { turn + 1.0 } else { turn })
    }

    fn direction(&self, height: f64, turn: f64) -> Vec3 {
        let local = on_sphere(2.0 * height - 1.0, turn);
        let [first, second, axis] = self.axes;
        (local.x * first + local.y * second + local.z * axis).as_vec3()
    }
}

/// Gauss's three points in [0,1], and their weights.
const GAUSS: [(f64, f64); 3] = [
    (0.112_701_665_379_258_3, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.887_298_334_620_741_7, 5.0 / 18.0),
];

/// How far the integral over a cell may be off: little beside what chance does to a count of samples.
fn tolerance(integral: f64, sample_count: usize) -> f64 {
    let count = sample_count.max(1) as f64;
    0.03 * (integral / count).sqrt() + 0.01 / count
}

/// A part of a cell, with its own sum.
struct Patch {
    leaf: usize,
    cell: Cell,
    level: u32,
    sum: Sum,
    samples: Vec<Place>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    integral: f64,
    /// The greatest value that went into it.
    greatest: f64,
}

impl Patch {
    fn into_quarters(self, cells: &[Cell], sums: &[Sum]) -> Vec<Patch> {
        let quarters = cells.iter().zip(sums).map(|(cell, sum)| Patch {
            leaf: self.leaf,
            cell: *cell,
            level: self.level + 1,
            sum: *sum,
            samples: self.samples.iter().copied().filter(|it| cell.contains(it)).collect(),
        });
        quarters.collect()
    }

    /// Whether samples say that the density is far higher somewhere than where the sum looked.
    fn has_missed_spike(&self, allowed: f64) -> bool {
        let densest = self.samples.iter().fold(0.0, |most: f64, it| most.max(it.density));
        let area = self.cell.area();
        densest > 4.0 * self.sum.greatest && densest * area > allowed && area > LEAST_AREA
    }
}

impl Cell {
    fn area(&self) -> f64 {
        2.0 * TAU * (self.height[1] - self.height[0]) * (self.turn[1] - self.turn[0])
    }

    fn contains(&self, place: &Place) -> bool {
        let within = |range: [f64; 2], value| range[0] <= value && value < range[1];
        within(self.height, place.height) && within(self.turn, place.turn)
    }

    /// The point at these parts of both sides.
    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let mix = |range: [f64; 2], part: f64| range[0] + part * (range[1] - range[0]);
        (mix(self.height, x), mix(self.turn, y))
    }

    fn quarters(&self) -> [Cell; 4] {
        let (height, turn) = self.at(0.5, 0.5);
        let heights = [[self.height[0], height], [height, self.height[1]]];
        let turns = [[self.turn[0], turn], [turn, self.turn[1]]];
        [(0, 0), (0, 1), (1, 0), (1, 1)]
            .map(|(x, y): (usize, usize)| Cell { height: heights[x], turn: turns[y] })
    }

    /// Both halves across the longer side: whether that is the height, and where.
    fn halves(&self) -> (bool, f64, [Cell; 2]) {
        let (height, turn) = self.at(0.5, 0.5);
        let angle = |height: f64| libm::acos((2.0 * height - 1.0).clamp(-1.0, 1.0));
        let upright = angle(self.height[0]) - angle(self.height[1]);
        let radius = 2.0 * (height * (1.0 - height)).max(0.0).sqrt();
        let around = radius * TAU * (self.turn[1] - self.turn[0]);
        if upright >= around {
            let halves = [[self.height[0], height], [height, self.height[1]]];
            (true, height, halves.map(|height| Cell { height, turn: self.turn }))
        } else {
            let halves = [[self.turn[0], turn], [turn, self.turn[1]]];
            (false, turn, halves.map(|turn| Cell { height: self.height, turn }))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    /// The density of a narrow lobe around the axis: `n + 1` over the turn times the cosine to the nth.
    fn lobe(axis: DVec3, n: f64, direction: Vec3) -> f32 {
        let cosine = axis.dot(direction.as_dvec3().normalize()).max(0.0);
        ((n + 1.0) / TAU * libm::pow(cosine, n)) as f32
    }

    #[test]
    fn cells_cover_the_sphere_once() {
        let partition = Partition::new(DVec3::new(0.48, 0.6, 0.64), &[]);
        let area: f64 = partition.cells.iter().map(Cell::area).sum();
        assert!((area - 4.0 * PI).abs() < 1e-9);
        for item in 0..500 {
            let direction = Stream::new(3).direction(item).as_vec3();
            let cell = partition.cell(direction);
            assert!(
                partition.cells[cell]
                    .contains(&partition.place(&Sample { direction, density: 1.0 }))
            );
            assert_eq!(partition.cell(partition.middle(cell)), cell);
        }
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
            let integrals = partition.integrate(20_000, density).unwrap();
            let whole: f64 = integrals.iter().map(|it| it.value).sum();
            assert!((whole - 1.0).abs() < 1e-3, "{n}: {whole}");
            assert!(integrals.iter().map(|it| it.error).sum::<f64>() < 1e-2);
        }
    }

    /// The integral over a triangle seen from afar, whose corners reach into cells without samples.
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
        let integrals = partition
            .integrate(6000, |directions| Ok(directions.iter().map(|it| density(*it)).collect()))
            .unwrap();
        let whole: f64 = integrals.iter().map(|it| it.value).sum();
        assert!((whole - 1.0).abs() < 2e-3, "{whole}");
    }
}
