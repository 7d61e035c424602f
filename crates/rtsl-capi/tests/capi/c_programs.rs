//! Programs in C that use the interface, with the address sanitizer.
//!
//! Where there is no C compiler they are left out, unless `RTSL_REQUIRE_CXX` is set.

use crate::compiler::{CProgram, check_header, has_compiler};

/// Compiles and runs a program of `tests/c` that links against the static library.
fn run(name: &str) {
    if has_compiler() {
        CProgram::new(name).sanitized().with_library().run();
    }
}

#[test]
fn a_host_changes_a_parameter_without_a_compilation() {
    run("parameters");
}

#[test]
fn shapes_pass_attributes_and_choices_have_names() {
    run("attributes");
}

#[test]
fn what_is_wrong_is_an_error_with_a_message() {
    run("misuse");
}

#[test]
fn the_headers_are_for_every_standard() {
    if !has_compiler() {
        return;
    }
    for (language, standard) in [("c", "c99"), ("c", "c17"), ("c++", "c++11"), ("c++", "c++20")] {
        check_header(language, standard);
    }
}

#[test]
fn shaders_ask_their_host() {
    run("requests");
}

#[test]
fn a_budget_ends_constructors() {
    run("budget");
}

#[test]
fn what_ends_with_the_process_may_be_released_then() {
    if has_compiler() {
        let printed = CProgram::new("ending").sanitized().with_library().run_with(&[]);
        assert_eq!(String::from_utf8_lossy(&printed), "ended\n");
    }
}

// Without the address sanitizer, whose own threads and locks do not survive forks.
#[test]
fn children_compile_or_are_told_that_they_cannot() {
    if has_compiler() {
        CProgram::new("forks").with_library().run();
    }
}

/// Of a few such ends at different moments one crashed at least as long as LLVM's globals went while threads used them.
#[test]
fn a_process_may_end_while_threads_compile() {
    if has_compiler() {
        let program = CProgram::new("exits").with_library().build();
        for milliseconds in (40..600).step_by(40) {
            let run = std::process::Command::new(&program).arg(milliseconds.to_string()).output();
            let run = run.expect("the program runs");
            let errors = String::from_utf8_lossy(&run.stderr);
            assert!(run.status.success(), "after {milliseconds} ms: {}\n{errors}", run.status);
        }
    }
}
