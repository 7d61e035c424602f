//! Reads arbitrary bytes as a photometric file of a light.

use std::io;
use std::path::{Path, PathBuf};

use rtsl_memory::Amount;
use rtsl_scene::reader::FileSource;
use rtsl_scene::{LoadOptions, load_scene};

/// A scene with a light, and its file.
struct Files<'a>(&'a [u8]);

impl FileSource for Files<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let scene = "Camera \"perspective\"\nWorldBegin\n\
            LightSource \"IesLight\" \"string filename\" \"lamp.ies\"\nShape \"sphere\"\n";
        match path.to_str() {
            Some("scene.pbrt") => Ok(scene.as_bytes().to_vec()),
            Some("lamp.ies") => Ok(self.0.to_vec()),
            _ => Err(io::ErrorKind::NotFound.into()),
        }
    }

    fn list(&self, _folder: &Path) -> io::Result<Vec<PathBuf>> {
        Ok(Vec::new())
    }
}

/// The reader, within 32 MiB. What it accepts has an intensity for each pair of angles, all of them finite.
pub fn ies(data: &[u8]) {
    let options = LoadOptions { input_memory: Some(Amount(32 << 20)), ..LoadOptions::default() };
    let Ok(loaded) = load_scene(Path::new("scene.pbrt"), &Files(data), &options) else { return };
    let light = &loaded.scene.lights[0].light;
    let [verticals, horizontals, candela] = ["verticals", "horizontals", "candela"].map(|name| {
        let words = light.buffer(name).expect("the class has it");
        assert!(words.iter().all(|word| f32::from_bits(*word).is_finite()));
        words.len()
    });
    assert_eq!(candela, verticals * horizontals);
}
