//! Meshes and their construction.

use rtsl::{Numbers, Scalar};
use rtsl_memory::Amount;

use super::{MeshError, MeshWarning};
use crate::attributes::GivenAttribute;

/// The greatest length of an array: kernels use 31-bit indices.
const MAX_NUMBERS: usize = i32::MAX as usize;

/// A mesh in the form that instances share. All corners of faces are valid vertices.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Three floats for each vertex, all of them finite.
    pub positions: Numbers,
    /// Three floats for each vertex, or nothing. A normal of length 0 means no normal.
    pub normals: Numbers,
    /// Two floats for each vertex, or nothing.
    pub uvs: Numbers,
    /// Three ints for each triangle, or four for each quadrilateral: the indices of its vertices.
    pub indices: Numbers,
    /// The attributes of its vertices or faces that were asked for.
    pub attributes: Vec<GivenAttribute>,
    /// The parts of its file that are left out.
    pub warnings: Vec<MeshWarning>,
}

impl Mesh {
    /// Returns the memory of the arrays.
    pub fn memory(&self) -> Amount {
        let arrays = [&self.positions, &self.normals, &self.uvs, &self.indices].into_iter();
        let arrays = arrays.chain(self.attributes.iter().map(|it| &it.numbers));
        arrays.map(|numbers| Amount::of::<u32>(numbers.words().len())).sum()
    }

    /// Returns the number of triangles of a triangle mesh.
    pub fn triangles(&self) -> usize {
        self.indices.words().len() / 3
    }

    /// Returns the number of vertices.
    pub fn vertices(&self) -> usize {
        self.positions.words().len() / 3
    }
}

/// A mesh under construction: growing arrays of bits, not yet checked.
#[derive(Clone, Debug, Default)]
pub struct MeshBuilder {
    /// Three floats for each vertex.
    pub positions: Vec<u32>,
    /// Three floats for each vertex, or nothing.
    pub normals: Vec<u32>,
    /// Two floats for each vertex, or nothing.
    pub uvs: Vec<u32>,
    /// Three indices for each triangle, or four for each quadrilateral.
    pub indices: Vec<u32>,
}

impl MeshBuilder {
    /// Returns the memory of the arrays until the mesh is finished, if `more` numbers are added: twice their size,
    /// because they grow and are copied to their final place. It changes in steps, so that the budget is not queried
    /// for each number.
    pub fn memory(&self, more: usize) -> Amount {
        const STEP: usize = 1 << 13;
        let arrays = [&self.positions, &self.normals, &self.uvs, &self.indices];
        let numbers = arrays.into_iter().map(Vec::len).fold(more, usize::saturating_add);
        Amount::of::<u32>(numbers.div_ceil(STEP)).times(2 * STEP)
    }

    /// Adds a polygon as a fan of triangles around its first corner. A polygon with fewer than three corners has no
    /// area and adds nothing.
    ///
    /// # Errors
    /// If the mesh has too many triangles.
    pub fn polygon(&mut self, corners: &[u32]) -> Result<(), MeshError> {
        if let [first, rest @ ..] = corners {
            for pair in rest.windows(2) {
                self.indices.extend([*first, pair[0], pair[1]]);
            }
        }
        check_size(self.indices.len(), 3, "triangles")
    }

    /// Checks a mesh of triangles and moves the arrays to their final place, one after the other, so that at most one
    /// of them exists twice.
    ///
    /// # Errors
    /// If the mesh is invalid.
    pub fn finish(self) -> Result<Mesh, MeshError> {
        check_size(self.indices.len(), 3, "triangles")?;
        check_whole(self.indices.len(), 3, "triangle")?;
        self.finish_faces()
    }

    /// The same for a mesh of quadrilaterals.
    ///
    /// # Errors
    /// If the mesh is invalid.
    pub fn finish_quadrilaterals(self) -> Result<Mesh, MeshError> {
        check_size(self.indices.len(), 4, "quadrilaterals")?;
        check_whole(self.indices.len(), 4, "quadrilateral")?;
        self.finish_faces()
    }

    fn finish_faces(mut self) -> Result<Mesh, MeshError> {
        check_size(self.positions.len(), 3, "vertices")?;
        check_whole(self.positions.len(), 3, "vertex")?;
        let vertices = self.positions.len() / 3;
        check_count("normals", self.normals.len(), 3, vertices)?;
        check_count("texture coordinates", self.uvs.len(), 2, vertices)?;
        check_indices(&self.indices, vertices)?;
        let warning = self.move_unused()?;
        let (normals, _) = self.normals.as_chunks_mut::<3>();
        for normal in normals.iter_mut().filter(|normal| is_bad(normal.as_slice())) {
            *normal = [0; 3];
        }
        Ok(Mesh {
            positions: Numbers::from_words(Scalar::F32, self.positions),
            normals: Numbers::from_words(Scalar::F32, self.normals),
            uvs: Numbers::from_words(Scalar::F32, self.uvs),
            indices: Numbers::from_words(Scalar::I32, self.indices),
            attributes: Vec::new(),
            warnings: warning.into_iter().collect(),
        })
    }

    /// Moves vertices that are not finite and that no face uses to the corner of a face.
    fn move_unused(&mut self) -> Result<Option<MeshWarning>, MeshError> {
        let (positions, _) = self.positions.as_chunks_mut::<3>();
        let bad = unused_bad_vertices(positions, |it| is_bad(it), &self.indices)?;
        let used = self.indices.first().map_or([0; 3], |index| positions[*index as usize]);
        bad.iter().for_each(|vertex| positions[*vertex] = used);
        Ok(bad.first().map(|vertex| MeshWarning::NotFinite(*vertex)))
    }
}

/// Checks that so many numbers, `each` of them for one element, can be indexed.
pub(super) fn check_size(numbers: usize, each: usize, what: &'static str) -> Result<(), MeshError> {
    if numbers > MAX_NUMBERS {
        return Err(MeshError::TooLarge(MAX_NUMBERS / each, what));
    }
    Ok(())
}

fn check_whole(numbers: usize, each: usize, what: &'static str) -> Result<(), MeshError> {
    if numbers.is_multiple_of(each) { Ok(()) } else { Err(MeshError::Incomplete(numbers, what)) }
}

fn check_count(
    what: &'static str,
    numbers: usize,
    each: usize,
    vertices: usize,
) -> Result<(), MeshError> {
    if numbers == 0 || numbers == vertices * each {
        return Ok(());
    }
    Err(MeshError::CountMismatch { what, found: numbers / each, vertices })
}

fn check_indices(indices: &[u32], vertices: usize) -> Result<(), MeshError> {
    // The greatest index is compared first: a loop without exits is vectorised, and errors are rare. Negative indices
    // are the greatest as unsigned numbers.
    let greatest = indices.iter().fold(None, |greatest, index| greatest.max(Some(*index)));
    match greatest {
        None => Err(MeshError::Empty),
        Some(greatest) if (greatest as usize) < vertices => Ok(()),
        Some(greatest) => {
            let index = i64::from(greatest.cast_signed());
            Err(MeshError::IndexOutOfRange { index, vertices })
        }
    }
}

/// Returns the vertices that are not finite, none of which a face uses.
///
/// # Errors
/// If a face uses one.
pub(crate) fn unused_bad_vertices<V>(
    positions: &[V],
    is_bad: impl Fn(&V) -> bool,
    corners: &[u32],
) -> Result<Vec<usize>, MeshError> {
    let all = positions.iter().enumerate();
    let bad: Vec<usize> = all.filter(|(_, it)| is_bad(it)).map(|(vertex, _)| vertex).collect();
    if bad.is_empty() {
        return Ok(bad);
    }
    let is_used = |corner: &&u32| positions.get(**corner as usize).is_some_and(&is_bad);
    match corners.iter().find(is_used) {
        Some(corner) => Err(MeshError::NotFinite(*corner as usize)),
        None => Ok(bad),
    }
}

/// True if one of some numbers is not finite.
fn is_bad(numbers: &[u32]) -> bool {
    numbers.iter().any(|bits| !f32::from_bits(*bits).is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn builder(positions: &[f32], indices: &[u32]) -> MeshBuilder {
        MeshBuilder {
            positions: positions.iter().map(|x| x.to_bits()).collect(),
            indices: indices.to_vec(),
            ..MeshBuilder::default()
        }
    }

    fn problem(builder: MeshBuilder) -> String {
        builder.finish().expect_err("it is wrong").to_string()
    }

    #[test]
    fn polygons_become_fans() {
        let mut builder = MeshBuilder::default();
        builder.polygon(&[7, 1, 2, 3, 4]).unwrap();
        builder.polygon(&[1, 2]).unwrap();
        builder.polygon(&[]).unwrap();
        assert_eq!(builder.indices, [7, 1, 2, 7, 2, 3, 7, 3, 4]);
    }

    #[test]
    fn what_kernels_may_not_see_is_refused() {
        let corners = [0.0; 9];
        assert_eq!(builder(&corners, &[0, 1, 2]).finish().unwrap().triangles(), 1);
        assert_eq!(problem(builder(&corners, &[])), "it has no face");
        assert_eq!(problem(builder(&corners[1..], &[0, 1, 2])), "8 numbers make no whole vertex");
        assert_eq!(problem(builder(&corners, &[0, 1])), "2 numbers make no whole triangle");
        assert_eq!(
            problem(builder(&corners, &[0, 3, 1])),
            "a face has the corner 3, but there are 3 vertices"
        );
        assert_eq!(
            problem(builder(&corners, &[0, 1, u32::MAX])),
            "a face has the corner -1, but there are 3 vertices"
        );
        let infinite = [0.0, 0.0, 0.0, 0.0, f32::INFINITY, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(
            problem(builder(&infinite, &[0, 1, 2])),
            "vertex 1 has a coordinate that is not finite"
        );
        let mut unused = builder(&[0., 0., 0., 1., 0., 0., 0., 1., 0.], &[1, 2, 1]);
        unused.positions[1] = f32::NAN.to_bits();
        unused.normals = vec![f32::INFINITY.to_bits(); 9];
        let mesh = unused.finish().unwrap();
        assert_eq!(mesh.positions.words()[..3], mesh.positions.words()[3..6]);
        assert_eq!(mesh.normals.words()[..], [0; 9]);
        assert_eq!(mesh.warnings, [MeshWarning::NotFinite(0)]);
        let mut few = builder(&corners, &[0, 1, 2]);
        few.uvs = vec![0; 4];
        assert_eq!(problem(few), "it has 3 vertices, but 2 texture coordinates");
    }
}
