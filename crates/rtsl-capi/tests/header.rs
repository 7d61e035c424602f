//! The headers are those of the text.
//!
//! A separate test program, since `rtsl.h` names it.

use std::path::{Path, PathBuf};

use expect_test::expect_file;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn rtsl_h_is_made_of_the_crate() {
    let config = cbindgen::Config::from_file(folder().join("cbindgen.toml")).expect("it is there");
    let mut builder = cbindgen::Builder::new().with_config(config);
    for source in sources(&folder().join("src")) {
        builder = builder.with_src(source);
    }
    let mut text = Vec::new();
    builder.generate().expect("the crate has a header").write(&mut text);
    let text = String::from_utf8(text).expect("it is text");
    expect_file!["../include/rtsl.h"].assert_eq(&text);
}

#[test]
fn rtsl_kernel_h_is_that_of_libraries() {
    expect_file!["../include/rtsl_kernel.h"].assert_eq(&rtsl::aot::kernel_header());
}

/// In the order of their names, but what others use first.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("it is there");
    let mut sources: Vec<PathBuf> =
        entries.map(|entry| entry.expect("it can be read").path()).collect();
    // The others are found by its modules, and would be there twice.
    sources
        .retain(|path| path.extension().is_some_and(|it| it == "rs") && !path.ends_with("lib.rs"));
    let order = ["version", "error", "diagnostics", "registry", "unit", "instance", "engine"];
    let position = |path: &PathBuf| {
        let name = path.file_stem().and_then(|name| name.to_str()).unwrap_or_default().to_owned();
        (order.iter().position(|it| *it == name).unwrap_or(order.len()), name)
    };
    sources.sort_by_key(position);
    sources
}
