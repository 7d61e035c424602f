//! Meshes as PLY files.

use rtsl::Numbers;

use crate::description::Entity;
use crate::reader::Values;

/// The arrays of a mesh.
pub struct MeshArrays<'e> {
    positions: &'e Numbers,
    normals: Option<&'e Numbers>,
    uvs: Option<&'e Numbers>,
    indices: &'e Numbers,
    /// True if coordinates of 0 stand for those that the mesh does not have: textures then show one texel.
    needs_uvs: bool,
}

/// The places of arrays in memory: shapes that share them have one file.
pub type MeshKey = (usize, usize);

impl<'e> MeshArrays<'e> {
    /// The arrays of a shape of a glTF file; `None` if it is no mesh.
    pub fn of(shape: &'e Entity) -> Option<Self> {
        let array = |name: &str| match shape.parameter(name).map(|it| &it.values) {
            Some(Values::Buffer(numbers)) => Some(numbers),
            Some(_) | None => None,
        };
        let filled = |name: &str| array(name).filter(|it| !it.words().is_empty());
        Some(MeshArrays {
            positions: array("positions")?,
            normals: filled("normals"),
            uvs: filled("uvs"),
            indices: array("indices")?,
            needs_uvs: shape.class == "GltfMesh",
        })
    }

    /// The number of triangles.
    pub fn triangles(&self) -> usize {
        self.indices.words().len() / 3
    }

    pub fn key(&self) -> MeshKey {
        (self.positions.words().as_ptr() as usize, self.indices.words().as_ptr() as usize)
    }

    /// The PLY file.
    pub fn ply(&self) -> Vec<u8> {
        let vertices = self.positions.words().len() / 3;
        let has_uvs = self.uvs.is_some() || self.needs_uvs;
        let mut header = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n\
             property float x\nproperty float y\nproperty float z\n"
        );
        if self.normals.is_some() {
            header += "property float nx\nproperty float ny\nproperty float nz\n";
        }
        if has_uvs {
            header += "property float u\nproperty float v\n";
        }
        header += &format!(
            "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.triangles()
        );
        let numbers = 3 + if self.normals.is_some() { 3 } else { 0 } + if has_uvs { 2 } else { 0 };
        let size = header.len() + 4 * numbers * vertices + 13 * self.triangles();
        let mut bytes = Vec::with_capacity(size);
        bytes.extend(header.into_bytes());
        for vertex in 0..vertices {
            push(&mut bytes, self.positions, 3, vertex);
            if let Some(normals) = self.normals {
                push(&mut bytes, normals, 3, vertex);
            }
            match self.uvs {
                Some(uvs) => push(&mut bytes, uvs, 2, vertex),
                None if has_uvs => bytes.extend([0; 8]),
                None => {}
            }
        }
        for triangle in 0..self.triangles() {
            bytes.push(3);
            push(&mut bytes, self.indices, 3, triangle);
        }
        bytes
    }
}

/// Appends the numbers of a vertex or of a triangle.
fn push(bytes: &mut Vec<u8>, numbers: &Numbers, count: usize, index: usize) {
    let words = numbers.words().get(index * count..(index + 1) * count).unwrap_or(&[0; 3][..count]);
    words.iter().for_each(|word| bytes.extend(word.to_le_bytes()));
}
