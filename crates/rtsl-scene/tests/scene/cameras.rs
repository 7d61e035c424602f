//! The cameras of pbrt: classes and the values of their members.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use expect_test::expect;
use rtsl::Instance;
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, load_scene};

/// Two surfaces of crown glass behind a diaphragm.
const LENSES: &str = "# radius thickness index diameter\n0 2 0 20\n50 2 1.5 20\n-50 50 1 20\n";

fn load(camera: &str) -> Result<Arc<Instance>, String> {
    let text = format!("Film \"rgb\" \"float diagonal\" 50\nCamera {camera}\nWorldBegin\n");
    let files = [("scene.pbrt", text.as_str()), ("lens.dat", LENSES), ("bad.dat", "1 2 3")];
    let files = files.map(|(path, text)| (PathBuf::from(path), text.to_owned()));
    let loaded =
        load_scene(Path::new("scene.pbrt"), &MemoryFiles(files.into()), &LoadOptions::default());
    match loaded {
        Ok(loaded) if loaded.warnings.is_empty() => Ok(loaded.scene.camera),
        Ok(loaded) => Err(loaded.warnings.to_text(false)),
        Err(messages) => Err(messages.to_text(false)),
    }
}

/// The class of a camera, and a member of it as numbers.
#[track_caller]
fn camera(text: &str, member: &str) -> (String, Vec<f32>) {
    let camera = load(text).unwrap_or_else(|messages| panic!("{messages}"));
    let buffer = camera.buffer(member).map(|buffer| buffer.to_vec());
    let words = buffer.or(camera.member(member).map(<[u32]>::to_vec)).expect("it has the member");
    let numbers = words.iter().map(|word| f32::from_bits(*word)).collect();
    (camera.class().name.clone(), numbers)
}

#[track_caller]
fn check(text: &str, class: &str, member: &str, expected: &[f32]) {
    assert_eq!(camera(text, member), (class.to_owned(), expected.to_vec()), "{text}");
}

#[test]
fn perspective_cameras_are_pinholes_unless_they_have_a_lens_or_a_window() {
    check("\"perspective\"", "Pinhole", "fov", &[90.0]);
    let closed = "\"perspective\" \"float lensradius\" 0 \"float focaldistance\" 1e30";
    check(closed, "Pinhole", "fov", &[90.0]);
    let open = "\"perspective\" \"float fov\" 30 \"float lensradius\" 0.5";
    check(open, "ThinLens", "lensRadius", &[0.5]);
    check(open, "ThinLens", "focalDistance", &[1e6]);
    check(open, "ThinLens", "window", &[0.0; 4]);
    check(&format!("{open} \"float focaldistance\" 1e30"), "ThinLens", "focalDistance", &[1e15]);
    let window = "\"perspective\" \"float screenwindow\" [-2 1 -0.5 0.5]";
    check(window, "ThinLens", "window", &[-2.0, 1.0, -0.5, 0.5]);
    check(window, "ThinLens", "lensRadius", &[0.0]);
    check(window, "ThinLens", "fov", &[90.0]);
    let frame = "\"perspective\" \"float frameaspectratio\"";
    check(&format!("{frame} 2"), "ThinLens", "window", &[-2.0, 2.0, -1.0, 1.0]);
    check(&format!("{frame} 0.5"), "ThinLens", "window", &[-1.0, 1.0, -2.0, 2.0]);
    let both = format!("{frame} 2 \"float screenwindow\" [0 1 0 1]");
    check(&both, "ThinLens", "window", &[0.0, 1.0, 0.0, 1.0]);
}

#[test]
fn orthographic_cameras_have_lenses_and_windows() {
    check("\"orthographic\"", "Orthographic", "lensRadius", &[0.0]);
    let window = "\"orthographic\" \"float screenwindow\" [-2 1 -1 1] \"float lensradius\" 0.1";
    check(window, "Orthographic", "window", &[-2.0, 1.0, -1.0, 1.0]);
    check(window, "Orthographic", "lensRadius", &[0.1_f32]);
    check(
        "\"orthographic\" \"float frameaspectratio\" 3",
        "Orthographic",
        "window",
        &[-3.0, 3.0, -1.0, 1.0],
    );
}

#[test]
fn spherical_cameras_have_two_mappings() {
    let equal_area = |text: &str| {
        let camera = load(&format!("\"spherical\" {text}")).unwrap();
        assert_eq!(camera.class().name, "Spherical");
        camera.member("equalArea").map(|words| words[0] != 0)
    };
    assert_eq!(equal_area(""), Some(true));
    assert_eq!(equal_area("\"string mapping\" \"equalarea\" \"float lensradius\" 1"), Some(true));
    assert_eq!(equal_area("\"string mapping\" \"equirectangular\""), Some(false));
    let messages = load("\"spherical\" \"string mapping\" \"cube\"").unwrap_err();
    let expected = "`mapping` of camera `spherical` cannot be `cube`";
    assert!(messages.contains(expected), "{messages}");
}

#[test]
fn realistic_cameras_read_their_lenses() {
    let text = "\"realistic\" \"string lensfile\" \"lens.dat\" \"float focusdistance\" 1 \"float aperturediameter\" 6";
    let (class, elements) = camera(text, "elements");
    assert_eq!((class.as_str(), elements.len()), ("Realistic", 12));
    // From the film: the rear and the front of the lens, then the diaphragm.
    let radii = [elements[0], elements[4], elements[8]];
    assert_eq!(radii, [-0.05, 0.05, 0.0]);
    assert_eq!([elements[2], elements[6]], [1.0 / 1.5, 1.5]);
    assert_eq!([elements[3], elements[11]], [0.01, 0.003]);
    // 1/f = 1/distance + 1/image, with f of 50 mm and a thickness of 2 mm.
    assert!((elements[1] - 0.0525).abs() < 3e-4, "{elements:?}");
    check(text, "Realistic", "diagonal", &[0.05]);
    assert_eq!(camera(text, "pupils").1.len(), 4 * 64);
    for aperture in ["gaussian", "square", "pentagon", "star"] {
        let (_, texels) = camera(&format!("{text} \"string aperture\" \"{aperture}\""), "aperture");
        assert_eq!(texels.len(), 256 * 256, "{aperture}");
    }
}

#[test]
fn lenses_that_cannot_be_used_are_errors() {
    let lens = "\"string lensfile\" \"lens.dat\"";
    for (text, problem) in [
        ("", "`realistic` names no file of lenses"),
        ("\"string lensfile\" \"missing.dat\"", "cannot read `missing.dat`"),
        ("\"string lensfile\" \"bad.dat\"", "`bad.dat` does not describe lenses"),
        (&*format!("{lens} \"float focusdistance\" 0.1"), "cannot be focused at a distance of 0.1"),
        (&*format!("{lens} \"string aperture\" \"heart.png\""), "cannot read `heart.png`"),
    ] {
        let messages = load(&format!("\"realistic\" {text}")).unwrap_err();
        assert!(messages.contains(problem), "{messages}");
        assert_eq!(messages.matches("error[").count(), 1, "{messages}");
    }
}

#[test]
fn scenes_without_a_camera_have_that_of_pbrt() {
    let load = |text: &str| {
        let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text.to_owned())].into());
        let loaded = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default());
        loaded
            .map(|loaded| {
                (loaded.scene.camera.class().name.clone(), loaded.warnings.to_text(false))
            })
            .map_err(|messages| messages.to_text(false))
    };
    let (class, warnings) = load("WorldBegin Shape \"sphere\"").expect("it loads");
    assert_eq!(class, "Pinhole");
    expect![[r#"
        warning[W0601]: the scene has no camera: `perspective` at the origin takes its place
          ┌─ scene.pbrt:1:1
          │
        1 │ WorldBegin Shape "sphere"
          │ ^^^^^^^^^^
          │
          = help: give one before `WorldBegin`: `Camera "perspective"`

    "#]]
    .assert_eq(&warnings);
    let message = load("LookAt 0 0 0  0 0 1  0 1 0").expect_err("nothing to show");
    assert!(message.contains("the scene has no `WorldBegin`"), "{message}");
    // One mistake, one message.
    let message = load("Camera \"perspectiv\" WorldBegin").expect_err("no such camera");
    assert_eq!(message.matches("error").count(), 1, "{message}");
}
