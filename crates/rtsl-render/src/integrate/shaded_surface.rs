//! The surface that a material shades, as its rays and light samples know it.

use rtsl::QueryColumns;

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
    /// A surface with these properties, in the order of the fields.
    pub fn new(
        point: [f32; 3],
        offset: f32,
        geometric_normal: [f32; 3],
        shading_normal: [f32; 3],
    ) -> ShadedSurface {
        ShadedSurface { point, offset, geometric_normal, shading_normal }
    }

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

    /// Returns the geometric and the shading normal on the side for which light is requested: 1 for that from which the
    /// ray came, -1 for the other. Environment lights sample around them.
    pub fn lit_normals(&self, side: f32) -> [[f32; 3]; 2] {
        [self.geometric_normal, self.shading_normal].map(|normal| normal.map(|it| it * side))
    }
}
