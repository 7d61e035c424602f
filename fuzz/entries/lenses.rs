//! Reads arbitrary bytes as the lenses of a camera.

use std::path::{Path, PathBuf};

use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, load_scene};

/// The reader. What it accepts has numbers alone.
pub fn lenses(data: &[u8]) {
    let text = "Camera \"realistic\" \"string lensfile\" \"lenses.dat\"\nWorldBegin\n";
    let lenses = String::from_utf8_lossy(data).into_owned();
    let files = [("scene.pbrt", text.to_owned()), ("lenses.dat", lenses)];
    let files = MemoryFiles(files.map(|(path, text)| (PathBuf::from(path), text)).into());
    if let Ok(loaded) = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default()) {
        for buffer in ["elements", "pupils"] {
            let words = loaded.scene.camera.buffer(buffer).expect("the class has it");
            assert!(words.iter().all(|word| f32::from_bits(*word).is_finite()));
        }
    }
}
