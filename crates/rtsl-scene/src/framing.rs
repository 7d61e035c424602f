//! A camera that shows all of a scene that has none.

use rtsl_math::{Transform, sine_and_cosine_of_degrees};

use crate::bounds::Bounds;
use crate::vector::{cross, dot, unit};

/// The direction from the scene to the camera that shows all of it, which is not yet of unit length: from the front,
/// the right and above.
const THREE_QUARTERS: [f64; 3] = [0.55, 0.4, 1.0];

/// The field of view of that camera, in degrees.
pub const FIELD_OF_VIEW: f64 = 35.0;

/// The tangent of an angle in degrees.
pub fn tangent(degrees: f64) -> f64 {
    let (sine, cosine) = sine_and_cosine_of_degrees(degrees);
    sine / cosine
}

/// From the world to a camera at `eye` that looks in a direction, with another one up.
pub fn look(eye: [f64; 3], direction: [f64; 3], up: [f64; 3]) -> Option<Transform> {
    let ahead = unit(direction)?;
    let right = unit(cross(ahead, up))?;
    let up = cross(right, ahead);
    let columns = [
        right[0], right[1], right[2], 0.0, up[0], up[1], up[2], 0.0, ahead[0], ahead[1], ahead[2],
        0.0, eye[0], eye[1], eye[2], 1.0,
    ];
    Transform::from_columns(&columns).inverse()
}

/// From the world to the camera that shows all of a box.
pub fn frame(bounds: &Bounds) -> Transform {
    let all = [[-1.0; 3], [1.0; 3]].into_iter().collect();
    let bounds = if bounds.is_empty() || !bounds.radius().is_finite() { &all } else { bounds };
    let (center, radius) = (bounds.center(), bounds.radius());
    // A point has no size.
    let radius = if radius > 0.0 { radius } else { 1e-6 };
    let [Some(back), Some(right)] =
        [unit(THREE_QUARTERS), unit(cross([0.0, 1.0, 0.0], THREE_QUARTERS))]
    else {
        return Transform::IDENTITY;
    };
    let up = cross(back, right);
    let tangent = tangent(0.5 * FIELD_OF_VIEW);
    // Each point is to appear within the square, with a margin.
    const MARGIN: f64 = 1.12;
    let distances = bounds.outline().map(|point| {
        let from_center = std::array::from_fn::<f64, 3, _>(|axis| point[axis] - center[axis]);
        let part = |axis: [f64; 3]| dot(from_center, axis);
        part(back) + MARGIN * part(right).abs().max(part(up).abs()) / tangent
    });
    let distance = distances.fold(0.5 * radius, f64::max);
    let eye = std::array::from_fn(|axis| center[axis] + distance * back[axis]);
    look(eye, back.map(|part| -part), [0.0, 1.0, 0.0]).unwrap_or(Transform::IDENTITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outline_is_in_the_picture() {
        let flat = [[-5.0, 1.0, -0.5], [3.0, 1.0, 90.0], [3.0, 1.0, -0.5]];
        let disk = (0..360).map(|degrees| {
            let (sine, cosine) = sine_and_cosine_of_degrees(degrees.into());
            [7.0 + cosine, 3.0, sine]
        });
        for points in [vec![[2.0; 3], [3.0; 3]], flat.to_vec(), disk.collect()] {
            let bounds: Bounds = points.iter().copied().collect();
            let to_camera = frame(&bounds);
            let tangent = tangent(0.5 * FIELD_OF_VIEW);
            let places = points.iter().map(|point| {
                let [x, y, z] = to_camera.point(*point);
                assert!(z > 0.0);
                x.abs().max(y.abs()) / (z * tangent)
            });
            let most = places.fold(0.0, f64::max);
            assert!(most < 1.0 && most > 0.8, "{most}");
        }
    }
}
