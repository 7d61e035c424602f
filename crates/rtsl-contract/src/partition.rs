//! An adaptive partition of the sphere of directions, with small cells where samples are dense.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use crate::random::on_sphere;

/// The greatest fraction of the samples in a cell, unless
const MAX_PART: f64 = 1.0 / 192.0;
/// the cell has this solid angle: narrower lobes exceed the precision of float directions.
pub const MIN_AREA: f64 = 1e-12;
/// The greatest ratio of a cell's solid angle to that of its samples: otherwise they fill only a corner of it.
const SPARSE: f64 = 8.0;
/// The greatest solid angle of a cell.
const MAX_AREA: f64 = 4.0 * PI / 64.0;

/// A direction and the density with which it was chosen, which is positive.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub direction: Vec3,
    pub density: f32,
}

/// A partition of the sphere.
pub struct Partition {
    /// The third is the axis. The plane perpendicular to it is a boundary of cells.
    axes: [DVec3; 3],
    tree: Vec<Node>,
    cells: Vec<Cell>,
    samples: Vec<Place>,
}

/// A rectangle on the map of the sphere by height (0 and 1 at the poles) and fraction of the turn. The map preserves
/// areas.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    height: [f64; 2],
    turn: [f64; 2],
}

/// A node of the tree that finds the cell of a direction.
#[derive(Clone, Copy, Debug)]
enum Node {
    Leaf(usize),
    /// Directions below the value of height (or turn) are in the first child, others in the second.
    Split {
        by_height: bool,
        at: f64,
        children: [usize; 2],
    },
}

/// A sample on the map.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    height: f64,
    turn: f64,
    pub density: f64,
}

impl Partition {
    /// Creates cells adapted to the distribution of these samples.
    pub fn new(axis: DVec3, samples: &[Sample]) -> Partition {
        let (first, second) = axis.any_orthonormal_pair();
        let mut partition = Partition {
            axes: [first, second, axis],
            tree: vec![Node::Leaf(0)],
            cells: Vec::new(),
            samples: Vec::new(),
        };
        partition.samples = samples.iter().map(|sample| partition.place(sample)).collect();
        let most = (samples.len() as f64 * MAX_PART).max(2.0) as usize;
        let all = Cell { height: [0.0, 1.0], turn: [0.0, 1.0] };
        partition.grow(0, all, partition.samples.clone(), most);
        partition
    }

    /// Returns the number of cells.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Returns the index stored in a direction's leaf: its cell, unless another index was set.
    pub fn cell(&self, direction: Vec3) -> usize {
        let (height, turn) = self.coordinates(direction);
        self.leaf(height, turn)
    }

    fn leaf(&self, height: f64, turn: f64) -> usize {
        let mut node = 0;
        loop {
            match self.tree[node] {
                Node::Leaf(number) => return number,
                Node::Split { by_height, at, children } => {
                    let value = if by_height { height } else { turn };
                    node = children[usize::from(value >= at)];
                }
            }
        }
    }

    /// Returns a direction in the middle of a cell.
    pub fn middle(&self, cell: usize) -> Vec3 {
        let Cell { height, turn } = self.cells[cell];
        self.direction((0.5 * (height[0] + height[1]), 0.5 * (turn[0] + turn[1])))
    }

    /// Returns the cells.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Returns the samples from which it was made, by cell.
    pub fn samples_by_cell(&self) -> Vec<Vec<Place>> {
        let mut sorted = vec![Vec::new(); self.cells.len()];
        for place in &self.samples {
            sorted[self.leaf(place.height, place.turn)].push(*place);
        }
        sorted
    }

    /// Returns the nodes that are leaves, in the order of their cells.
    pub fn leaves(&self) -> Vec<usize> {
        let mut leaves = vec![0; self.cells.len()];
        for (index, node) in self.tree.iter().enumerate() {
            if let Node::Leaf(cell) = node {
                leaves[*cell] = index;
            }
        }
        leaves
    }

    /// Replaces a leaf with this cell by four leaves, and returns these in the order of [`Cell::quarters`]. They have
    /// no index until [`Partition::set_leaf`] sets it.
    pub fn quarter(&mut self, leaf: usize, cell: &Cell) -> [usize; 4] {
        let (height, turn) = cell.at(0.5, 0.5);
        let below = self.split(leaf, true, height);
        let [a, b] = self.split(below[0], false, turn);
        let [c, d] = self.split(below[1], false, turn);
        [a, b, c, d]
    }

    /// Sets the index of a leaf.
    pub fn set_leaf(&mut self, leaf: usize, number: usize) {
        self.tree[leaf] = Node::Leaf(number);
    }

    fn split(&mut self, leaf: usize, by_height: bool, at: f64) -> [usize; 2] {
        let children = [self.tree.len(), self.tree.len() + 1];
        self.tree.extend([Node::Leaf(0); 2]);
        self.tree[leaf] = Node::Split { by_height, at, children };
        children
    }

    fn grow(&mut self, node: usize, cell: Cell, samples: Vec<Place>, most: usize) {
        let area = cell.area();
        let is_sparse = area > SPARSE * self.area_of(&samples);
        let is_fine = samples.len() <= most && (samples.is_empty() || !is_sparse);
        if area <= MAX_AREA && (is_fine || area <= MIN_AREA) {
            self.tree[node] = Node::Leaf(self.cells.len());
            self.cells.push(cell);
            return;
        }
        let (by_height, at, halves) = cell.halves();
        let is_above =
            |place: &Place| if by_height { place.height >= at } else { place.turn >= at };
        let (above, below) = samples.into_iter().partition(is_above);
        let children = self.split(node, by_height, at);
        self.grow(children[0], halves[0], below, most);
        self.grow(children[1], halves[1], above, most);
    }

    /// The solid angle that samples represent according to their densities.
    fn area_of(&self, samples: &[Place]) -> f64 {
        samples.iter().map(|it| 1.0 / it.density).sum::<f64>() / self.samples.len().max(1) as f64
    }

    fn place(&self, sample: &Sample) -> Place {
        let (height, turn) = self.coordinates(sample.direction);
        Place { height, turn, density: f64::from(sample.density) }
    }

    /// The height above the lower pole and the fraction of the turn, both from 0 to 1.
    fn coordinates(&self, direction: Vec3) -> (f64, f64) {
        let direction = direction.as_dvec3().normalize();
        let [x, y, z] = self.axes.map(|axis| axis.dot(direction));
        let turn = libm::atan2(y, x) / TAU;
        (0.5 + 0.5 * z, if turn < 0.0 { turn + 1.0 } else { turn })
    }

    /// Returns the direction at a height and a turn.
    pub fn direction(&self, (height, turn): (f64, f64)) -> Vec3 {
        let local = on_sphere(2.0 * height - 1.0, turn);
        let [first, second, axis] = self.axes;
        (local.x * first + local.y * second + local.z * axis).as_vec3()
    }
}

impl Cell {
    /// Returns the solid angle.
    pub fn area(&self) -> f64 {
        2.0 * TAU * (self.height[1] - self.height[0]) * (self.turn[1] - self.turn[0])
    }

    /// True if a sample lies in it.
    pub fn contains(&self, place: &Place) -> bool {
        let within = |range: [f64; 2], value| range[0] <= value && value < range[1];
        within(self.height, place.height) && within(self.turn, place.turn)
    }

    /// Returns the point at these fractions of both sides.
    pub fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let mix = |range: [f64; 2], part: f64| range[0] + part * (range[1] - range[0]);
        (mix(self.height, x), mix(self.turn, y))
    }

    /// Returns the quarters, those of the lower half first.
    pub fn quarters(&self) -> [Cell; 4] {
        let (height, turn) = self.at(0.5, 0.5);
        let heights = [[self.height[0], height], [height, self.height[1]]];
        let turns = [[self.turn[0], turn], [turn, self.turn[1]]];
        [(0, 0), (0, 1), (1, 0), (1, 1)]
            .map(|(x, y): (usize, usize)| Cell { height: heights[x], turn: turns[y] })
    }

    /// Splits the longer side. Returns true if that is the height, the position, and both halves.
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
}
