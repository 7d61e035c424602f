//! The geometry of a primitive: the arrays of its attributes, in the shape that morph targets and skins give it.

use gltf::json::Index;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::{Primitive, Semantic};
use rtsl_math::Transform;
use rtsl_memory::{Amount, Held, InputBudget};

use super::strokes::{Bodies, Strokes};
use crate::mesh::gltf::{
    GltfFile, MAX_PLACED, Numbers, VertexAttribute, VertexValues, attribute, corners, size,
};
use crate::mesh::{MeshError, unused_bad_vertices};
use crate::vector::cross;

/// The arrays of a primitive. Those that it does not have are empty.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// The vertices.
    pub positions: Vec<[f32; 3]>,
    /// The normals.
    pub normals: Vec<[f32; 3]>,
    /// The tangents; the last number is -1 where the bitangent is reversed.
    pub tangents: Vec<[f32; 4]>,
    /// Two sets of texture coordinates.
    pub uvs: [Vec<[f32; 2]>; 2],
    /// Linear red, green, blue and opacity.
    pub colors: Vec<[f32; 4]>,
    /// The attributes that shaders read.
    pub attributes: Vec<VertexValues>,
    /// The vertices of triangles, three for each.
    pub corners: Vec<u32>,
    /// Points or lines, which [`Surface::thicken`] makes triangles of.
    pub strokes: Option<Strokes>,
    /// The vertices of the attributes that the arrays have; `None` for all of them in their order.
    pub used: Option<Vec<u32>>,
    /// The number of vertices that the attributes have.
    pub count: usize,
}

/// The attributes to read besides positions and normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Wanted {
    /// The sets of texture coordinates.
    pub sets: [Option<u32>; 2],
    /// True for tangents.
    pub tangents: bool,
}

/// The joints of a skin: the transforms from the space of bound vertices to the world's.
pub type Joints = Vec<Transform>;

/// The greatest number of sets of joints that are read.
const MAX_JOINT_SETS: u32 = 4;

impl Surface {
    /// Reads a primitive; `None` for primitives without positions.
    ///
    /// # Errors
    /// If it is invalid, or would take too much memory.
    pub fn read(
        file: &GltfFile<'_>,
        primitive: &Primitive,
        wanted: Wanted,
        held: &mut Held,
    ) -> Result<Option<Self>, MeshError> {
        let Some(positions) = attribute(primitive, Semantic::Positions) else { return Ok(None) };
        let count = size(file.accessor(positions)?.count);
        if count > MAX_PLACED {
            return Err(MeshError::TooLarge(MAX_PLACED, "vertices"));
        }
        let listed = match primitive.indices {
            Some(indices) => size(file.accessor(indices)?.count),
            None => count,
        };
        if listed > MAX_PLACED {
            return Err(MeshError::TooLarge(MAX_PLACED, "corners"));
        }
        held.grow_to(memory(0, listed))?;
        let (mut corners, strokes) = match corners(file, primitive, count)? {
            Some(corners) => (corners, None),
            None => (Vec::new(), Some(Strokes::read(file, primitive, count)?)),
        };
        let used = if strokes.is_none() { used_alone(&mut corners, count) } else { None };
        let vertices = used.as_ref().map_or(count, Vec::len);
        held.grow_to(memory(vertices, listed))?;
        if let Some(strokes) = &strokes {
            held.grow_to(memory(strokes.vertices(), strokes.corners()))?;
        }
        let reader = Reader { file, count, used: used.as_deref() };
        let find = |semantic| attribute(primitive, semantic);
        let mut surface = Surface {
            positions: reader.floats(positions)?,
            normals: reader.optional(find(Semantic::Normals))?,
            corners,
            strokes,
            count,
            ..Surface::default()
        };
        if wanted.tangents && !surface.normals.is_empty() {
            surface.tangents = reader.optional(find(Semantic::Tangents))?;
        }
        for (slot, set) in surface.uvs.iter_mut().zip(wanted.sets) {
            if let Some(set) = set {
                *slot = reader.optional(find(Semantic::TexCoords(set)))?;
            }
        }
        if let Some(colors) = find(Semantic::Colors(0)) {
            surface.colors = reader.colors(colors)?;
        }
        surface.used = used;
        Ok(Some(surface))
    }

    /// Adds an attribute that shaders read, whose values neither morph targets nor skins change.
    ///
    /// # Errors
    /// If it is invalid, or would take too much memory; the surface is then as it was.
    pub fn add_attribute(
        &mut self,
        file: &GltfFile<'_>,
        attribute: &VertexAttribute,
        budget: &InputBudget,
    ) -> Result<Held, MeshError> {
        // Twice: triangles may get vertices of their own.
        let vertices = self.used.as_ref().map_or(self.count, Vec::len);
        let numbers = vertices.saturating_add(self.corners.len()).saturating_add(
            self.strokes.as_ref().map_or(0, |strokes| strokes.vertices() + strokes.corners()),
        );
        let held = budget.hold(Amount::of::<u32>(numbers.saturating_mul(2 * attribute.scalars)))?;
        let mut values = VertexValues::new(attribute);
        // Textures count from the bottom, and the file from the top.
        let is_turned = matches!(attribute.semantic, Semantic::TexCoords(_));
        let map =
            |[u, v, z, w]: [f64; 4]| if is_turned { [u, 1.0 - v, z, w] } else { [u, v, z, w] };
        let used = self.used.as_deref();
        attribute.read(file, self.count, used, &map, values.values())?;
        self.attributes.push(values);
        Ok(held)
    }

    /// Moves vertices by the morph targets of the primitive, with these weights.
    ///
    /// # Errors
    /// If a target is invalid.
    pub fn morph(
        &mut self,
        file: &GltfFile<'_>,
        primitive: &Primitive,
        weights: &[f32],
    ) -> Result<(), MeshError> {
        let reader = Reader { file, count: self.count, used: self.used.as_deref() };
        for (target, weight) in primitive.targets.iter().flatten().zip(weights) {
            if *weight == 0.0 || !weight.is_finite() {
                continue;
            }
            if let Some(accessor) = target.positions {
                add(&mut self.positions, &reader.floats::<3>(accessor)?, *weight);
            }
            if let (Some(accessor), false) = (target.normals, self.normals.is_empty()) {
                add(&mut self.normals, &reader.floats::<3>(accessor)?, *weight);
            }
            if let (Some(accessor), false) = (target.tangents, self.tangents.is_empty()) {
                let moved = reader.floats::<3>(accessor)?;
                for (tangent, by) in self.tangents.iter_mut().zip(moved) {
                    (0..3).for_each(|axis| tangent[axis] += weight * by[axis]);
                }
            }
        }
        Ok(())
    }

    /// Moves vertices to the world's space by the joints of a skin.
    ///
    /// # Errors
    /// If the attributes of joints are invalid.
    pub fn skin(
        &mut self,
        file: &GltfFile<'_>,
        primitive: &Primitive,
        joints: &Joints,
    ) -> Result<(), MeshError> {
        let reader = Reader { file, count: self.count, used: self.used.as_deref() };
        let mut sums = vec![[0.0; 16]; self.positions.len()];
        for set in 0..MAX_JOINT_SETS {
            let indices = attribute(primitive, Semantic::Joints(set));
            let weights = attribute(primitive, Semantic::Weights(set));
            let (Some(indices), Some(weights)) = (indices, weights) else { break };
            let pairs = reader.floats::<4>(indices)?;
            let weights = reader.floats::<4>(weights)?;
            for ((sum, indices), weights) in sums.iter_mut().zip(pairs).zip(weights) {
                let weights = weights.map(f64::from);
                for (index, weight) in indices.into_iter().zip(weights) {
                    let joint = joints.get(index as usize).copied().unwrap_or(Transform::IDENTITY);
                    if weight != 0.0 {
                        let columns = joint.columns();
                        (0..16).for_each(|number| sum[number] += weight * columns[number]);
                    }
                }
            }
        }
        for (vertex, sum) in sums.iter().enumerate() {
            // Weights sum up to 1 but for rounding.
            let total = sum[15];
            if total.abs() < 1e-6 {
                continue;
            }
            let columns = sum.map(|number| number / total);
            let position = &mut self.positions[vertex];
            *position = turned(&columns, *position, 1.0);
            if let Some(normal) = self.normals.get_mut(vertex) {
                *normal = turned(&cofactors(&columns), *normal, 0.0);
            }
            if let Some(tangent) = self.tangents.get_mut(vertex) {
                let [x, y, z] = turned(&columns, [tangent[0], tangent[1], tangent[2]], 0.0);
                *tangent = [x, y, z, tangent[3]];
            }
        }
        Ok(())
    }

    /// Transforms vertices by a matrix that may flatten them. Normals are then those of the faces.
    pub fn bake(&mut self, transform: Transform) {
        let columns = transform.columns();
        self.positions.iter_mut().for_each(|position| *position = turned(&columns, *position, 1.0));
        self.normals.clear();
        self.tangents.clear();
    }

    /// Checks that there are triangles and that their vertices are finite; normals that are not become 0. Returns the
    /// first vertex that is not, and that no triangle uses: it becomes one that a triangle uses.
    ///
    /// # Errors
    /// If not.
    pub fn check(&mut self) -> Result<Option<usize>, MeshError> {
        if self.corners.len() < 3 {
            return Err(MeshError::Empty);
        }
        self.corners.truncate(self.corners.len() / 3 * 3);
        let is_bad = |position: &[f32; 3]| !position.iter().all(|it| it.is_finite());
        let bad = unused_bad_vertices(&self.positions, is_bad, &self.corners)?;
        let used = self.corners.first().and_then(|it| self.positions.get(*it as usize)).copied();
        bad.iter().for_each(|vertex| self.positions[*vertex] = used.unwrap_or_default());
        for normal in &mut self.normals {
            if !normal.iter().all(|it| it.is_finite()) {
                *normal = [0.0; 3];
            }
        }
        Ok(bad.first().copied())
    }

    /// Makes small bodies of points and lines, in the space of the vertices.
    pub fn thicken(&mut self) {
        let Some(strokes) = self.strokes.take() else { return };
        let Bodies { positions, vertices, corners } = strokes.bodies(&self.positions);
        fn spread<T: Copy>(values: &mut Vec<T>, vertices: &[u32]) {
            if !values.is_empty() {
                *values = vertices.iter().map(|vertex| values[*vertex as usize]).collect();
            }
        }
        self.positions = positions;
        self.corners = corners;
        self.normals.clear();
        self.tangents.clear();
        self.uvs.iter_mut().for_each(|uvs| spread(uvs, &vertices));
        spread(&mut self.colors, &vertices);
        self.attributes.iter_mut().for_each(|it| it.spread(&vertices));
    }

    /// Gives each triangle vertices of its own, and their normals if they have none: those of the faces.
    pub fn separate(&mut self) {
        let corners = std::mem::take(&mut self.corners);
        fn spread<T: Copy>(values: &mut Vec<T>, corners: &[u32]) {
            if !values.is_empty() {
                *values = corners.iter().map(|corner| values[*corner as usize]).collect();
            }
        }
        spread(&mut self.positions, &corners);
        spread(&mut self.normals, &corners);
        spread(&mut self.tangents, &corners);
        self.uvs.iter_mut().for_each(|uvs| spread(uvs, &corners));
        spread(&mut self.colors, &corners);
        self.attributes.iter_mut().for_each(|it| it.spread(&corners));
        self.corners = (0..corners.len() as u32).collect();
        if self.normals.is_empty() {
            let faces = self.positions.chunks_exact(3);
            self.normals = faces.flat_map(|face| [face_normal(face); 3]).collect();
        }
    }
}

/// The memory of reading so many vertices and corners: arrays, their copies with separate corners, and the arrays for
/// instances.
fn memory(vertices: usize, corners: usize) -> Amount {
    const OF_VERTEX: usize = 3 + 3 + 4 + 2 + 2 + 4;
    let numbers = vertices.saturating_mul(2 * OF_VERTEX + 32);
    let more = corners.saturating_mul(2 * OF_VERTEX + 6);
    Amount::of::<f32>(numbers.saturating_add(more))
}

/// Reads attributes of so many vertices.
struct Reader<'f> {
    file: &'f GltfFile<'f>,
    count: usize,
    /// Those that are read.
    used: Option<&'f [u32]>,
}

impl Reader<'_> {
    fn numbers<const COUNT: usize>(
        &self,
        index: Index<Accessor>,
    ) -> Result<Numbers<'_, COUNT>, MeshError> {
        let found = size(self.file.accessor(index)?.count);
        if found != self.count {
            let what = "of another attribute";
            return Err(MeshError::CountMismatch { what, found, vertices: self.count });
        }
        Numbers::new(index, self.file)
    }

    fn floats<const COUNT: usize>(
        &self,
        index: Index<Accessor>,
    ) -> Result<Vec<[f32; COUNT]>, MeshError> {
        let numbers = self.numbers::<COUNT>(index)?;
        let float = |tuple: [f64; COUNT]| tuple.map(|number| number as f32);
        Ok(match self.used {
            Some(used) => used.iter().map(|vertex| float(numbers.at(*vertex as usize))).collect(),
            None => numbers.iter().map(float).collect(),
        })
    }

    fn optional<const COUNT: usize>(
        &self,
        index: Option<Index<Accessor>>,
    ) -> Result<Vec<[f32; COUNT]>, MeshError> {
        index.map_or(Ok(Vec::new()), |index| self.floats(index))
    }

    /// Colours without opacity have 1.
    fn colors(&self, index: Index<Accessor>) -> Result<Vec<[f32; 4]>, MeshError> {
        let accessor = self.file.accessor(index)?;
        match &accessor.type_ {
            gltf::json::validation::Checked::Valid(gltf::json::accessor::Type::Vec3) => {
                let colors = self.floats::<3>(index)?;
                Ok(colors.into_iter().map(|[red, green, blue]| [red, green, blue, 1.0]).collect())
            }
            _ => self.floats(index),
        }
    }
}

/// The vertices of corners that name less than half of `count`, which are then numbered among these: primitives may
/// share the arrays of all of a mesh.
fn used_alone(corners: &mut [u32], count: usize) -> Option<Vec<u32>> {
    if corners.len() >= count / 2 {
        return None;
    }
    let mut used = corners.to_vec();
    used.sort_unstable();
    used.dedup();
    for corner in corners {
        *corner = used.binary_search(corner).unwrap_or(0) as u32;
    }
    Some(used)
}

fn add(vectors: &mut [[f32; 3]], moved: &[[f32; 3]], weight: f32) {
    for (vector, by) in vectors.iter_mut().zip(moved) {
        (0..3).for_each(|axis| vector[axis] += weight * by[axis]);
    }
}

/// A point, or a direction if `w` is 0, under an affine matrix.
fn turned(columns: &[f64; 16], v: [f32; 3], w: f64) -> [f32; 3] {
    let [x, y, z] = v.map(f64::from);
    let row = |row: usize| {
        columns[row] * x + columns[4 + row] * y + columns[8 + row] * z + columns[12 + row] * w
    };
    [row(0) as f32, row(1) as f32, row(2) as f32]
}

/// The matrix that turns normals: that of cofactors.
fn cofactors(columns: &[f64; 16]) -> [f64; 16] {
    let column = |at: usize| [columns[at], columns[at + 1], columns[at + 2]];
    let (a, b, c) = (column(0), column(4), column(8));
    let [x, y, z] = [cross(b, c), cross(c, a), cross(a, b)];
    [x[0], x[1], x[2], 0.0, y[0], y[1], y[2], 0.0, z[0], z[1], z[2], 0.0, 0.0, 0.0, 0.0, 1.0]
}

fn face_normal(face: &[[f32; 3]]) -> [f32; 3] {
    let edge = |to: usize| {
        std::array::from_fn(|axis| f64::from(face[to][axis]) - f64::from(face[0][axis]))
    };
    let normal: [f64; 3] = cross(edge(1), edge(2));
    let length = normal.iter().map(|part| part * part).sum::<f64>().sqrt();
    if length > 0.0 { normal.map(|part| (part / length) as f32) } else { [0.0; 3] }
}
