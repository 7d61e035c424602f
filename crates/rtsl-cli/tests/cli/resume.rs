//! A render that is killed again and again, and goes on from its checkpoint each time, ends with the bits of one
//! that was never disturbed.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::command::{Folder, rtsl};

/// A folder with the scene.
fn scene_folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("scene.pbrt", SCENE);
    folder
}

const SCENE: &str = "Film \"rgb\" \"integer xresolution\" 60 \"integer yresolution\" 44
Sampler \"sobol\" \"integer pixelsamples\" 80
Integrator \"path\" \"integer maxdepth\" 3
LookAt 0 1 -5  0 0 0  0 1 0
Camera \"Pinhole\"
WorldBegin
LightSource \"infinite\" \"rgb L\" [0.5 0.6 0.7]
Shape \"Sphere\"
Texture \"tiles\" \"spectrum\" \"Checker\" \"float scale\" 3
Material \"diffuse\" \"texture reflectance\" \"tiles\"
Shape \"Plane\" \"point3 point\" [0 -1 0]
";

fn render(folder: &Folder, output: &str) -> Command {
    let mut command = rtsl();
    command.arg("render").arg(folder.path("scene.pbrt")).arg("-o").arg(folder.path(output));
    command.args(["--threads", "2"]).stderr(Stdio::null());
    command
}

fn kept(folder: &Folder, output: &str) -> Command {
    let mut command = render(folder, output);
    command.arg("--checkpoint").arg(folder.path("kept.checkpoint"));
    command.args(["--checkpoint-every", "0", "--resume"]);
    command
}

fn bytes(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn a_killed_render_ends_with_the_same_bits() {
    let folder = scene_folder("killed");
    let begun = Instant::now();
    assert!(render(&folder, "whole.exr").status().expect("it runs").success());
    let whole = begun.elapsed();
    let (mut kills, mut kills_with_checkpoint) = (0, 0);
    let mut state = 12_345_u32;
    while kills < 20 {
        let mut child = kept(&folder, "resumed.exr").spawn().expect("it runs");
        // Any moment, that of writing a checkpoint included.
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let part = f64::from(state) / f64::from(u32::MAX);
        std::thread::sleep(whole.mul_f64(0.3 + 0.5 * part));
        if child.try_wait().expect("it is ours").is_some() {
            break;
        }
        child.kill().expect("it can be killed");
        child.wait().expect("it ends");
        kills += 1;
        kills_with_checkpoint += u32::from(folder.path("kept.checkpoint").exists());
    }
    assert!(kills_with_checkpoint > 0, "{kills} kills before the first checkpoint");
    assert!(kept(&folder, "resumed.exr").status().expect("it runs").success(), "{kills} kills");
    assert!(
        bytes(&folder.path("resumed.exr")) == bytes(&folder.path("whole.exr")),
        "{kills} kills"
    );
}

#[test]
fn time_ends_a_render_that_goes_on_later() {
    let folder = scene_folder("time");
    assert!(render(&folder, "whole.exr").status().expect("it runs").success());
    // Nothing is rendered in no time but what was begun.
    let early = render(&folder, "picture.exr").args(["--time", "0"]).output().expect("it runs");
    assert_eq!(early.status.code(), Some(0));
    assert!(folder.path("picture.exr.checkpoint").exists());
    let resumed = render(&folder, "picture.exr").arg("--resume").status().expect("it runs");
    assert!(resumed.success());
    assert!(bytes(&folder.path("picture.exr")) == bytes(&folder.path("whole.exr")));
}

/// Textures smoothed over what rays see, and a target for noise, at numbers of samples with which no wave ends.
#[test]
fn more_samples_go_on_from_fewer() {
    for (sampler, noise) in [("sobol", None), ("independent", None), ("sobol", Some("0.03"))] {
        let folder = scene_folder(&format!("more-{sampler}-{}", noise.is_some()));
        let text = SCENE.replace("sobol", sampler);
        std::fs::write(folder.path("scene.pbrt"), text).expect("a scene for the test");
        let wanted = |command: &mut Command, samples: &[&str]| {
            command.args(["--size", "24x16"]);
            command.args(noise.map(|noise| ["--noise", noise]).into_iter().flatten());
            assert!(command.args(samples).status().expect("it runs").success());
        };
        wanted(&mut render(&folder, "whole.exr"), &[]);
        for samples in ["20", "46"] {
            wanted(&mut kept(&folder, "few.exr"), &["--spp", samples]);
        }
        wanted(&mut kept(&folder, "more.exr"), &[]);
        let same = bytes(&folder.path("more.exr")) == bytes(&folder.path("whole.exr"));
        assert!(same, "{sampler}, noise {noise:?}");
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let folder = scene_folder("refused");
    assert!(kept(&folder, "picture.exr").status().expect("it runs").success());
    let refused = |command: &mut Command, expected: &str| {
        let output = command.stderr(Stdio::piped()).output().expect("it runs");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert!(text.contains(expected), "{text}");
    };
    refused(kept(&folder, "other.exr").args(["--seed", "3"]), "E0622");
    refused(kept(&folder, "other.exr").args(["--aov", "albedo"]), "E0622");
    let strict = ["--math", "strict"];
    refused(kept(&folder, "other.exr").args(strict), "the render arithmetic strict");
    let fast = ["--math", "fast"];
    refused(kept(&folder, "other.exr").args(fast), "the checkpoint has arithmetic contract");
    folder.write("scene.pbrt", format!("{SCENE}# changed\n"));
    refused(&mut kept(&folder, "other.exr"), "E0622");
    folder.write("scene.pbrt", SCENE);
    let mut damaged = bytes(&folder.path("kept.checkpoint"));
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    std::fs::write(folder.path("kept.checkpoint"), damaged).expect("a checkpoint");
    refused(&mut kept(&folder, "other.exr"), "E0621");
    assert!(!folder.path("other.exr").exists());
}
