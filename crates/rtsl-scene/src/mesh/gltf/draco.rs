//! Meshes that `KHR_draco_mesh_compression` compresses, decoded to arrays of their accessors.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute};
use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType};
use gltf::json::buffer::View;
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Index, Root, Value};
use rayon::prelude::*;
use rtsl_memory::{Amount, Held, InputBudget, on_all_processors};

use super::buffers::Buffers;
use super::file::size;
use crate::mesh::MeshError;

/// The extension that compresses meshes.
pub const DRACO: &str = "KHR_draco_mesh_compression";

/// The greatest memory of the decoder for a number of an attribute of a vertex, and for a triangle, with the results.
const OF_NUMBER: Amount = Amount(40);
const OF_TRIANGLE: Amount = Amount(320);

/// The arrays of the accessors of compressed primitives.
#[derive(Default)]
pub struct Decoded {
    /// Numbers of 32 bits without gaps, by the index of the accessor.
    arrays: BTreeMap<usize, Vec<u8>>,
    /// The problems of primitives, by the index of their compressed buffer view.
    problems: BTreeMap<usize, String>,
    held: Vec<Held>,
}

/// A compressed primitive.
struct Compressed {
    mesh: usize,
    primitive: usize,
    view: Index<View>,
    indices: Option<Index<Accessor>>,
    /// The accessors of attributes, each with the id that it has in the compressed data.
    attributes: Vec<(Index<Accessor>, u32)>,
}

/// A decoded primitive.
struct Arrays {
    vertices: usize,
    corners: Vec<u8>,
    /// The numbers of attributes, in the order of [`Compressed::attributes`].
    attributes: Vec<Vec<u8>>,
    held: Held,
}

impl Decoded {
    /// Decodes all compressed primitives whose attributes the file has in no other form. Their accessors become those of
    /// the arrays.
    pub fn decode(root: &mut Root, buffers: &Buffers<'_>, budget: &InputBudget) -> Decoded {
        let mut decoded = Decoded::default();
        let compressed = compressed(root);
        let decode =
            |it: &Compressed| it.decode(root, buffers, budget).map_err(|error| error.to_string());
        let arrays: Vec<_> = on_all_processors(|| compressed.par_iter().map(decode).collect());
        for (it, arrays) in compressed.iter().zip(arrays) {
            match arrays {
                Ok(arrays) => decoded.keep(it, arrays, root),
                Err(problem) => {
                    decoded.problems.insert(it.view.value(), problem);
                }
            }
        }
        decoded
    }

    fn keep(&mut self, compressed: &Compressed, arrays: Arrays, root: &mut Root) {
        let Arrays { vertices, corners, attributes, held } = arrays;
        self.held.push(held);
        root.meshes[compressed.mesh].primitives[compressed.primitive].mode =
            Checked::Valid(Mode::Triangles);
        if let Some(indices) = compressed.indices {
            describe(root, indices, corners.len() / 4, ComponentType::U32);
            self.arrays.insert(indices.value(), corners);
        }
        for ((accessor, _), numbers) in compressed.attributes.iter().zip(attributes) {
            describe(root, *accessor, vertices, ComponentType::F32);
            self.arrays.insert(accessor.value(), numbers);
        }
    }

    /// Returns the numbers of an accessor that was compressed.
    pub fn array(&self, accessor: Index<Accessor>) -> Option<&[u8]> {
        self.arrays.get(&accessor.value()).map(Vec::as_slice)
    }

    /// Returns the problem for which a compressed primitive could not be decoded.
    pub fn problem(&self, root: &Root, primitive: &Primitive) -> Option<&str> {
        match extension(primitive)? {
            Some((view, _)) => self.problems.get(&view.value()).map(String::as_str),
            None if has_numbers(root, primitive) => None,
            None => Some("it names no compressed buffer view"),
        }
    }
}

/// Changes an accessor to one of an array.
fn describe(root: &mut Root, index: Index<Accessor>, count: usize, component: ComponentType) {
    if let Some(accessor) = root.accessors.get_mut(index.value()) {
        accessor.count = USize64(count as u64);
        accessor.component_type = Checked::Valid(GenericComponentType(component));
        accessor.normalized = false;
        accessor.buffer_view = None;
        accessor.byte_offset = None;
        accessor.sparse = None;
    }
}

/// A compressed buffer view, and the ids of attributes by their names.
type Extension = (Index<View>, BTreeMap<String, u32>);

/// The extension of a primitive, if it has it; `None` in it if it is malformed.
fn extension(primitive: &Primitive) -> Option<Option<Extension>> {
    let extension = primitive.extensions.as_ref()?.others.get(DRACO)?;
    let number = |value: &Value| u32::try_from(value.as_u64()?).ok();
    let view = extension.get("bufferView").and_then(number);
    let attributes = extension.get("attributes").and_then(Value::as_object);
    Some(view.zip(attributes).map(|(view, attributes)| {
        let ids = attributes.iter().filter_map(|(name, id)| Some((name.clone(), number(id)?)));
        (Index::new(view), ids.collect())
    }))
}

/// True if all attributes of a primitive are in buffers, too: files for other readers have them twice.
fn has_numbers(root: &Root, primitive: &Primitive) -> bool {
    let in_buffer = |index: &Index<Accessor>| {
        root.accessors.get(index.value()).is_some_and(|it| it.buffer_view.is_some())
    };
    primitive.attributes.values().all(in_buffer)
}

/// The compressed primitives of a file. A second one with the arrays of another is left out.
fn compressed(root: &Root) -> Vec<Compressed> {
    let mut found: BTreeMap<usize, Compressed> = BTreeMap::new();
    for (mesh, definition) in root.meshes.iter().enumerate() {
        for (index, primitive) in definition.primitives.iter().enumerate() {
            let Some(Some((view, ids))) = extension(primitive) else { continue };
            if has_numbers(root, primitive) {
                continue;
            }
            let attributes = primitive.attributes.iter().filter_map(|(semantic, accessor)| {
                Some((*accessor, *ids.get(&semantic.to_string())?))
            });
            found.entry(view.value()).or_insert(Compressed {
                mesh,
                primitive: index,
                view,
                indices: primitive.indices,
                attributes: attributes.collect(),
            });
        }
    }
    found.into_values().collect()
}

impl Compressed {
    fn decode(
        &self,
        root: &Root,
        buffers: &Buffers<'_>,
        budget: &InputBudget,
    ) -> Result<Arrays, MeshError> {
        let malformed = |what: &str| MeshError::Malformed(what.to_owned());
        let bytes = buffers.view(root, self.view).map_err(|problem| {
            MeshError::Malformed(format!("its compressed buffer view {problem}"))
        })?;
        let accessor = |index: Index<Accessor>| root.accessors.get(index.value());
        let count = |index| accessor(index).map_or(0, |it| size(it.count));
        let vertices = self.attributes.iter().map(|(index, _)| count(*index)).max().unwrap_or(0);
        let triangles = self.indices.map_or(vertices, count) / 3;
        let numbers: usize = 4 * self.attributes.len() + 16;
        let of_vertices = OF_NUMBER.times(vertices.saturating_mul(numbers));
        let held = budget.hold(of_vertices + OF_TRIANGLE.times(triangles))?;
        let limits = DecodeLimits::default()
            .with_max_faces(triangles as u64)
            .with_max_decoded_bytes(of_vertices.0);
        let mut mesh = Mesh::new();
        // The library has assertions.
        let decoded = catch_unwind(AssertUnwindSafe(|| {
            MeshDecoder::new().decode(&mut DecoderBuffer::new(bytes).with_limits(limits), &mut mesh)
        }));
        match decoded {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(MeshError::Malformed(error.to_string())),
            Err(_) => return Err(malformed("its compressed data are damaged")),
        }
        let vertices = mesh.num_points();
        let attribute = |(index, id): &(Index<Accessor>, u32)| {
            let accessor = accessor(*index).ok_or_else(|| malformed("an accessor is missing"))?;
            let attribute = mesh.attribute_by_unique_id(*id);
            let attribute = attribute.ok_or_else(|| {
                MeshError::Malformed(format!("its compressed data have no attribute {id}"))
            })?;
            Ok(numbers_of(attribute, accessor, vertices))
        };
        let attributes = self.attributes.iter().map(attribute).collect::<Result<_, MeshError>>()?;
        let corners = mesh.faces().iter().flatten().flat_map(|it| it.0.to_le_bytes()).collect();
        Ok(Arrays { vertices, corners, attributes, held })
    }
}

/// The numbers of an attribute as floats: integers that stand for fractions are divided.
fn numbers_of(attribute: &PointAttribute, accessor: &Accessor, vertices: usize) -> Vec<u8> {
    let components = match accessor.type_ {
        Checked::Valid(ty) => ty.multiplicity(),
        Checked::Invalid => attribute.num_components().into(),
    };
    let greatest: f32 = match accessor.component_type {
        Checked::Valid(it) if accessor.normalized => match it.0 {
            ComponentType::I8 => i8::MAX.into(),
            ComponentType::U8 => u8::MAX.into(),
            ComponentType::I16 => i16::MAX.into(),
            ComponentType::U16 => u16::MAX.into(),
            ComponentType::U32 | ComponentType::F32 => 1.0,
        },
        Checked::Valid(_) | Checked::Invalid => 1.0,
    };
    let numbers = attribute.read_f32s(vertices, components);
    numbers.into_iter().flat_map(|it| (it / greatest).to_le_bytes()).collect()
}
