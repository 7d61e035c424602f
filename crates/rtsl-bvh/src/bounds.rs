//! Axis-aligned boxes.

use rtsl_math::{MovingTransform, Transform};

/// An axis-aligned box with finite corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The least coordinates.
    pub min: [f32; 3],
    /// The greatest coordinates.
    pub max: [f32; 3],
}

/// Boxes that reach further are treated as unbounded: their areas would overflow.
const FARTHEST: f32 = 1e17;

/// How much a box grows on all sides, as a part of its diagonal and of its distance from the
/// origin: more than rounding moves a hit off its surface.
const PAD_OF_DIAGONAL: f64 = 1e-4;
const PAD_OF_DISTANCE: f64 = 2e-6;

impl Default for Bounds {
    fn default() -> Self {
        Bounds::EMPTY
    }
}

impl Bounds {
    /// The box of what holds nothing; the union with it changes nothing.
    pub const EMPTY: Bounds = Bounds { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    /// A box that lies farther than anything: what no ray is asked to meet.
    pub const NOWHERE: Bounds = Bounds { min: [FARTHEST; 3], max: [FARTHEST; 3] };

    /// A box, or `None` where the corners are those of no finite box.
    pub fn new(min: [f32; 3], max: [f32; 3]) -> Option<Self> {
        let bounded = (0..3)
            .all(|axis| min[axis] <= max[axis] && min[axis] >= -FARTHEST && max[axis] <= FARTHEST);
        bounded.then_some(Bounds { min, max })
    }

    /// The box around the images of this one's corners.
    pub fn transformed(&self, transform: Transform) -> Option<Self> {
        let mut min = [f64::INFINITY; 3];
        let mut max = [f64::NEG_INFINITY; 3];
        for corner in 0..8_usize {
            let side = |axis: usize| if corner >> axis & 1 == 0 { self.min } else { self.max };
            let point = transform.point(std::array::from_fn(|axis| f64::from(side(axis)[axis])));
            for axis in 0..3 {
                min[axis] = min[axis].min(point[axis]);
                max[axis] = max[axis].max(point[axis]);
            }
        }
        Bounds::new(min.map(|x| (x as f32).next_down()), max.map(|x| (x as f32).next_up()))
    }

    /// The box that holds what this one holds while it moves: of points that go on straight lines from key
    /// to key, the union over the keys.
    pub fn moved(&self, motion: &MovingTransform) -> Option<Self> {
        let mut keys = motion.keys().iter().map(|key| self.transformed(*key));
        let first = keys.next()??;
        keys.try_fold(first, |all, key| Some(all.union(&key?)))
    }

    /// The box grown on all sides by the fixed rule that every object's own box obeys.
    pub fn padded(&self) -> Self {
        let farthest = self.min.iter().chain(&self.max).fold(0.0, |far: f32, x| far.max(x.abs()));
        let pad = self.diagonal() * PAD_OF_DIAGONAL + f64::from(farthest) * PAD_OF_DISTANCE;
        Bounds {
            min: self.min.map(|x| ((f64::from(x) - pad) as f32).next_down()),
            max: self.max.map(|x| ((f64::from(x) + pad) as f32).next_up()),
        }
    }

    /// The smallest box that holds both.
    pub fn union(&self, other: &Bounds) -> Self {
        Bounds {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    /// The point at these parts of the ways along its sides.
    pub fn at(&self, parts: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|axis| {
            let (min, max) = (f64::from(self.min[axis]), f64::from(self.max[axis]));
            (min + (max - min) * f64::from(parts[axis])) as f32
        })
    }

    /// The point in its middle.
    pub fn center(&self) -> [f32; 3] {
        self.at([0.5; 3])
    }

    /// Its surface; 0 for the empty box.
    pub fn area(&self) -> f64 {
        let side = |axis: usize| (f64::from(self.max[axis]) - f64::from(self.min[axis])).max(0.0);
        2.0 * (side(0) * side(1) + side(1) * side(2) + side(2) * side(0))
    }

    /// The distance of its corners; 0 for the empty box.
    pub fn diagonal(&self) -> f64 {
        let side = |axis: usize| (f64::from(self.max[axis]) - f64::from(self.min[axis])).max(0.0);
        (side(0) * side(0) + side(1) * side(1) + side(2) * side(2)).sqrt()
    }
}
