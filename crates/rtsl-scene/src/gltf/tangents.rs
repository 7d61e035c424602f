//! Tangents that a file leaves to be computed, by the algorithm that glTF names: MikkTSpace.

use bevy_mikktspace::{Geometry, Ops, TangentSpace, generate_tangents};

use super::surface::Surface;

/// Gives a surface with normals and coordinates tangents. Its triangles get vertices of their own, because one vertex
/// may have different tangents in its triangles.
pub fn add_tangents(surface: &mut Surface) {
    surface.separate();
    if surface.uvs[0].is_empty() || surface.corners.is_empty() {
        return;
    }
    // The library takes numbers that are not finite for a fault of its own.
    let finite = |numbers: &[f32]| numbers.iter().all(|number| number.abs() < 1e18);
    let is_usable = surface.positions.iter().all(|it| finite(it))
        && surface.normals.iter().all(|it| finite(it))
        && surface.uvs[0].iter().all(|it| finite(it));
    if !is_usable {
        return;
    }
    let mut tangents = vec![[0.0; 4]; surface.positions.len()];
    let mut faces = Faces { surface, tangents: &mut tangents };
    if generate_tangents::<_, Arithmetic>(&mut faces).is_ok() {
        surface.tangents = tangents;
    }
}

/// The triangles of a surface whose corners have vertices of their own.
struct Faces<'a> {
    surface: &'a Surface,
    tangents: &'a mut [[f32; 4]],
}

impl Geometry<Arithmetic> for Faces<'_> {
    fn num_faces(&self) -> usize {
        self.surface.positions.len() / 3
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.surface.positions[3 * face + corner]
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.surface.normals[3 * face + corner]
    }

    /// Upwards, as the second number of mapped normals.
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let [u, v] = self.surface.uvs[0][3 * face + corner];
        [u, 1.0 - v]
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        if let Some(tangent) = tangent {
            self.tangents[3 * face + corner] = tangent.tangent_encoded();
        }
    }
}

/// Arithmetic with the same bits on every machine.
struct Arithmetic;

impl Ops for Arithmetic {
    fn sqrt(x: f32) -> f32 {
        x.sqrt()
    }

    /// Abramowitz and Stegun, "Handbook of Mathematical Functions", 4.4.46.
    fn acos(x: f32) -> f32 {
        const COEFFICIENTS: [f64; 8] = [
            -0.001_262_491_1,
            0.006_670_090_1,
            -0.017_088_125_6,
            0.030_891_881_0,
            -0.050_174_304_6,
            0.088_978_987_4,
            -0.214_598_801_6,
            1.570_796_305_0,
        ];
        let size = f64::from(x).abs().min(1.0);
        let sum = COEFFICIENTS.iter().fold(0.0, |sum, coefficient| sum * size + coefficient);
        let angle = (1.0 - size).sqrt() * sum;
        (if x < 0.0 { std::f64::consts::PI - angle } else { angle }) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_the_library() {
        for step in -100..=100 {
            let x = step as f32 / 100.0;
            // The handbook's bound is 2e-8.
            assert!((Arithmetic::acos(x) - libm::acosf(x)).abs() < 3e-7, "{x}");
        }
    }

    #[test]
    fn tangents_follow_the_first_coordinate() {
        let mut surface = Surface {
            positions: vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
            // Upside down, as images count rows, and once more seen in a mirror.
            uvs: [vec![[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]], Vec::new()],
            corners: vec![0, 1, 2],
            ..Surface::default()
        };
        let mut mirrored = surface.clone();
        mirrored.uvs[0].iter_mut().for_each(|uv| uv[0] = 1.0 - uv[0]);
        add_tangents(&mut surface);
        assert_eq!(surface.normals, [[0.0, 0.0, 1.0]; 3]);
        assert_eq!(surface.tangents, [[1.0, 0.0, 0.0, 1.0]; 3]);
        add_tangents(&mut mirrored);
        assert_eq!(mirrored.tangents, [[-1.0, 0.0, 0.0, -1.0]; 3]);
    }
}
