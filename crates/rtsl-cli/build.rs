//! Finds the pages of the manual, so that `rtsl help` has them built in.

use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let package = std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR");
    let package = Path::new(&package);
    // The repository has the folder at its root, with a link to it here, so that packages hold it. A checkout of Git
    // on Windows makes no links, but text files.
    let mut docs = package.join("docs");
    if !docs.is_dir() {
        docs = package.join("../../docs");
    }
    println!("cargo::rustc-env=RTSL_DOCS={}", docs.display());
}
