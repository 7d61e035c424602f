//! Sessions that show a scene by integrators.

use super::tests::{Folder, SCENE, SLICE, STRIPES, find, finish, shown};
use super::*;

/// An integrator with a parameter, like that of the guide.
const MINE: &str = "class Mine : rt_Integrator;
[[min 0, max 9]] public float scale = 1.0;
public int steps = 1;
void radiance() {
    color sum = color(0.0);
    rt_Surface surface = nearestHit();
    for (int step = 0; step < steps && surface.found; ++step) {
        sum += color(abs(surface.shadingNormal) * scale);
        surface = surface.follow(surface.direction, 0.0);
    }
    rt_SampleColor = sum + color(0.1) * (sample1D(7) - 0.5);
}";

fn scene_of_mine() -> String {
    SCENE.replace(
        "Integrator \"interactive\" \"integer budget\" 5000",
        "Integrator \"Mine\" \"float scale\" 0.5",
    )
}

/// A folder with a scene whose integrator is in a file beside it.
fn folder_of_mine(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("mine.rtsl", MINE);
    folder.write("scene.pbrt", &scene_of_mine());
    folder
}

/// The addresses of the code of the integrator's stages.
fn code(session: &Session) -> Vec<*const rtsl::TieredKernel> {
    session.renderer.scene().code()
}

#[test]
fn integrators_make_the_images_of_batch_renders() {
    let folder = Folder::new("integrators");
    let mut session = folder.open();
    let first = finish(&mut session);
    let names = session.integrators();
    assert_eq!(names[0], "interactive");
    assert!(names.iter().any(|name| name == "Path"), "{names:?}");
    for name in &names[1..] {
        session.set_integrator(name).unwrap();
        assert_eq!(
            (session.integrator(), session.status().integrator.as_str()),
            (&**name, &**name)
        );
        assert_eq!(finish(&mut session), folder.render_by(name), "{name}");
    }
    assert!(session.status().lane_utilisation.is_some());
    session.set_integrator("interactive").unwrap();
    assert_eq!(finish(&mut session), first);
    assert!(!session.set_integrator("interactive").unwrap().changed);
}

#[test]
fn slices_of_any_length_make_the_same_image_by_an_integrator() {
    let folder = Folder::new("pieces");
    let mut session = folder.open();
    session.set_integrator("Path").unwrap();
    while session.advance(Duration::from_micros(1)) {}
    assert_eq!(session.film().image().unwrap(), folder.render_by("Path"));
}

#[test]
fn the_integrator_of_the_scene_has_its_parameters() {
    let folder = folder_of_mine("mine");
    let mut session = folder.open();
    assert_eq!(session.integrator(), "Mine");
    assert_eq!(session.integrators()[..2], ["interactive", "Mine"]);
    let own = finish(&mut session);
    assert_eq!(own, folder.render(&[]));
    session.set_integrator("Normals").unwrap();
    assert_ne!(finish(&mut session), own);
    session.set_integrator("Mine").unwrap();
    assert_eq!(finish(&mut session), own);
}

#[test]
fn an_edited_class_leaves_the_kernels_of_others() {
    let folder = Folder::new("kept");
    let mut session = folder.open();
    session.set_integrator("Path").unwrap();
    finish(&mut session);
    let before = code(&session);
    folder.write("stripes.rtsl", &STRIPES.replace("0.8", "0.1"));
    assert!(session.reload().unwrap().changed);
    // Neither the first stage, nor that of the ball, nor the camera have a texture.
    let is_new = |code: &*const rtsl::TieredKernel| !before.contains(code);
    let new: Vec<bool> = code(&session).iter().map(is_new).collect();
    assert_eq!(new.iter().filter(|is_new| **is_new).count(), 1, "{new:?}");
    assert_eq!(finish(&mut session), folder.render_by("Path"));
}

#[test]
fn parameters_change_the_image_and_no_code_of_integrators() {
    let folder = folder_of_mine("values");
    let mut session = folder.open();
    finish(&mut session);
    let before = code(&session);
    assert!(!before.is_empty());
    let mine = find(&session, "integrator");
    session.set_control(mine, "scale", &[0.25]).unwrap();
    session.set_control(mine, "steps", &[3.0]).unwrap();
    let (red, lamp) = (find(&session, "red"), find(&session, "lamp"));
    session.set_control(red, "kd", &[0.1, 0.2, 0.7]).unwrap();
    let mine = ["integrator.scale=0.25", "integrator.steps=3", "red.kd=0.1,0.2,0.7"];
    assert_eq!(finish(&mut session), folder.render(&mine));
    assert_eq!(code(&session), before);
    // Other classes of surfaces and lights are asked by `Path`.
    session.set_integrator("Path").unwrap();
    finish(&mut session);
    let before = code(&session);
    session.set_control(red, "kd", &[0.7, 0.7, 0.1]).unwrap();
    session.set_control(lamp, "intensity", &[9.0, 50.0, 10.0]).unwrap();
    let pattern = find(&session, "pattern");
    session.set_control(pattern, "dark", &[1.0]).unwrap();
    let changed = finish(&mut session);
    assert_eq!(code(&session), before);
    let defines = ["red.kd=0.7,0.7,0.1", "lamp.intensity=9,50,10", "pattern.dark=true"];
    assert_eq!(changed, folder.render_with(Some("Path"), &defines));
    // `Whitted` calls `shade`, whose stages are separate.
    session.set_integrator("Whitted").unwrap();
    finish(&mut session);
    let before = code(&session);
    session.set_control(red, "kd", &[0.3, 0.7, 0.9]).unwrap();
    session.set_control(pattern, "dark", &[0.0]).unwrap();
    let changed = finish(&mut session);
    assert_eq!(code(&session), before);
    let defines = ["red.kd=0.3,0.7,0.9", "lamp.intensity=9,50,10", "pattern.dark=false"];
    assert_eq!(changed, folder.render_with(Some("Whitted"), &defines));
}

#[test]
fn an_edited_integrator_is_compiled() {
    let folder = folder_of_mine("edited");
    let mut session = folder.open();
    finish(&mut session);
    let before = code(&session);
    folder.write("mine.rtsl", &MINE.replace("abs(surface.shadingNormal)", "vec3(0.5)"));
    assert!(session.reload().unwrap().changed);
    assert_eq!(finish(&mut session), folder.render(&[]));
    assert_ne!(code(&session), before);
}

#[test]
fn an_unknown_integrator_changes_nothing() {
    let folder = Folder::new("unknown");
    let mut session = folder.open();
    let first = finish(&mut session);
    let messages = session.set_integrator("Nothing").unwrap_err().to_text(false);
    assert!(messages.contains("Nothing"), "{messages}");
    assert_eq!(session.integrator(), "interactive");
    assert!(!session.is_busy());
    session.reload().unwrap();
    assert_eq!(session.film().image().unwrap(), first);
}

#[test]
fn an_integrator_that_never_ends_is_stopped_and_told() {
    let folder = folder_of_mine("endless");
    let endless = "\"float scale\" 0.5 \"integer budget\" 5000";
    folder.write("scene.pbrt", &scene_of_mine().replace("\"float scale\" 0.5", endless));
    let text = MINE.replace(
        "color sum = color(0.0);",
        "color sum = color(0.0); while (scale > 0.0) sum += color(1.0);",
    );
    folder.write("mine.rtsl", &text);
    let mut session = folder.open();
    while session.advance(SLICE) {}
    let problem = session.status().problem.expect("it runs past its budget");
    assert!(problem.contains("Mine") && problem.contains("5000"), "{problem}");
    folder.write("mine.rtsl", MINE);
    session.reload().unwrap();
    finish(&mut session);
}

#[test]
fn visits_and_lanes_of_integrators_are_shown_as_heat() {
    let folder = folder_of_mine("heat_of_mine");
    let mut session = folder.open();
    let first = finish(&mut session);
    let image = shown(&session);
    for mode in [ViewMode::Nodes, ViewMode::Lanes] {
        session.set_view_mode(mode);
        assert_eq!(finish(&mut session), first);
        assert_ne!(shown(&session), image);
    }
    let lanes = session.status().lane_utilisation.expect("they were counted");
    assert!(lanes > 0.25 && lanes <= 1.0, "{lanes}");
}

#[test]
fn a_pixel_is_named_and_a_moved_camera_comes_back_with_an_integrator() {
    let folder = folder_of_mine("pick_of_mine");
    let mut session = folder.open();
    let first = finish(&mut session);
    assert_eq!(session.pick(22, 14).map(|picked| picked.title), Some("ball".to_owned()));
    session.set_camera(session.camera().after(Transform::translate([0.5, 0.0, 0.0])));
    assert_ne!(finish(&mut session), first);
    session.set_camera(session.scene_camera());
    assert_eq!(finish(&mut session), first);
    session.resize(21, 50);
    let expected = folder.render(&["film.xresolution=21", "film.yresolution=50"]);
    assert_eq!(finish(&mut session), expected);
}
