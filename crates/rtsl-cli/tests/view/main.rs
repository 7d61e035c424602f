//! `rtsl view` under a virtual display: keys are pressed, the pointer drags, a shader is edited, and
//! the window's pixels are read back from the X server.
//!
//! Where there is no Xvfb the tests say so and pass, unless `RTSL_REQUIRE_DISPLAY=1` asks for it.
//!
//! A separate test program, since the tests wait for windows for limited times.

mod display;

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use display::{Display, Pixels, Window};
use tempfile::TempDir;

/// Nothing here takes so long, on any machine.
const PATIENCE: Duration = Duration::from_secs(30);

/// The columns and rows of the picture, and of the window with its toolbar.
const SIZE: (u16, u16) = (700, 200);
const WINDOW: (u16, u16) = (700, 230);

const SCENE: &str = r#"
LookAt 0 2 -6   0 0.5 0   0 1 0
Camera "Pinhole" "float fov" 40
Sampler "independent" "integer pixelsamples" 1
Integrator "interactive" "integer budget" 20000
WorldBegin
MakeNamedMaterial "ground" "string type" "Dots" "float size" 0.1
NamedMaterial "ground"
Shape "Plane"
MakeNamedMaterial "dotted" "string type" "Dots" "float size" 0.5
NamedMaterial "dotted"
Translate 0 1 0
Shape "Sphere" "float radius" 1 "string name" "ball"
"#;

const DOTS: &str = "class Dots : rt_Material;
[[label \"Size\", min 0, max 1]] public float size = 0.25;
void shade() { rt_SampleColor = color(size, 0.25, 0.25); }";

/// A pixel of the ball below the figures of the overlay.
const BALL: (i16, i16) = (350, 150);
/// One where the pane of parameters takes its part of the window.
const BALL_BESIDE_PANE: (i16, i16) = (180, 150);
const BALL_COLOR: u32 = 0x00BC_8989;

/// The rows that the toolbar and figures take, which change with the time.
const FIGURES: u16 = 90;

/// The slider of the ball's material: in the row behind camera, ground, plane and dotted.
const SLIDER_Y: i16 = 138;
const SLIDER: (i16, i16) = (514, 640);

/// A scene in a folder of its own, removed in the end.
struct Folder(TempDir);

impl Folder {
    fn new(name: &str) -> Folder {
        let folder = Folder(tempfile::Builder::new().prefix(name).tempdir().unwrap());
        std::fs::write(folder.0.path().join("scene.pbrt"), SCENE).unwrap();
        folder.write_shader(DOTS);
        folder
    }

    fn write_shader(&self, text: &str) {
        std::fs::write(self.0.path().join("dots.rtsl"), text).unwrap();
    }

    fn view(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rtsl"));
        command.arg("view").arg(self.0.path().join("scene.pbrt"));
        command.arg("--size").arg(format!("{}x{}", SIZE.0, SIZE.1));
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
        command
    }
}

/// A viewer that runs, ended when it is dropped.
struct Viewer {
    child: Child,
    window: Window,
}

impl Viewer {
    fn open(display: &Display, folder: &Folder) -> Viewer {
        let mut command = folder.view();
        command.env("DISPLAY", display.name()).stdout(Stdio::null());
        let child = command.spawn().unwrap();
        let window = wait_for("a window", || display.window(WINDOW));
        window.focus();
        let viewer = Viewer { child, window };
        viewer.wait_for_ball(BALL_COLOR);
        viewer
    }

    fn pixels(&self) -> Pixels {
        self.window.pixels().expect("the window stands")
    }

    /// Waits until the ball has a colour; how long that took.
    fn wait_for_ball(&self, color: u32) -> Duration {
        let start = Instant::now();
        wait_for(&format!("a ball of colour {color:06x}"), || {
            (self.pixels().at(BALL) == color).then_some(())
        });
        start.elapsed()
    }

    /// The pixels once they stay the same.
    fn settled(&self) -> Pixels {
        let mut before = self.pixels();
        wait_for("a picture that rests", || {
            std::thread::sleep(Duration::from_millis(300));
            let now = self.pixels();
            let rests = now == before;
            before = now;
            rests.then(|| before.clone())
        })
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn wait_for<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(start.elapsed() < PATIENCE, "there is no {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// A display, or nothing where there is no Xvfb.
fn display() -> Option<Display> {
    let display = Display::start();
    if display.is_none() {
        let required = std::env::var_os("RTSL_REQUIRE_DISPLAY").is_some_and(|it| it == "1");
        assert!(!required, "Xvfb is not installed, and RTSL_REQUIRE_DISPLAY=1");
        eprintln!("skipped: Xvfb is not installed");
    }
    display
}

fn standard_error(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn keys_and_drags_move_the_camera() {
    let Some(display) = display() else { return };
    let folder = Folder::new("camera");
    let viewer = Viewer::open(&display, &folder);
    let with_figures = viewer.settled();
    viewer.window.press_key('o');
    let first = wait_for("picture without figures", || {
        Some(viewer.settled()).filter(|now| *now != with_figures)
    });
    let mut seen = vec![first.clone()];
    let mut see_another = |what: &str| {
        let other = wait_for(what, || Some(viewer.settled()).filter(|now| !seen.contains(now)));
        seen.push(other);
    };
    viewer.window.drag(1, (100, 80), (160, 80));
    see_another("orbit");
    viewer.window.drag(2, (100, 80), (100, 60));
    see_another("pan");
    viewer.window.drag(3, (100, 80), (130, 80));
    see_another("look around");
    viewer.window.click(4, BALL);
    see_another("dolly");
    viewer.window.hold_key('w', Duration::from_millis(300));
    see_another("flight");
    viewer.window.press_named(display::HOME);
    wait_for("way home", || (viewer.settled() == first).then_some(()));
}

#[test]
fn a_slider_of_the_picked_material_changes_the_next_frame() {
    let Some(display) = display() else { return };
    let folder = Folder::new("slider");
    let viewer = Viewer::open(&display, &folder);
    viewer.window.press_key('o');
    viewer.window.click(1, BALL);
    let without_pane = viewer.settled();
    viewer.window.press_named(display::TAB);
    let ball = |viewer: &Viewer| viewer.pixels().at(BALL_BESIDE_PANE);
    // A drag before the slider stands there would move the camera.
    wait_for("pane", || Some(viewer.settled()).filter(|now| *now != without_pane));
    wait_for("ball beside the pane", || (ball(&viewer) == BALL_COLOR).then_some(()));
    let start = Instant::now();
    viewer.window.drag(1, (SLIDER.0 + 55, SLIDER_Y), (SLIDER.1, SLIDER_Y));
    wait_for("change beside the pane", || (ball(&viewer) != BALL_COLOR).then_some(()));
    let taken = milliseconds(start.elapsed());
    eprintln!(
        "a drag of {:.0} ms changed the picture after {taken:.1} ms",
        milliseconds(display::DRAG)
    );
    viewer.window.press_named(display::TAB);
    viewer.wait_for_ball(0x00FF_8989);
}

#[test]
fn a_saved_shader_changes_the_picture_and_a_fault_is_told() {
    let Some(display) = display() else { return };
    let folder = Folder::new("shader");
    let viewer = Viewer::open(&display, &folder);
    let first = viewer.settled();
    folder.write_shader(&DOTS.replace("color(size", "colour(size"));
    let told = wait_for("diagnostic", || Some(viewer.settled()).filter(|now| *now != first));
    assert_eq!(told.at((4, 4)), first.at((4, 4)), "it stands at the bottom");
    folder.write_shader(&DOTS.replace("0.25)", "1.0)"));
    let taken = viewer.wait_for_ball(0x00BC_89FF);
    eprintln!("a saved shader changed the picture after {:.1} ms", milliseconds(taken));
    let endless = "float endless() { float x = size; while (x > 0.0) x += 1.0; return x; }\nvoid";
    let text = DOTS.replace("void", endless).replace("color(size", "color(endless()");
    folder.write_shader(&text);
    std::thread::sleep(Duration::from_millis(500));
    assert!(viewer.window.pixels().is_some(), "a shader that never ends does not end the viewer");
    folder.write_shader(DOTS);
    viewer.wait_for_ball(BALL_COLOR);
    let below = first.below(FIGURES);
    wait_for("first picture", || (viewer.settled().below(FIGURES) == below).then_some(()));
}

#[test]
fn a_resized_window_is_filled() {
    let Some(display) = display() else { return };
    let folder = Folder::new("resize");
    let viewer = Viewer::open(&display, &folder);
    viewer.window.press_key('o');
    viewer.window.resize((300, 160));
    wait_for("picture of another size", || {
        let now = viewer.settled();
        let corners = [(0, 159), (299, 159)];
        let filled = now.size() == (300, 160) && corners.iter().all(|at| now.at(*at) != 0);
        filled.then_some(())
    });
}

#[test]
fn a_script_takes_a_picture() {
    let Some(display) = display() else { return };
    let folder = Folder::new("script");
    let picture = folder.0.path().join("picture.png");
    let mut command = folder.view();
    command.env("DISPLAY", display.name());
    let output = command.args(["--frames", "500", "--screenshot"]).arg(&picture).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", standard_error(&output));
    assert!(picture_size(&picture) == (700, 230));
}

#[test]
fn what_is_wrong_is_told() {
    let folder = Folder::new("wrong");
    let output = folder.view().output().unwrap();
    assert_eq!(output.status.code(), Some(1), "there is no display");
    let text = standard_error(&output);
    assert!(text.contains("cannot open a window") && text.contains("rtsl render"), "{text}");
    assert!(!text.contains(".rs"), "{text}");
    let output = folder.view().args(["--screenshot", "a.exr"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", standard_error(&output));
    folder.write_shader("class Dots : rt_Material; void shade() { oops; }");
    let output = folder.view().output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(standard_error(&output).contains("oops"), "{}", standard_error(&output));
}

/// Columns and rows that the header of a PNG tells.
fn picture_size(path: &Path) -> (u32, u32) {
    let bytes = std::fs::read(path).unwrap();
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    (number(16), number(20))
}

fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}
