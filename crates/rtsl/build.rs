//! Lists the files of the standard library, so that they are built into the program.

use std::fmt::Write;
use std::path::{Path, PathBuf};

fn main() {
    // Asked for when it runs: a build folder that was copied may bring a script compiled elsewhere.
    let package = std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR");
    let package = Path::new(&package);
    let out = std::env::var_os("OUT_DIR").expect("cargo sets OUT_DIR");
    let list = Path::new(&out).join("shaders_files.rs");
    std::fs::write(list, list_files(package, "shaders")).expect("OUT_DIR is writable");
}

/// An array expression of all RTSL files in a folder, sorted by name.
fn list_files(package: &Path, folder: &str) -> String {
    // The repository has the folder at its root, with a link to it here, so that packages hold it. A checkout of
    // Git on Windows makes no links, but text files.
    let root = if package.join(folder).is_dir() { package } else { &package.join("../..") };
    let mut files = Vec::new();
    collect(&root.join(folder), &mut files);
    assert!(
        !files.is_empty(),
        "the package or the repository has a folder `{folder}` with RTSL files"
    );
    files.sort();
    let mut list = String::from("&[\n");
    for file in files {
        let Ok(absolute) = file.canonicalize() else { continue };
        let name = file.strip_prefix(root).unwrap_or(&file).to_string_lossy().replace('\\', "/");
        let absolute = absolute.to_string_lossy();
        writeln!(list, "LibraryFile {{ path: {name:?}, text: include_str!({absolute:?}) }},")
            .expect("writing to a string succeeds");
    }
    list + "]"
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    println!("cargo::rerun-if-changed={}", folder.display());
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|ending| ending == "rtsl") {
            files.push(path);
        }
    }
}
