//! Reads arbitrary bytes as a PLY file.

use rtsl_scene::mesh::read_ply;

/// The reader. What it accepts keeps its word: every corner is a vertex.
pub fn ply(data: &[u8]) {
    if let Ok(mesh) = read_ply(data) {
        let vertices = mesh.vertices() as u32;
        assert!(mesh.indices.words().iter().all(|index| *index < vertices));
    }
}
