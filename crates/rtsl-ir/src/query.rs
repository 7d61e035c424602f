//! Queries: what an integrator asks of the scene.
//!
//! A query names a ray, a surface, a light or a number of the sampler by scalars alone, so that an integrator is
//! compiled without knowing the scene. A *surface* is the 14 scalars of [`SURFACE`]: which object a ray hit, and the
//! ray. Everything else about it (point, normals, what its material does) is computed from these on request.

use rtsl_spec::{COLOR_COMPONENTS, MAX_ATTRIBUTE_SCALARS};

use crate::{Effect, Scalar};

/// A question that an integrator asks of the scene. The operands and results are listed by [`Query::operands`] and
/// [`Query::results`]. Points, directions and distances are in world space; a distance is a ray parameter, in units of
/// the direction's length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Query {
    /// The nearest hit of a ray: whether there is one, the object, and the distance. An epsilon of 0 is the scene's.
    NearestHit,
    /// The properties of a surface that do not depend on its material.
    SurfaceProperties,
    /// The radiance that the surface's material emits towards the ray's origin; what `shade` returns for a material that
    /// has no other method.
    Emission,
    /// The radiance of the area light that the surface is; black if it is none.
    LightEmission,
    /// The density per solid angle with which [`Query::SampleLight`] at a point chooses the direction to this surface;
    /// 0 if it never does.
    LightPdf,
    /// The material's scattering function for the ray and a direction, without the cosine.
    Bsdf,
    /// The density per solid angle with which [`Query::SampleBsdf`] chooses a direction.
    BsdfPdf,
    /// A direction of scattered light that the material chooses, its value, its density, which is 0 for a delta, and the
    /// relative index of refraction on its side.
    SampleBsdf,
    /// The radiance that the material's `shade` returns; the rays that it traces are integrated at the next depth.
    Shade,
    /// A light of the scene, which the seed selects, for a point with these normals, on the side that is seen. Rays that
    /// leave the point begin off the surface by the offset. The density includes the probability with which the light
    /// was selected; it is 0 if no ray can find the light. The colour is divided by the density of the sample; for a
    /// delta light by that probability.
    SampleLight,
    /// The number of lights that rays find when they leave the scene.
    SkyCount,
    /// The radiance of such a light for a ray that leaves the scene.
    SkyEmission,
    /// The density per solid angle with which [`Query::SampleLight`] at a point chooses a direction of such a light.
    SkyPdf,
    /// Adds light to the radiance of the path if nothing lies on the ray before the limit. The integrator gets no
    /// answer, so that it can go on before the ray is traced.
    Contribute,
    /// One dimension of the path's sampler: uniform in [0, 1).
    Sample,
    /// Two dimensions of the path's sampler, which are stratified together.
    SamplePair,
    /// Adds the radiance along another ray, times a weight, to the radiance of the path. The ray is integrated after the
    /// path has ended, at the next depth.
    Spawn,
    /// Makes the path that a spawned ray becomes, in kernels: the ray, off the surface that it leaves; the product of the
    /// weights from the camera on; the greatest weight, the key of the path's random sequences, and the number of surfaces
    /// that its parent has met before the one that is shaded.
    SpawnPath,
    /// The colour that the material's `shade` computes, without the light that [defers](Query::Spawn): that of rays which
    /// it traces and that of lights, which are added to the radiance of the path, times the weight.
    OwnShade,
    /// A sample of the light with an index, as `illuminance` takes it, and the limit of the ray on which something may
    /// block it: [`Query::Contribute`] traces that.
    UnshadowedLight,
}

/// A group of operands or results: name, type and number of scalars.
pub type Scalars = (&'static str, Scalar, u32);

/// The scalars of a surface. Which object a ray hit: object, instance and element. Where: the distance, and the least
/// and greatest that count. The ray, and the width of its footprint at the origin and by how much it grows with
/// distance.
pub const SURFACE: [Scalars; 10] = [
    ("object", Scalar::I32, 1),
    ("instance", Scalar::I32, 1),
    ("element", Scalar::I32, 1),
    ("distance", Scalar::F32, 1),
    ("epsilon", Scalar::F32, 1),
    ("limit", Scalar::F32, 1),
    ("origin", Scalar::F32, 3),
    ("direction", Scalar::F32, 3),
    ("width", Scalar::F32, 1),
    ("spread", Scalar::F32, 1),
];

/// The number of scalars that identify a surface.
pub const SURFACE_SCALARS: usize = {
    let (mut count, mut group) = (0, 0);
    while group < SURFACE.len() {
        count += SURFACE[group].2 as usize;
        group += 1;
    }
    count
};

/// The number of results of [`Query::SurfaceProperties`], at their end, that only materials and their textures read:
/// derivatives of texture coordinates, attributes, and the maps between the object's space and the world.
pub const PROPERTIES_OF_MATERIALS: usize = 4 + MAX_ATTRIBUTE_SCALARS as usize + 2 * 12;

const POINT: Scalars = ("point", Scalar::F32, 3);
const DIRECTION: Scalars = ("direction", Scalar::F32, 3);
const GEOMETRIC_NORMAL: Scalars = ("geometric_normal", Scalar::F32, 3);
const SHADING_NORMAL: Scalars = ("shading_normal", Scalar::F32, 3);
const COLOR: Scalars = ("color", Scalar::F32, COLOR_COMPONENTS);
const WEIGHT: Scalars = ("weight", Scalar::F32, COLOR_COMPONENTS);
const DENSITY: Scalars = ("density", Scalar::F32, 1);
const DISTANCE: Scalars = ("distance", Scalar::F32, 1);
const INDEX: Scalars = ("index", Scalar::I32, 1);
const REGULARIZATION: Scalars = ("regularization", Scalar::F32, 1);

/// The operands, after those of the surface if it is about one, and the results of a query.
struct Shape {
    name: &'static str,
    of_surface: bool,
    operands: &'static [Scalars],
    results: &'static [Scalars],
}

impl Query {
    /// All queries.
    pub const ALL: [Query; 20] = [
        Query::NearestHit,
        Query::SurfaceProperties,
        Query::Emission,
        Query::LightEmission,
        Query::LightPdf,
        Query::Bsdf,
        Query::BsdfPdf,
        Query::SampleBsdf,
        Query::Shade,
        Query::SampleLight,
        Query::SkyCount,
        Query::SkyEmission,
        Query::SkyPdf,
        Query::Contribute,
        Query::Sample,
        Query::SamplePair,
        Query::Spawn,
        Query::SpawnPath,
        Query::OwnShade,
        Query::UnshadowedLight,
    ];

    /// Returns the queries whose first operands identify a surface.
    pub fn of_surfaces() -> impl Iterator<Item = Query> {
        Query::ALL.into_iter().filter(|query| query.is_of_surface())
    }

    /// The greatest number of operands.
    pub const MAX_OPERANDS: usize = 18;

    /// The greatest number of results.
    pub const MAX_RESULTS: usize = 27 + MAX_ATTRIBUTE_SCALARS as usize + 2 * 12;

    /// Returns the index in [`Query::ALL`].
    pub fn number(self) -> u32 {
        self as u32
    }

    /// Returns the keyword of the text form.
    pub fn name(self) -> &'static str {
        self.shape().name
    }

    /// Returns the query with this keyword.
    pub fn from_name(name: &str) -> Option<Query> {
        Query::ALL.into_iter().find(|query| query.name() == name)
    }

    /// True if the first operands are those of a surface.
    pub fn is_of_surface(self) -> bool {
        self.shape().of_surface
    }

    /// True if the query is about the material's scattering. Its last operand is then the width of highlights up to which
    /// narrower ones are widened.
    pub fn is_of_scattering(self) -> bool {
        matches!(self, Query::Bsdf | Query::BsdfPdf | Query::SampleBsdf)
    }

    /// True if all rays of a call have the same answer.
    pub fn is_uniform(self) -> bool {
        self == Query::SkyCount
    }

    /// Returns the groups of operands, in order.
    pub fn operands(self) -> impl Iterator<Item = Scalars> {
        let Shape { of_surface, operands, .. } = self.shape();
        let surface: &[Scalars] = if of_surface { &SURFACE } else { &[] };
        surface.iter().chain(operands).copied()
    }

    /// Returns the groups of results, in order.
    pub fn results(self) -> impl Iterator<Item = Scalars> {
        self.shape().results.iter().copied()
    }

    /// Returns the types of all operands, in order.
    pub fn operand_scalars(self) -> impl Iterator<Item = Scalar> {
        scalars(self.operands())
    }

    /// Returns the types of all results, in order.
    pub fn result_scalars(self) -> impl Iterator<Item = Scalar> {
        scalars(self.results())
    }

    /// Returns the side effect. Methods of materials and lights may take numbers from the path's sampler, so calls of
    /// them are neither removed nor reordered.
    pub fn effect(self) -> Effect {
        match self {
            Query::SurfaceProperties
            | Query::LightPdf
            | Query::SkyCount
            | Query::Sample
            | Query::SamplePair => Effect::None,
            Query::NearestHit
            | Query::Emission
            | Query::LightEmission
            | Query::Bsdf
            | Query::BsdfPdf
            | Query::SampleBsdf
            | Query::Shade
            | Query::SampleLight
            | Query::SkyEmission
            | Query::SkyPdf
            | Query::Contribute
            | Query::Spawn
            | Query::SpawnPath
            | Query::OwnShade
            | Query::UnshadowedLight => Effect::Host,
        }
    }

    fn shape(self) -> Shape {
        let of = |name, operands, results| Shape { name, of_surface: false, operands, results };
        let on =
            |name, operands, results| Shape { of_surface: true, ..of(name, operands, results) };
        match self {
            Query::NearestHit => of(
                "nearest_hit",
                &[
                    ("origin", Scalar::F32, 3),
                    DIRECTION,
                    ("epsilon", Scalar::F32, 1),
                    ("limit", Scalar::F32, 1),
                ],
                &[
                    ("found", Scalar::Bool, 1),
                    ("object", Scalar::I32, 1),
                    ("instance", Scalar::I32, 1),
                    ("element", Scalar::I32, 1),
                    DISTANCE,
                ],
            ),
            Query::SurfaceProperties => on(
                "surface_properties",
                &[],
                &[
                    POINT,
                    GEOMETRIC_NORMAL,
                    SHADING_NORMAL,
                    ("uv", Scalar::F32, 2),
                    ("uvw", Scalar::F32, 3),
                    ("dpdu", Scalar::F32, 3),
                    ("dpdv", Scalar::F32, 3),
                    ("du", Scalar::F32, 1),
                    ("dv", Scalar::F32, 1),
                    ("offset", Scalar::F32, 1),
                    ("dsdu", Scalar::F32, 1),
                    ("dsdv", Scalar::F32, 1),
                    ("dtdu", Scalar::F32, 1),
                    ("dtdv", Scalar::F32, 1),
                    ("attributes", Scalar::F32, MAX_ATTRIBUTE_SCALARS),
                    ("to_object", Scalar::F32, 12),
                    ("to_world", Scalar::F32, 12),
                ],
            ),
            Query::Emission => on("emission", &[], &[COLOR]),
            Query::LightEmission => on("light_emission", &[], &[COLOR]),
            Query::LightPdf => on("light_pdf", &[POINT], &[DENSITY]),
            Query::Bsdf => on("bsdf", &[DIRECTION, REGULARIZATION], &[COLOR]),
            Query::BsdfPdf => on("bsdf_pdf", &[DIRECTION, REGULARIZATION], &[DENSITY]),
            Query::SampleBsdf => on(
                "sample_bsdf",
                &[("seed", Scalar::F32, 3), REGULARIZATION],
                &[DIRECTION, COLOR, DENSITY, ("relative_index", Scalar::F32, 1)],
            ),
            Query::Shade => on("shade", &[], &[COLOR]),
            Query::SampleLight => of(
                "sample_light",
                &[
                    POINT,
                    GEOMETRIC_NORMAL,
                    SHADING_NORMAL,
                    ("offset", Scalar::F32, 1),
                    ("seed", Scalar::F32, 1),
                ],
                &[("found", Scalar::Bool, 1), DIRECTION, DISTANCE, COLOR, DENSITY],
            ),
            Query::SkyCount => of("sky_count", &[], &[("count", Scalar::I32, 1)]),
            Query::SkyEmission => of("sky_emission", &[INDEX, POINT, DIRECTION], &[COLOR]),
            Query::SkyPdf => of(
                "sky_pdf",
                &[INDEX, POINT, GEOMETRIC_NORMAL, SHADING_NORMAL, DIRECTION],
                &[DENSITY],
            ),
            Query::Contribute => of(
                "contribute",
                &[("origin", Scalar::F32, 3), DIRECTION, ("limit", Scalar::F32, 1), COLOR],
                &[],
            ),
            Query::Spawn => of(
                "spawn",
                &[("origin", Scalar::F32, 3), DIRECTION, ("limit", Scalar::F32, 1), WEIGHT],
                &[],
            ),
            Query::SpawnPath => of(
                "spawn_path",
                &[
                    ("origin", Scalar::F32, 3),
                    DIRECTION,
                    ("limit", Scalar::F32, 1),
                    ("throughput", Scalar::F32, COLOR_COMPONENTS),
                    ("bound", Scalar::F32, 1),
                    ("key", Scalar::U32, 1),
                    ("surfaces", Scalar::U32, 1),
                ],
                &[],
            ),
            Query::OwnShade => on("own_shade", &[WEIGHT], &[COLOR]),
            Query::UnshadowedLight => of(
                "unshadowed_light",
                &[INDEX, POINT, ("axis", Scalar::F32, 3), ("cosine", Scalar::F32, 1)],
                &[
                    ("found", Scalar::Bool, 1),
                    DIRECTION,
                    DISTANCE,
                    COLOR,
                    DENSITY,
                    ("limit", Scalar::F32, 1),
                ],
            ),
            Query::Sample => {
                of("sample", &[("dimension", Scalar::I32, 1)], &[("number", Scalar::F32, 1)])
            }
            Query::SamplePair => {
                of("sample_pair", &[("dimension", Scalar::I32, 1)], &[("numbers", Scalar::F32, 2)])
            }
        }
    }
}

fn scalars(groups: impl Iterator<Item = Scalars>) -> impl Iterator<Item = Scalar> {
    groups.flat_map(|(_, scalar, count)| std::iter::repeat_n(scalar, count as usize))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_find_their_queries() {
        for query in Query::ALL {
            assert_eq!(Query::from_name(query.name()), Some(query));
        }
    }

    #[test]
    fn numbers_and_limits_are_those_of_the_table() {
        let most = |count: fn(Query) -> usize| Query::ALL.into_iter().map(count).max();
        let (operands, results) =
            (most(|it| it.operand_scalars().count()), most(|it| it.result_scalars().count()));
        assert_eq!((operands, results), (Some(Query::MAX_OPERANDS), Some(Query::MAX_RESULTS)));
        for (query, number) in Query::ALL.into_iter().zip(0..) {
            assert_eq!(query.number(), number);
        }
    }

    #[test]
    fn surfaces_come_first() {
        assert_eq!(scalars(SURFACE.into_iter()).count(), SURFACE_SCALARS);
        for query in Query::of_surfaces() {
            assert!(query.operands().take(SURFACE.len()).eq(SURFACE), "{query:?}");
        }
    }
}
