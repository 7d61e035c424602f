//! `cargo xtask package`: the packages that would be published.

use std::path::PathBuf;

use crate::shell::{Failure, Result, cargo, root, say};

/// Files that every package has.
const IN_ALL: [&str; 4] = ["Cargo.toml", "README.md", "LICENSE-APACHE", "LICENSE-MIT"];

/// Files that one package has from folders outside it, for each folder one.
const IN_ONE: [(&str, &str); 3] = [
    ("rtsl", "shaders/primitives/sphere.rtsl"),
    ("rtsl-sema", "prelude/common.rtsl"),
    ("rtsl-cli", "docs/src/explanation/architecture.md"),
];

/// Makes the packages and checks which files they have.
///
/// # Errors
///
/// If Cargo fails, or a file is missing.
pub fn run(arguments: &[String]) -> Result<()> {
    let verify = match arguments {
        [] => false,
        [option] if option == "--verify" => true,
        _ => return Err(Failure("usage: cargo xtask package [--verify]".to_owned())),
    };
    let (published, unpublished) = packages()?;
    say("files of each package");
    for name in &published {
        let list = cargo(["package", "--list", "--allow-dirty", "--package", name.as_str()]);
        let list = list.output()?;
        let files: Vec<String> = list.lines().map(|line| line.replace('\\', "/")).collect();
        let in_one = IN_ONE.iter().filter(|(package, _)| package == name).map(|(_, file)| file);
        for file in IN_ALL.iter().chain(in_one) {
            if !files.iter().any(|it| it == file) {
                return Err(Failure(format!("the package {name} lacks {file}")));
            }
        }
        eprintln!("{name}: {} files", files.len());
    }
    say("packages");
    let mut package = cargo(["package", "--workspace", "--allow-dirty"]);
    for name in &unpublished {
        package = package.args(["--exclude", name.as_str()]);
    }
    package.args((!verify).then_some("--no-verify")).run()
}

/// Names of the workspace's packages: those that are published, and the others.
fn packages() -> Result<(Vec<String>, Vec<String>)> {
    let mut manifests: Vec<PathBuf> =
        ["bench", "integrations/embree/rust", "xtask"].iter().map(|it| root().join(it)).collect();
    let crates = std::fs::read_dir(root().join("crates"));
    let crates = crates.map_err(|error| Failure(format!("crates: {error}")))?;
    manifests.extend(crates.flatten().map(|entry| entry.path()));
    manifests.sort();
    let (mut published, mut unpublished) = (Vec::new(), Vec::new());
    for folder in manifests {
        let path = folder.join("Cargo.toml");
        let text = std::fs::read_to_string(&path);
        let text = text.map_err(|error| Failure(format!("{}: {error}", path.display())))?;
        let name = text.lines().find_map(|line| line.strip_prefix("name = "));
        let name = name.unwrap_or_default().trim_matches('"').to_owned();
        let list =
            if text.contains("\npublish = false") { &mut unpublished } else { &mut published };
        list.push(name);
    }
    Ok((published, unpublished))
}
