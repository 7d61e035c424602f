//! Reads arbitrary bytes as a glTF file: as a mesh, and as a scene.

use std::io;
use std::path::{Path, PathBuf};

use rtsl::{Diagnostics, SourceMap};
use rtsl_memory::{Amount, InputBudget};
use rtsl_scene::gltf::read_gltf_scene;
use rtsl_scene::mesh::read_gltf;
use rtsl_scene::reader::{FileSource, Values};

/// The reader of meshes. What it accepts keeps its word: every corner is a vertex.
pub fn gltf(data: &[u8]) {
    let no_files = |_: &str| Err(io::ErrorKind::NotFound.into());
    if let Ok(mesh) = read_gltf(data, &no_files) {
        let vertices = mesh.vertices() as u32;
        assert!(mesh.indices.words().iter().all(|index| *index < vertices));
    }
}

/// One file.
struct Lone<'a>(&'a [u8]);

impl FileSource for Lone<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let is_it = path == Path::new("fuzz.glb");
        if is_it { Ok(self.0.to_vec()) } else { Err(io::ErrorKind::NotFound.into()) }
    }

    fn list(&self, _folder: &Path) -> io::Result<Vec<PathBuf>> {
        Ok(Vec::new())
    }
}

/// The reader of scenes, within 64 MiB. Arrays of shapes have whole elements, and every corner is a vertex.
pub fn gltf_scene(data: &[u8]) {
    let budget = InputBudget::new(Some(Amount(64 << 20)));
    let (mut map, mut diagnostics) = (SourceMap::new(), Diagnostics::new());
    let path = Path::new("fuzz.glb");
    let scene = read_gltf_scene(path, None, &Lone(data), &budget, &mut map, &mut diagnostics);
    for entity in &scene.entities {
        let words = |name: &str| match entity.parameter(name).map(|it| &it.values) {
            Some(Values::Buffer(numbers)) => numbers.words().to_vec(),
            Some(_) | None => Vec::new(),
        };
        let vertices = words("positions").len() / 3;
        assert!(words("indices").iter().all(|index| (*index as usize) < vertices));
        for (name, each) in
            [("normals", 3), ("tangents", 4), ("uvs", 2), ("uvs1", 2), ("colors", 4)]
        {
            let count = words(name).len();
            assert!(count == 0 || count == each * vertices, "{name}");
        }
    }
}
