//! The corners of a primitive's triangles.

use gltf::json::mesh::{Mode, Primitive};
use gltf::json::validation::Checked;

use super::file::GltfFile;
use super::numbers::Numbers;
use crate::mesh::MeshError;

/// Returns the corners of a primitive's triangles, three for each; `None` for points and lines.
///
/// # Errors
/// If one of them is none of so many vertices.
pub fn corners(
    file: &GltfFile<'_>,
    primitive: &Primitive,
    vertices: usize,
) -> Result<Option<Vec<u32>>, MeshError> {
    let mode = match primitive.mode {
        Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
        Checked::Valid(_) | Checked::Invalid => return Ok(None),
    };
    let corners = listed(file, primitive, vertices)?;
    Ok(Some(match mode {
        Mode::TriangleStrip => unroll_strip(&corners),
        Mode::TriangleFan => unroll_fan(&corners),
        _ => corners,
    }))
}

/// Returns the vertices of a primitive in their order.
///
/// # Errors
/// If one of them is none of so many vertices.
pub fn listed(
    file: &GltfFile<'_>,
    primitive: &Primitive,
    vertices: usize,
) -> Result<Vec<u32>, MeshError> {
    let listed: Vec<u32> = match primitive.indices {
        None => (0..vertices as u32).collect(),
        Some(indices) => {
            let numbers = Numbers::<1>::new(indices, file)?;
            numbers.iter().map(|[index]| index as u32).collect()
        }
    };
    match listed.iter().find(|index| **index as usize >= vertices) {
        Some(index) => Err(MeshError::IndexOutOfRange { index: (*index).into(), vertices }),
        None => Ok(listed),
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
mod tests {
    use super::*;

    #[test]
    fn strips_turn_every_other_triangle() {
        assert_eq!(unroll_strip(&[0, 1, 2, 3, 4]), [0, 1, 2, 2, 1, 3, 2, 3, 4]);
        assert_eq!(unroll_strip(&[0, 1]), [0; 0]);
        assert_eq!(unroll_fan(&[]), [0; 0]);
    }
}
