//! The reader of glTF files, `.gltf` and `.glb`.
//!
//! It creates one mesh of all triangles of the default scene (or the first scene, if there is no default), transformed
//! by their nodes. Materials, cameras, lights, skins and animations are ignored. Coordinates are not converted.
//!
//! The crate `gltf` parses and validates the structure. This module checks the properties that the crate does not: the
//! length of a binary file, attributes without accessors, cycles of nodes, and offsets and counts of numbers in
//! buffers.

mod buffers;
mod numbers;

use std::io;

use gltf::mesh::Mode;
use gltf::{Accessor, Document, Node, Primitive, Semantic};
use rtsl_math::Transform;
use rtsl_memory::{Amount, Held, InputBudget};

use super::{Mesh, MeshBuilder, MeshError};
use buffers::Buffers;
use numbers::Numbers;

/// The greatest number of vertices, and of triangles, of the result: a mesh may be instantiated many times.
const MAX_PLACED: usize = 1 << 27;

/// Reads a mesh from the bytes of a file. `read` returns the contents of the files that it refers to.
///
/// # Errors
/// If one of the files is invalid or cannot be read.
pub fn read_gltf(
    bytes: &[u8],
    read: &dyn Fn(&str) -> io::Result<Vec<u8>>,
) -> Result<Mesh, MeshError> {
    read_gltf_within(bytes, read, &InputBudget::default())
}

/// The same within a budget, which keeps the memory of the mesh. `read` holds the memory of the files that it returns.
///
/// # Errors
/// If one of the files is invalid or cannot be read, or they take too much memory.
pub fn read_gltf_within(
    bytes: &[u8],
    read: &dyn Fn(&str) -> io::Result<Vec<u8>>,
    budget: &InputBudget,
) -> Result<Mesh, MeshError> {
    let of_structure = budget.hold(buffers::structure_memory(bytes)?)?;
    let (document, embedded) = buffers::open(bytes)?;
    let reader = Reader { buffers: Buffers::read(&document, embedded, read)? };
    let mut held = budget.hold(Amount::default())?;
    let mesh = reader.scene(&document, &mut held)?.finish()?;
    held.keep(mesh.memory());
    drop(of_structure);
    Ok(mesh)
}

struct Reader<'a> {
    buffers: Buffers<'a>,
}

impl Reader<'_> {
    fn scene(&self, document: &Document, held: &mut Held) -> Result<MeshBuilder, MeshError> {
        let mut builder = MeshBuilder::default();
        let mut visited = vec![false; document.nodes().len()];
        let scene = document.default_scene().or_else(|| document.scenes().next());
        let roots = scene.into_iter().flat_map(|scene| scene.nodes().collect::<Vec<_>>());
        let mut open: Vec<(Node<'_>, Transform)> =
            roots.map(|node| (node, Transform::IDENTITY)).collect();
        while let Some((node, parent)) = open.pop() {
            if std::mem::replace(&mut visited[node.index()], true) {
                let message = format!("node {} has two parents or contains itself", node.index());
                return Err(MeshError::Malformed(message));
            }
            let placement = parent.after(transform(&node));
            if let Some(mesh) = node.mesh() {
                for primitive in mesh.primitives() {
                    self.primitive(&primitive, placement, &mut builder, held)?;
                }
            }
            open.extend(node.children().map(|child| (child, placement)));
        }
        held.grow_to(builder.memory(2 * builder.positions.len()))?;
        // Vertices after the last one with normals have no normals.
        fill(&mut builder.normals, builder.positions.len());
        fill(&mut builder.uvs, builder.positions.len() / 3 * 2);
        Ok(builder)
    }

    /// Adds the triangles of a primitive; points and lines are ignored.
    fn primitive(
        &self,
        primitive: &Primitive<'_>,
        placement: Transform,
        builder: &mut MeshBuilder,
        held: &mut Held,
    ) -> Result<(), MeshError> {
        let Some(positions) = primitive.get(&Semantic::Positions) else { return Ok(()) };
        let first = builder.positions.len() / 3;
        let count = positions.count();
        if first + count > MAX_PLACED {
            return Err(MeshError::TooLarge(MAX_PLACED, "vertices"));
        }
        let corners = primitive.indices().map_or(count, |indices| indices.count());
        // Positions, normals, texture coordinates, and those that earlier vertices lack; for a corner of a strip three
        // indices of its triangles, besides the list itself.
        let of_vertices = count.saturating_mul(8).saturating_add(builder.positions.len() * 2);
        held.grow_to(builder.memory(of_vertices.saturating_add(corners.saturating_mul(8))))?;
        let Some(corners) = self.corners(primitive, count)? else { return Ok(()) };
        if builder.indices.len() / 3 + corners.len() / 3 > MAX_PLACED {
            return Err(MeshError::TooLarge(MAX_PLACED, "triangles"));
        }
        for position in self.vertices::<3>(&positions, count)?.iter() {
            builder.positions.extend(placement.point(position).map(|x| (x as f32).to_bits()));
        }
        // A singular transform has no normal transform: faces are then flat.
        let normals = primitive.get(&Semantic::Normals).zip(placement.inverse());
        if let Some((normals, inverse)) = normals {
            fill(&mut builder.normals, 3 * first);
            for normal in self.vertices::<3>(&normals, count)?.iter() {
                let normal = inverse.transposed_vector(normal);
                builder.normals.extend(normal.map(|x| (x as f32).to_bits()));
            }
        }
        if let Some(uvs) = primitive.get(&Semantic::TexCoords(0)) {
            fill(&mut builder.uvs, 2 * first);
            for uv in self.vertices::<2>(&uvs, count)?.iter() {
                builder.uvs.extend(uv.map(|x| (x as f32).to_bits()));
            }
        }
        add_triangles(&corners, first as u32, placement.swaps_handedness(), builder);
        Ok(())
    }

    /// The corners of a primitive's triangles, three for each; `None` for points and lines.
    fn corners(
        &self,
        primitive: &Primitive<'_>,
        vertices: usize,
    ) -> Result<Option<Vec<u32>>, MeshError> {
        let mode = primitive.mode();
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            return Ok(None);
        }
        let corners: Vec<u32> = match primitive.indices() {
            None => (0..vertices as u32).collect(),
            Some(indices) => {
                let numbers = Numbers::<1>::new(&indices, &self.buffers)?;
                numbers.iter().map(|[index]| index as u32).collect()
            }
        };
        if let Some(index) = corners.iter().find(|index| **index as usize >= vertices) {
            return Err(MeshError::IndexOutOfRange { index: (*index).into(), vertices });
        }
        Ok(Some(match mode {
            Mode::TriangleStrip => unroll_strip(&corners),
            Mode::TriangleFan => unroll_fan(&corners),
            _ => corners,
        }))
    }

    fn vertices<const COUNT: usize>(
        &self,
        accessor: &Accessor<'_>,
        vertices: usize,
    ) -> Result<Numbers<'_, COUNT>, MeshError> {
        if accessor.count() != vertices {
            let what = "of another attribute";
            return Err(MeshError::CountMismatch { what, found: accessor.count(), vertices });
        }
        Numbers::new(accessor, &self.buffers)
    }
}

/// Appends zeros for the vertices of primitives without this attribute: normals of length 0.
fn fill(numbers: &mut Vec<u32>, length: usize) {
    if !numbers.is_empty() || length == 0 {
        numbers.resize(length, 0);
    }
}

fn transform(node: &Node<'_>) -> Transform {
    let columns = node.transform().matrix();
    Transform::from_columns(&std::array::from_fn(|index| columns[index / 4][index % 4].into()))
}

/// Adds triangles whose corners are relative to the vertex `first`. A mirrored transform reverses the order of corners,
/// so that the outside stays outside.
fn add_triangles(corners: &[u32], first: u32, mirrored: bool, builder: &mut MeshBuilder) {
    for triangle in corners.chunks_exact(3) {
        let [a, b, c] = [first + triangle[0], first + triangle[1], first + triangle[2]];
        builder.indices.extend(if mirrored { [a, c, b] } else { [a, b, c] });
    }
}

/// Converts a strip to triangles. Every other one reverses its orientation.
fn unroll_strip(corners: &[u32]) -> Vec<u32> {
    let triangles = corners.windows(3).enumerate().map(|(index, corners)| {
        if index % 2 == 0 {
            [corners[0], corners[1], corners[2]]
        } else {
            [corners[1], corners[0], corners[2]]
        }
    });
    triangles.flatten().collect()
}

fn unroll_fan(corners: &[u32]) -> Vec<u32> {
    let [center, rest @ ..] = corners else { return Vec::new() };
    rest.windows(2).flat_map(|pair| [*center, pair[0], pair[1]]).collect()
}

#[cfg(test)]
mod tests;
