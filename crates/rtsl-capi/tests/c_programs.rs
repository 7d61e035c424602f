//! Programs in C that use the interface, with the address sanitizer.
//!
//! Where there is no C compiler they are left out, unless `RTSL_REQUIRE_CXX` is set.

mod compiler;

use compiler::{CProgram, check_header, has_compiler};

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
