//! Transforms that move while the shutter is open.

use glam::{DMat3, DMat4, DQuat, DVec3};

use super::{Affine, Transform};

/// A moving transform, represented by its values (keys) at equally spaced times, the first at shutter open, the last at
/// shutter close. Each component is interpolated linearly between keys, so a point moves on straight lines from key to
/// key, and a box that contains an object at all keys contains it at all times.
#[derive(Clone, Debug, PartialEq)]
pub struct MovingTransform {
    keys: Vec<Transform>,
}

/// The greatest number of intervals between keys.
const MAX_INTERVALS: usize = 64;

/// The permitted deviation of a point from its true path, relative to its distance from the local origin, or to the
/// distance that the origin travels.
const TOLERANCE: f64 = 5e-4;

impl MovingTransform {
    /// The motion from `start` to `end`: translations and scalings are linear and rotations have constant angular
    /// velocity, along the shorter arc. The shutter opens and closes at the two fractions of the motion given by
    /// `shutter`; before 0 and after 1 nothing moves. Returns `None` if a transform has no inverse, or if only one of
    /// them is a reflection, so that an intermediate one has none.
    pub fn new(start: Transform, end: Transform, shutter: [f64; 2]) -> Option<Self> {
        let path = Path::new(start, end, shutter)?;
        let sample = |intervals: usize| {
            let key = |index: usize| path.at(index as f64 / intervals as f64);
            MovingTransform { keys: (0..=intervals).map(key).collect() }
        };
        let counts = (1..MAX_INTERVALS).map(sample);
        let mut enough = counts.filter(|sampled| path.is_followed_by(sampled));
        Some(enough.next().unwrap_or_else(|| sample(MAX_INTERVALS)))
    }

    /// Returns the keys: at least two.
    pub fn keys(&self) -> &[Transform] {
        &self.keys
    }

    /// True if the transform changes.
    pub fn moves(&self) -> bool {
        self.keys.iter().any(|key| *key != self.keys[0])
    }

    /// Returns the transform at a time from 0, when the shutter opens, to 1.
    pub fn at(&self, time: f64) -> Transform {
        let intervals = self.keys.len() - 1;
        let place = time.clamp(0.0, 1.0) * intervals as f64;
        let before = (place as usize).min(intervals - 1);
        self.keys[before].mix(self.keys[before + 1], place - before as f64)
    }

    /// Returns the transform at the time of a ray.
    pub fn map_at(&self, time: f32) -> Affine {
        self.at(f64::from(time)).affine()
    }

    /// Returns the inverse at the time of a ray.
    pub fn inverse_at(&self, time: f32) -> Affine {
        self.at(f64::from(time)).affine_inverse()
    }

    /// Returns this motion applied after `first`: exact if one of them does not move, otherwise interpolated between
    /// keys.
    pub fn after(&self, first: &MovingTransform) -> MovingTransform {
        let intervals = match (self.moves(), first.moves()) {
            (true, true) => MAX_INTERVALS,
            (true, false) => self.keys.len() - 1,
            (false, _) => first.keys.len() - 1,
        };
        let times = (0..=intervals).map(|index| index as f64 / intervals as f64);
        MovingTransform { keys: times.map(|time| self.at(time).after(first.at(time))).collect() }
    }
}

impl From<Transform> for MovingTransform {
    /// A transform that does not move.
    fn from(transform: Transform) -> Self {
        MovingTransform { keys: vec![transform; 2] }
    }
}

/// The true path, which the keys approximate.
struct Path {
    start: Parts,
    end: Parts,
    shutter: [f64; 2],
}

impl Path {
    fn new(start: Transform, end: Transform, shutter: [f64; 2]) -> Option<Self> {
        if start.swaps_handedness() != end.swaps_handedness() {
            return None;
        }
        let (start, mut end) = (Parts::of(start)?, Parts::of(end)?);
        if start.rotation.dot(end.rotation) < 0.0 {
            end.rotation = -end.rotation;
        }
        Some(Path { start, end, shutter })
    }

    fn at(&self, time: f64) -> Transform {
        let [first, last] = self.shutter;
        let part = (first + (last - first) * time).clamp(0.0, 1.0);
        let translation = self.start.translation.lerp(self.end.translation, part);
        let rotation = slerp(self.start.rotation, self.end.rotation, part);
        let stretch = self.start.stretch * (1.0 - part) + self.end.stretch * part;
        Parts { translation, rotation, stretch }.product()
    }

    /// True if linear interpolation between keys approximates the path within the tolerance.
    fn is_followed_by(&self, moving: &MovingTransform) -> bool {
        const TIMES: usize = 4;
        let times = (moving.keys.len() - 1) * TIMES;
        let way = self.start.translation.distance(self.end.translation);
        (0..=times).all(|index| {
            let time = index as f64 / times as f64;
            let (true_place, place) = (self.at(time).matrix(), moving.at(time).matrix());
            let error = true_place - place;
            let turned = frobenius(DMat3::from_mat4(error));
            let size = frobenius(DMat3::from_mat4(true_place));
            let shifted = error.w_axis.truncate().length();
            turned <= TOLERANCE * size && shifted <= TOLERANCE * way
        })
    }
}

fn frobenius(matrix: DMat3) -> f64 {
    matrix.to_cols_array().iter().fold(0.0, |sum, x| sum + x * x).sqrt()
}

/// A transform as a stretch (symmetric, with the reflection if there is one), then a rotation, then a translation.
struct Parts {
    translation: DVec3,
    rotation: DQuat,
    stretch: DMat3,
}

impl Parts {
    /// Shoemake and Duff, "Matrix Animation and Polar Decomposition", 1992.
    fn of(transform: Transform) -> Option<Parts> {
        // Convergence is quadratic, after some steps that halve the distance from a rotation.
        const STEPS: usize = 100;
        transform.inverse()?;
        let matrix = transform.matrix();
        let linear = DMat3::from_mat4(matrix);
        let mut rotation = linear;
        for _ in 0..STEPS {
            let next = (rotation + rotation.transpose().inverse()) * 0.5;
            let change = frobenius(next - rotation);
            rotation = next;
            if change <= 1e-15 {
                break;
            }
        }
        if transform.swaps_handedness() {
            rotation = -rotation;
        }
        let stretch = rotation.transpose() * linear;
        let rotation = DQuat::from_mat3(&rotation).normalize();
        let parts = Parts { translation: matrix.w_axis.truncate(), rotation, stretch };
        rotation.is_finite().then_some(parts)
    }

    fn product(&self) -> Transform {
        let linear = DMat3::from_quat(self.rotation) * self.stretch;
        let mut matrix = DMat4::from_mat3(linear);
        matrix.w_axis = self.translation.extend(1.0);
        Transform::from_matrix(matrix)
    }
}

/// Interpolates a rotation by bisection: the rotation halfway is the normalised sum, which needs no trigonometry.
fn slerp(mut from: DQuat, mut to: DQuat, mut part: f64) -> DQuat {
    const HALVINGS: usize = 52;
    for _ in 0..HALVINGS {
        // Both ends are returned exactly.
        if part == 0.0 {
            return from;
        }
        if part == 1.0 {
            return to;
        }
        let middle = (from + to).normalize();
        part *= 2.0;
        if part < 1.0 {
            to = middle;
        } else {
            from = middle;
            part -= 1.0;
        }
    }
    from
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: [f64; 2] = [0.0, 1.0];

    fn rotation(degrees: f64) -> Transform {
        Transform::rotate(degrees, [1.0, 2.0, -1.0]).unwrap()
    }

    fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
        DVec3::from_array(a).distance(DVec3::from_array(b))
    }

    #[test]
    fn translations_and_scalings_need_two_keys() {
        let start = Transform::translate([1.0, 2.0, 3.0]).after(rotation(30.0));
        let end = Transform::translate([4.0, 2.0, 5.0])
            .after(rotation(30.0))
            .after(Transform::scale([2.0, 1.0, 0.5]));
        let moving = MovingTransform::new(start, end, WHOLE).unwrap();
        assert_eq!(moving.keys().len(), 2);
        let middle = moving.at(0.5).point([0.0; 3]);
        assert!(distance(middle, [2.5, 2.0, 4.0]) < 1e-12);
    }

    #[test]
    fn rotations_turn_evenly_on_their_circle() {
        for degrees in [1.0, 45.0, 90.0, 170.0] {
            let moving = MovingTransform::new(rotation(0.0), rotation(degrees), WHOLE).unwrap();
            for step in 0..=100 {
                let time = f64::from(step) / 100.0;
                let point = [0.3, -0.7, 0.2];
                let expected = rotation(degrees * time).point(point);
                let found = moving.at(time).point(point);
                assert!(distance(found, expected) < 1e-3, "{degrees} degrees at {time}");
            }
        }
    }

    #[test]
    fn the_shorter_way_is_taken_and_keys_are_few() {
        let moving = MovingTransform::new(rotation(0.0), rotation(350.0), WHOLE).unwrap();
        assert!(distance(moving.at(0.5).point([1.0; 3]), rotation(-5.0).point([1.0; 3])) < 1e-3);
        assert!(moving.keys().len() <= 4, "{} keys", moving.keys().len());
        let half = MovingTransform::new(rotation(0.0), rotation(180.0), WHOLE).unwrap();
        assert!(half.keys().len() <= MAX_INTERVALS, "{} keys", half.keys().len());
    }

    #[test]
    fn the_shutter_cuts_the_motion() {
        let start = Transform::translate([0.0; 3]);
        let end = Transform::translate([8.0, 0.0, 0.0]);
        let part = MovingTransform::new(start, end, [0.25, 0.5]).unwrap();
        assert_eq!(part.at(0.0).point([0.0; 3]), [2.0, 0.0, 0.0]);
        assert_eq!(part.at(1.0).point([0.0; 3]), [4.0, 0.0, 0.0]);
        let stands = MovingTransform::new(start, end, [-1.0, 1.0]).unwrap();
        assert_eq!(stands.at(0.25).point([0.0; 3]), [0.0; 3]);
        assert_eq!(stands.at(0.75).point([0.0; 3]), [4.0, 0.0, 0.0]);
        assert!(!MovingTransform::new(start, end, [0.5, 0.5]).unwrap().moves());
        assert!(part.moves());
    }

    #[test]
    fn mirrors_stay_mirrors() {
        let mirror = Transform::scale([-1.0, 1.0, 1.0]);
        let end = rotation(60.0).after(mirror);
        let moving = MovingTransform::new(mirror, end, WHOLE).unwrap();
        assert!(moving.keys().iter().all(|key| key.swaps_handedness()));
        let expected = rotation(60.0).point([-1.0, 2.0, 3.0]);
        assert!(distance(moving.at(1.0).point([1.0, 2.0, 3.0]), expected) < 1e-9);
        assert!(MovingTransform::new(Transform::IDENTITY, mirror, WHOLE).is_none());
        let flat = Transform::scale([1.0, 0.0, 1.0]);
        assert!(MovingTransform::new(Transform::IDENTITY, flat, WHOLE).is_none());
    }

    #[test]
    fn maps_of_rays_lead_there_and_back() {
        let start = rotation(10.0).after(Transform::scale([1.0, 2.0, 0.5]));
        let end = Transform::translate([5.0, 1.0, 0.0]).after(rotation(100.0));
        let moving = MovingTransform::new(start, end, WHOLE).unwrap();
        for time in [0.0, 0.3, 0.999, 1.0] {
            let point = moving.map_at(time).point([0.1, 0.2, 0.3]);
            let back = moving.inverse_at(time).point(point);
            assert!(distance(back.map(f64::from), [0.1, 0.2, 0.3]) < 1e-6, "{back:?} at {time}");
        }
    }

    #[test]
    fn motions_follow_each_other() {
        let slide = |x| Transform::translate([x, 0.0, 0.0]);
        let sliding = MovingTransform::new(slide(0.0), slide(4.0), WHOLE).unwrap();
        let turning = MovingTransform::new(rotation(0.0), rotation(80.0), WHOLE).unwrap();
        let still = MovingTransform::from(rotation(20.0));
        for (second, first) in [(&sliding, &turning), (&turning, &sliding), (&still, &sliding)] {
            let both = second.after(first);
            for time in [0.0, 0.21, 0.5, 1.0] {
                let expected = second.at(time).point(first.at(time).point([1.0, 2.0, 3.0]));
                assert!(distance(both.at(time).point([1.0, 2.0, 3.0]), expected) < 1e-3);
            }
        }
        assert_eq!(still.after(&sliding).keys().len(), 2);
    }

    #[test]
    fn ends_and_keys_are_where_they_should_be() {
        let start = rotation(10.0).after(Transform::scale([1.0, 1e3, 1e-3]));
        let end = Transform::translate([5.0, 0.0, 0.0]).after(rotation(100.0));
        let moving = MovingTransform::new(start, end, WHOLE).unwrap();
        for (time, expected) in [(0.0, start), (1.0, end)] {
            let point = [0.1, 0.2, 0.3];
            assert!(distance(moving.at(time).point(point), expected.point(point)) < 1e-9);
        }
    }
}
