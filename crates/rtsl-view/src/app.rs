//! The viewer: converts events to pixels. It does not depend on a window.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use rtsl_math::Transform;
use rtsl_render::Messages;
use rtsl_render::session::{Picked, Reloaded, Session, ViewMode};
use rtsl_scene::EntityId;

use crate::camera_control::{self, Vector};
use crate::canvas::Canvas;
use crate::input::{Button, Event, Key};
use crate::overlay;
use crate::panel::{self, Panel, Request};

/// The camera's rotation in degrees for a pixel of a drag.
const DEGREES_PER_PIXEL: f64 = 0.35;
/// The camera's rotation in degrees for an arrow key.
const DEGREES_PER_STEP: f64 = 5.0;
/// The factor of the distance for a notch of the wheel.
const DOLLY_PER_NOTCH: f64 = 0.88;
/// The speed of flights: the fraction of the distance to the pivot per second.
const FLIGHT_PER_SECOND: f64 = 0.7;
/// The factor by which Shift speeds flights up.
const HASTE: f64 = 4.0;
/// The greatest movement of the pointer during a click, in pixels.
const CLICK_RADIUS: f64 = 3.0;
/// The least width of a window in which the panel opens automatically: in narrower ones it would cover the figures.
const WIDE_ENOUGH: i32 = 3 * panel::WIDTH;

/// The viewer, without its window.
pub struct App {
    session: Session,
    panel: Panel,
    shows_panel: bool,
    shows_figures: bool,
    shows_help: bool,
    /// The point about which the camera orbits.
    pivot: Vector,
    up: Vector,
    pointer: (f64, f64),
    drag: Option<Drag>,
    keys: BTreeSet<Key>,
    picked: Option<Picked>,
    /// Diagnostics, until they are closed or out of date.
    message: Option<String>,
    /// The smoothed time between frames.
    frame_time: Duration,
    last_frame: Option<Instant>,
    wishes: Vec<Wish>,
}

/// A request that only the window can fulfil.
#[derive(Clone, Debug, PartialEq)]
pub enum Wish {
    /// Write a line to standard output.
    Print(String),
    /// Write a picture of the window.
    Screenshot,
}

/// A drag with the pointer over the image.
#[derive(Clone, Copy, Debug)]
struct Drag {
    button: Button,
    start: (f64, f64),
    /// True if it moved too far for a click.
    moved: bool,
}

impl App {
    /// Creates a viewer of a session.
    pub fn new(session: Session) -> Self {
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
        let mut app = App {
            up: camera_control::world_up(camera),
            pivot,
            panel: Panel::new(session.things()),
            shows_panel: width as i32 >= WIDE_ENOUGH,
            shows_figures: true,
            shows_help: false,
            pointer: (0.0, 0.0),
            drag: None,
            keys: BTreeSet::new(),
            picked: None,
            message: None,
            frame_time: Duration::ZERO,
            last_frame: None,
            wishes: Vec::new(),
            session,
        };
        let first = app.panel.things.iter().map(|thing| thing.entity);
        let first = first.into_iter().find(|it| !app.session.controls(*it).is_empty());
        app.select(first);
        app
    }

    /// Returns the session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Returns the message being shown.
    pub fn message(&self) -> Option<&str> {
        self.message.as_deref()
    }

    /// Returns the last pick.
    pub fn picked(&self) -> Option<&Picked> {
        self.picked.as_ref()
    }

    /// Takes the wishes since the last call.
    pub fn take_wishes(&mut self) -> Vec<Wish> {
        std::mem::take(&mut self.wishes)
    }

    /// Handles an event.
    pub fn handle(&mut self, event: Event) {
        match event {
            Event::Resized { width, height } => self.session.resize(width, height),
            Event::PointerMoved { x, y } => self.move_pointer(x, y),
            Event::ButtonPressed(button) => self.press(button),
            Event::ButtonReleased(button) => self.release(button),
            Event::Scrolled(notches) => self.scroll(notches),
            Event::KeyPressed(key) => {
                self.keys.insert(key);
                self.press_key(key);
            }
            Event::KeyReleased(key) => {
                self.keys.remove(&key);
            }
            Event::FocusLost => self.keys.clear(),
            Event::FilesChanged => self.reload(),
        }
    }

    /// True if [`App::advance`] has work to do.
    pub fn is_busy(&self) -> bool {
        self.session.is_busy() || self.flight() != [0.0; 3]
    }

    /// Renders for about `budget`, after moving the camera for the time of the last frame.
    pub fn advance(&mut self, budget: Duration) {
        let now = Instant::now();
        let since = self.last_frame.map_or(Duration::ZERO, |last| now - last);
        // After a rest, the time since the last frame is not a frame time.
        let since = since.min(Duration::from_millis(250));
        self.last_frame = Some(now);
        self.frame_time = self.frame_time.mul_f64(0.8) + since.mul_f64(0.2);
        self.fly(since);
        self.session.advance(budget);
        if let Some(problem) = self.session.status().problem {
            self.message = Some(problem);
        }
    }

    /// Notes that the viewer rests: the next frame time does not start at the last frame.
    pub fn rest(&mut self) {
        self.last_frame = None;
    }

    /// Paints the window: `pixels` has the size of the session's film.
    pub fn paint(&self, pixels: &mut [u32]) {
        let (width, height) = self.session.film().size();
        if pixels.len() < width * height {
            return;
        }
        self.session.film().copy_to(pixels, width);
        let mut canvas = Canvas::new(pixels, width);
        if self.shows_figures {
            let (status, mode) = (self.session.status(), self.session.view_mode());
            let picked = self.picked.as_ref();
            overlay::paint_figures(&mut canvas, &status, mode, self.frame_time, picked);
        }
        if self.shows_panel {
            self.panel.paint(&mut canvas, self.panel_left());
        } else if self.shows_figures {
            overlay::paint_hint(&mut canvas, "tab: parameters   h: help");
        }
        if let Some(message) = &self.message {
            overlay::paint_message(&mut canvas, message);
        }
        if self.shows_help {
            overlay::paint_help(&mut canvas);
        }
    }

    fn panel_left(&self) -> i32 {
        self.session.film().size().0 as i32 - panel::WIDTH
    }

    fn is_over_panel(&self) -> bool {
        let (x, y) = self.pointer;
        self.shows_panel && x >= f64::from(self.panel_left()) && y < f64::from(self.panel.height())
    }

    fn move_pointer(&mut self, x: f64, y: f64) {
        let by = (x - self.pointer.0, y - self.pointer.1);
        self.pointer = (x, y);
        if self.panel.is_held() {
            let request = self.panel.drag_to(self.panel_left(), x);
            self.obey(request);
        } else if let Some(mut drag) = self.drag {
            let way = (x - drag.start.0).abs().max((y - drag.start.1).abs());
            drag.moved |= way > CLICK_RADIUS;
            self.drag = Some(drag);
            if drag.moved {
                self.drag_camera(drag.button, by);
            }
        }
    }

    fn press(&mut self, button: Button) {
        let (x, y) = self.pointer;
        if self.is_over_panel() {
            let request = self.panel.press(self.panel_left(), x, y);
            self.obey(request);
        } else {
            self.drag = Some(Drag { button, start: (x, y), moved: false });
        }
    }

    fn release(&mut self, button: Button) {
        self.panel.release();
        let drag = self.drag.take();
        if drag.is_some_and(|drag| !drag.moved && drag.button == button && button == Button::Left) {
            self.pick();
        }
    }

    fn scroll(&mut self, notches: f64) {
        if self.is_over_panel() {
            self.panel.scroll(notches);
        } else {
            self.dolly(notches);
        }
    }

    fn press_key(&mut self, key: Key) {
        match key {
            Key::Character('o') => self.shows_figures = !self.shows_figures,
            Key::Character('h') => self.shows_help = !self.shows_help,
            Key::Character('r') => self.reload(),
            Key::Character('i') => self.show_next_integrator(),
            Key::Character('f') => self.orbit_about_pointer(),
            Key::Character('c') => self.wishes.push(Wish::Print(self.camera_text())),
            Key::Character('+' | '=') => self.dolly(1.0),
            Key::Character('-') => self.dolly(-1.0),
            Key::Character(digit @ '1'..='9') => {
                let index = digit as usize - '1' as usize;
                let mode = ViewMode::ALL.get(index);
                mode.into_iter().for_each(|mode| self.session.set_view_mode(*mode));
            }
            // Flights are controlled by the keys that are down.
            Key::Character(_) | Key::Shift => {}
            Key::ArrowLeft => self.orbit([DEGREES_PER_STEP, 0.0]),
            Key::ArrowRight => self.orbit([-DEGREES_PER_STEP, 0.0]),
            Key::ArrowUp => self.orbit([0.0, DEGREES_PER_STEP]),
            Key::ArrowDown => self.orbit([0.0, -DEGREES_PER_STEP]),
            Key::Tab => self.shows_panel = !self.shows_panel,
            Key::Home => self.session.set_camera(self.session.scene_camera()),
            Key::F12 => self.wishes.push(Wish::Screenshot),
            Key::Escape => {
                self.message = None;
                self.shows_help = false;
                self.picked = None;
            }
        }
    }

    fn drag_camera(&mut self, button: Button, (dx, dy): (f64, f64)) {
        let is_pan = button == Button::Middle || self.keys.contains(&Key::Shift);
        let angles = [dx * DEGREES_PER_PIXEL, dy * DEGREES_PER_PIXEL];
        match button {
            Button::Left | Button::Middle if is_pan => self.pan(dx, dy),
            Button::Left | Button::Middle => self.orbit(angles),
            Button::Right => {
                let camera = camera_control::look(self.session.camera(), self.up, angles);
                self.session.set_camera(camera);
            }
        }
    }

    fn orbit(&mut self, angles: [f64; 2]) {
        let camera = camera_control::orbit(self.session.camera(), self.pivot, self.up, angles);
        self.session.set_camera(camera);
    }

    /// Moves the camera parallel to the image, so that the scene follows the pointer if the field of view is about 50
    /// degrees.
    fn pan(&mut self, dx: f64, dy: f64) {
        let camera = self.session.camera();
        let (width, height) = self.session.film().size();
        let scale = self.distance() / width.min(height).max(1) as f64;
        let moved = camera_control::fly(camera, [-dx * scale, dy * scale, 0.0]);
        self.move_pivot_with(moved);
    }

    fn dolly(&mut self, notches: f64) {
        let whole = notches.abs().round() as usize;
        let factor = std::iter::repeat_n(DOLLY_PER_NOTCH, whole.max(1)).product::<f64>();
        let factor = if notches < 0.0 { 1.0 / factor } else { factor };
        let camera = camera_control::dolly(self.session.camera(), self.pivot, factor);
        self.session.set_camera(camera);
    }

    fn fly(&mut self, time: Duration) {
        let way = self.flight();
        if way != [0.0; 3] {
            let haste = if self.keys.contains(&Key::Shift) { HASTE } else { 1.0 };
            let step = time.as_secs_f64() * FLIGHT_PER_SECOND * haste * self.distance();
            let moved = camera_control::fly(self.session.camera(), way.map(|x| x * step));
            self.move_pivot_with(moved);
        }
    }

    /// The direction of flight for the keys that are down: right, up, forward.
    fn flight(&self) -> Vector {
        let along = |forth: char, back: char| {
            let down = |letter| f64::from(self.keys.contains(&Key::Character(letter)));
            down(forth) - down(back)
        };
        [along('d', 'a'), along('e', 'q'), along('w', 's')]
    }

    fn move_pivot_with(&mut self, camera: Transform) {
        let (before, after) = (self.session.camera(), camera);
        let (before, after) = (camera_control::position(before), camera_control::position(after));
        self.pivot = [0, 1, 2].map(|axis: usize| self.pivot[axis] + after[axis] - before[axis]);
        self.session.set_camera(camera);
    }

    fn distance(&self) -> f64 {
        let position = camera_control::position(self.session.camera());
        camera_control::distance(position, self.pivot).max(1e-6)
    }

    fn pick(&mut self) {
        self.print_pixel();
        self.picked = self.picked_at_pointer();
        if let Some(picked) = &self.picked {
            let entity = picked.material.unwrap_or(picked.shape);
            self.select(Some(entity));
            let (_, height) = self.session.film().size();
            self.panel.show_selected(height as i32);
        }
    }

    /// Prints what shaders print for the pixel under the pointer.
    fn print_pixel(&mut self) {
        let (x, y) = self.pointer;
        if x < 0.0 || y < 0.0 {
            return;
        }
        let (x, y) = (x as usize, y as usize);
        match self.session.prints(x, y) {
            Ok(lines) if lines.is_empty() => {}
            Ok(lines) => {
                self.wishes.push(Wish::Print(format!("pixel {x},{y}:")));
                self.wishes.extend(lines.into_iter().map(Wish::Print));
            }
            Err(problem) => self.message = Some(problem.to_text(false)),
        }
    }

    fn orbit_about_pointer(&mut self) {
        if let Some(picked) = self.picked_at_pointer() {
            self.pivot = picked.position;
        }
    }

    fn picked_at_pointer(&self) -> Option<Picked> {
        let (x, y) = self.pointer;
        (x >= 0.0 && y >= 0.0).then(|| self.session.pick(x as usize, y as usize))?
    }

    fn select(&mut self, entity: Option<EntityId>) {
        let controls = entity.map_or_else(Vec::new, |entity| self.session.controls(entity));
        self.panel.select(entity, controls);
    }

    fn obey(&mut self, request: Option<Request>) {
        match request {
            Some(Request::Select(entity)) => self.select(Some(entity)),
            Some(Request::Set { name, values }) => {
                let Some(entity) = self.panel.selected() else { return };
                match self.session.set_control(entity, &name, &values) {
                    Ok(()) => self.message = None,
                    Err(messages) => {
                        self.message = Some(messages.to_text(false));
                        self.panel.controls = self.session.controls(entity);
                    }
                }
            }
            None => {}
        }
    }

    fn reload(&mut self) {
        let reloaded = self.session.reload();
        self.adopt(reloaded);
    }

    fn show_next_integrator(&mut self) {
        let names = self.session.integrators();
        let is_shown = |name: &String| name.eq_ignore_ascii_case(self.session.integrator());
        let next = names.iter().position(is_shown).map_or(0, |shown| (shown + 1) % names.len());
        let changed = self.session.set_integrator(&names[next]);
        self.adopt(changed);
    }

    /// Shows the result of reading the scene again.
    fn adopt(&mut self, reloaded: Result<Reloaded, Messages>) {
        match reloaded {
            Ok(reloaded) => {
                let warnings = reloaded.warnings.to_text(false);
                self.message = (!warnings.is_empty()).then_some(warnings);
                if reloaded.changed {
                    self.picked = None;
                    self.panel.things = self.session.things();
                    let known = |entity: &EntityId| {
                        self.panel.things.iter().any(|thing| thing.entity == *entity)
                    };
                    self.select(self.panel.selected().filter(known));
                }
            }
            Err(messages) => self.message = Some(messages.to_text(false)),
        }
    }

    /// The camera as a line of a scene file.
    fn camera_text(&self) -> String {
        let camera = self.session.camera();
        let [from, up] = [camera_control::position(camera), camera_control::above(camera)];
        let ahead = camera_control::forward(camera);
        let to = [0, 1, 2].map(|axis: usize| from[axis] + ahead[axis] * self.distance());
        let mirror = if camera.swaps_handedness() { "Scale -1 1 1   " } else { "" };
        let triple = |[x, y, z]: Vector| format!("{x:.5} {y:.5} {z:.5}");
        format!("{mirror}LookAt {}   {}   {}", triple(from), triple(to), triple(up))
    }
}

#[cfg(test)]
#[path = "app_tests.rs"]
mod tests;
