//! The viewer without a window: events in, pixels out.

use rtsl_render::session::SessionOptions;
use tempfile::TempDir;

use super::*;

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
void shade() { rt_SampleColor = color(size, 0.25, 0.25); }";

/// A viewer of a scene in a temporary folder, which is removed at the end.
struct Viewer {
    folder: TempDir,
    app: App,
}

impl Viewer {
    fn new(name: &str) -> Viewer {
        let folder = tempfile::Builder::new().prefix(name).tempdir().unwrap();
        std::fs::write(folder.path().join("scene.pbrt"), SCENE).unwrap();
        std::fs::write(folder.path().join("dots.rtsl"), DOTS).unwrap();
        let opened = Session::open(&folder.path().join("scene.pbrt"), SessionOptions::default());
        let (session, _) = opened.unwrap_or_else(|it| panic!("{}", it.to_text(false)));
        let mut app = App::new(session);
        // It would cover the image.
        app.shows_panel = false;
        Viewer { folder, app }
    }

    fn events(&mut self, events: impl IntoIterator<Item = Event>) {
        events.into_iter().for_each(|event| self.app.handle(event));
    }

    fn drag(&mut self, button: Button, from: (f64, f64), to: (f64, f64)) {
        let moved = |(x, y)| Event::PointerMoved { x, y };
        self.events([
            moved(from),
            Event::ButtonPressed(button),
            moved(to),
            Event::ButtonReleased(button),
        ]);
    }

    fn press(&mut self, key: Key) {
        self.events([Event::KeyPressed(key), Event::KeyReleased(key)]);
    }

    /// The pixels after all samples are taken.
    fn pixels(&mut self) -> Vec<u32> {
        while self.app.is_busy() {
            self.app.advance(Duration::from_millis(20));
        }
        let (width, height) = self.app.session().film().size();
        let mut pixels = vec![0; width * height];
        self.app.paint(&mut pixels);
        pixels
    }

    /// The pixels of the image alone.
    fn image(&mut self) -> Vec<u32> {
        let mut pixels = self.pixels();
        self.app.session().film().copy_to(&mut pixels, 320);
        pixels
    }

    fn position(&self) -> Vector {
        camera_control::position(self.app.session().camera())
    }
}

/// The position of the ball.
const BALL: (f64, f64) = (160.0, 40.0);
const BALL_PIXEL: usize = 40 * 320 + 160;

#[test]
fn drags_orbit_pan_and_look() {
    let mut viewer = Viewer::new("drags");
    let (start, first) = (viewer.position(), viewer.image());
    viewer.drag(Button::Left, (150.0, 75.0), (190.0, 75.0));
    let orbited = viewer.position();
    assert_ne!(start, orbited);
    let pivot = viewer.app.pivot;
    let [before, after] = [start, orbited].map(|it| camera_control::distance(it, pivot));
    assert!((before - after).abs() < 1e-6, "an orbit keeps its distance");
    assert_ne!(viewer.image(), first);
    viewer.drag(Button::Middle, (150.0, 75.0), (150.0, 95.0));
    assert_ne!(viewer.position(), orbited);
    assert_ne!(viewer.app.pivot, pivot, "a pan takes the pivot along");
    let panned = viewer.position();
    viewer.drag(Button::Right, (150.0, 75.0), (180.0, 75.0));
    assert_eq!(viewer.position(), panned, "who looks around stays");
    viewer.press(Key::Home);
    assert_eq!(viewer.image(), first);
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
        viewer.press(Key::Character('i'));
        assert_eq!(viewer.app.session().integrator(), name);
        if name == "Normals" {
            assert_ne!(viewer.image(), first);
        }
    }
    viewer.press(Key::Character('i'));
    assert_eq!(viewer.app.session().integrator(), "interactive", "after the last comes the first");
    assert_eq!(viewer.image(), first);
}

#[test]
fn the_wheel_and_keys_dolly() {
    let mut viewer = Viewer::new("wheel");
    let pivot = viewer.app.pivot;
    let distance = |viewer: &Viewer| camera_control::distance(viewer.position(), pivot);
    let start = distance(&viewer);
    viewer.events([Event::PointerMoved { x: 100.0, y: 100.0 }, Event::Scrolled(2.0)]);
    assert!((distance(&viewer) - start * DOLLY_PER_NOTCH * DOLLY_PER_NOTCH).abs() < 1e-6);
    viewer.press(Key::Character('-'));
    viewer.press(Key::Character('-'));
    assert!((distance(&viewer) - start).abs() < 1e-6);
}

#[test]
fn letters_fly_while_they_are_down() {
    let mut viewer = Viewer::new("fly");
    viewer.pixels();
    let start = viewer.position();
    viewer.events([Event::KeyPressed(Key::Character('w'))]);
    assert!(viewer.app.is_busy(), "it flies");
    for _ in 0..3 {
        std::thread::sleep(Duration::from_millis(2));
        viewer.app.advance(Duration::from_millis(5));
    }
    assert!(viewer.position()[2] > start[2], "forward");
    viewer.events([Event::FocusLost]);
    viewer.pixels();
    assert!(!viewer.app.is_busy());
}

#[test]
fn a_click_names_the_object_and_selects_its_material() {
    let mut viewer = Viewer::new("click");
    viewer.drag(Button::Left, BALL, BALL);
    let picked = viewer.app.picked().expect("the ball");
    assert_eq!((picked.title.as_str(), picked.class.as_str()), ("ball", "Sphere"));
    assert_eq!(picked.material_class, "Dots");
    assert_eq!(viewer.app.panel.selected(), picked.material);
    assert_eq!(viewer.app.panel.controls[0].label, "Size");
    viewer.drag(Button::Left, (10.0, 10.0), (10.0, 10.0));
    assert_eq!(viewer.app.picked(), None, "the sky");
}

/// The value of a parameter that was set, and the picture from a camera that has moved.
#[test]
fn a_click_prints_what_shaders_print_for_the_pixel() {
    let mut viewer = Viewer::new("prints");
    viewer.drag(Button::Left, BALL, BALL);
    assert_eq!(viewer.app.take_wishes(), [], "no shader prints");
    let dots = "class Dots : rt_Material;
[[label \"Size\", min 0, max 1]] public float size = 0.25;
void shade() {
    print(\"size {}, near {}\", size, length(rt_HitPoint - rt_RayOrigin) < 4.0);
    rt_SampleColor = color(size, 0.25, 0.25);
}";
    std::fs::write(viewer.folder.path().join("dots.rtsl"), dots).unwrap();
    viewer.events([Event::KeyPressed(Key::Character('r'))]);
    viewer.drag(Button::Left, BALL, BALL);
    let printed = |viewer: &mut Viewer| -> Vec<String> {
        let wishes = viewer.app.take_wishes().into_iter();
        let lines = wishes.map(|wish| match wish {
            Wish::Print(line) => line,
            Wish::Screenshot => panic!("no screenshot is asked for"),
        });
        lines.collect()
    };
    let (x, y) = BALL;
    let lines = printed(&mut viewer);
    assert_eq!(lines[0], format!("pixel {x},{y}:"));
    assert!(lines[1].ends_with("dots.rtsl:4: Dots.shade: size 0.5, near false"), "{lines:?}");
    let material = viewer.app.picked().unwrap().material.unwrap();
    viewer.app.session.set_control(material, "size", &[0.75]).unwrap();
    for _ in 0..20 {
        viewer.events([Event::KeyPressed(Key::Character('+'))]);
    }
    viewer.drag(Button::Left, BALL, BALL);
    let lines = printed(&mut viewer);
    assert!(lines[1].ends_with("dots.rtsl:4: Dots.shade: size 0.75, near true"), "{lines:?}");
    // The sky.
    viewer.events([Event::KeyPressed(Key::Home)]);
    viewer.drag(Button::Left, (10.0, 10.0), (10.0, 10.0));
    assert_eq!(printed(&mut viewer), [""; 0]);
}

#[test]
fn a_slider_changes_the_picture() {
    let mut viewer = Viewer::new("slider");
    viewer.drag(Button::Left, BALL, BALL);
    let before = viewer.image();
    viewer.press(Key::Tab);
    viewer.events([Event::PointerMoved { x: 300.0, y: 10.0 }, Event::Scrolled(99.0)]);
    let row = viewer.app.panel.things.iter().position(|it| it.title == "dotted").unwrap() + 1;
    let y = (row * 19 + 9) as f64;
    let track = f64::from(320 - panel::WIDTH + 116);
    viewer.drag(Button::Left, (track + 55.0, y), (track + 110.0, y));
    assert_eq!(viewer.app.panel.controls[0].values, [1.0]);
    let after = viewer.image();
    assert_eq!((before[BALL_PIXEL], after[BALL_PIXEL]), (0x00BC_8989, 0x00FF_8989));
    assert_eq!(viewer.position(), [0.0, 2.0, -6.0], "the camera stays");
}

#[test]
fn a_saved_shader_changes_the_picture_or_its_fault_is_shown() {
    let mut viewer = Viewer::new("saved");
    let (first, painted) = (viewer.image(), viewer.pixels());
    let shader = viewer.folder.path().join("dots.rtsl");
    std::fs::write(&shader, DOTS.replace("color(size", "colour(size")).unwrap();
    viewer.events([Event::FilesChanged]);
    let message = viewer.app.message().expect("a diagnostic");
    assert!(message.contains("dots.rtsl:3"), "{message}");
    assert_ne!(viewer.pixels(), painted, "the message is shown");
    assert_eq!(viewer.image(), first, "the old picture stays");
    std::fs::write(&shader, DOTS.replace("0.25)", "1.0)")).unwrap();
    viewer.events([Event::FilesChanged]);
    assert_eq!(viewer.app.message(), None);
    assert_eq!(viewer.image()[BALL_PIXEL], 0x00BC_89FF);
}

#[test]
fn a_shader_that_never_ends_is_told() {
    let mut viewer = Viewer::new("endless");
    let first = viewer.image();
    let endless = "float x = size; while (x > 0.0) x += 1.0; rt_SampleColor = color(x,";
    let text = DOTS.replace("rt_SampleColor = color(size,", endless);
    std::fs::write(viewer.folder.path().join("dots.rtsl"), text).unwrap();
    viewer.events([Event::FilesChanged]);
    let after = viewer.image();
    let message = viewer.app.message().expect("it ran past its budget");
    assert!(message.contains("`shade` of `Dots` ran for more than"), "{message}");
    assert_eq!(after, first, "the old picture stays");
}

#[test]
fn keys_show_and_hide() {
    let mut viewer = Viewer::new("keys");
    let with_figures = viewer.pixels();
    viewer.press(Key::Tab);
    assert_ne!(viewer.pixels(), with_figures, "the panel");
    viewer.press(Key::Tab);
    viewer.press(Key::Character('h'));
    assert_ne!(viewer.pixels(), with_figures, "help");
    viewer.press(Key::Escape);
    viewer.press(Key::Character('o'));
    assert_eq!(viewer.pixels(), viewer.image());
    viewer.press(Key::Character('2'));
    assert_eq!(viewer.app.session().view_mode(), ViewMode::Time);
    viewer.press(Key::Character('4'));
    assert_eq!(viewer.app.session().view_mode(), ViewMode::Lanes);
    viewer.press(Key::F12);
    viewer.press(Key::Character('c'));
    let wishes = viewer.app.take_wishes();
    assert_eq!(wishes[0], Wish::Screenshot);
    let Wish::Print(text) = &wishes[1] else { panic!("{wishes:?}") };
    assert!(text.starts_with("LookAt 0.00000 2.00000 -6.00000   "), "{text}");
}

#[test]
fn a_window_of_another_size_has_as_many_pixels() {
    let mut viewer = Viewer::new("resize");
    viewer.events([Event::Resized { width: 123, height: 77 }]);
    assert_eq!(viewer.pixels().len(), 123 * 77);
    viewer.events([Event::Resized { width: 0, height: 0 }]);
    assert_eq!(viewer.pixels().len(), 123 * 77, "a window that is hidden");
}
