//! The example host in C draws the same picture as that in Rust, whose test pins it too.

use crate::compiler::{CProgram, has_compiler, repository};
use expect_test::expect_file;
use rtsl_testing::digest::fnv1a;

#[test]
fn the_host_in_c_draws_two_pictures() {
    if !has_compiler() {
        return;
    }
    let source = repository().join("integrations/hosts/ray_tracer.c");
    let program = CProgram::of(&source).sanitized().with_library();
    let folder = program.folder().to_owned();
    let (thin, thick) = (folder.join("thin.ppm"), folder.join("thick.ppm"));
    let shaders = repository().join("shaders");
    program
        .argument(shaders.join("primitives/torus.rtsl"))
        .argument(shaders.join("materials/ward.rtsl"))
        .argument("minorRadius=0.2")
        .argument(&thin)
        .argument("minorRadius=0.5")
        .argument("alphaU=0.4")
        .argument(&thick)
        .run();
    let [thin, thick] = [thin, thick].map(|path| std::fs::read(path).expect("it was written"));
    assert_ne!(thin, thick);
    let sums = format!("{:08x} {:08x}\n", fnv1a(&thin), fnv1a(&thick));
    expect_file!["../../../../integrations/hosts/pictures.txt"].assert_eq(&sums);
}
