//! The viewer without a window: cameras, keys, parameters and files.

use std::time::Duration;

use egui::{Event, Key, Modifiers, PointerButton, Pos2, RawInput, Rect, pos2, vec2};
use rtsl_render::session::ViewMode;

use super::Wish;
use crate::navigation::DOLLY_PER_NOTCH;
use crate::testing::{BALL, BALL_PIXEL, DOTS, TOP, Viewer};
use crate::{camera_control, layout};

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
            other => panic!("{other:?} is not asked for"),
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
    viewer.click((label.left() + 131.0, label.center().y));
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

/// The time of a frame of 1280 by 800 pixels with all panes, without the picture's samples:
/// `cargo test --release -p rtsl-view --lib -- --ignored --nocapture times`.
#[test]
#[ignore = "it measures, and asserts nothing"]
fn times_of_frames() {
    let start = |folder: &std::path::Path| super::Start {
        edit: Some((folder.join("dots.rtsl"), None)),
        inspect: Some(([160, 40], 0)),
        ..super::Start::default()
    };
    let line =
        |index| format!("float more{index}(float x) {{ return x * x; }} // a line of a text\n");
    let lines: String = (0..200).map(line).collect();
    let text = format!("{DOTS}\n{lines}");
    let mut viewer = Viewer::start("times", (1280, 800), &text, start);
    viewer.settle();
    viewer.pixels();
    let mut measure = |what: &str, change: &mut dyn FnMut(&mut Viewer, usize)| {
        let begin = std::time::Instant::now();
        for frame in 0..50 {
            change(&mut viewer, frame);
        }
        eprintln!("{what}: {:.2} ms", begin.elapsed().as_secs_f64() * 1e3 / 50.0);
    };
    measure("nothing changes", &mut |viewer, _| viewer.events([]));
    measure("figures change", &mut |viewer, frame| {
        viewer.app.frame_time = Duration::from_micros(1000 * frame as u64);
        viewer.events([]);
    });
    measure("the replay steps", &mut |viewer, frame| {
        let key = if frame % 2 == 0 { Key::F11 } else { Key::F10 };
        viewer.press(key);
    });
    let mut pixels = vec![0; 1280 * 800];
    measure("pixels are put together", &mut |viewer, _| viewer.app.paint(&mut pixels));
}
