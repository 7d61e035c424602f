//! Lists the files of the prelude and of the renderer's texts, so that they are built into the program.

use std::fmt::Write;
use std::path::{Path, PathBuf};

fn main() {
    // Asked for when it runs: a build folder that was copied may bring a script compiled elsewhere.
    let package = std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR");
    let package = Path::new(&package);
    // The repository has the folder at its root, with a link to it here, so that packages hold it. A checkout of Git on
    // Windows makes no links, but text files.
    let root = if package.join("prelude").is_dir() { package } else { &package.join("../..") };
    let out = std::env::var_os("OUT_DIR").expect("cargo sets OUT_DIR");
    for (name, folder) in [("prelude", "prelude"), ("renderer", "prelude/renderer")] {
        let list = Path::new(&out).join(format!("{name}_files.rs"));
        std::fs::write(list, list_files(root, folder)).expect("OUT_DIR is writable");
    }
}

/// An array expression of the RTSL files in a folder, sorted by name.
fn list_files(root: &Path, folder: &str) -> String {
    let within = root.join(folder);
    println!("cargo::rerun-if-changed={}", within.display());
    let entries = std::fs::read_dir(within).expect("the package or the repository has the folder");
    let paths = entries.flatten().map(|entry| entry.path());
    let mut files: Vec<PathBuf> =
        paths.filter(|path| path.extension().is_some_and(|ending| ending == "rtsl")).collect();
    files.sort();
    let mut list = String::from("&[\n");
    for file in files {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let absolute = file.canonicalize().expect("it exists");
        let absolute = absolute.to_string_lossy();
        let path = format!("{folder}/{name}");
        writeln!(list, "TextFile {{ path: {path:?}, text: include_str!({absolute:?}) }},")
            .expect("writing to a string succeeds");
    }
    list + "]"
}
