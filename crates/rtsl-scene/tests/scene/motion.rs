//! Motion in scenes: moving objects, their placements, and the shutter interval.

use std::path::{Path, PathBuf};

use expect_test::expect;
use rtsl::Messages;
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, Loaded, load_scene};

fn load(text: &str) -> Result<Loaded, Messages> {
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text.to_owned())].into());
    load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default())
}

fn loaded(text: &str) -> Loaded {
    load(text).unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

const CAMERA: &str = "Camera \"Pinhole\"\n";
/// From x = 1 to x = 5.
const SLIDE: &str = "Translate 1 0 0 ActiveTransform EndTime Translate 4 0 0 ActiveTransform All\n";

#[test]
fn shapes_and_instances_move_and_what_stands_does_not() {
    let text = format!(
        "{CAMERA}WorldBegin\nShape \"Sphere\"\n\
         ObjectBegin \"ball\" Shape \"Sphere\" ObjectEnd\n\
         AttributeBegin {SLIDE} Scale 2 2 2 Shape \"Sphere\" ObjectInstance \"ball\" AttributeEnd\n\
         Shape \"Sphere\"\n"
    );
    let scene = loaded(&text).scene;
    let moves: Vec<bool> =
        scene.world.iter().map(|it| scene.objects[*it as usize].motion.is_some()).collect();
    assert_eq!(moves, [false, true, false]);
    let moving = &scene.objects[scene.world[1] as usize];
    for motion in [&moving.motion, &scene.instances[0].motion] {
        let motion = motion.as_ref().expect("it moves");
        assert_eq!(motion.at(0.0).point([1.0, 0.0, 0.0]), [3.0, 0.0, 0.0]);
        assert_eq!(motion.at(0.5).point([1.0, 0.0, 0.0]), [5.0, 0.0, 0.0]);
        assert_eq!(motion.at(1.0).point([1.0, 0.0, 0.0]), [7.0, 0.0, 0.0]);
    }
    assert_eq!(moving.transform.point([1.0, 0.0, 0.0]), [3.0, 0.0, 0.0]);
}

#[test]
fn a_camera_moves_the_other_way_round() {
    let scene = loaded(&format!("{SLIDE}{CAMERA}WorldBegin\nShape \"Sphere\"\n")).scene;
    let motion = scene.camera_motion.expect("it moves");
    assert_eq!(motion.at(0.0).point([0.0; 3]), [-1.0, 0.0, 0.0]);
    assert_eq!(motion.at(1.0).point([0.0; 3]), [-5.0, 0.0, 0.0]);
}

#[test]
fn the_shutter_sees_a_part_of_the_motion() {
    let text = |shutter: &str| {
        format!(
            "TransformTimes 2 6\nCamera \"Pinhole\" {shutter}\nWorldBegin\n{SLIDE}Shape \"Sphere\"\n"
        )
    };
    let part = loaded(&text("\"float shutteropen\" 3 \"float shutterclose\" 4")).scene;
    let motion = part.objects[0].motion.as_ref().expect("it moves");
    assert_eq!(motion.at(0.0).point([0.0; 3]), [2.0, 0.0, 0.0]);
    assert_eq!(motion.at(1.0).point([0.0; 3]), [3.0, 0.0, 0.0]);
    // A shutter interval of length 0, and one that closes before the motion starts.
    let moment = loaded(&text("\"float shutteropen\" 4 \"float shutterclose\" 4"));
    assert!(moment.scene.objects[0].motion.is_none() && moment.warnings.is_empty());
    assert_eq!(moment.scene.objects[0].transform.point([0.0; 3]), [3.0, 0.0, 0.0]);
    assert!(loaded(&text("")).scene.objects[0].motion.is_none());
}

#[test]
fn coordinate_systems_and_blocks_keep_both_ends() {
    let text = format!(
        "{CAMERA}WorldBegin\nAttributeBegin {SLIDE} CoordinateSystem \"slide\"\n\
         ActiveTransform StartTime AttributeEnd\n\
         Translate 0 0 9 CoordSysTransform \"slide\" Translate 0 1 0 Shape \"Sphere\"\n"
    );
    let scene = loaded(&text).scene;
    let motion = scene.objects[0].motion.as_ref().expect("it moves");
    assert_eq!(motion.at(0.0).point([0.0; 3]), [1.0, 1.0, 0.0]);
    assert_eq!(motion.at(1.0).point([0.0; 3]), [5.0, 1.0, 0.0]);
}

#[test]
fn what_cannot_move_so_is_said() {
    let text = "TransformTimes 1 1\nCamera \"Pinhole\" \"float shutteropen\" 2\nWorldBegin\n\
        ActiveTransform Noon\nActiveTransform EndTime Scale -1 1 1\nShape \"Sphere\"\n\
        TransformTimes 0 1\n";
    let messages = load(text).expect_err("it is wrong").to_text(false);
    expect![[r#"
        error[E0607]: the motion starts at 1 and ends at 1, not after it
          ┌─ scene.pbrt:1:1
          │
        1 │ TransformTimes 1 1
          │ ^^^^^^^^^^^^^^

        error[E0602]: expected `StartTime`, `EndTime` or `All`
          ┌─ scene.pbrt:4:17
          │
        4 │ ActiveTransform Noon
          │                 ^^^^

        error[E0613]: the current transform moves from one side of a mirror to the other
          ┌─ scene.pbrt:6:1
          │
        6 │ Shape "Sphere"
          │ ^^^^^

        error[E0612]: `TransformTimes` appears after `WorldBegin`, expected before it
          ┌─ scene.pbrt:7:1
          │
        7 │ TransformTimes 0 1
          │ ^^^^^^^^^^^^^^

        error[E0607]: the shutter closes at 1, before it opens at 2
          ┌─ scene.pbrt:2:8
          │
        2 │ Camera "Pinhole" "float shutteropen" 2
          │        ^^^^^^^^^

    "#]]
    .assert_eq(&messages);
}
