//! The inspector in the viewer without a window: values of samples, replays, samples that are not finite.

use egui::Key;
use rtsl_render::session::ViewMode;

use super::{Start, Wish};
use crate::inspector::Move;
use crate::layout::{self, Side};
use crate::testing::{BALL, TOP, Viewer};

/// The size of windows with both panes, and with that at the right.
const SIZE: (usize, usize) = (320 + (layout::EDITOR + layout::SIDE) as usize, 500 + TOP);
const SIDE_ALONE: (usize, usize) = (320 + layout::SIDE as usize, 250 + TOP);

/// A shader with a variable, a call and a print.
const STEPS: &str = "class Dots : rt_Material;
public float size = 0.25;
float half_of(float x) {
    float smaller = 0.5 * x;
    return smaller;
}
void shade() {
    float part = half_of(size);
    print(\"part {}\", part);
    rt_SampleColor = color(part, 0.25, 0.25);
}";

/// A row that shows the ball in the picture of the scene's size, and one in that which the window has room for.
const ROW: usize = 40;
const ROW_OF_WINDOW: usize = 120;

fn viewer(name: &str, size: (usize, usize), shader: &str, start: Start) -> Viewer {
    let mut viewer = Viewer::start(name, size, shader, |_| start);
    viewer.settle();
    viewer
}

fn inspecting(name: &str, shader: &str) -> Viewer {
    let inspect = Some(([160, ROW], 0));
    viewer(name, SIZE, shader, Start { inspect, ..Start::default() })
}

fn line_and_values(viewer: &Viewer) -> (u32, String) {
    let debugging = viewer.app.inspector.debugging.as_ref().expect("a replay");
    let (_, line, _) = debugging.place().expect("a line");
    (line, debugging.beside.get(&line).cloned().unwrap_or_default())
}

/// Steps until the replay stands at a line.
fn step_to(viewer: &mut Viewer, line: u32) {
    for _ in 0..100_000 {
        if line_and_values(viewer).0 == line {
            viewer.app.show_position();
            viewer.settle();
            return;
        }
        viewer.app.inspector.debugging.as_mut().unwrap().go(Move::In);
    }
    panic!("no step reaches line {line}");
}

#[test]
fn a_click_shows_the_values_of_a_sample() {
    let side = Some(Side::Inspector);
    let mut viewer = viewer("values", SIDE_ALONE, STEPS, Start { side, ..Start::default() });
    viewer.pixels();
    viewer.click((160.0, (ROW_OF_WINDOW + TOP) as f32));
    viewer.settle();
    assert!(viewer.shows("ball: Sphere"), "{:?}", viewer.names());
    assert!(viewer.shows("Dots.shade: part 0.25"), "{:?}", viewer.names());
    assert!(viewer.shows("0.25, 0.25, 0.25"), "the radiance");
    let printed = viewer.app.take_wishes();
    assert!(matches!(&printed[1], Wish::Print(line) if line.ends_with("part 0.25")), "{printed:?}");
    viewer.picture("inspector");
    // Another scene has other values.
    viewer.press(Key::ArrowLeft);
    assert!(viewer.shows("The picture has changed since."));
    viewer.click_on("Look again");
    viewer.settle();
    assert!(!viewer.shows("The picture has changed since."));
}

#[test]
fn a_replay_steps_through_the_shader() {
    let mut viewer = inspecting("replay", STEPS);
    assert!(viewer.app.panes.editor && viewer.shows("Replay"));
    step_to(&mut viewer, 8);
    assert!(viewer.app.editor.text().contains("half_of"), "the editor shows the shader");
    assert_eq!(line_and_values(&viewer), (8, "size = 0.5".to_owned()));
    viewer.press(Key::F11);
    assert_eq!(line_and_values(&viewer), (4, "x = 0.5".to_owned()));
    assert!(viewer.shows("half_of:4"), "the calls: {:?}", viewer.names());
    viewer.settle();
    viewer.picture("replay");
    viewer.click_on("out >");
    assert_eq!(line_and_values(&viewer), (9, "part = 0.25".to_owned()));
    viewer.modifiers.shift = true;
    viewer.press(Key::F10);
    viewer.modifiers.shift = false;
    assert_eq!(line_and_values(&viewer).0, 8, "back over the call");
}

#[test]
fn breakpoints_beside_the_text_end_runs() {
    let mut viewer = inspecting("breakpoints", STEPS);
    step_to(&mut viewer, 8);
    // The margin of line 10: two lines below the one that is scrolled into the middle.
    viewer
        .app
        .editor
        .set_breakpoint(&viewer.folder.path().join("dots.rtsl").display().to_string(), 10);
    let debugging = viewer.app.inspector.debugging.as_mut().unwrap();
    debugging.set_breakpoints(viewer.app.editor.breakpoints());
    viewer.press(Key::F5);
    assert_eq!(line_and_values(&viewer).0, 10);
    assert!(viewer.shows("at a breakpoint"));
    viewer.press(Key::F5);
    assert!(viewer.shows("at the end of the recording"));
}

#[test]
fn options_start_a_replay_at_a_line() {
    let mut viewer = Viewer::start("start", SIZE, STEPS, |folder| Start {
        edit: Some((folder.join("dots.rtsl"), Some(10))),
        inspect: Some(([160, ROW], 0)),
        ..Start::default()
    });
    viewer.settle();
    assert_eq!(line_and_values(&viewer).0, 10);
    let beside = &viewer.app.inspector.debugging.as_ref().unwrap().beside;
    assert_eq!(beside.get(&8).map(String::as_str), Some("part = 0.25"));
}

#[test]
fn samples_that_are_not_finite_are_found() {
    let shader = "class Dots : rt_Material;
public float size = 0.25;
void shade() {
    float broken = sqrt(rt_HitPoint.x);
    rt_SampleColor = color(broken, size, size);
}";
    let side = Some(Side::NotFinite);
    let mut viewer = viewer("nan", SIDE_ALONE, shader, Start { side, ..Start::default() });
    viewer.pixels();
    viewer.settle();
    assert!(viewer.shows("are not finite and count as black"), "{:?}", viewer.names());
    viewer.press(Key::Num5);
    assert_eq!(viewer.app.session().view_mode(), ViewMode::NotFinite);
    let marked = viewer.image().iter().filter(|pixel| **pixel == 0x00FF_00FF).count();
    assert!(marked > 100, "{marked} pixels are marked");
    assert!(viewer.shows("W0631"), "{:?}", viewer.names());
    viewer.picture("not-finite");
    viewer.click_on("dots.rtsl:4: sqrt(rt_HitPoint.x)");
    viewer.settle();
    assert!(viewer.app.panes.editor);
    assert!(viewer.app.editor.text().contains("float broken"), "the line is shown");
}

#[test]
fn a_pixel_that_was_clicked_is_evaluated_when_the_pane_opens() {
    let mut viewer = Viewer::new("later");
    viewer.click(BALL);
    assert!(!viewer.app.is_waiting());
    viewer.press(Key::P);
    viewer.settle();
    assert!(viewer.shows("ball: Sphere"), "{:?}", viewer.names());
}

/// A shader with one line that costs more than all others.
const DEAR: &str = "class Dots : rt_Material;
public float size = 0.25;
void shade() {
    float sum = 0.0;
    for (int i = 0; i < 200; i = i + 1) sum = sum + sin(float(i) * rt_HitPoint.x);
    rt_SampleColor = color(0.5 + 0.0001 * sum);
}";

#[test]
fn costs_are_measured_when_their_pane_opens() {
    let side = Some(Side::Costs);
    let mut viewer = viewer("costs", SIZE, DEAR, Start { side, ..Start::default() });
    let costs = viewer.app.costs.measured().expect("they are measured");
    let dots = costs.of_text(|name| name.ends_with("dots.rtsl")).expect("the shader has costs");
    let (line, cost) = dots.lines.iter().max_by(|a, b| a.1.share.total_cmp(&b.1.share)).unwrap();
    assert_eq!((*line, cost.share), (5, dots.greatest));
    // The ball covers a small part of the picture.
    let (dear, active) = (cost.share, cost.active.unwrap_or_default());
    assert!(dear > 0.1 && active > 0.2, "{cost:?}");
    assert!(costs.shares[0].0.ends_with("dots.rtsl"), "{:?}", costs.shares);
    let name = costs.shares[0].0.clone();
    viewer.app.panes.editor = false;
    viewer.settle();
    viewer.click_on(&name);
    assert!(viewer.app.panes.editor, "a click on a text shows it");
    viewer.settle();
    viewer.picture("costs");
    // Measured again when someone asks, of the text as it is then.
    let cheap = DEAR.replace("200", "2");
    std::fs::write(viewer.folder.path().join("dots.rtsl"), cheap).unwrap();
    viewer.app.files_changed();
    viewer.settle();
    assert!(viewer.shows("of the scene before the last change"));
    viewer.click_on("Measure again");
    viewer.settle();
    let costs = viewer.app.costs.measured().expect("they are measured");
    let dots = costs.of_text(|name| name.ends_with("dots.rtsl")).expect("the shader has costs");
    let share = dots.lines.values().map(|line| line.share).fold(0.0, f32::max);
    assert!(share < 0.25 * dear, "{share}, {dear}");
}
