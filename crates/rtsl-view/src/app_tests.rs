//! The viewer without a window: input in, pixels out.

use egui::{Event, Modifiers, pos2, vec2};
use rtsl_render::session::SessionOptions;
use tempfile::TempDir;

use super::*;
use crate::camera_control::{self, Vector};
use crate::navigation::DOLLY_PER_NOTCH;

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

const DOTS: &str = "class Dots : rt_Material;
[[label \"Size\", min 0, max 1]] public float size = 0.25;
public bool bright = false;
void shade() { rt_SampleColor = color(size, 0.25, bright ? 1.0 : 0.25); }";

/// The top of the picture.
const TOP: usize = layout::TOOLBAR as usize;
/// The position of the ball in the window, and its pixel of the picture.
const BALL: (f32, f32) = (160.0, 70.0);
const BALL_PIXEL: usize = 40 * 320 + 160;

/// A viewer of a scene in a temporary folder, which is removed at the end.
struct Viewer {
    folder: TempDir,
    app: App,
    size: (usize, usize),
    modifiers: Modifiers,
    platform: egui::PlatformOutput,
}

impl Viewer {
    /// A viewer whose picture has the size of the scene's.
    fn new(name: &str) -> Viewer {
        Viewer::with(name, (320, 100 + TOP))
    }

    fn with(name: &str, size: (usize, usize)) -> Viewer {
        let folder = tempfile::Builder::new().prefix(name).tempdir().unwrap();
        std::fs::write(folder.path().join("scene.pbrt"), SCENE).unwrap();
        std::fs::write(folder.path().join("dots.rtsl"), DOTS).unwrap();
        let opened = Session::open(&folder.path().join("scene.pbrt"), SessionOptions::default());
        let (session, _) = opened.unwrap_or_else(|it| panic!("{}", it.to_text(false)));
        let app = App::new(session);
        app.context().enable_accesskit();
        let (modifiers, platform) = (Modifiers::NONE, egui::PlatformOutput::default());
        let mut viewer = Viewer { folder, app, size, modifiers, platform };
        viewer.events([]);
        viewer
    }

    /// A frame with these events.
    fn events(&mut self, events: impl IntoIterator<Item = Event>) {
        let (width, height) = self.size;
        let screen = Rect::from_min_size(Pos2::ZERO, vec2(width as f32, height as f32));
        let events = events.into_iter().collect();
        let input = RawInput { screen_rect: Some(screen), events, ..RawInput::default() };
        self.platform = self.app.frame(input, self.size).platform;
    }

    fn button(&self, button: PointerButton, (x, y): (f32, f32), pressed: bool) -> Event {
        Event::PointerButton { pos: pos2(x, y), button, pressed, modifiers: self.modifiers }
    }

    fn drag(&mut self, button: PointerButton, from: (f32, f32), to: (f32, f32)) {
        self.events([Event::PointerMoved(from.into())]);
        self.events([self.button(button, from, true)]);
        if from != to {
            self.events([Event::PointerMoved(to.into())]);
        }
        self.events([self.button(button, to, false)]);
    }

    fn click(&mut self, at: (f32, f32)) {
        self.drag(PointerButton::Primary, at, at);
        self.events([]);
    }

    /// Clicks on the control with this name.
    fn click_on(&mut self, name: &str) {
        let at = self.place_of(name).center();
        self.click((at.x, at.y));
    }

    /// The rectangle of the control with this name.
    fn place_of(&self, name: &str) -> Rect {
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

    fn key(&self, key: Key, pressed: bool) -> Event {
        let modifiers = self.modifiers;
        Event::Key { key, physical_key: None, pressed, repeat: false, modifiers }
    }

    fn press(&mut self, key: Key) {
        self.events([self.key(key, true), self.key(key, false)]);
        self.events([]);
    }

    /// The pixels after all samples are taken.
    fn pixels(&mut self) -> Vec<u32> {
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
    fn image(&mut self) -> Vec<u32> {
        self.pixels();
        let (width, height) = self.app.session().film().size();
        let mut pixels = vec![0; width * height];
        self.app.session().film().copy_to(&mut pixels, width);
        pixels
    }

    fn position(&self) -> Vector {
        camera_control::position(self.app.session().camera())
    }
}

#[test]
fn drags_orbit_pan_and_look() {
    let mut viewer = Viewer::new("drags");
    let (start, first) = (viewer.position(), viewer.image());
    viewer.drag(PointerButton::Primary, (150.0, 105.0), (190.0, 105.0));
    let orbited = viewer.position();
    assert_ne!(start, orbited);
    let pivot = viewer.app.navigation.pivot;
    let [before, after] = [start, orbited].map(|it| camera_control::distance(it, pivot));
    assert!((before - after).abs() < 1e-6, "an orbit keeps its distance");
    assert!(viewer.image() != first);
    viewer.drag(PointerButton::Middle, (150.0, 105.0), (150.0, 125.0));
    assert_ne!(viewer.position(), orbited);
    assert_ne!(viewer.app.navigation.pivot, pivot, "a pan takes the pivot along");
    let panned = viewer.position();
    viewer.drag(PointerButton::Secondary, (150.0, 105.0), (180.0, 105.0));
    assert_eq!(viewer.position(), panned, "who looks around stays");
    viewer.press(Key::Home);
    assert!(viewer.image() == first);
}

#[test]
fn a_key_shows_the_next_integrator() {
    let mut viewer = Viewer::new("integrators");
    let integrators = viewer.app.session().integrators();
    assert_eq!(
        (integrators[0].as_str(), viewer.app.session().integrator()),
        ("interactive", "interactive")
    );
    let first = viewer.image();
    for name in &integrators[1..] {
        viewer.press(Key::I);
        assert_eq!(viewer.app.session().integrator(), name);
        if name == "Normals" {
            assert!(viewer.image() != first);
        }
    }
    viewer.press(Key::I);
    assert_eq!(viewer.app.session().integrator(), "interactive", "after the last comes the first");
    assert!(viewer.image() == first);
}

#[test]
fn the_wheel_and_keys_dolly() {
    let mut viewer = Viewer::new("wheel");
    let pivot = viewer.app.navigation.pivot;
    let distance = |viewer: &Viewer| camera_control::distance(viewer.position(), pivot);
    let start = distance(&viewer);
    viewer.events([Event::PointerMoved(pos2(100.0, 100.0))]);
    viewer.events([Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: vec2(0.0, 2.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Wheel,
        modifiers: Modifiers::NONE,
    }]);
    assert!((distance(&viewer) - start * DOLLY_PER_NOTCH * DOLLY_PER_NOTCH).abs() < 1e-6);
    viewer.press(Key::Minus);
    viewer.press(Key::Minus);
    assert!((distance(&viewer) - start).abs() < 1e-6);
}

#[test]
fn letters_fly_while_they_are_down() {
    let mut viewer = Viewer::new("fly");
    viewer.pixels();
    let start = viewer.position();
    viewer.events([viewer.key(Key::W, true)]);
    assert!(viewer.app.is_busy(), "it flies");
    for _ in 0..3 {
        std::thread::sleep(Duration::from_millis(2));
        viewer.app.advance(Duration::from_millis(5));
    }
    assert!(viewer.position()[2] > start[2], "forward");
    viewer.events([Event::WindowFocused(false)]);
    viewer.pixels();
    assert!(!viewer.app.is_busy());
}

#[test]
fn a_click_names_the_object_and_selects_its_material() {
    let mut viewer = Viewer::new("click");
    viewer.click(BALL);
    let picked = viewer.app.picked().expect("the ball");
    assert_eq!((picked.title.as_str(), picked.class.as_str()), ("ball", "Sphere"));
    assert_eq!(picked.material_class, "Dots");
    assert_eq!(viewer.app.parameters.selected(), picked.material);
    assert_eq!(viewer.app.parameters.controls[0].label, "Size");
    viewer.click((10.0, 40.0));
    assert_eq!(viewer.app.picked(), None, "the sky");
}

/// The value of a parameter that was set, and the picture from a camera that has moved.
#[test]
fn a_click_prints_what_shaders_print_for_the_pixel() {
    let mut viewer = Viewer::new("prints");
    viewer.click(BALL);
    assert_eq!(viewer.app.take_wishes(), [], "no shader prints");
    let dots = "class Dots : rt_Material;
[[label \"Size\", min 0, max 1]] public float size = 0.25;
void shade() {
    print(\"size {}, near {}\", size, length(rt_HitPoint - rt_RayOrigin) < 4.0);
    rt_SampleColor = color(size, 0.25, 0.25);
}";
    std::fs::write(viewer.folder.path().join("dots.rtsl"), dots).unwrap();
    viewer.press(Key::R);
    viewer.click(BALL);
    let printed = |viewer: &mut Viewer| -> Vec<String> {
        let wishes = viewer.app.take_wishes().into_iter();
        let lines = wishes.map(|wish| match wish {
            Wish::Print(line) => line,
            Wish::Screenshot => panic!("no screenshot is asked for"),
        });
        lines.collect()
    };
    let lines = printed(&mut viewer);
    assert_eq!(lines[0], "pixel 160,40:");
    assert!(lines[1].ends_with("dots.rtsl:4: Dots.shade: size 0.5, near false"), "{lines:?}");
    let material = viewer.app.picked().unwrap().material.unwrap();
    viewer.app.session.set_control(material, "size", &[0.75]).unwrap();
    for _ in 0..20 {
        viewer.press(Key::Plus);
    }
    viewer.click(BALL);
    let lines = printed(&mut viewer);
    assert!(lines[1].ends_with("dots.rtsl:4: Dots.shade: size 0.75, near true"), "{lines:?}");
    // The sky.
    viewer.press(Key::Home);
    viewer.click((10.0, 40.0));
    assert_eq!(printed(&mut viewer), [""; 0]);
}

#[test]
fn controls_of_the_picked_material_change_the_picture() {
    let mut viewer = Viewer::with("slider", (320 + layout::SIDE as usize, 100 + TOP));
    viewer.press(Key::Tab);
    assert_eq!(viewer.app.session().film().size(), (320, 100), "the pane is beside the picture");
    viewer.click(BALL);
    viewer.events([]);
    let before = viewer.image();
    let slider = viewer.place_of("0.5");
    let (middle, y) = (slider.center().x, slider.center().y);
    viewer.drag(PointerButton::Primary, (middle, y), (slider.right() + 60.0, y));
    assert_eq!(viewer.app.parameters.controls[0].values, [1.0]);
    let after = viewer.image();
    assert_eq!((before[BALL_PIXEL], after[BALL_PIXEL]), (0x00BC_8989, 0x00FF_8989));
    assert_eq!(viewer.position(), [0.0, 2.0, -6.0], "the camera stays");
    let label = viewer.place_of("bright");
    viewer.click((label.left() + 107.0, label.center().y));
    assert_eq!(viewer.image()[BALL_PIXEL], 0x00FF_89FF);
}

#[test]
fn a_saved_shader_changes_the_picture_or_its_fault_is_shown() {
    let mut viewer = Viewer::new("saved");
    let (first, painted) = (viewer.image(), viewer.pixels());
    let shader = viewer.folder.path().join("dots.rtsl");
    std::fs::write(&shader, DOTS.replace("color(size", "colour(size")).unwrap();
    viewer.app.files_changed();
    let message = viewer.app.message().expect("a diagnostic");
    assert!(message.contains("dots.rtsl:4"), "{message}");
    assert!(viewer.pixels() != painted, "the message is shown");
    assert!(viewer.image() == first, "the old picture stays");
    std::fs::write(&shader, DOTS.replace("0.25, bright", "1.0, bright")).unwrap();
    viewer.app.files_changed();
    assert_eq!(viewer.app.message(), None);
    assert_eq!(viewer.image()[BALL_PIXEL], 0x00BC_FF89);
}

#[test]
fn a_shader_that_never_ends_is_told() {
    let mut viewer = Viewer::new("endless");
    let first = viewer.image();
    let endless = "float x = size; while (x > 0.0) x += 1.0; rt_SampleColor = color(x,";
    let text = DOTS.replace("rt_SampleColor = color(size,", endless);
    std::fs::write(viewer.folder.path().join("dots.rtsl"), text).unwrap();
    viewer.app.files_changed();
    let after = viewer.image();
    let message = viewer.app.message().expect("it ran past its budget");
    assert!(message.contains("`shade` of `Dots` ran for more than"), "{message}");
    assert!(after == first, "the old picture stays");
}

#[test]
fn keys_show_and_hide() {
    let mut viewer = Viewer::new("keys");
    let with_figures = viewer.pixels();
    viewer.press(Key::H);
    assert!(viewer.pixels() != with_figures, "help");
    viewer.press(Key::Escape);
    viewer.press(Key::O);
    let image = viewer.image();
    assert!(viewer.pixels()[320 * TOP..] == image, "the picture is below the toolbar");
    viewer.press(Key::Num2);
    assert_eq!(viewer.app.session().view_mode(), ViewMode::Time);
    viewer.press(Key::Num4);
    assert_eq!(viewer.app.session().view_mode(), ViewMode::Lanes);
    viewer.press(Key::F12);
    viewer.press(Key::C);
    let wishes = viewer.app.take_wishes();
    assert_eq!(wishes[0], Wish::Screenshot);
    let Wish::Print(text) = &wishes[1] else { panic!("{wishes:?}") };
    assert!(text.starts_with("LookAt 0.00000 2.00000 -6.00000   "), "{text}");
}

#[test]
fn a_window_of_another_size_has_as_many_pixels() {
    let mut viewer = Viewer::new("resize");
    viewer.size = (123, 77);
    viewer.events([]);
    assert_eq!(viewer.app.session().film().size(), (123, 77 - TOP));
    assert_eq!(viewer.pixels().len(), 123 * 77);
    // A window that is hidden.
    viewer.size = (0, 0);
    viewer.events([]);
    assert_eq!(viewer.app.session().film().size(), (123, 77 - TOP));
}

/// A frame without changes draws nothing again, and none is due.
#[test]
fn a_viewer_that_rests_costs_nothing() {
    let mut viewer = Viewer::new("rest");
    viewer.pixels();
    viewer.events([]);
    let screen = Rect::from_min_size(Pos2::ZERO, vec2(320.0, (100 + TOP) as f32));
    let input = RawInput { screen_rect: Some(screen), ..RawInput::default() };
    let shown = viewer.app.frame(input, viewer.size);
    assert_eq!(shown.repaint_after, Duration::MAX);
    assert!(!viewer.app.is_busy());
}
