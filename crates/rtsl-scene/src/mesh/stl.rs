//! The reader of STL files, binary and text: triangles, each with vertices of its own.

use rtsl::encoding;
use rtsl_memory::InputBudget;

use super::{Mesh, MeshBuilder, MeshError};

/// The bytes before the triangles of a binary file: a comment, and the number of triangles.
const HEADER: usize = 84;
/// The bytes of a triangle: the normal, three corners, and a number without a meaning.
const TRIANGLE: usize = 50;

/// Reads a mesh within a budget, which keeps the memory of the mesh.
///
/// # Errors
/// If the file is invalid or takes too much memory.
pub fn read_stl_within(bytes: &[u8], budget: &InputBudget) -> Result<Mesh, MeshError> {
    // A corner of a text has 6 bytes at least, and one of a binary file 16.
    let mut builder = MeshBuilder::default();
    let held = budget.hold(builder.memory(bytes.len() / 6 * 4))?;
    match triangles(bytes) {
        Some(triangles) => {
            for triangle in triangles.chunks_exact(TRIANGLE) {
                let (numbers, _) = triangle[12..48].as_chunks::<4>();
                builder.positions.extend(numbers.iter().map(|bytes| u32::from_le_bytes(*bytes)));
            }
        }
        None => read_text(bytes, &mut builder)?,
    }
    builder.indices.extend(0..builder.positions.len() as u32 / 3);
    let mesh = builder.finish()?;
    held.keep(mesh.memory());
    Ok(mesh)
}

/// The triangles of a binary file; `None` for other files. Its comment may begin like a text.
fn triangles(bytes: &[u8]) -> Option<&[u8]> {
    let count = bytes.get(80..HEADER)?.try_into().map(u32::from_le_bytes).ok()?;
    let length = (count as usize).checked_mul(TRIANGLE)?;
    let triangles = bytes.get(HEADER..)?;
    let is_text = bytes.starts_with(b"solid") && triangles.len() != length;
    triangles.get(..length).filter(|_| !is_text)
}

fn read_text(bytes: &[u8], builder: &mut MeshBuilder) -> Result<(), MeshError> {
    encoding::check_width(bytes).map_err(|problem| MeshError::Malformed(problem.to_owned()))?;
    let text = String::from_utf8_lossy(encoding::without_mark(bytes));
    if !text.trim_start().starts_with("solid") {
        return Err(MeshError::Malformed("it is not an STL file, or was cut off".to_owned()));
    }
    let mut words = text.split_ascii_whitespace();
    while words.by_ref().any(|word| word == "vertex") {
        for _ in 0..3 {
            let word = words.next().unwrap_or("");
            let number: f32 = word.parse().map_err(|_| {
                let shown: String = word.chars().take(40).collect();
                MeshError::Malformed(format!("it has `{shown}` where a number should be"))
            })?;
            builder.positions.push(number.to_bits());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<Mesh, String> {
        let budget = InputBudget::default();
        read_stl_within(bytes, &budget).map_err(|error| error.to_string())
    }

    const TEXT: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
        vertex 0 1e0 0\nendloop\nendfacet\nendsolid a\n";

    fn binary() -> Vec<u8> {
        let mut file = b"solid binary".to_vec();
        file.resize(80, b' ');
        file.extend(1_u32.to_le_bytes());
        let numbers = [0_f32, 0., 1., 0., 0., 0., 1., 0., 0., 0., 1., 0.];
        file.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        file.extend([0; 2]);
        file
    }

    #[test]
    fn text_and_binary_give_the_same_mesh() {
        let marked = format!("\u{feff}{TEXT}");
        for file in [TEXT.as_bytes(), marked.as_bytes(), &binary()] {
            let mesh = read(file).unwrap();
            let positions = mesh.positions.words().iter().map(|bits| f32::from_bits(*bits));
            assert_eq!(positions.collect::<Vec<_>>(), [0., 0., 0., 1., 0., 0., 0., 1., 0.]);
            assert_eq!(mesh.indices.words()[..], [0, 1, 2]);
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        let problem = |file: &[u8]| read(file).expect_err("it is wrong");
        assert_eq!(problem(&binary()[..130]), "it has no face");
        let plain = [b"x".repeat(80), vec![9, 0, 0, 0]].concat();
        assert_eq!(problem(&plain), "it is not an STL file, or was cut off");
        assert_eq!(problem(b""), "it is not an STL file, or was cut off");
        let word = TEXT.replace("1e0", "one");
        assert_eq!(problem(word.as_bytes()), "it has `one` where a number should be");
        let corner = TEXT.replace("vertex 0 0 0", "");
        assert_eq!(problem(corner.as_bytes()), "2 numbers make no whole triangle");
    }
}
