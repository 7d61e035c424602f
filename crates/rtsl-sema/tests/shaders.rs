//! The shaders of the standard library check without a word.

mod support;

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
            let text = std::fs::read_to_string(&path).unwrap();
            let said = support::diagnostics(&text);
            if !said.is_empty() {
                report += &format!("{}:\n{said}\n", path.display());
            }
        }
    }
    assert!(report.is_empty(), "{report}");
}
