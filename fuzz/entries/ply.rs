//! Reads arbitrary bytes as files of meshes: PLY, OBJ and STL.

use rtsl_memory::{Amount, InputBudget};
use rtsl_scene::mesh::{Mesh, read_obj_within, read_ply, read_stl_within};

/// The reader of PLY files.
pub fn ply(data: &[u8]) {
    read_ply(data).iter().for_each(check);
}

/// The reader of OBJ files.
pub fn obj(data: &[u8]) {
    read_obj_within(data, &budget()).iter().for_each(check);
}

/// The reader of STL files.
pub fn stl(data: &[u8]) {
    read_stl_within(data, &budget()).iter().for_each(check);
}

fn budget() -> InputBudget {
    InputBudget::new(Some(Amount(32 << 20)))
}

/// A mesh that a reader accepts keeps its word: every corner is a vertex.
fn check(mesh: &Mesh) {
    let vertices = mesh.vertices() as u32;
    assert!(mesh.indices.words().iter().all(|index| *index < vertices));
}
