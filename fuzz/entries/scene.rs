//! Reads arbitrary text as a scene.

use std::path::PathBuf;

use rtsl::{Diagnostics, SourceMap, render};
use rtsl_scene::reader::{MemoryFiles, read_scene};

/// The reader; the scene can include itself.
pub fn scene(data: &[u8]) {
    let path = PathBuf::from("fuzz.pbrt");
    let text = String::from_utf8_lossy(data).into_owned();
    let files = MemoryFiles([(path.clone(), text)].into());
    let (mut map, mut diagnostics) = (SourceMap::new(), Diagnostics::new());
    read_scene(&path, &files, &mut map, &mut diagnostics);
    render::all_to_text(&map, diagnostics.iter(), false);
}
