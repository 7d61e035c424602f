//! Reads arbitrary bytes as a scene.

use std::io;
use std::path::{Path, PathBuf};

use rtsl::{Diagnostics, SourceMap, render};
use rtsl_memory::{Amount, InputBudget};
use rtsl_scene::reader::{FileSource, read_scene_within};

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
