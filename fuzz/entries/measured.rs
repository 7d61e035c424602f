//! Reads arbitrary bytes as a measured material.

use std::io;
use std::path::{Path, PathBuf};

use rtsl_memory::Amount;
use rtsl_scene::reader::FileSource;
use rtsl_scene::{LoadOptions, load_scene};

const SCENE: &str = "Camera \"perspective\"\nWorldBegin\n\
    Material \"measured\" \"string filename\" \"paint.bsdf\"\nShape \"sphere\"\n";

/// A scene, and the bytes as its material.
struct Files<'a>(&'a [u8]);

impl FileSource for Files<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        match path.extension() {
            Some(extension) if extension == "bsdf" => Ok(self.0.to_vec()),
            // Shaders of the library include others, which are looked for beside the scene, too.
            Some(extension) if extension == "rtsl" => Err(io::ErrorKind::NotFound.into()),
            _ => Ok(SCENE.as_bytes().to_vec()),
        }
    }

    fn list(&self, _: &Path) -> io::Result<Vec<PathBuf>> {
        Ok(Vec::new())
    }
}

/// The reader, in 32 MiB. What it accepts has numbers alone. Returns true if it accepts the bytes.
pub fn measured(data: &[u8]) -> bool {
    let options = LoadOptions { input_memory: Some(Amount(32 << 20)), ..LoadOptions::default() };
    let Ok(loaded) = load_scene(Path::new("scene.pbrt"), &Files(data), &options) else {
        return false;
    };
    let words = loaded.scene.materials[0].buffer("tables").expect("the class has it");
    assert!(words.iter().all(|word| f32::from_bits(*word).is_finite()));
    true
}
