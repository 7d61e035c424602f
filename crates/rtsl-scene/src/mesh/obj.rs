//! The reader of OBJ files: the polygons of all groups, with normals and texture coordinates. Materials, curves and
//! free surfaces are left out.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Read};

use rtsl::encoding;
use rtsl_memory::{Amount, InputBudget};

use super::{Mesh, MeshBuilder, MeshError, MeshWarning};

/// The greatest length of a line.
const MAX_LINE_BYTES: u64 = 1 << 20;

/// Reads a mesh within a budget, which keeps the memory of the mesh.
///
/// # Errors
/// If the file is invalid or cannot be read, or takes too much memory.
pub fn read_obj_within(source: impl Read, budget: &InputBudget) -> Result<Mesh, MeshError> {
    let mut held = budget.hold(Amount::default())?;
    let mut source = BufReader::new(source);
    encoding::check_width(source.fill_buf()?)
        .map_err(|problem| MeshError::Malformed(problem.to_owned()))?;
    let mut reader = Reader::default();
    let mut line = Vec::new();
    while read_line(&mut source, &mut line)? {
        let text = String::from_utf8_lossy(encoding::without_mark(&line));
        reader.line(&text, |memory| held.grow_to(memory))?;
    }
    let mesh = reader.finish()?;
    held.keep(mesh.memory());
    Ok(mesh)
}

/// Reads a line with those that continue it; false at the end.
fn read_line(source: &mut impl BufRead, line: &mut Vec<u8>) -> Result<bool, MeshError> {
    line.clear();
    loop {
        let room = MAX_LINE_BYTES - line.len() as u64;
        let read = source.by_ref().take(room).read_until(b'\n', line)?;
        if line.len() as u64 == MAX_LINE_BYTES {
            return Err(MeshError::Malformed("it has an endless line".to_owned()));
        }
        let end = line.trim_ascii_end().len();
        if read == 0 || end == 0 || line[end - 1] != b'\\' {
            return Ok(!line.is_empty());
        }
        line.truncate(end - 1);
        line.push(b' ');
    }
}

/// The indices of the position, the coordinates and the normal of a corner; [`NONE`] for those that it lacks.
type Corner = [u32; 3];

const NONE: u32 = u32::MAX;

#[derive(Default)]
struct Reader {
    positions: Vec<[u32; 3]>,
    uvs: Vec<[u32; 2]>,
    normals: Vec<[u32; 3]>,
    /// The vertices of the mesh by their parts.
    vertices: HashMap<Corner, u32>,
    builder: MeshBuilder,
    has_uvs: bool,
    has_normals: bool,
    has_materials: bool,
}

impl Reader {
    fn line(
        &mut self,
        line: &str,
        hold: impl FnOnce(Amount) -> Result<(), rtsl_memory::OverBudget>,
    ) -> Result<(), MeshError> {
        let mut words = line.split('#').next().unwrap_or("").split_ascii_whitespace();
        match words.next() {
            Some("v") => self.positions.push(numbers(&mut words, line, 3)?),
            Some("vt") => self.uvs.push(numbers(&mut words, line, 1)?),
            Some("vn") => self.normals.push(numbers(&mut words, line, 3)?),
            Some("f" | "fo") => {
                let corners =
                    words.map(|word| self.corner(word)).collect::<Result<Vec<u32>, _>>()?;
                self.builder.polygon(&corners)?;
            }
            Some("usemtl") => self.has_materials = true,
            _ => return Ok(()),
        }
        Ok(hold(self.memory())?)
    }

    /// The memory of the lists and of the mesh.
    fn memory(&self) -> Amount {
        // An entry of the map has four numbers, and twice the room while it grows.
        let more = 3 * (self.positions.len() + self.normals.len()) + 2 * self.uvs.len();
        self.builder.memory(more + 12 * self.vertices.len())
    }

    /// The vertex of a corner such as `7`, `7/2`, `7//3` or `-1/-1/-1`.
    fn corner(&mut self, word: &str) -> Result<u32, MeshError> {
        let mut parts = word.split('/');
        let lengths = [self.positions.len(), self.uvs.len(), self.normals.len()];
        let corner = lengths.map(|length| match parts.next() {
            None | Some("") => Some(NONE),
            Some(index) => place(index, length),
        });
        let ([Some(position), Some(uv), Some(normal)], None) = (corner, parts.next()) else {
            let shown: String = word.chars().take(40).collect();
            return Err(MeshError::Malformed(format!("a face has the corner `{shown}`")));
        };
        if let Some(known) = self.vertices.get(&[position, uv, normal]) {
            return Ok(*known);
        }
        let Some(point) = self.positions.get(position as usize) else {
            return Err(MeshError::Malformed("a face has a corner without a vertex".to_owned()));
        };
        let vertex = self.builder.positions.len() as u32 / 3;
        self.builder.positions.extend(point);
        self.builder.uvs.extend(self.uvs.get(uv as usize).copied().unwrap_or_default());
        self.builder.normals.extend(self.normals.get(normal as usize).copied().unwrap_or_default());
        self.has_uvs |= uv != NONE;
        self.has_normals |= normal != NONE;
        self.vertices.insert([position, uv, normal], vertex);
        Ok(vertex)
    }

    fn finish(mut self) -> Result<Mesh, MeshError> {
        if !self.has_uvs {
            self.builder.uvs.clear();
        }
        if !self.has_normals {
            self.builder.normals.clear();
        }
        let mut mesh = self.builder.finish()?;
        mesh.warnings.extend(self.has_materials.then_some(MeshWarning::Materials));
        Ok(mesh)
    }
}

/// The bits of the next numbers of a line, of which the first `least` must be there.
fn numbers<'a, const COUNT: usize>(
    words: &mut impl Iterator<Item = &'a str>,
    line: &str,
    least: usize,
) -> Result<[u32; COUNT], MeshError> {
    let mut numbers = [0; COUNT];
    for (index, number) in numbers.iter_mut().enumerate() {
        let word = words.next();
        if word.is_none() && index >= least {
            break;
        }
        let Some(value) = word.and_then(|word| word.parse::<f32>().ok()) else {
            let shown: String = line.trim_end().chars().take(40).collect();
            return Err(MeshError::Malformed(format!("it has the line `{shown}`")));
        };
        *number = value.to_bits();
    }
    Ok(numbers)
}

/// The place of an index that counts from 1, or backwards from the end of the list so far.
fn place(index: &str, length: usize) -> Option<u32> {
    let index: i64 = index.parse().ok()?;
    let length = i64::try_from(length).ok()?;
    let place = if index < 0 { length + index } else { index - 1 };
    (0..length).contains(&place).then_some(place as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Mesh, String> {
        let budget = InputBudget::default();
        read_obj_within(text.as_bytes(), &budget).map_err(|error| error.to_string())
    }

    fn floats(numbers: &rtsl::Numbers) -> Vec<f32> {
        numbers.words().iter().map(|bits| f32::from_bits(*bits)).collect()
    }

    #[test]
    fn corners_share_vertices_with_equal_parts() {
        let text = "\u{feff}# a square\nmtllib a.mtl\no square\nv 0 0 0\nv 1 0 0 1\nv 1 1 0 \\\n 1 0 0\n\
            v 0 1 0\nvt .5\nvn 0 0 1\ns off\nf 1/1/1 2//1 3//1\r\nf -4/1/1 -2//1 -1 # the end";
        let mesh = read(text).unwrap();
        assert_eq!(floats(&mesh.positions), [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
        assert_eq!(mesh.indices.words()[..], [0, 1, 2, 0, 2, 3]);
        assert_eq!(floats(&mesh.uvs), [0.5, 0., 0., 0., 0., 0., 0., 0.]);
        assert_eq!(floats(&mesh.normals), [0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 0.]);
        assert!(mesh.warnings.is_empty());
        let plain = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3").unwrap();
        assert_eq!((plain.uvs.words().len(), plain.normals.words().len()), (0, 0));
        assert_eq!(plain.warnings, [MeshWarning::Materials]);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let problem = |text: &str| read(text).expect_err("it is wrong");
        assert_eq!(problem("v 0 0"), "it has the line `v 0 0`");
        assert_eq!(problem("v 0 0 0\nf 1 2 1"), "a face has the corner `2`");
        assert_eq!(problem("v 0 0 0\nf 1/1 1 1"), "a face has the corner `1/1`");
        assert_eq!(problem("v 0 0 0\nf 1 0 1"), "a face has the corner `0`");
        assert_eq!(problem("v 0 0 0\nf 1 /1 1"), "a face has the corner `/1`");
        assert_eq!(problem("v 0 0 0\nf 1 / 1"), "a face has a corner without a vertex");
        assert_eq!(problem("v 0 0 0\n"), "it has no face");
        assert_eq!(problem(&"x".repeat(1 << 21)), "it has an endless line");
    }
}
