//! Boxes around points.

use rtsl_math::Transform;

/// A box around points, with axes along those of the space, and the points that lie farthest in some directions, which
/// tell the outline from the box's. Empty if its least corner is beyond its greatest.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    pub least: [f64; 3],
    pub greatest: [f64; 3],
    /// For each direction the distance and the point.
    extremes: [(f64, [f64; 3]); DIRECTIONS.len()],
}

/// Towards the faces, the edges and the corners of a cube.
const DIRECTIONS: [[f64; 3]; 26] = directions();

const fn directions() -> [[f64; 3]; 26] {
    let mut directions = [[0.0; 3]; 26];
    let (mut count, mut code) = (0, 0);
    while code < 27 {
        // The middle of the cube has no direction.
        if code != 13 {
            let parts = [code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1];
            directions[count] = [parts[0] as f64, parts[1] as f64, parts[2] as f64];
            count += 1;
        }
        code += 1;
    }
    directions
}

impl Default for Bounds {
    fn default() -> Self {
        Bounds {
            least: [f64::INFINITY; 3],
            greatest: [f64::NEG_INFINITY; 3],
            extremes: [(f64::NEG_INFINITY, [0.0; 3]); DIRECTIONS.len()],
        }
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
        self.least = std::array::from_fn(|axis| self.least[axis].min(point[axis]));
        self.greatest = std::array::from_fn(|axis| self.greatest[axis].max(point[axis]));
        for (direction, extreme) in DIRECTIONS.iter().zip(&mut self.extremes) {
            let distance = (0..3).map(|axis| direction[axis] * point[axis]).sum();
            if distance > extreme.0 {
                *extreme = (distance, point);
            }
        }
    }

    /// Includes the transformed outline of another box.
    pub fn add(&mut self, other: &Bounds, transform: Transform) {
        if !other.is_empty() {
            other.outline().for_each(|point| self.include(transform.point(point)));
        }
    }

    /// Returns the points that lie farthest in some directions.
    pub fn outline(&self) -> impl Iterator<Item = [f64; 3]> {
        self.extremes.iter().map(|(_, point)| *point)
    }

    /// Returns the middle.
    pub fn center(&self) -> [f64; 3] {
        std::array::from_fn(|axis| 0.5 * (self.least[axis] + self.greatest[axis]))
    }

    /// Returns half of the diagonal.
    pub fn radius(&self) -> f64 {
        let sides = (0..3).map(|axis| self.greatest[axis] - self.least[axis]);
        0.5 * sides.map(|side| side * side).sum::<f64>().sqrt()
    }
}
