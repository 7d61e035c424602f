//! The reader of PLY files: text, and binary of either byte order.
//!
//! It reads positions (`x y z`), normals (`nx ny nz`) and texture coordinates (`u v`, `s t`, `texture_u texture_v` or
//! `texture_s texture_t`) of vertices, the list `vertex_indices` or `vertex_index` of faces and of strips of triangles
//! (`tristrips`), and attributes; other properties and elements are skipped. Numbers may have any of the format's
//! types.
//!
//! The crate `ply-rs-bw` 4.0, the maintained library for the format, is as fast, but rejects `.5` and `1.` in text, and
//! comments that are not UTF-8, all of which exporters write.

mod attributes;
mod header;
mod numbers;

use std::collections::BTreeSet;
use std::io::{BufReader, Read};

use rtsl_memory::{Amount, Held, InputBudget};

use super::builder::check_size;
use super::{Mesh, MeshBuilder, MeshError};
use crate::attributes::{GivenAttribute, Spread, WantedAttributes};
use attributes::AttributeColumns;
use header::{Element, Header, Kind, NumberType};
use numbers::NumberReader;

/// The size of a read from the file, in bytes.
const BUFFER: usize = 1 << 16;

/// Reads a mesh.
///
/// # Errors
/// If the file is invalid or cannot be read.
pub fn read_ply(source: impl Read) -> Result<Mesh, MeshError> {
    read_ply_within(source, &InputBudget::default(), &WantedAttributes::default())
}

/// Reads a mesh with these attributes within a budget, which keeps the memory of the mesh.
///
/// # Errors
/// If the file is invalid or cannot be read, or takes too much memory.
pub fn read_ply_within(
    source: impl Read,
    budget: &InputBudget,
    wanted: &WantedAttributes,
) -> Result<Mesh, MeshError> {
    let mut held = budget.hold(Amount::default())?;
    let mut reader = BufReader::with_capacity(BUFFER, source);
    let header = Header::read(&mut reader)?;
    let mut numbers = NumberReader::new(reader, header.encoding);
    let mut builder = MeshBuilder::default();
    let mut attributes: Vec<GivenAttribute> = Vec::new();
    for element in &header.elements {
        let columns = |spread| AttributeColumns::new(element, wanted, spread);
        let read = match element.name.as_str() {
            "vertex" => {
                let columns = columns(Spread::Vertices);
                read_vertices(element, &mut numbers, &mut builder, columns, &mut held)?
            }
            "face" => {
                let columns = columns(Spread::Faces);
                read_faces(element, &mut numbers, &mut builder, columns, &mut held)?
            }
            "tristrips" => {
                read_strips(element, &mut numbers, &mut builder, &mut held)?;
                continue;
            }
            _ => {
                skip(element, &mut numbers)?;
                continue;
            }
        };
        attributes.extend(read.finish());
    }
    // Those of vertices count before those of faces.
    attributes.sort_by_key(|attribute| attribute.spread);
    let mut names = BTreeSet::new();
    attributes.retain(|attribute| names.insert(attribute.name.clone()));
    let mesh = Mesh { attributes, ..builder.finish()? };
    held.keep(mesh.memory());
    Ok(mesh)
}

/// The index of a vertex property among the numbers that are kept of a vertex.
fn vertex_slot(name: &str) -> Option<usize> {
    let names: [&[&str]; 8] = [
        &["x"],
        &["y"],
        &["z"],
        &["nx"],
        &["ny"],
        &["nz"],
        &["u", "s", "texture_u", "texture_s"],
        &["v", "t", "texture_v", "texture_t"],
    ];
    names.iter().position(|names| names.contains(&name))
}

fn read_vertices<R: Read>(
    element: &Element,
    numbers: &mut NumberReader<R>,
    builder: &mut MeshBuilder,
    mut attributes: AttributeColumns,
    held: &mut Held,
) -> Result<AttributeColumns, MeshError> {
    let slots: Vec<Option<usize>> =
        element.properties.iter().map(|property| vertex_slot(&property.name)).collect();
    let has = |wanted: &[usize]| wanted.iter().all(|slot| slots.contains(&Some(*slot)));
    if !has(&[0, 1, 2]) {
        return Err(MeshError::Malformed("its vertices lack `x`, `y` or `z`".to_owned()));
    }
    let (normals, uvs) = (has(&[3, 4, 5]), has(&[6, 7]));
    check_size(element.count.saturating_mul(3), 3, "vertices")?;
    let mut vertices = 0;
    for _ in 0..element.count {
        let mut vertex = [0_u32; 8];
        for (index, (property, slot)) in element.properties.iter().zip(&slots).enumerate() {
            match property.kind {
                Kind::Scalar(ty) => {
                    let number = numbers.next(ty)?;
                    attributes.take(index, number);
                    if let Some(slot) = slot {
                        vertex[*slot] = (number as f32).to_bits();
                    }
                }
                kind @ Kind::List { .. } => skip_property(kind, numbers)?,
            }
        }
        attributes.push(1);
        vertices += 1;
        held.grow_to(builder.memory(vertex.len() + vertices * attributes.scalars()))?;
        builder.positions.extend_from_slice(&vertex[..3]);
        if normals {
            builder.normals.extend_from_slice(&vertex[3..6]);
        }
        if uvs {
            builder.uvs.extend_from_slice(&vertex[6..]);
        }
    }
    Ok(attributes)
}

fn read_faces<R: Read>(
    element: &Element,
    numbers: &mut NumberReader<R>,
    builder: &mut MeshBuilder,
    mut attributes: AttributeColumns,
    held: &mut Held,
) -> Result<AttributeColumns, MeshError> {
    if !element.properties.iter().any(|property| is_corners(&property.name)) {
        return Err(MeshError::Malformed("its faces lack `vertex_indices`".to_owned()));
    }
    let mut corners = Vec::new();
    for _ in 0..element.count {
        let faces = builder.indices.len() / 3;
        for (index_of_property, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::Scalar(ty) => attributes.take(index_of_property, numbers.next(ty)?),
                Kind::List { count, item } if is_corners(&property.name) => {
                    corners.clear();
                    for _ in 0..read_count(count, numbers)? {
                        // The memory of its triangles, and of the growth of the list.
                        if corners.len().is_power_of_two() {
                            held.grow_to(builder.memory(6 * corners.len()))?;
                        }
                        corners.push(index(numbers.next(item)?));
                    }
                    held.grow_to(builder.memory(4 * corners.len()))?;
                    builder.polygon(&corners)?;
                }
                kind @ Kind::List { .. } => skip_property(kind, numbers)?,
            }
        }
        let all = builder.indices.len() / 3;
        attributes.push(all - faces);
        held.grow_to(builder.memory(all * attributes.scalars()))?;
    }
    Ok(attributes)
}

/// Reads lists of triangles, each of which has its two last corners from the one before it. Every other one is turned
/// around, and a negative number begins anew.
fn read_strips<R: Read>(
    element: &Element,
    numbers: &mut NumberReader<R>,
    builder: &mut MeshBuilder,
    held: &mut Held,
) -> Result<(), MeshError> {
    if !element.properties.iter().any(|property| is_corners(&property.name)) {
        return Err(MeshError::Malformed("its strips lack `vertex_indices`".to_owned()));
    }
    for _ in 0..element.count {
        for property in &element.properties {
            match property.kind {
                Kind::List { count, item } if is_corners(&property.name) => {
                    let mut strip = Vec::with_capacity(3);
                    let mut is_turned = false;
                    for _ in 0..read_count(count, numbers)? {
                        let number = numbers.next(item)?;
                        if number < 0.0 {
                            strip.clear();
                            is_turned = false;
                            continue;
                        }
                        strip.push(index(number));
                        let &[a, b, c] = strip.as_slice() else { continue };
                        // Strips are joined by triangles without area.
                        if a != b && b != c && c != a {
                            held.grow_to(builder.memory(3))?;
                            builder.polygon(&if is_turned { [b, a, c] } else { [a, b, c] })?;
                        }
                        is_turned = !is_turned;
                        strip.remove(0);
                    }
                }
                kind => skip_property(kind, numbers)?,
            }
        }
    }
    Ok(())
}

/// True for the name of the list of the corners of faces.
fn is_corners(name: &str) -> bool {
    matches!(name, "vertex_indices" | "vertex_index")
}

/// Converts an index for the builder's check: an invalid one becomes one that no vertex has.
fn index(number: f64) -> u32 {
    let index = number as u32;
    if f64::from(index) == number { index } else { u32::MAX }
}

fn read_count<R: Read>(ty: NumberType, numbers: &mut NumberReader<R>) -> Result<u64, MeshError> {
    let number = numbers.next(ty)?;
    let count = number as u64;
    if count as f64 == number {
        return Ok(count);
    }
    Err(MeshError::Malformed(format!("it has a list of {number} numbers")))
}

fn skip<R: Read>(element: &Element, numbers: &mut NumberReader<R>) -> Result<(), MeshError> {
    // Elements without properties occupy no bytes, so their count is not limited by the file's length.
    let count = if element.properties.is_empty() { 0 } else { element.count };
    for _ in 0..count {
        for property in &element.properties {
            skip_property(property.kind, numbers)?;
        }
    }
    Ok(())
}

fn skip_property<R: Read>(kind: Kind, numbers: &mut NumberReader<R>) -> Result<(), MeshError> {
    match kind {
        Kind::Scalar(ty) => numbers.next(ty).map(drop),
        Kind::List { count, item } => {
            for _ in 0..read_count(count, numbers)? {
                numbers.next(item)?;
            }
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests;
