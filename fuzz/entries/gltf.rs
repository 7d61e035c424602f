//! Reads arbitrary bytes as a glTF file: as a mesh, and as a scene.

use std::io;
use std::path::{Path, PathBuf};

use rtsl::{Diagnostics, SourceMap};
use rtsl_memory::{Amount, InputBudget};
use rtsl_scene::gltf::read_gltf_scene;
use rtsl_scene::mesh::read_gltf;
use rtsl_scene::reader::{FileSource, Values};
use rtsl_scene::{LoadOptions, load_scene};

/// The reader of meshes. What it accepts keeps its word: every corner is a vertex.
pub fn gltf(data: &[u8]) {
    let no_files = |_: &str| Err(io::ErrorKind::NotFound.into());
    if let Ok(mesh) = read_gltf(data, &no_files) {
        let vertices = mesh.vertices() as u32;
        assert!(mesh.indices.words().iter().all(|index| *index < vertices));
    }
}

/// One file, and a material that reads attributes.
struct Lone<'a>(&'a [u8]);

const READER: &str = "class GltfPbr : rt_Material;
public texture color baseColor = color(1.0);
public texture float metallic = 1.0;
public texture float roughness = 1.0;
attribute float height; attribute color Cd; attribute vec2 uv0; attribute vec2 st; attribute vec3 tangent;
void emission() { rt_EmissionColor = height * uv0.x * st.x * tangent.x * Cd * baseColor; }
";

impl FileSource for Lone<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        match path.to_str() {
            Some("fuzz.glb") => Ok(self.0.to_vec()),
            Some("reader.rtsl") => Ok(READER.as_bytes().to_vec()),
            _ => Err(io::ErrorKind::NotFound.into()),
        }
    }

    fn list(&self, _folder: &Path) -> io::Result<Vec<PathBuf>> {
        Ok(vec!["reader.rtsl".into()])
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

/// The reader of attributes, within 64 MiB. Each attribute has values for all vertices of its shape.
pub fn gltf_attributes(data: &[u8]) {
    let options = LoadOptions { input_memory: Some(Amount(64 << 20)), ..LoadOptions::default() };
    let Ok(loaded) = load_scene(Path::new("fuzz.glb"), &Lone(data), &options) else { return };
    for object in &loaded.scene.objects {
        let class = object.primitive.class();
        let length = |name: &str| object.primitive.buffer(name).map_or(0, |words| words.len());
        let vertices = length("positions") / 3;
        for buffer in class.buffers.iter().filter(|it| it.name.starts_with("attributeValues")) {
            let count = length(&buffer.name);
            assert_eq!(count, vertices * buffer.len.max(1) as usize, "{}", buffer.name);
        }
    }
}
