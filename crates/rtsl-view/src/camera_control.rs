//! Camera movements, as functions from the present transform to the next.
//!
//! A camera's transform maps its own space, with x to the right, y up and z forward, to the world. Its handedness is
//! preserved. Angles are in degrees.

use rtsl_math::Transform;

/// A point or a direction in the world.
pub type Vector = [f64; 3];

/// The greatest cosine between the view and the vertical: beyond it, left and right are ill-defined.
const STEEPEST: f64 = 0.998;

/// Orbits a camera around a point: positive angles move it to the left and up, so that the image moves to the right and
/// down.
pub fn orbit(camera: Transform, pivot: Vector, up: Vector, [yaw, pitch]: [f64; 2]) -> Transform {
    let pitched = turn(camera, pivot, right(camera), pitch * handedness(camera));
    let pitched = if is_steep(pitched, up) { camera } else { pitched };
    turn(pitched, pivot, up, yaw * handedness(camera))
}

/// Rotates a camera at its position: positive angles look to the right and down.
pub fn look(camera: Transform, up: Vector, angles: [f64; 2]) -> Transform {
    orbit(camera, position(camera), up, angles)
}

/// Moves a camera along its own axes: right, up, forward.
pub fn fly(camera: Transform, by: Vector) -> Transform {
    let axes = [right(camera), above(camera), forward(camera)];
    let way = [0, 1, 2].map(|row: usize| (0..3).map(|axis| axes[axis][row] * by[axis]).sum());
    Transform::translate(way).after(camera)
}

/// Moves a camera towards a point, until its distance is `factor` of what it was.
pub fn dolly(camera: Transform, pivot: Vector, factor: f64) -> Transform {
    let way = subtract(pivot, position(camera));
    Transform::translate(way.map(|x| x * (1.0 - factor))).after(camera)
}

/// Returns the position of a camera.
pub fn position(camera: Transform) -> Vector {
    camera.point([0.0; 3])
}

/// Returns the viewing direction, of unit length.
pub fn forward(camera: Transform) -> Vector {
    axis(camera, [0.0, 0.0, 1.0])
}

/// Returns the direction to the right, of unit length.
pub fn right(camera: Transform) -> Vector {
    axis(camera, [1.0, 0.0, 0.0])
}

/// Returns the camera's up direction, of unit length.
pub fn above(camera: Transform) -> Vector {
    axis(camera, [0.0, 1.0, 0.0])
}

/// Returns the world axis closest to the camera's up direction: the world's up, in most scenes.
pub fn world_up(camera: Transform) -> Vector {
    let above = above(camera);
    let nearest = (0..3).max_by(|a: &usize, b| above[*a].abs().total_cmp(&above[*b].abs()));
    let mut up = [0.0; 3];
    nearest.into_iter().for_each(|axis| up[axis] = above[axis].signum());
    up
}

/// Returns the distance of two points.
pub fn distance(one: Vector, other: Vector) -> f64 {
    dot(subtract(one, other), subtract(one, other)).sqrt()
}

fn turn(camera: Transform, pivot: Vector, axis: Vector, degrees: f64) -> Transform {
    let Some(rotation) = Transform::rotate(degrees, axis) else { return camera };
    let there = Transform::translate(pivot);
    there.after(rotation).after(Transform::translate(pivot.map(|x| -x))).after(camera)
}

fn is_steep(camera: Transform, up: Vector) -> bool {
    dot(forward(camera), up).abs() > STEEPEST || dot(above(camera), up) < 0.0
}

/// 1 if right is the cross product of up and forward, -1 in mirrored scenes.
fn handedness(camera: Transform) -> f64 {
    if camera.swaps_handedness() { -1.0 } else { 1.0 }
}

fn axis(camera: Transform, of: Vector) -> Vector {
    let way = subtract(camera.point(of), position(camera));
    let length = dot(way, way).sqrt();
    way.map(|x| x / length)
}

fn subtract(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    const UP: Vector = [0.0, 1.0, 0.0];

    fn camera() -> Transform {
        let to_camera = Transform::look_at([0.0, 0.0, -5.0], [0.0; 3], UP).unwrap();
        to_camera.inverse().unwrap()
    }

    fn mirrored() -> Transform {
        Transform::scale([-1.0, 1.0, 1.0]).after(camera())
    }

    fn near(one: Vector, other: Vector) -> bool {
        distance(one, other) < 1e-9
    }

    #[test]
    fn orbits_keep_distance_and_target() {
        for start in [camera(), mirrored()] {
            let moved = orbit(start, [0.0; 3], UP, [30.0, 20.0]);
            assert!((distance(position(moved), [0.0; 3]) - 5.0).abs() < 1e-9);
            let target = position(moved).map(|x| -x / 5.0);
            assert!(near(forward(moved), target));
            assert!(position(moved)[1] > 0.0, "a positive pitch lifts the camera");
            let side = dot(subtract(position(moved), position(start)), right(start));
            assert!(side < 0.0, "a positive yaw moves it to its left");
        }
    }

    #[test]
    fn no_orbit_goes_over_the_pole() {
        let mut camera = camera();
        (0..100).for_each(|_| camera = orbit(camera, [0.0; 3], UP, [3.0, 10.0]));
        assert!(dot(above(camera), UP) > 0.0);
    }

    #[test]
    fn looking_turns_where_it_stands() {
        for start in [camera(), mirrored()] {
            let moved = look(start, UP, [10.0, 10.0]);
            assert!(near(position(moved), position(start)));
            assert!(dot(forward(moved), right(start)) > 0.0, "to the right");
            assert!(dot(forward(moved), above(start)) < 0.0, "down");
        }
    }

    #[test]
    fn flights_go_along_the_cameras_axes() {
        let start = mirrored();
        let moved = fly(start, [1.0, 2.0, 3.0]);
        let way = subtract(position(moved), position(start));
        let along = [right(start), above(start), forward(start)].map(|axis| dot(axis, way));
        assert!(near(along, [1.0, 2.0, 3.0]));
    }

    #[test]
    fn dollies_come_nearer() {
        let moved = dolly(camera(), [0.0, 0.0, 5.0], 0.5);
        assert!(near(position(moved), [0.0; 3]));
        assert!(near(forward(moved), forward(camera())));
    }

    #[test]
    fn up_is_the_nearest_axis() {
        let to_camera = Transform::look_at([5.0, 3.0, 4.0], [0.0; 3], [0.0, 0.0, 1.0]).unwrap();
        assert_eq!(world_up(to_camera.inverse().unwrap()), [0.0, 0.0, 1.0]);
    }
}
