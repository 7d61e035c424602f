//! The surface that a material shades, as its rays and light samples know it.

use rtsl::QueryColumns;
use rtsl_math::dot;

use super::shading_batch::ShadingBatch;

/// The surface that a material shades, in world space.
#[derive(Clone, Copy, Debug)]
pub struct ShadedSurface {
    /// The point that is shaded.
    point: [f32; 3],
    /// The offset at which rays that leave the point begin.
    pub offset: f32,
    /// The geometric normal, of unit length, on the side from which the ray came.
    geometric_normal: [f32; 3],
    /// The normal for shading, on the same side.
    shading_normal: [f32; 3],
}

impl ShadedSurface {
    /// Returns the point.
    pub fn point(&self) -> [f32; 3] {
        self.point
    }

    /// Returns the geometric normal, on the side from which the ray came.
    pub fn normal(&self) -> [f32; 3] {
        self.geometric_normal
    }

    /// Returns the surface of a lane of a prepared batch.
    pub fn of_lane(batch: &ShadingBatch, lane: usize) -> ShadedSurface {
        let ShadingBatch { surfaces, side, .. } = batch;
        let normal = |first: usize| surfaces.vector(first, lane).map(|it| it * side[lane]);
        ShadedSurface {
            point: surfaces.vector(QueryColumns::POINT, lane),
            offset: surfaces.column(QueryColumns::OFFSET)[lane],
            geometric_normal: normal(QueryColumns::GEOMETRIC_NORMAL),
            shading_normal: normal(QueryColumns::SHADING_NORMAL),
        }
    }

    /// Returns the numbers of the surfaces of a prepared batch, column by column: point, offset, geometric and shading
    /// normal.
    pub fn columns(batch: &ShadingBatch) -> impl Iterator<Item = impl Iterator<Item = f32> + '_> {
        // The normals come last.
        const { assert!(QueryColumns::SHADING_NORMAL == QueryColumns::POINT + 7) };
        let ShadingBatch { surfaces, side, .. } = batch;
        (QueryColumns::POINT..QueryColumns::SHADING_NORMAL + 3).map(move |column| {
            let is_turned = column >= QueryColumns::GEOMETRIC_NORMAL;
            let numbers = surfaces.column(column).iter().zip(side);
            numbers.map(move |(number, side)| if is_turned { number * side } else { *number })
        })
    }

    /// Returns the origin of a ray: if it begins on the surface, within rounding, off it on the side that the ray leads
    /// to. Materials may have moved it along the surface. Other origins stay unchanged.
    pub fn leave(&self, origin: [f32; 3], direction: [f32; 3]) -> [f32; 3] {
        leaving(self.point, self.geometric_normal, self.offset, origin, direction)
    }

    /// Returns the geometric and the shading normal on the side for which light is requested: that from which the ray
    /// came, or the other if a cone around `axis` points there. Environment lights sample around them.
    pub fn lit_normals(&self, axis: Option<[f32; 3]>) -> [[f32; 3]; 2] {
        let is_behind = axis.is_some_and(|axis| dot(self.geometric_normal, axis) < 0.0);
        let side = if is_behind { -1.0 } else { 1.0 };
        [self.geometric_normal, self.shading_normal].map(|normal| normal.map(|it| it * side))
    }
}

/// As [`ShadedSurface::leave`], given the point, the geometric normal and the offset.
#[inline(always)]
pub fn leaving(
    point: [f32; 3],
    normal: [f32; 3],
    offset: f32,
    origin: [f32; 3],
    direction: [f32; 3],
) -> [f32; 3] {
    let axes = [0, 1, 2];
    let height = dot(axes.map(|axis: usize| origin[axis] - point[axis]), normal);
    if height.abs() > offset || height.is_nan() {
        return origin;
    }
    let offset = offset.copysign(dot(direction, normal));
    axes.map(|axis: usize| origin[axis] + normal[axis] * offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLOOR: ShadedSurface = ShadedSurface {
        point: [1.0, 0.0, 2.0],
        offset: 0.25,
        geometric_normal: [0.0, 1.0, 0.0],
        shading_normal: [0.6, 0.8, 0.0],
    };

    #[test]
    fn rays_that_begin_on_the_surface_leave_it() {
        assert_eq!(FLOOR.leave([3.0, 0.125, 0.0], [0.0, 1.0, 0.0]), [3.0, 0.375, 0.0]);
        assert_eq!(FLOOR.leave([3.0, 0.0, 0.0], [1.0, -1.0, 0.0]), [3.0, -0.25, 0.0]);
        let elsewhere = [3.0, 0.5, 0.0];
        assert_eq!(FLOOR.leave(elsewhere, [0.0, 1.0, 0.0]), elsewhere);
        let nowhere = FLOOR.leave([f32::NAN, 0.0, 0.0], [0.0, 1.0, 0.0]);
        assert!(nowhere[0].is_nan() && nowhere[1] == 0.0);
    }

    #[test]
    fn cones_turn_the_normals_to_their_side() {
        let [geometric, shading] = FLOOR.lit_normals(Some([0.0, -3.0, 0.0]));
        assert_eq!((geometric, shading), ([-0.0, -1.0, -0.0], [-0.6, -0.8, -0.0]));
        assert_eq!(FLOOR.lit_normals(None)[1], FLOOR.shading_normal);
    }
}
