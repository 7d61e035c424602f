//! Reads arbitrary bytes as a scene.

use std::io;
use std::path::{Path, PathBuf};

use rtsl::{Diagnostics, SourceMap, render};
use rtsl_memory::{Amount, InputBudget};
use rtsl_scene::reader::{ConversionOptions, FileSource, convert_scene, read_scene_within};

/// One file of any bytes.
struct OneFile<'a>(&'a [u8]);

const NAME: &str = "fuzz.pbrt";

impl FileSource for OneFile<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        if path == Path::new(NAME) {
            Ok(self.0.to_vec())
        } else {
            Err(io::ErrorKind::NotFound.into())
        }
    }

    fn list(&self, _: &Path) -> io::Result<Vec<PathBuf>> {
        Ok(Vec::new())
    }
}

/// The reader; the scene may be compressed and can include itself.
pub fn scene(data: &[u8]) {
    let budget = InputBudget::new(Some(Amount(32 << 20)));
    let (mut map, mut diagnostics) = (SourceMap::new(), Diagnostics::new());
    read_scene_within(Path::new(NAME), &OneFile(data), &budget, &mut map, &mut diagnostics);
    assert!(budget.taken() <= budget.limit());
    render::all_to_text(&map, diagnostics.iter(), false);
}

/// The conversion to the format of pbrt-v4, of which every result is read again.
pub fn conversion(data: &[u8]) {
    for inline in [false, true] {
        let options = ConversionOptions { inline, input_memory: Some(Amount(32 << 20)) };
        let converted =
            convert_scene(Path::new(NAME), Path::new("new.pbrt"), &OneFile(data), &options);
        match converted {
            Ok(conversion) => {
                conversion.files.iter().for_each(|(_, text)| scene(text.as_bytes()));
                conversion.warnings.to_text(false);
            }
            Err(messages) => assert!(messages.has_errors()),
        }
    }
}
