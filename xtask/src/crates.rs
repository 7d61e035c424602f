//! The crates and their dependencies: a picture of them for the manual, and the rule that none is added in passing.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use crate::shell::{Failure, Result, cargo};

/// The crates of RTSL that each crate may use. A dependency that is not here fails [`check`]: it belongs here, and
/// into the table of the architecture page, before it is used.
const ALLOWED: &[(&str, &[&str])] = &[
    ("rtsl-source", &[]),
    ("rtsl-spec", &[]),
    ("rtsl-math", &[]),
    ("rtsl-memory", &["rtsl-source"]),
    ("rtsl-syntax", &["rtsl-source"]),
    ("rtsl-format", &["rtsl-source", "rtsl-syntax"]),
    ("rtsl-ir", &["rtsl-spec"]),
    ("rtsl-sema", &["rtsl-source", "rtsl-spec", "rtsl-syntax", "rtsl-ir"]),
    ("rtsl-lower", &["rtsl-source", "rtsl-spec", "rtsl-sema", "rtsl-ir"]),
    ("rtsl-opt", &["rtsl-ir", "rtsl-spec"]),
    ("rtsl-stages", &["rtsl-ir", "rtsl-opt"]),
    ("rtsl-abi", &["rtsl-spec", "rtsl-ir", "rtsl-memory"]),
    ("rtsl-link", &["rtsl-source", "rtsl-spec", "rtsl-ir", "rtsl-opt", "rtsl-abi"]),
    (
        "rtsl-integrate",
        &[
            "rtsl-source",
            "rtsl-spec",
            "rtsl-syntax",
            "rtsl-ir",
            "rtsl-sema",
            "rtsl-lower",
            "rtsl-opt",
            "rtsl-stages",
            "rtsl-abi",
            "rtsl-link",
            "rtsl-math",
        ],
    ),
    ("rtsl-packet", &["rtsl-abi", "rtsl-spec", "rtsl-ir"]),
    ("rtsl-llvm", &["rtsl-abi", "rtsl-packet", "rtsl-ir", "rtsl-spec"]),
    ("rtsl-cpp", &["rtsl-abi", "rtsl-ir", "rtsl-spec"]),
    ("rtsl-jit", &["rtsl-abi", "rtsl-ir", "rtsl-memory", "rtsl-packet", "rtsl-llvm"]),
    (
        "rtsl",
        &[
            "rtsl-source",
            "rtsl-spec",
            "rtsl-syntax",
            "rtsl-ir",
            "rtsl-sema",
            "rtsl-lower",
            "rtsl-opt",
            "rtsl-stages",
            "rtsl-abi",
            "rtsl-link",
            "rtsl-integrate",
            "rtsl-packet",
            "rtsl-llvm",
            "rtsl-cpp",
            "rtsl-jit",
            "rtsl-math",
            "rtsl-memory",
        ],
    ),
    ("rtsl-ide", &["rtsl", "rtsl-source", "rtsl-spec", "rtsl-sema", "rtsl-syntax"]),
    ("rtsl-lsp", &["rtsl", "rtsl-format", "rtsl-ide"]),
    ("rtsl-image", &["rtsl-source", "rtsl-math", "rtsl-memory"]),
    ("rtsl-bvh", &["rtsl-math", "rtsl-memory"]),
    ("rtsl-materialx", &["rtsl-source"]),
    ("rtsl-scene", &["rtsl", "rtsl-image", "rtsl-materialx", "rtsl-math", "rtsl-memory"]),
    ("rtsl-render", &["rtsl", "rtsl-bvh", "rtsl-image", "rtsl-math", "rtsl-memory", "rtsl-scene"]),
    ("rtsl-contract", &["rtsl"]),
    ("rtsl-debug", &["rtsl"]),
    (
        "rtsl-view",
        &["rtsl", "rtsl-debug", "rtsl-ide", "rtsl-image", "rtsl-math", "rtsl-render", "rtsl-scene"],
    ),
    ("rtsl-capi", &["rtsl"]),
    ("rtsl-python", &["rtsl", "rtsl-image", "rtsl-math", "rtsl-render", "rtsl-scene"]),
    (
        "rtsl-cli",
        &[
            "rtsl",
            "rtsl-contract",
            "rtsl-debug",
            "rtsl-format",
            "rtsl-image",
            "rtsl-lsp",
            "rtsl-materialx",
            "rtsl-memory",
            "rtsl-render",
            "rtsl-scene",
            "rtsl-view",
        ],
    ),
    ("rtsl-testing", &["rtsl-source", "rtsl-spec", "rtsl-syntax", "rtsl-sema", "rtsl-ir"]),
];

/// The file of the picture.
const PICTURE: &str = "docs/src/images/crates.svg";

/// Writes the picture.
pub fn draw() -> Result<()> {
    let picture = picture(&dependencies()?);
    std::fs::write(PICTURE, picture).map_err(|error| Failure(format!("{PICTURE}: {error}")))
}

/// Checks that every crate uses only the crates that it may use, and that the picture shows the crates as they are.
pub fn check() -> Result<()> {
    let found = dependencies()?;
    let allowed: BTreeMap<&str, &[&str]> = ALLOWED.iter().copied().collect();
    for (name, uses) in &found {
        let allowed = allowed.get(name.as_str());
        let Some(allowed) = allowed else {
            return Err(Failure(format!("`{name}` is missing in xtask/src/crates.rs")));
        };
        if let Some(other) = uses.iter().find(|it| !allowed.contains(&it.as_str())) {
            return Err(Failure(format!(
                "`{name}` must not know `{other}`; xtask/src/crates.rs lists what it may use"
            )));
        }
    }
    let written = std::fs::read_to_string(PICTURE).unwrap_or_default();
    if written == picture(&found) {
        Ok(())
    } else {
        Err(Failure(format!("{PICTURE} is not current; `cargo xtask crates` renews it")))
    }
}

/// The crates in `crates/`, each with those of them that it uses, by Cargo.
fn dependencies() -> Result<BTreeMap<String, BTreeSet<String>>> {
    let tree = [
        "tree",
        "--workspace",
        "--all-features",
        "--edges",
        "normal",
        "--depth",
        "1",
        "--prefix",
        "depth",
        "--no-dedupe",
    ];
    let listed = cargo(tree).args(["--format", "{p}"]).output()?;
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut current = None;
    for line in listed.lines() {
        let is_crate = line.contains("/crates/") || line.contains("\\crates\\");
        let name = line.get(1..).and_then(|it| it.split(' ').next()).unwrap_or_default().to_owned();
        match line.get(..1) {
            Some("0") => {
                current = is_crate.then(|| name.clone());
                if is_crate {
                    found.entry(name).or_default();
                }
            }
            Some("1") if is_crate => {
                if let Some(uses) = current.as_ref().and_then(|it| found.get_mut(it)) {
                    uses.insert(name);
                }
            }
            _ => {}
        }
    }
    Ok(found)
}

/// The longest way from each crate down to one that uses none.
fn layers(found: &BTreeMap<String, BTreeSet<String>>) -> BTreeMap<&str, usize> {
    let mut layers: BTreeMap<&str, usize> = found.keys().map(|it| (it.as_str(), 0)).collect();
    // Each round settles at least one layer, since Cargo accepts no circles.
    for _ in found {
        for (name, uses) in found {
            let below = uses.iter().filter_map(|it| layers.get(it.as_str()).copied()).max();
            layers.insert(name, below.map_or(0, |below| below + 1));
        }
    }
    layers
}

/// The dependencies that do not follow from others.
fn direct<'a>(
    found: &'a BTreeMap<String, BTreeSet<String>>,
    name: &str,
) -> impl Iterator<Item = &'a String> {
    let uses = &found[name];
    let reaches = move |from: &String, to: &String| {
        let mut waiting = vec![from];
        while let Some(next) = waiting.pop() {
            if next == to {
                return true;
            }
            waiting.extend(found.get(next).into_iter().flatten());
        }
        false
    };
    uses.iter().filter(move |it| !uses.iter().any(|other| other != *it && reaches(other, it)))
}

/// The column of each crate in the picture: renderers on the left, the compiler on the right.
const COLUMNS: &[&[&str]] = &[
    &["rtsl-math", "rtsl-bvh", "rtsl-render", "rtsl-view"],
    &["rtsl-memory", "rtsl-image", "rtsl-scene", "rtsl-python"],
    &["rtsl-source", "rtsl-syntax", "rtsl-sema", "rtsl-lower", "rtsl-cli"],
    &["rtsl-opt", "rtsl-stages", "rtsl-integrate", "rtsl"],
    &["rtsl-spec", "rtsl-ir", "rtsl-link", "rtsl-contract"],
    &["rtsl-abi", "rtsl-packet", "rtsl-llvm", "rtsl-jit", "rtsl-capi"],
];

/// The column of each crate: its own, or for crates without one the last that is free in their layer.
fn columns(layers: &BTreeMap<&str, usize>) -> Vec<usize> {
    let own = |name: &str| COLUMNS.iter().position(|names| names.contains(&name));
    let mut taken: BTreeSet<(usize, usize)> =
        layers.iter().filter_map(|(name, layer)| Some((*layer, own(name)?))).collect();
    let mut column_of = |(name, layer): (&&str, &usize)| {
        own(name).unwrap_or_else(|| {
            let free = (0..COLUMNS.len()).rev().find(|column| taken.insert((*layer, *column)));
            free.expect("a layer has a column for each of its crates")
        })
    };
    layers.iter().map(&mut column_of).collect()
}

/// The crates as boxes, a row for each layer, users above what they use.
fn picture(found: &BTreeMap<String, BTreeSet<String>>) -> String {
    const BOX: (usize, usize) = (118, 30);
    const STEP: (usize, usize) = (134, 60);
    // Tests alone use it.
    let mut found = found.clone();
    found.remove("rtsl-testing");
    let layers = layers(&found);
    let rows = 1 + layers.values().copied().max().unwrap_or(0);
    let (width, height) = (COLUMNS.len() * STEP.0, rows * STEP.1);
    let center = |(name, column): (&&'_ str, usize)| {
        let (x, y) =
            (column * STEP.0 + STEP.0 / 2, (rows - 1 - layers[name]) * STEP.1 + STEP.1 / 2);
        (name.to_string(), (x, y))
    };
    let centers: BTreeMap<String, (usize, usize)> =
        layers.keys().zip(columns(&layers)).map(center).collect();
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"13\" text-anchor=\"middle\">\n<title>The crates of RTSL; lines lead down to the crates that a crate \
         uses</title>\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    for name in found.keys() {
        let (x, y) = centers[name.as_str()];
        for other in direct(&found, name) {
            let (to_x, to_y) = centers[other.as_str()];
            let (from_y, to_y) = (y + BOX.1 / 2, to_y - BOX.1 / 2);
            let middle = (from_y + to_y) / 2;
            let _ = writeln!(
                svg,
                "<path d=\"M{x} {from_y} C{x} {middle} {to_x} {middle} {to_x} {to_y}\" fill=\"none\" stroke=\"#999\"/>"
            );
        }
    }
    for (name, (x, y)) in &centers {
        let (left, top) = (x - BOX.0 / 2, y - BOX.1 / 2);
        let _ = writeln!(
            svg,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" rx=\"4\" fill=\"#eef3fa\" stroke=\"#456\"/>\
             <text x=\"{x}\" y=\"{}\">{name}</text>",
            BOX.0,
            BOX.1,
            y + 5
        );
    }
    svg + "</svg>\n"
}
