//! The editor in the viewer without a window: typing, errors, saving.

use egui::{Event, Key};

use super::{Start, Wish};
use crate::layout;
use crate::testing::{BALL_PIXEL, DOTS, TOP, Viewer};

/// The size of a window whose picture keeps its size beside the editor.
const SIZE: (usize, usize) = (320 + layout::EDITOR as usize, 250 + TOP);

/// A viewer with the shader in its editor, whose text has the focus.
fn editing(name: &str) -> Viewer {
    let start = |folder: &std::path::Path| Start {
        edit: Some((folder.join("dots.rtsl"), None)),
        ..Start::default()
    };
    let mut viewer = Viewer::start(name, SIZE, DOTS, start);
    viewer.settle();
    viewer.click((300.0, 250.0));
    assert!(viewer.app.context.text_edit_focused());
    viewer
}

fn file(viewer: &Viewer) -> String {
    std::fs::read_to_string(viewer.folder.path().join("dots.rtsl")).unwrap()
}

fn go_to_end(viewer: &mut Viewer) {
    viewer.command(Key::End);
}

#[test]
fn errors_are_shown_while_someone_types() {
    let mut viewer = editing("typing");
    assert_eq!(viewer.app.editor.problems(), []);
    go_to_end(&mut viewer);
    viewer.type_text("\nvoid oops() { missing = 1.0; }");
    viewer.settle();
    let problems = viewer.app.editor.problems();
    let (line, message) = problems.first().expect("a problem");
    assert_eq!(*line, 5);
    assert!(message.contains("missing"), "{message}");
    assert!(viewer.shows("missing"), "it is in the list below the text");
    assert_eq!(file(&viewer), DOTS, "nothing is saved yet");
    assert_eq!(viewer.app.message(), None, "nor compiled");
    viewer.picture("editor-error");
    viewer.command(Key::Z);
    viewer.settle();
    assert_eq!(viewer.app.editor.text(), DOTS, "undone");
    assert_eq!(viewer.app.editor.problems(), []);
}

#[test]
fn letters_are_typed_and_no_commands() {
    let mut viewer = editing("letters");
    let camera = viewer.position();
    go_to_end(&mut viewer);
    viewer.events([viewer.key(Key::W, true), Event::Text("w".to_owned())]);
    assert!(!viewer.app.navigation.is_flying());
    viewer.press(Key::Home);
    viewer.press(Key::ArrowLeft);
    assert_eq!(viewer.position(), camera);
    assert!(viewer.app.editor.text().ends_with('w'));
    // A click into the picture gives the keys back to the camera.
    viewer.click((layout::EDITOR + 160.0, 200.0));
    viewer.press(Key::ArrowLeft);
    assert_ne!(viewer.position(), camera);
}

#[test]
fn a_saved_text_changes_the_picture() {
    let mut viewer = editing("saving");
    viewer.pixels();
    let changed = DOTS.replace("0.25, bright", "1.0, bright");
    viewer.command(Key::A);
    viewer.type_text(&changed);
    assert_eq!(viewer.app.editor.unsaved(), ["dots.rtsl"]);
    assert!(viewer.shows("dots.rtsl •"));
    viewer.command(Key::S);
    assert_eq!(file(&viewer), changed);
    assert_eq!(viewer.app.editor.unsaved(), [""; 0]);
    let center = 250 / 2;
    let (width, _) = viewer.app.session().film().size();
    let image = viewer.image();
    assert_eq!(image[center * width + width / 2] & 0xFF00, 0xFF00, "the ball is greener");
    assert!(image.len() > BALL_PIXEL);
}

#[test]
fn texts_of_other_programs_are_not_overwritten() {
    let mut viewer = editing("conflict");
    go_to_end(&mut viewer);
    viewer.type_text("\n// mine");
    let theirs = format!("{DOTS}\n// theirs");
    std::fs::write(viewer.folder.path().join("dots.rtsl"), &theirs).unwrap();
    viewer.app.files_changed();
    viewer.settle();
    assert!(viewer.app.editor.text().ends_with("// mine"));
    assert!(viewer.shows("Another program has changed the file."));
    viewer.picture("editor-conflict");
    viewer.command(Key::S);
    assert_eq!(file(&viewer), theirs, "what is on the disk stays");
    viewer.click_on("Keep this text");
    viewer.command(Key::S);
    assert!(file(&viewer).ends_with("// mine"));
}

#[test]
fn a_window_with_unsaved_texts_asks_before_it_closes() {
    let mut viewer = editing("closing");
    assert!(viewer.app.may_close());
    go_to_end(&mut viewer);
    viewer.type_text("\n// more");
    assert!(!viewer.app.may_close());
    viewer.settle();
    viewer.picture("closing");
    viewer.click_on("Save all and close");
    assert_eq!(viewer.app.take_wishes(), [Wish::Close]);
    assert!(file(&viewer).ends_with("// more"));
}

#[test]
fn completions_are_offered_and_taken() {
    let mut viewer = editing("completions");
    go_to_end(&mut viewer);
    viewer.type_text("\nvoid more() { float x = smoothst");
    viewer.settle();
    viewer.type_text("e");
    viewer.settle();
    assert!(viewer.shows("smoothstep"), "{:?}", viewer.names());
    viewer.picture("editor-completion");
    viewer.press(Key::Enter);
    assert!(viewer.app.editor.text().contains("float x = smoothstep"));
}
