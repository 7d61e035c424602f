//! The project's shaders: those of the standard library give no diagnostics, and the others give
//! none of the warnings below.

use std::path::Path;

#[test]
fn the_standard_library_checks() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shaders");
    let mut report = String::new();
    for role in std::fs::read_dir(folder).unwrap() {
        let role = role.unwrap().path();
        if !role.is_dir() {
            continue;
        }
        for shader in std::fs::read_dir(role).unwrap() {
            let path = shader.unwrap().path();
            let said = rtsl_testing::checked::library_diagnostics(&path);
            if !said.is_empty() {
                report += &format!("{}:\n{said}\n", path.display());
            }
        }
    }
    assert!(report.is_empty(), "{report}");
}

/// Warnings about mistakes that compile.
const WARNINGS: [&str; 6] = ["W0245", "W0246", "W0335", "W0336", "W0337", "W0338"];

/// Texts that contain such statements on purpose.
const MEANT: [&str; 2] = ["tests/syntax/expressions.rtsl", "tests/glsl/not-supported-values.rtsl"];

#[test]
fn correct_shaders_give_no_warnings() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut folders = ["bench", "crates", "integrations", "scenes", "shaders", "tests"]
        .map(|folder| root.join(folder))
        .to_vec();
    let (mut report, mut checked) = (String::new(), 0);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|it| it == "rtsl")
                && !MEANT.iter().any(|meant| path.ends_with(meant))
            {
                let text = std::fs::read_to_string(&path).unwrap();
                let codes = rtsl_testing::checked::codes(&text);
                if codes.iter().any(|code| WARNINGS.contains(code)) {
                    report += &format!(
                        "{}:\n{}\n",
                        path.display(),
                        rtsl_testing::checked::diagnostics(&text)
                    );
                }
                checked += 1;
            }
        }
    }
    assert!(report.is_empty() && checked > 100, "{checked} texts\n{report}");
}
