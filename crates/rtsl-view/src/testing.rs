//! A viewer of a scene in a temporary folder, without a window: input in, pixels out.

use std::time::{Duration, Instant};

use egui::{Event, Key, Modifiers, PointerButton, Pos2, RawInput, Rect, pos2, vec2};
use rtsl_render::session::{Session, SessionOptions};
use tempfile::TempDir;

use crate::app::{App, Start};
use crate::camera_control::{self, Vector};
use crate::layout;

const SCENE: &str = r#"
LookAt 0 2 -6   0 0.5 0   0 1 0
Camera "Pinhole" "float fov" 40
Film "rgb" "integer xresolution" 320 "integer yresolution" 100
Sampler "stratified" "integer pixelsamples" 1
WorldBegin
LightSource "PointLight" "point3 position" [4 8 -4] "rgb intensity" [60 60 60] "string name" "lamp"
MakeNamedMaterial "gray" "string type" "Lambertian" "rgb kd" [0.5 0.5 0.5]
NamedMaterial "gray"
Shape "Plane"
MakeNamedMaterial "dotted" "string type" "Dots" "float size" 0.5
NamedMaterial "dotted"
Translate 0 1 0
Shape "Sphere" "float radius" 1 "string name" "ball"
"#;

/// The shader of the ball.
pub const DOTS: &str = "class Dots : rt_Material;
[[label \"Size\", min 0, max 1]] public float size = 0.25;
public bool bright = false;
void shade() { rt_SampleColor = color(size, 0.25, bright ? 1.0 : 0.25); }";

/// The top of the picture.
pub const TOP: usize = layout::TOOLBAR as usize;
/// The position of the ball in the window, and its pixel of the picture.
pub const BALL: (f32, f32) = (160.0, 70.0);
pub const BALL_PIXEL: usize = 40 * 320 + 160;

/// A viewer of a scene in a temporary folder, which is removed at the end.
pub struct Viewer {
    pub folder: TempDir,
    pub app: App,
    pub size: (usize, usize),
    pub modifiers: Modifiers,
    platform: egui::PlatformOutput,
}

impl Viewer {
    /// A viewer whose picture has the size of the scene's.
    pub fn new(name: &str) -> Viewer {
        Viewer::with(name, (320, 100 + TOP))
    }

    /// A viewer with a window of this size.
    pub fn with(name: &str, size: (usize, usize)) -> Viewer {
        Viewer::start(name, size, DOTS, |_| Start::default())
    }

    /// A viewer of this shader, that starts as `start` says for the folder.
    pub fn start(
        name: &str,
        size: (usize, usize),
        dots: &str,
        start: impl FnOnce(&std::path::Path) -> Start,
    ) -> Viewer {
        let folder = tempfile::Builder::new().prefix(name).tempdir().unwrap();
        std::fs::write(folder.path().join("scene.pbrt"), SCENE).unwrap();
        std::fs::write(folder.path().join("dots.rtsl"), dots).unwrap();
        let opened = Session::open(&folder.path().join("scene.pbrt"), SessionOptions::default());
        let (session, _) = opened.unwrap_or_else(|it| panic!("{}", it.to_text(false)));
        let app = App::new(session, &start(folder.path()));
        app.context().enable_accesskit();
        let (modifiers, platform) = (Modifiers::NONE, egui::PlatformOutput::default());
        let mut viewer = Viewer { folder, app, size, modifiers, platform };
        viewer.events([]);
        viewer
    }

    /// A frame with these events.
    pub fn events(&mut self, events: impl IntoIterator<Item = Event>) {
        let (width, height) = self.size;
        let screen = Rect::from_min_size(Pos2::ZERO, vec2(width as f32, height as f32));
        let events = events.into_iter().collect();
        let input = RawInput { screen_rect: Some(screen), events, ..RawInput::default() };
        self.platform = self.app.frame(input, self.size).platform;
    }

    pub fn button(&self, button: PointerButton, (x, y): (f32, f32), pressed: bool) -> Event {
        Event::PointerButton { pos: pos2(x, y), button, pressed, modifiers: self.modifiers }
    }

    pub fn drag(&mut self, button: PointerButton, from: (f32, f32), to: (f32, f32)) {
        self.events([Event::PointerMoved(from.into())]);
        self.events([self.button(button, from, true)]);
        if from != to {
            self.events([Event::PointerMoved(to.into())]);
        }
        self.events([self.button(button, to, false)]);
    }

    pub fn click(&mut self, at: (f32, f32)) {
        self.drag(PointerButton::Primary, at, at);
        self.events([]);
    }

    /// Clicks on the control with this name.
    pub fn click_on(&mut self, name: &str) {
        let at = self.place_of(name).center();
        self.click((at.x, at.y));
    }

    /// The rectangle of the control with this name.
    pub fn place_of(&self, name: &str) -> Rect {
        let update = self.platform.accesskit_update.as_ref().expect("it is asked for");
        let named = |node: &egui::accesskit::Node| {
            let number = node.numeric_value().filter(|_| node.role() == egui::Role::Slider);
            let number = number.map(|number| number.to_string());
            [node.label(), node.value(), number.as_deref()].contains(&Some(name))
        };
        let found = update.nodes.iter().find(|(_, node)| named(node));
        let bounds = found.and_then(|(_, node)| node.bounds());
        let bounds = bounds.unwrap_or_else(|| {
            let names = update.nodes.iter().filter_map(|(_, node)| node.label());
            panic!("there is no `{name}` among {:?}", names.collect::<Vec<_>>())
        });
        let corner = |x: f64, y: f64| pos2(x as f32, y as f32);
        Rect::from_min_max(corner(bounds.x0, bounds.y0), corner(bounds.x1, bounds.y1))
    }

    pub fn key(&self, key: Key, pressed: bool) -> Event {
        let modifiers = self.modifiers;
        Event::Key { key, physical_key: None, pressed, repeat: false, modifiers }
    }

    pub fn press(&mut self, key: Key) {
        self.events([self.key(key, true), self.key(key, false)]);
        self.events([]);
    }

    /// Types a text into the control that has the focus.
    pub fn type_text(&mut self, text: &str) {
        self.events([Event::Text(text.to_owned())]);
        self.events([]);
    }

    /// Presses a key with the command key of the system.
    pub fn command(&mut self, key: Key) {
        self.modifiers = Modifiers { ctrl: true, command: true, ..Modifiers::NONE };
        self.press(key);
        self.modifiers = Modifiers::NONE;
    }

    /// Shows frames until no thread finds anything out any more.
    pub fn settle(&mut self) {
        let start = Instant::now();
        self.events([]);
        while self.app.is_waiting() {
            assert!(start.elapsed() < Duration::from_secs(60), "threads take too long");
            std::thread::sleep(Duration::from_millis(5));
            self.events([]);
        }
        self.events([]);
    }

    /// True if a control, or a text, has this name.
    pub fn shows(&self, text: &str) -> bool {
        self.names().iter().any(|name| name.contains(text))
    }

    /// The names and texts of all controls.
    pub fn names(&self) -> Vec<String> {
        let update = self.platform.accesskit_update.as_ref().expect("it is asked for");
        let named = |node: &egui::accesskit::Node| {
            [node.label(), node.value()]
                .into_iter()
                .flatten()
                .map(str::to_owned)
                .collect::<Vec<_>>()
        };
        update.nodes.iter().flat_map(|(_, node)| named(node)).collect()
    }

    /// Writes a picture of the window, for people to look at: if `RTSL_VIEW_PICTURES` names a folder.
    pub fn picture(&mut self, name: &str) {
        let Some(folder) = std::env::var_os("RTSL_VIEW_PICTURES") else { return };
        let pixels = self.pixels();
        let path = std::path::Path::new(&folder).join(name).with_extension("png");
        rtsl_image::write_pixels(&pixels, self.size.0, &path).unwrap();
    }

    /// The pixels after all samples are taken.
    pub fn pixels(&mut self) -> Vec<u32> {
        while self.app.is_busy() {
            self.app.advance(Duration::from_millis(20));
        }
        // What is new is measured by one frame, and shown by the next.
        self.events([]);
        self.events([]);
        let (width, height) = self.size;
        let mut pixels = vec![0; width * height];
        self.app.paint(&mut pixels);
        pixels
    }

    /// The pixels of the image alone.
    pub fn image(&mut self) -> Vec<u32> {
        self.pixels();
        let (width, height) = self.app.session().film().size();
        let mut pixels = vec![0; width * height];
        self.app.session().film().copy_to(&mut pixels, width);
        pixels
    }

    pub fn position(&self) -> Vector {
        camera_control::position(self.app.session().camera())
    }
}
