//! The pages that `rtsl explain` prints for scenes: each example reports its code, and the corrected example reports
//! nothing.

use std::path::{Path, PathBuf};

use rtsl::Messages;
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, load_scene};

/// The messages of loading a scene. Examples omit the camera.
fn messages(text: &str) -> Messages {
    let camera = "Camera \"Pinhole\"\n";
    let text = format!("{camera}{text}");
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text)].into());
    match load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default()) {
        Ok(loaded) => loaded.warnings,
        Err(messages) => messages,
    }
}

/// The text of the first block that starts with `fence`.
fn block<'a>(page: &'a str, fence: &str) -> Option<&'a str> {
    let start = page.find(fence)? + fence.len();
    let length = page[start..].find("```")?;
    Some(&page[start..start + length])
}

#[test]
fn examples_give_their_codes() {
    let mut examples = 0;
    let pages = rtsl::codes().iter();
    for info in pages.filter(|info| matches!(&info.code.as_str()[1..3], "06")) {
        let Some(failing) = block(info.explanation, "```pbrt,fails\n") else { continue };
        examples += 1;
        let said = messages(failing);
        let found = said.iter().any(|(_, diagnostic)| diagnostic.code == info.code);
        assert!(found, "{} expected, found:\n{}", info.code, said.to_text(false));
        let mended = block(info.explanation, "```pbrt\n").unwrap_or_default();
        let said = messages(mended);
        assert!(said.is_empty(), "{}, mended:\n{}", info.code, said.to_text(false));
    }
    assert!(examples >= 15, "{examples} examples");
}
