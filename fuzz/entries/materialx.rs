//! Reads arbitrary bytes as a MaterialX document of a scene's material.

use std::io;
use std::path::{Path, PathBuf};

use rtsl_memory::Amount;
use rtsl_scene::reader::FileSource;
use rtsl_scene::{LoadOptions, load_scene};

/// A scene with a sphere, and the document of its material.
struct Files<'a>(&'a [u8]);

impl FileSource for Files<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let scene = "Camera \"perspective\"\nWorldBegin\n\
            Material \"materialx\" \"string file\" \"document.mtlx\"\nShape \"sphere\"\n";
        match path.to_str() {
            Some("scene.pbrt") => Ok(scene.as_bytes().to_vec()),
            Some("document.mtlx") => Ok(self.0.to_vec()),
            _ => Err(io::ErrorKind::NotFound.into()),
        }
    }

    fn list(&self, _folder: &Path) -> io::Result<Vec<PathBuf>> {
        Ok(Vec::new())
    }
}

/// The reader, within 64 MiB. A document that is accepted gives a class without errors.
pub fn materialx(data: &[u8]) {
    let options = LoadOptions { input_memory: Some(Amount(64 << 20)), ..LoadOptions::default() };
    let Ok(loaded) = load_scene(Path::new("scene.pbrt"), &Files(data), &options) else { return };
    assert_eq!(loaded.scene.materials.len(), 1);
}
