//! The shader cases of dEQP and piglit against the compiler and the interpreter.
//!
//! Every case becomes a class: what a stage receives and passes on are members, and `lookup` calls `main`. The rules of
//! `rules` leave cases out, each for a difference that the manual names. The suites are no part of this project;
//! `RTSL_GLSL` names a folder with them, in any depth. `RTSL_GLSL_SHOW` prints what became of the cases whose names
//! contain its text, and their translations.

mod builtins;
mod case;
mod deqp;
mod drawing;
mod items;
mod judge;
mod piglit;
mod reference;
mod report;
mod rules;
mod run;
mod tokens;
mod translate;

/// The part of the applicable cases that must agree.
const WANTED: f64 = 0.999;

#[test]
#[ignore = "needs the suites: `cargo xtask long glsl --suites FOLDER`"]
fn the_suites_agree() {
    let folder = std::env::var_os("RTSL_GLSL").expect("RTSL_GLSL names the folder");
    assert!(
        reference::is_installed(),
        "glslangValidator is missing; Debian has it in glslang-tools"
    );
    let shown = std::env::var("RTSL_GLSL_SHOW").ok();
    let suites = report::run(std::path::Path::new(&folder), shown.as_deref());
    assert!(!suites.is_empty(), "no case below {}", folder.display());
    for (name, suite) in suites {
        assert!(suite.agreeing() >= WANTED, "{name}: {:.4} agree", suite.agreeing());
    }
}
