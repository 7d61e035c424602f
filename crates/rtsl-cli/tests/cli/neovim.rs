//! `rtsl lsp` with an editor that people use: Neovim without a window.

use std::process::Command;

use expect_test::expect;

use crate::command::Folder;
use crate::lsp::{BALL, WAVE};

const DISC: &str = "/// A disc.
class Disc : rt_Primitive;

[[min 0]] public float radius = 1.0;

void intersect() {
    float t = -rt_RayOrigin.z / rt_RayDirection.z;
    vec2 p = rt_RayOrigin.xy + t * rt_RayDirection.xy;
    if (dot(p, p) < radius * radius) hit(tt);
}

void computeNormal() {
    rt_GeometricNormal = vec3(0.0, 0.0, 1.0);
    rt_Hi
}
";

#[test]
fn neovim_shows_diagnostics_completes_and_renames() {
    let is_there = Command::new("nvim").arg("--version").output().is_ok();
    if !is_there {
        assert!(std::env::var_os("RTSL_REQUIRE_NEOVIM").is_none(), "there is no Neovim");
        println!("there is no Neovim: skipped");
        return;
    }
    let folder = Folder::new("neovim");
    folder.write("wave.rtsl", DISC);
    folder.write("halves.rtsl", WAVE.replace("Wave", "Halves"));
    folder.write("ball.pbrt", BALL.replace("Wave", "Halves"));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cli/neovim.lua");
    let run = Command::new("nvim")
        .args(["--clean", "--headless", "-n", "-i", "NONE", "-c", &format!("luafile {script}")])
        .current_dir(&folder.0)
        .env("RTSL_PROGRAM", env!("CARGO_BIN_EXE_rtsl"))
        .env("RTSL_PLUGIN", concat!(env!("CARGO_MANIFEST_DIR"), "/../../editors/neovim"))
        .env("XDG_CACHE_HOME", folder.0.path().join("cache"))
        .output()
        .expect("Neovim runs");
    let output = String::from_utf8_lossy(&run.stdout).replace('\r', "");
    let errors = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{output}\n{errors}");
    expect![[r#"
        line 14: E0101: expected `;` after the expression, found `}`
        line 9: E0201: there is no `tt` here
        line 14: E0201: there is no `rt_Hi` here
        completes rt_HitDistance rt_HitPoint
        renamed: [[min 0]] public float size = 1.0;
        renamed: if (dot(p, p) < size * size) hit(tt);
        refused: true
        RTSL: Costs of lines: ball.pbrt
        costs: true
        RTSL: Pixel 2,4: ball.pbrt
        4 x = -N; 5 print: x = -N; 6 rt_FloatTextureValue = NaN
        6 print: x = -N; 7 rt_FloatTextureValue = NaN
        costs move: true
        cleared: true
    "#]]
    .assert_eq(&output);
}
