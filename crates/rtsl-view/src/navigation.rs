//! The movements of the camera by gestures over the picture and by keys.

use std::collections::BTreeSet;
use std::time::Duration;

use egui::{Key, PointerButton};
use rtsl_math::Transform;
use rtsl_render::session::Session;

use crate::camera_control::{self, Vector};

/// The camera's rotation in degrees for a pixel of a drag.
const DEGREES_PER_PIXEL: f64 = 0.35;
/// The camera's rotation in degrees for an arrow key.
const DEGREES_PER_STEP: f64 = 5.0;
/// The factor of the distance for a notch of the wheel.
pub const DOLLY_PER_NOTCH: f64 = 0.88;
/// The speed of flights: the fraction of the distance to the pivot per second.
const FLIGHT_PER_SECOND: f64 = 0.7;
/// The factor by which Shift speeds flights up.
const HASTE: f64 = 4.0;

/// The camera's pivot, and the keys of flights that are down.
pub struct Navigation {
    /// The point about which the camera orbits.
    pub pivot: Vector,
    up: Vector,
    keys: BTreeSet<Key>,
    /// True while a Shift key is down.
    pub is_shifted: bool,
}

impl Navigation {
    /// Returns the navigation of a session, whose pivot is the point at the centre of the picture.
    pub fn new(session: &Session) -> Navigation {
        let (width, height) = session.film().size();
        let camera = session.camera();
        let middle = session.pick(width / 2, height / 2);
        let position = camera_control::position(camera);
        let ahead = camera_control::forward(camera);
        // A scene without bounds is assumed to be as large as its camera's distance from the origin.
        let reach = camera_control::distance(position, [0.0; 3]).max(1.0);
        let pivot = middle.map_or_else(
            || [0, 1, 2].map(|axis: usize| position[axis] + ahead[axis] * reach),
            |picked| picked.position,
        );
        let up = camera_control::world_up(camera);
        Navigation { pivot, up, keys: BTreeSet::new(), is_shifted: false }
    }

    /// Notes that a key of flights is pressed or released.
    pub fn hold(&mut self, key: Key, is_down: bool) {
        match is_down {
            true => self.keys.insert(key),
            false => self.keys.remove(&key),
        };
    }

    /// Forgets the keys that are down.
    pub fn release_all(&mut self) {
        self.keys.clear();
    }

    /// True while the camera flies.
    pub fn is_flying(&self) -> bool {
        self.flight() != [0.0; 3]
    }

    /// Handles a drag over the picture by so many pixels.
    pub fn drag(&mut self, session: &mut Session, button: PointerButton, [dx, dy]: [f64; 2]) {
        let is_pan = button == PointerButton::Middle || self.is_shifted;
        let angles = [dx * DEGREES_PER_PIXEL, dy * DEGREES_PER_PIXEL];
        match button {
            PointerButton::Primary | PointerButton::Middle if is_pan => {
                self.pan(session, [dx, dy]);
            }
            PointerButton::Secondary => {
                session.set_camera(camera_control::look(session.camera(), self.up, angles));
            }
            _ => self.orbit(session, angles),
        }
    }

    /// Orbits by so many steps of an arrow key to the right and down.
    pub fn step(&mut self, session: &mut Session, steps: [f64; 2]) {
        self.orbit(session, steps.map(|steps| steps * DEGREES_PER_STEP));
    }

    fn orbit(&mut self, session: &mut Session, angles: [f64; 2]) {
        let camera = camera_control::orbit(session.camera(), self.pivot, self.up, angles);
        session.set_camera(camera);
    }

    /// Moves the camera parallel to the image, so that the scene follows the pointer if the field of view is about 50
    /// degrees.
    fn pan(&mut self, session: &mut Session, [dx, dy]: [f64; 2]) {
        let (width, height) = session.film().size();
        let scale = self.distance(session) / width.min(height).max(1) as f64;
        let moved = camera_control::fly(session.camera(), [-dx * scale, dy * scale, 0.0]);
        self.move_with_pivot(session, moved);
    }

    /// Moves the camera nearer by so many notches of the wheel.
    pub fn dolly(&mut self, session: &mut Session, notches: f64) {
        let (whole, part) = (notches.abs().trunc().min(100.0), notches.abs().fract());
        let factor = std::iter::repeat_n(DOLLY_PER_NOTCH, whole as usize).product::<f64>();
        // Touchpads turn by parts of a notch.
        let factor = factor * (1.0 - part * (1.0 - DOLLY_PER_NOTCH));
        let factor = if notches < 0.0 { 1.0 / factor } else { factor };
        session.set_camera(camera_control::dolly(session.camera(), self.pivot, factor));
    }

    /// Flies for so long in the direction of the keys that are down.
    pub fn fly(&mut self, session: &mut Session, time: Duration) {
        let way = self.flight();
        if way != [0.0; 3] {
            let haste = if self.is_shifted { HASTE } else { 1.0 };
            let step = time.as_secs_f64() * FLIGHT_PER_SECOND * haste * self.distance(session);
            let moved = camera_control::fly(session.camera(), way.map(|x| x * step));
            self.move_with_pivot(session, moved);
        }
    }

    /// The direction of flight for the keys that are down: right, up, forward.
    fn flight(&self) -> Vector {
        let along = |forth: Key, back: Key| {
            let down = |key| f64::from(self.keys.contains(&key));
            down(forth) - down(back)
        };
        [along(Key::D, Key::A), along(Key::E, Key::Q), along(Key::W, Key::S)]
    }

    fn move_with_pivot(&mut self, session: &mut Session, camera: Transform) {
        let (before, after) = (session.camera(), camera);
        let (before, after) = (camera_control::position(before), camera_control::position(after));
        self.pivot = [0, 1, 2].map(|axis: usize| self.pivot[axis] + after[axis] - before[axis]);
        session.set_camera(camera);
    }

    fn distance(&self, session: &Session) -> f64 {
        let position = camera_control::position(session.camera());
        let distance = camera_control::distance(position, self.pivot);
        if distance > 0.0 { distance } else { 1.0 }
    }

    /// Returns the camera as a line of a scene file.
    pub fn camera_text(&self, session: &Session) -> String {
        let camera = session.camera();
        let [from, up] = [camera_control::position(camera), camera_control::above(camera)];
        let (ahead, distance) = (camera_control::forward(camera), self.distance(session));
        let to = [0, 1, 2].map(|axis: usize| from[axis] + ahead[axis] * distance);
        let mirror = if camera.swaps_handedness() { "Scale -1 1 1   " } else { "" };
        let triple = |[x, y, z]: Vector| format!("{x:.5} {y:.5} {z:.5}");
        format!("{mirror}LookAt {}   {}   {}", triple(from), triple(to), triple(up))
    }
}
