//! Transforms: 4x4 matrices in binary64 while a scene is read, 3x4 in binary32 while it is rendered.

use std::ops::RangeInclusive;

use glam::{DAffine3, DMat3, DMat4, DVec3, DVec4};

use super::sine_and_cosine_of_degrees;

/// A transform with the conventions of the scene format: points are columns, and a new transform applies before the
/// current one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform(DMat4);

impl Transform {
    /// The identity.
    pub const IDENTITY: Transform = Transform(DMat4::IDENTITY);

    /// Returns a translation.
    pub fn translate(by: [f64; 3]) -> Self {
        Transform(DMat4::from_translation(DVec3::from_array(by)))
    }

    /// Returns a scaling along the axes.
    pub fn scale(by: [f64; 3]) -> Self {
        Transform(DMat4::from_scale(DVec3::from_array(by)))
    }

    /// Returns a rotation about an axis; `None` if the axis has length 0.
    pub fn rotate(degrees: f64, axis: [f64; 3]) -> Option<Self> {
        let axis = DVec3::from_array(axis);
        let length = dot64(axis, axis).sqrt();
        if !(length > 0.0 && length.is_finite()) {
            return None;
        }
        let a = DVec3::new(axis.x / length, axis.y / length, axis.z / length);
        let (s, c) = sine_and_cosine_of_degrees(degrees);
        let k = 1.0 - c;
        let x =
            DVec4::new(a.x * a.x * k + c, a.x * a.y * k + a.z * s, a.x * a.z * k - a.y * s, 0.0);
        let y =
            DVec4::new(a.x * a.y * k - a.z * s, a.y * a.y * k + c, a.y * a.z * k + a.x * s, 0.0);
        let z =
            DVec4::new(a.x * a.z * k + a.y * s, a.y * a.z * k - a.x * s, a.z * a.z * k + c, 0.0);
        Some(Transform(DMat4::from_cols(x, y, z, DVec4::W)))
    }

    /// Returns the transform from world to camera space of a camera at `eye` that looks along +z at `target`, with y up
    /// and x to the right (a left-handed frame). Returns `None` if the vectors do not define a frame.
    pub fn look_at(eye: [f64; 3], target: [f64; 3], up: [f64; 3]) -> Option<Self> {
        let eye = DVec3::from_array(eye);
        let forward = unit64(DVec3::from_array(target) - eye)?;
        let right = unit64(cross64(unit64(DVec3::from_array(up))?, forward))?;
        let up = cross64(forward, right);
        let camera_to_world = DMat4::from_cols(
            right.extend(0.0),
            up.extend(0.0),
            forward.extend(0.0),
            eye.extend(1.0),
        );
        Transform(camera_to_world).inverse()
    }

    /// Creates a transform from 16 numbers in the order of the format: column by column.
    pub fn from_columns(numbers: &[f64; 16]) -> Self {
        Transform(DMat4::from_cols_array(numbers))
    }

    /// Returns its 16 numbers, column by column.
    pub fn columns(self) -> [f64; 16] {
        self.0.to_cols_array()
    }

    /// Creates a transform from a matrix whose last row is that of an affine map.
    pub(super) fn from_matrix(matrix: DMat4) -> Self {
        Transform(matrix)
    }

    /// Returns the matrix.
    pub(super) fn matrix(self) -> DMat4 {
        self.0
    }

    /// Interpolates the components linearly, with weight `part` for `other`.
    pub fn mix(self, other: Transform, part: f64) -> Self {
        Transform(self.0 * (1.0 - part) + other.0 * part)
    }

    /// Returns the composition that applies `first`, then `self`.
    pub fn after(self, first: Transform) -> Self {
        Transform(self.0 * first.0)
    }

    /// Returns the inverse; `None` if there is no finite one.
    pub fn inverse(self) -> Option<Self> {
        let inverse = self.0.inverse();
        let regular = self.0.determinant() != 0.0 && self.0.is_finite() && inverse.is_finite();
        regular.then_some(Transform(inverse))
    }

    /// True if the last row is that of an affine map, which preserves parallel lines.
    pub fn is_affine(self) -> bool {
        let row = self.0.row(3);
        row.x == 0.0 && row.y == 0.0 && row.z == 0.0 && row.w == 1.0
    }

    /// True if it maps right-handed frames to left-handed ones.
    pub fn swaps_handedness(self) -> bool {
        self.0.determinant() < 0.0
    }

    /// Returns the factor by which it scales volumes; positive.
    pub fn volume_scale(self) -> f64 {
        self.0.determinant().abs()
    }

    /// Transforms a point in binary64.
    pub fn point(self, point: [f64; 3]) -> [f64; 3] {
        let p = DVec3::from_array(point);
        (self.0 * p.extend(1.0)).truncate().to_array()
    }

    /// Applies the transposed linear part to a vector: transforms a normal by the inverse of this transform.
    pub fn transposed_vector(self, vector: [f64; 3]) -> [f64; 3] {
        let v = DVec3::from_array(vector);
        std::array::from_fn(|column| dot64(self.0.col(column).truncate(), v))
    }

    /// Returns the map in binary32.
    pub fn affine(self) -> Affine {
        let column = |index: usize| self.0.col(index).truncate().as_vec3().to_array();
        Affine { columns: [column(0), column(1), column(2), column(3)] }
    }

    /// Returns the inverse of an invertible affine map in binary32.
    pub fn affine_inverse(self) -> Affine {
        let DAffine3 { matrix3: m, translation } = DAffine3::from_mat4(self.0).inverse();
        let columns = [m.x_axis, m.y_axis, m.z_axis, translation];
        Affine { columns: columns.map(|column| column.as_vec3().to_array()) }
    }
}

fn dot64(a: DVec3, b: DVec3) -> f64 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

fn cross64(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

fn unit64(v: DVec3) -> Option<DVec3> {
    let length = dot64(v, v).sqrt();
    (length > 0.0 && length.is_finite()).then(|| v / length)
}

/// An affine transform in binary64 without its last row, for long lists.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PackedTransform([f64; 12]);

impl From<Transform> for PackedTransform {
    /// Leaves the last row out, which is that of an affine map.
    fn from(transform: Transform) -> Self {
        let columns = transform.columns();
        PackedTransform(std::array::from_fn(|index| columns[index / 3 * 4 + index % 3]))
    }
}

impl From<PackedTransform> for Transform {
    fn from(PackedTransform(numbers): PackedTransform) -> Self {
        let column = |index: usize, last: f64| {
            let [x, y, z] = [numbers[3 * index], numbers[3 * index + 1], numbers[3 * index + 2]];
            DVec4::new(x, y, z, last)
        };
        let columns = [column(0, 0.0), column(1, 0.0), column(2, 0.0), column(3, 1.0)];
        let [x, y, z, w] = columns;
        Transform(DMat4::from_cols(x, y, z, w))
    }
}

/// An affine map in binary32, applied with one fixed order of operations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// The images of the three axes, then that of the origin.
    pub columns: [[f32; 3]; 4],
}

impl Affine {
    /// The identity.
    pub const IDENTITY: Affine =
        Affine { columns: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]] };

    /// True if it is the identity.
    pub fn is_identity(&self) -> bool {
        *self == Affine::IDENTITY
    }

    /// Transforms a point.
    #[inline]
    pub fn point(&self, p: [f32; 3]) -> [f32; 3] {
        let v = self.vector(p);
        let origin = self.columns[3];
        [v[0] + origin[0], v[1] + origin[1], v[2] + origin[2]]
    }

    /// Transforms a vector.
    #[inline]
    pub fn vector(&self, v: [f32; 3]) -> [f32; 3] {
        let [x, y, z, _] = &self.columns;
        let row = |row: usize| x[row] * v[0] + y[row] * v[1] + z[row] * v[2];
        [row(0), row(1), row(2)]
    }

    /// Returns the map of magnitudes for error bounds: from the magnitudes of a point's coordinates to those of the
    /// terms of which its image is the sum.
    pub fn of_sizes(&self) -> Self {
        Affine { columns: self.columns.map(|column| column.map(f32::abs)) }
    }

    /// Returns the composition that applies `first`, then this, in binary32.
    pub fn after(&self, first: &Affine) -> Self {
        let [x, y, z, origin] = &first.columns;
        Affine { columns: [self.vector(*x), self.vector(*y), self.vector(*z), self.point(*origin)] }
    }

    /// Returns the factor by which it scales volumes; positive.
    pub fn volume_scale(&self) -> f64 {
        let [x, y, z, _] = self.columns.map(|column| DVec3::from_array(column.map(f64::from)));
        DMat3::from_cols(x, y, z).determinant().abs()
    }

    /// Applies the transposed linear part to a vector: transforms a normal by the inverse of this map.
    pub fn transposed_vector(&self, v: [f32; 3]) -> [f32; 3] {
        [dot(self.columns[0], v), dot(self.columns[1], v), dot(self.columns[2], v)]
    }
}

/// The scalar product.
#[inline]
pub fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The range of squared lengths that are computed without overflow or loss of precision.
pub const USUAL_SQUARES: RangeInclusive<f32> = 1e-30..=1e30;

/// Returns `v` normalised, or `otherwise` if `v` has no direction.
pub fn normalize_or(v: [f32; 3], otherwise: [f32; 3]) -> [f32; 3] {
    let square = dot(v, v);
    if USUAL_SQUARES.contains(&square) {
        let factor = 1.0 / square.sqrt();
        return v.map(|x| x * factor);
    }
    // Scaled first, so that no square overflows or underflows.
    let largest = v[0].abs().max(v[1].abs()).max(v[2].abs());
    if !(largest > 0.0 && largest.is_finite() && v.iter().all(|x| !x.is_nan())) {
        return otherwise;
    }
    let scaled = [v[0] / largest, v[1] / largest, v[2] / largest];
    let length = dot(scaled, scaled).sqrt();
    [scaled[0] / length, scaled[1] / length, scaled[2] / length]
}

/// Returns the reciprocal of each component.
pub fn reciprocal(v: [f32; 3]) -> [f32; 3] {
    [1.0 / v[0], 1.0 / v[1], 1.0 / v[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn look_at_is_left_handed_along_z() {
        let world_to_camera =
            Transform::look_at([0.0, 0.0, -5.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]).unwrap();
        assert_eq!(world_to_camera.point([0.0, 0.0, 0.0]), [0.0, 0.0, 5.0]);
        assert_eq!(world_to_camera.point([1.0, 2.0, 0.0]), [1.0, 2.0, 5.0]);
    }

    #[test]
    fn rotation_about_z_takes_x_to_y() {
        let rotation = Transform::rotate(90.0, [0.0, 0.0, 2.0]).unwrap();
        assert_eq!(rotation.point([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn what_has_no_inverse_gives_none() {
        assert!(Transform::scale([1.0, 0.0, 1.0]).inverse().is_none());
        assert!(Transform::look_at([0.0; 3], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]).is_none());
        assert!(Transform::rotate(10.0, [0.0; 3]).is_none());
    }

    #[test]
    fn normals_stay_at_right_angles() {
        let transform = Transform::scale([1.0, 2.0, 1.0]);
        let inverse = transform.inverse().unwrap().affine();
        let tangent = transform.affine().vector([1.0, -1.0, 0.0]);
        assert_eq!(dot(inverse.transposed_vector([1.0, 1.0, 0.0]), tangent), 0.0);
    }
}
