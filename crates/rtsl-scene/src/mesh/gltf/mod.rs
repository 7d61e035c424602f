//! The reader of glTF files, `.gltf` and `.glb`, as one mesh.
//!
//! It creates one mesh of all triangles of the default scene (or the first scene, if there is no default), transformed
//! by their nodes. Materials, cameras, lights, skins and animations are ignored: [`crate::gltf`] reads them.
//! Coordinates are not converted.
//!
//! The crate `gltf` parses the structure. This module checks all that it refers to: indices, cycles of nodes, and
//! offsets and counts of numbers in buffers.

mod attributes;
mod buffers;
mod corners;
mod draco;
mod file;
mod meshopt;
mod numbers;

use gltf::json::Index;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::scene::Node;
use rtsl_math::Transform;
use rtsl_memory::{Amount, Held, InputBudget};

pub use attributes::{VertexAttribute, VertexValues};
pub use buffers::{MESHOPT, contents};
pub use corners::{corners, listed};
pub use draco::DRACO;
pub use file::{GltfFile, ReadFile, attribute, size, structure_memory};
pub use numbers::Numbers;

use super::{Mesh, MeshBuilder, MeshError, MeshWarning};
use crate::attributes::WantedAttributes;
use attributes::JoinedAttributes;

/// The greatest number of vertices, and of triangles, of the result: a mesh may be instantiated many times.
pub const MAX_PLACED: usize = 1 << 27;

/// Reads a mesh from the bytes of a file. `read` returns the contents of the files that it refers to.
///
/// # Errors
/// If one of the files is invalid or cannot be read.
pub fn read_gltf(bytes: &[u8], read: ReadFile<'_>) -> Result<Mesh, MeshError> {
    read_gltf_within(bytes, read, &InputBudget::default(), &WantedAttributes::default())
}

/// The same within a budget, which keeps the memory of the mesh, and with the wanted attributes that it has. `read`
/// holds the memory of the files that it returns.
///
/// # Errors
/// If one of the files is invalid or cannot be read, or they take too much memory.
pub fn read_gltf_within(
    bytes: &[u8],
    read: ReadFile<'_>,
    budget: &InputBudget,
    wanted: &WantedAttributes,
) -> Result<Mesh, MeshError> {
    let of_structure = budget.hold(structure_memory(bytes)?)?;
    let file = GltfFile::open(bytes, read, budget)?;
    let mut held = budget.hold(Amount::default())?;
    let has_materials = !file.root.materials.is_empty();
    let mut reader = Reader { file, wanted, attributes: JoinedAttributes::default() };
    let mesh = reader.scene(&mut held)?.finish()?;
    let attributes = reader.attributes.finish(mesh.vertices());
    let warnings =
        has_materials.then_some(MeshWarning::Materials).into_iter().chain(mesh.warnings.clone());
    let mesh = Mesh { warnings: warnings.collect(), attributes, ..mesh };
    held.keep(mesh.memory());
    drop(of_structure);
    Ok(mesh)
}

struct Reader<'a> {
    file: GltfFile<'a>,
    wanted: &'a WantedAttributes,
    attributes: JoinedAttributes,
}

impl Reader<'_> {
    fn scene(&mut self, held: &mut Held) -> Result<MeshBuilder, MeshError> {
        let mut builder = MeshBuilder::default();
        let mut visited = vec![false; self.file.root.nodes.len()];
        let roots = self.file.root_nodes();
        let mut open: Vec<(Index<Node>, Transform)> =
            roots.iter().map(|node| (*node, Transform::IDENTITY)).collect();
        while let Some((index, parent)) = open.pop() {
            let Some(node) = self.file.root.nodes.get(index.value()) else {
                return Err(missing("node", index.value()));
            };
            if std::mem::replace(&mut visited[index.value()], true) {
                let message = format!("node {} has two parents or contains itself", index.value());
                return Err(MeshError::Malformed(message));
            }
            let placement = parent.after(transform(node));
            open.extend(node.children.iter().flatten().map(|child| (*child, placement)));
            if let Some(mesh) = node.mesh {
                let Some(mesh) = self.file.root.meshes.get(mesh.value()) else {
                    return Err(missing("mesh", mesh.value()));
                };
                for primitive in mesh.primitives.clone() {
                    self.primitive(&primitive, placement, &mut builder, held)?;
                }
            }
        }
        let of_attributes = self.attributes.numbers(builder.positions.len() / 3, &[]);
        held.grow_to(builder.memory(2 * builder.positions.len() + of_attributes))?;
        // Vertices after the last one with normals have no normals.
        fill(&mut builder.normals, builder.positions.len());
        fill(&mut builder.uvs, builder.positions.len() / 3 * 2);
        Ok(builder)
    }

    /// Adds the triangles of a primitive; points and lines are ignored.
    fn primitive(
        &mut self,
        primitive: &Primitive,
        placement: Transform,
        builder: &mut MeshBuilder,
        held: &mut Held,
    ) -> Result<(), MeshError> {
        let Some(positions) = attribute(primitive, Semantic::Positions) else { return Ok(()) };
        self.file.check_compression(primitive)?;
        let first = builder.positions.len() / 3;
        let count = size(self.file.accessor(positions)?.count);
        if count > MAX_PLACED || first + count > MAX_PLACED {
            return Err(MeshError::TooLarge(MAX_PLACED, "vertices"));
        }
        let indices = primitive.indices.map(|index| self.file.accessor(index)).transpose()?;
        let listed = indices.map_or(count, |indices| size(indices.count));
        // Positions, normals, texture coordinates, and those that earlier vertices lack; for a corner of a strip three
        // indices of its triangles, besides the list itself.
        let of_vertices = count.saturating_mul(8).saturating_add(builder.positions.len() * 2);
        let attributes = VertexAttribute::all(&self.file, primitive, self.wanted);
        let attributes = attributes.into_iter().collect::<Result<Vec<_>, _>>()?;
        let more = [
            of_vertices,
            listed.saturating_mul(8),
            self.attributes.numbers(first.saturating_add(count), &attributes),
        ];
        held.grow_to(builder.memory(more.into_iter().fold(0, usize::saturating_add)))?;
        let Some(corners) = corners(&self.file, primitive, count)? else { return Ok(()) };
        if builder.indices.len() / 3 + corners.len() / 3 > MAX_PLACED {
            return Err(MeshError::TooLarge(MAX_PLACED, "triangles"));
        }
        for position in self.vertices::<3>(positions, count)?.iter() {
            builder.positions.extend(placement.point(position).map(|x| (x as f32).to_bits()));
        }
        // A singular transform has no normal transform: faces are then flat.
        let normals = attribute(primitive, Semantic::Normals).zip(placement.inverse());
        if let Some((normals, inverse)) = normals {
            fill(&mut builder.normals, 3 * first);
            for normal in self.vertices::<3>(normals, count)?.iter() {
                let normal = inverse.transposed_vector(normal);
                builder.normals.extend(normal.map(|x| (x as f32).to_bits()));
            }
        }
        if let Some(uvs) = attribute(primitive, Semantic::TexCoords(0)) {
            fill(&mut builder.uvs, 2 * first);
            for uv in self.vertices::<2>(uvs, count)?.iter() {
                builder.uvs.extend(uv.map(|x| (x as f32).to_bits()));
            }
        }
        for attribute in &attributes {
            let values = self.attributes.values(attribute, first)?;
            let map = |value: [f64; 4]| placed(&attribute.semantic, placement, value);
            attribute.read(&self.file, count, None, &map, values)?;
        }
        add_triangles(&corners, first as u32, placement.swaps_handedness(), builder);
        Ok(())
    }

    fn vertices<const COUNT: usize>(
        &self,
        index: Index<Accessor>,
        vertices: usize,
    ) -> Result<Numbers<'_, COUNT>, MeshError> {
        let found = size(self.file.accessor(index)?.count);
        if found != vertices {
            let what = "of another attribute";
            return Err(MeshError::CountMismatch { what, found, vertices });
        }
        Numbers::new(index, &self.file)
    }
}

/// The value of an attribute of vertices that a node places: tangents are directions along the surface, of which the
/// last number tells the side of the other tangent.
fn placed(semantic: &Semantic, placement: Transform, value: [f64; 4]) -> [f64; 4] {
    if *semantic != Semantic::Tangents {
        return value;
    }
    let columns = placement.columns();
    let row = |row: usize| (0..3).map(|column| columns[4 * column + row] * value[column]).sum();
    [row(0), row(1), row(2), if placement.swaps_handedness() { -value[3] } else { value[3] }]
}

/// The error of a reference to something that does not exist.
pub fn missing(what: &str, index: usize) -> MeshError {
    MeshError::Malformed(format!("it refers to {what} {index}, which does not exist"))
}

/// Appends zeros for the vertices of primitives without this attribute: normals of length 0.
fn fill(numbers: &mut Vec<u32>, length: usize) {
    if !numbers.is_empty() || length == 0 {
        numbers.resize(length, 0);
    }
}

/// Returns the transform of a node to its parent's space.
pub fn transform(node: &Node) -> Transform {
    if let Some(columns) = node.matrix {
        return Transform::from_columns(&columns.map(f64::from));
    }
    let [x, y, z] = node.translation.unwrap_or_default().map(f64::from);
    let [a, b, c] = node.scale.unwrap_or([1.0; 3]).map(f64::from);
    let rotation = node.rotation.map_or([0.0, 0.0, 0.0, 1.0], |it| it.0.map(f64::from));
    Transform::translate([x, y, z]).after(turned(rotation)).after(Transform::scale([a, b, c]))
}

/// The rotation of a quaternion, which need not have unit length.
pub fn turned([x, y, z, w]: [f64; 4]) -> Transform {
    let square = x * x + y * y + z * z + w * w;
    let s = if square > 0.0 { 2.0 / square } else { 0.0 };
    Transform::from_columns(&[
        1.0 - s * (y * y + z * z),
        s * (x * y + z * w),
        s * (x * z - y * w),
        0.0,
        s * (x * y - z * w),
        1.0 - s * (x * x + z * z),
        s * (y * z + x * w),
        0.0,
        s * (x * z + y * w),
        s * (y * z - x * w),
        1.0 - s * (x * x + y * y),
        0.0,
        0.0,
        0.0,
        0.0,
        1.0,
    ])
}

/// Adds triangles whose corners are relative to the vertex `first`. A mirrored transform reverses the order of corners,
/// so that the outside stays outside.
fn add_triangles(corners: &[u32], first: u32, mirrored: bool, builder: &mut MeshBuilder) {
    for triangle in corners.chunks_exact(3) {
        let [a, b, c] = [first + triangle[0], first + triangle[1], first + triangle[2]];
        builder.indices.extend(if mirrored { [a, c, b] } else { [a, b, c] });
    }
}

#[cfg(test)]
mod tests;
