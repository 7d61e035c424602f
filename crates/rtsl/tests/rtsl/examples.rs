//! The example host draws the same picture as that in C, whose test pins it too.

use std::path::{Path, PathBuf};
use std::process::Command;

use expect_test::expect_file;
use rtsl_testing::digest::fnv1a;

#[test]
fn the_host_in_rust_draws_two_pictures() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let (thin, thick) = (folder.join("thin.ppm"), folder.join("thick.ppm"));
    let shaders = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shaders");
    let mut run = Command::new(env!("CARGO"));
    // Without naming the package: its dependencies would be built again, with the features that it needs alone.
    run.current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."));
    run.args(["run", "--quiet", "--example", "ray_tracer", "--"]);
    run.arg(shaders.join("primitives/torus.rtsl")).arg(shaders.join("materials/ward.rtsl"));
    run.arg("minorRadius=0.2").arg(&thin).arg("minorRadius=0.5").arg("alphaU=0.4").arg(&thick);
    let ran = run.output().expect("cargo runs");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let [thin, thick] = [thin, thick].map(|path| std::fs::read(path).expect("it was written"));
    assert_ne!(thin, thick);
    let sums = format!("{:08x} {:08x}\n", fnv1a(&thin), fnv1a(&thick));
    expect_file!["../../../../integrations/hosts/pictures.txt"].assert_eq(&sums);
}
