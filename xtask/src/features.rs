//! The features of dependencies, the same in all builds of a checkout.
//!
//! Cargo compiles a crate once for each set of its features, and with it all crates above it. Tests, the program and
//! the Python package share their builds as long as each asks for the same sets. The crate `rtsl-features` names what
//! some would lack.

use std::collections::BTreeSet;

use crate::shell::{Failure, Result, cargo};

/// The build of `cargo xtask test`, as arguments of `cargo tree`.
const ALL: &[&str] = &["--workspace", "--exclude", "rtsl-python", "--edges", "normal,build,dev"];

/// The builds of parts.
const PARTS: &[(&str, &[&str])] = &[
    ("cargo run", &["--edges", "normal,build"]),
    ("cargo test", &["--edges", "normal,build,dev"]),
    (
        "cargo xtask python",
        &["-p", "rtsl-python", "--features", "rtsl-features", "--edges", "normal,build"],
    ),
];

/// The crates whose features differ: those of the window and of the X server, above which few crates are, and parts of
/// parsers that tests alone use.
const DIFFERING: &[&str] =
    &["rtsl-cli", "serde_spanned", "toml", "toml_datetime", "x11rb", "x11rb-protocol"];

/// Fails if a dependency has features in one build that it does not have in that of `cargo xtask test`.
///
/// # Errors
///
/// Names the dependency and the build.
pub fn check() -> Result<()> {
    let all = features(ALL)?;
    let is_shared = |package: &str| all.iter().any(|(other, _)| other == package);
    for (build, arguments) in PARTS {
        let others = features(arguments)?;
        let mut differing = others.difference(&all).filter(|(package, _)| is_shared(package));
        if let Some((package, features)) = differing.next() {
            return Err(Failure(format!(
                "`{package}` has other features for `{build}` ([{features}]) than for `cargo xtask test`, so \
                 crates above it are compiled twice; name the features in xtask/features/Cargo.toml, or the crate in \
                 xtask/src/features.rs"
            )));
        }
    }
    Ok(())
}

/// The packages of a build, by name and version, with their features.
fn features(arguments: &[&str]) -> Result<BTreeSet<(String, String)>> {
    let tree = cargo(["tree", "--prefix", "none", "--format", "{p}|{f}"]).args(arguments);
    let printed = tree.output()?;
    let package = |line: &str| {
        let (package, features) = line.trim_end_matches(" (*)").split_once('|')?;
        let mut words = package.split(' ');
        let (name, version) = (words.next()?, words.next()?);
        let is_watched = !DIFFERING.contains(&name);
        is_watched.then(|| (format!("{name} {version}"), features.to_owned()))
    };
    Ok(printed.lines().filter_map(package).collect())
}
