//! Axis-aligned boxes.

use rtsl_math::{MovingTransform, Transform};

/// An axis-aligned box with finite corners.
///
/// ```
/// use rtsl_bvh::Bounds;
/// use rtsl_math::Transform;
///
/// let cube = Bounds::new([-1.0; 3], [1.0; 3]).expect("the corners are finite and ordered");
/// let moved = cube.transformed(Transform::translate([4.0, 0.0, 0.0])).expect("it stays finite");
/// assert!(moved.min[0] <= 3.0 && moved.max[0] >= 5.0);
/// assert!(Bounds::new([0.0; 3], [f32::INFINITY; 3]).is_none());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The least coordinates.
    pub min: [f32; 3],
    /// The greatest coordinates.
    pub max: [f32; 3],
}

/// Boxes that reach further are treated as unbounded: their areas would overflow.
const FARTHEST: f32 = 1e17;

/// The padding of a box on all sides, as a fraction of its diagonal and of its distance from the origin: more than
/// rounding moves a hit off its surface.
const PAD_OF_DIAGONAL: f64 = 1e-4;
const PAD_OF_DISTANCE: f64 = 2e-6;

impl Default for Bounds {
    fn default() -> Self {
        Bounds::EMPTY
    }
}

impl Bounds {
    /// The empty box: its union with another box is that box.
    pub const EMPTY: Bounds = Bounds { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    /// A box farther away than any scene: no ray is tested against its content.
    pub const NOWHERE: Bounds = Bounds { min: [FARTHEST; 3], max: [FARTHEST; 3] };

    /// Returns the box with these corners, or `None` if they are not finite or not ordered.
    pub fn new(min: [f32; 3], max: [f32; 3]) -> Option<Self> {
        let bounded = (0..3)
            .all(|axis| min[axis] <= max[axis] && min[axis] >= -FARTHEST && max[axis] <= FARTHEST);
        bounded.then_some(Bounds { min, max })
    }

    /// Returns the box around the images of the box's corners.
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

    /// Returns the box around the moving box over the whole shutter. Points move on straight lines between keys, so it
    /// is the union over the keys.
    pub fn moved(&self, motion: &MovingTransform) -> Option<Self> {
        let mut keys = motion.keys().iter().map(|key| self.transformed(*key));
        let first = keys.next()??;
        keys.try_fold(first, |all, key| Some(all.union(&key?)))
    }

    /// Returns the padded box, by the fixed rule that applies to every object's own box.
    pub fn padded(&self) -> Self {
        let farthest = self.min.iter().chain(&self.max).fold(0.0, |far: f32, x| far.max(x.abs()));
        let pad = self.diagonal() * PAD_OF_DIAGONAL + f64::from(farthest) * PAD_OF_DISTANCE;
        Bounds {
            min: self.min.map(|x| ((f64::from(x) - pad) as f32).next_down()),
            max: self.max.map(|x| ((f64::from(x) + pad) as f32).next_up()),
        }
    }

    /// Returns the smallest box that contains both.
    pub fn union(&self, other: &Bounds) -> Self {
        Bounds {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    /// Returns the point at these fractions of the box's sides.
    pub fn at(&self, parts: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|axis| {
            let (min, max) = (f64::from(self.min[axis]), f64::from(self.max[axis]));
            (min + (max - min) * f64::from(parts[axis])) as f32
        })
    }

    /// Returns the center of the box.
    pub fn center(&self) -> [f32; 3] {
        self.at([0.5; 3])
    }

    /// Returns the surface area; 0 for the empty box.
    pub fn area(&self) -> f64 {
        let side = |axis: usize| (f64::from(self.max[axis]) - f64::from(self.min[axis])).max(0.0);
        2.0 * (side(0) * side(1) + side(1) * side(2) + side(2) * side(0))
    }

    /// Returns the length of the diagonal; 0 for the empty box.
    pub fn diagonal(&self) -> f64 {
        let side = |axis: usize| (f64::from(self.max[axis]) - f64::from(self.min[axis])).max(0.0);
        (side(0) * side(0) + side(1) * side(1) + side(2) * side(2)).sqrt()
    }
}
