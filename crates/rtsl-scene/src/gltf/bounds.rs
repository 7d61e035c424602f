//! Boxes around points.

use rtsl_math::Transform;

/// A box around points, with axes along those of the space; empty if its least corner is beyond its greatest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    pub least: [f64; 3],
    pub greatest: [f64; 3],
}

impl Default for Bounds {
    fn default() -> Self {
        Bounds { least: [f64::INFINITY; 3], greatest: [f64::NEG_INFINITY; 3] }
    }
}

impl FromIterator<[f64; 3]> for Bounds {
    fn from_iter<I: IntoIterator<Item = [f64; 3]>>(points: I) -> Self {
        let mut bounds = Bounds::default();
        points.into_iter().for_each(|point| bounds.include(point));
        bounds
    }
}

impl Bounds {
    /// True if there is no point in the box.
    pub fn is_empty(&self) -> bool {
        (0..3).any(|axis| self.least[axis] > self.greatest[axis])
    }

    fn include(&mut self, point: [f64; 3]) {
        for axis in 0..3 {
            self.least[axis] = self.least[axis].min(point[axis]);
            self.greatest[axis] = self.greatest[axis].max(point[axis]);
        }
    }

    /// Includes the transformed corners of another box.
    pub fn add(&mut self, other: &Bounds, transform: Transform) {
        if !other.is_empty() {
            other.corners().for_each(|corner| self.include(transform.point(corner)));
        }
    }

    /// Returns the eight corners.
    pub fn corners(&self) -> impl Iterator<Item = [f64; 3]> {
        let Bounds { least, greatest } = *self;
        (0..8).map(move |corner| {
            std::array::from_fn(
                |axis| {
                    if corner >> axis & 1 == 0 { least[axis] } else { greatest[axis] }
                },
            )
        })
    }

    /// Returns the middle.
    pub fn center(&self) -> [f64; 3] {
        std::array::from_fn(|axis| 0.5 * (self.least[axis] + self.greatest[axis]))
    }

    /// Returns half of the diagonal.
    pub fn radius(&self) -> f64 {
        let squares = (0..3).map(|axis| (self.greatest[axis] - self.least[axis]).powi(2));
        0.5 * squares.sum::<f64>().sqrt()
    }
}
