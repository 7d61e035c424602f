//! The contracts and their texts.

/// A property that renderers rely on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Contract {
    /// Directions of `sampleBSDF` have unit length.
    ScatteredDirections,
    /// Values of a material are finite and not negative.
    ScatteredValues,
    /// `sampleBSDF` gives what `BSDF` and `evaluatePDF` give for its direction.
    ScatteredAgreement,
    /// The integral of `evaluatePDF` is the fraction of samples that have a density.
    ScatteredIntegral,
    /// Directions of `sampleBSDF` are distributed according to `evaluatePDF`.
    ScatteredDistribution,
    /// A material conserves energy.
    Energy,
    /// The BSDF is reciprocal.
    Reciprocity,
    /// Shading normals that differ from the surface's do not lead to invalid values.
    TiltedNormals,
    /// Grazing rays, zero tangents and similar inputs do not lead to invalid values.
    ExtremeRays,
    /// Hits lie within the bounds of `computeBounds`.
    Bounds,
    /// The closest hit is found, within the limits of the ray.
    Limits,
    /// The hit of a ray does not depend on the length of its direction.
    Lengths,
    /// A point that one ray hits is also hit by other rays towards it.
    Points,
    /// Rays that leave the surface do not hit it immediately.
    Leaving,
    /// Normals, texture coordinates and their derivatives are not NaN.
    SurfaceValues,
    /// The geometric normal is perpendicular to the surface.
    Normals,
    /// The normals of closed surfaces point outward.
    Outward,
    /// Derivatives are those of the texture coordinates.
    Derivatives,
    /// Points of `generateSample` lie on the surface.
    SamplePoints,
    /// Normals of `generateSample` are those of `computeNormal`.
    SampleNormals,
    /// `generateSample` gives the density that `samplePDF` gives for its point.
    SampleAgreement,
    /// The integral of `samplePDF` over the visible directions is the fraction of samples that are visible.
    SampleIntegral,
    /// Points of `generateSample` are distributed according to `samplePDF`.
    SampleDistribution,
    /// Directions of `illumination` have unit length.
    LightDirections,
    /// Values of a light are finite and not negative.
    LightValues,
    /// `illumination` gives the density that `evaluatePDF` gives for its direction.
    LightAgreement,
    /// The integral of `evaluatePDF` is the fraction of samples that have a density.
    LightIntegral,
    /// Directions of `illumination` are distributed according to `evaluatePDF`.
    LightDistribution,
    /// `emission` along a sampled direction is the sample's radiance.
    LightEmission,
    /// Every point of the image and the lens has a ray.
    CameraRays,
    /// Weights of rays are finite and not negative.
    CameraWeights,
    /// The limits of rays permit hits.
    CameraLimits,
    /// Values of a texture are never NaN, for any filter.
    TextureValues,
    /// Wide filters return the mean.
    TextureFilter,
    /// Results have the same bits at every width and on the interpreter.
    SameBits,
    /// No method exceeds its budget of loop iterations.
    Budget,
    /// Rays that leave the scene find samples with a density at infinity, and no others.
    LightMeeting,
    /// The radiance of an integrator is finite.
    Radiance,
    /// An integrator that scatters light finds no more than is emitted.
    Furnace,
    /// Pictures have the same bits at every width and on the interpreter. Renderers check it.
    Pictures,
    /// Rays from within a solid find its far side.
    Within,
}

impl Contract {
    /// Returns a name for programs, such as `ScatteredIntegral`.
    pub fn name(self) -> String {
        format!("{self:?}")
    }

    /// Returns a short description of the property.
    pub const fn promise(self) -> &'static str {
        match self {
            Contract::ScatteredDirections => "sampled directions have unit length",
            Contract::ScatteredValues => "values are finite and not negative",
            Contract::ScatteredAgreement => "sampleBSDF agrees with BSDF and evaluatePDF",
            Contract::ScatteredIntegral => {
                "the density integrates to the part of samples that have one"
            }
            Contract::ScatteredDistribution => "samples are distributed as evaluatePDF says",
            Contract::Energy => "no more light is scattered than arrives",
            Contract::Reciprocity => "light takes the same way back",
            Contract::TiltedNormals => "tilted shading normals do no harm",
            Contract::ExtremeRays => "extreme rays do no harm",
            Contract::Bounds => "hits lie within the bounds",
            Contract::Limits => "the nearest hit is found, within the ray's limits",
            Contract::Lengths => "directions may have any length",
            Contract::Points => "hits are found from everywhere",
            Contract::Within => "rays from within find the far side",
            Contract::Leaving => "rays that leave the surface do not hit it at once",
            Contract::SurfaceValues => "normals and texture coordinates are numbers",
            Contract::Normals => "the normal is the surface's",
            Contract::Outward => "normals point outward",
            Contract::Derivatives => "derivatives are those of the texture coordinates",
            Contract::SamplePoints => "sampled points lie on the surface",
            Contract::SampleNormals => "normals of samples are those of computeNormal",
            Contract::SampleAgreement => "generateSample agrees with samplePDF",
            Contract::SampleIntegral => {
                "the density integrates to the part of samples that are seen"
            }
            Contract::SampleDistribution => "samples are distributed as samplePDF says",
            Contract::LightDirections => "directions have unit length",
            Contract::LightValues => "colours, densities and distances are what they may be",
            Contract::LightAgreement => "illumination agrees with evaluatePDF",
            Contract::LightIntegral => {
                "the density integrates to the part of samples that have one"
            }
            Contract::LightDistribution => "samples are distributed as evaluatePDF says",
            Contract::LightEmission => "samples are as bright as rays in their direction",
            Contract::CameraRays => "every place of image and lens has a ray",
            Contract::CameraWeights => "weights are finite and not negative",
            Contract::CameraLimits => "limits of rays let hits count",
            Contract::TextureValues => "values are numbers, whatever the filter",
            Contract::TextureFilter => "wide filters tend to the mean",
            Contract::Radiance => "radiance is finite",
            Contract::Furnace => "no more light is found than is emitted",
            Contract::Pictures => "pictures have the same bits at every width",
            Contract::SameBits => "results have the same bits at every width",
            Contract::Budget => "every call comes to its end",
            Contract::LightMeeting => "rays find samples with a density at infinity alone",
        }
    }

    /// Returns advice for finding the mistake if the contract is broken.
    pub const fn hint(self) -> &'static str {
        match self {
            Contract::ScatteredDirections => {
                "sampleBSDF sets rt_LightDirection; is something left to normalize?"
            }
            Contract::ScatteredValues => {
                "a division by a cosine that may be 0, the root or logarithm of a number below 0, or a weight below 0"
            }
            Contract::ScatteredAgreement => {
                "sampleBSDF may end with calls of BSDF() and evaluatePDF(); deltas alone leave rt_PDF 0"
            }
            Contract::ScatteredIntegral => {
                "a constant factor of the density, shares of lobes that do not add up to 1, or directions that evaluatePDF counts and sampleBSDF never makes"
            }
            Contract::ScatteredDistribution => {
                "the density of what sampleBSDF really does: the Jacobian of its map, the shares of its lobes, its frame"
            }
            Contract::Energy => {
                "a missing division by pi, a lobe without its normalisation, or lobes whose weights add up to more than 1"
            }
            Contract::Reciprocity => {
                "BSDF must not change where viewer and light change places; light that comes through may, by one factor"
            }
            Contract::TiltedNormals | Contract::ExtremeRays => {
                "return black and a density of 0 where view or light lie on the wrong side; guard divisions by cosines"
            }
            Contract::Bounds => {
                "computeBounds: an extent, a half size taken for a whole one, or a box without its centre"
            }
            Contract::Limits => {
                "offer every hit to hit() and let it choose: it knows rt_Epsilon and rt_HitDistance"
            }
            Contract::Lengths => {
                "the parameter of a hit counts in units of rt_RayDirection's length; divide by its square where you solve for it"
            }
            Contract::Radiance => {
                "a division by a density or a probability that may be 0, or a weight without bound"
            }
            Contract::Furnace => {
                "light that is counted twice, by emission() and by sampleLight(), or a division by a density too many"
            }
            Contract::Pictures => "nothing in the class: please report it",
            Contract::Points => "intersect: a hit that is none, or one that is missed",
            Contract::Within => {
                "intersect: offer the farther hit where the nearer one is refused, as in `if (!hit(near)) hit(far);`"
            }
            Contract::Leaving => {
                "a root that loses its digits near 0: compute it in another way than by a difference"
            }
            Contract::SurfaceValues => {
                "poles and edges, where a length is 0 or an angle is undefined"
            }
            Contract::Normals => {
                "computeNormal: rt_HitPoint is in the primitive's space; has scaling been undone?"
            }
            Contract::Outward => "the sign in computeNormal, or the order of a cross product",
            Contract::Derivatives => {
                "computeDerivatives: the factor of an angle, such as 2 pi for a whole turn, or exchanged directions; for a class without it, computeTextureCoordinates, from which they follow"
            }
            Contract::SamplePoints => {
                "generateSample: rt_HitPoint is a point in the primitive's space"
            }
            Contract::SampleNormals => "the sign of rt_GeometricNormal in generateSample",
            Contract::SampleAgreement => "let both methods call one function for the density",
            Contract::SampleIntegral | Contract::SampleDistribution => {
                "densities count per solid angle: one over the area, times the distance squared, over the cosine at the light"
            }
            Contract::LightDirections => "illumination: is something left to normalize?",
            Contract::LightValues => {
                "points where a distance or a cosine is 0; rt_LightDistance is greater than 0"
            }
            Contract::LightAgreement => "let both methods call one function for the density",
            Contract::LightIntegral | Contract::LightDistribution => {
                "densities count per solid angle; rt_PDF 0 means a light without extent, or that nothing was sampled"
            }
            Contract::LightEmission => {
                "let illumination and emission call one function for the radiance; rt_RayDirection points as rt_LightDirection does"
            }
            Contract::CameraRays => "edges and corners of the image, and of the lens",
            Contract::CameraWeights => "rt_SampleColor: vignetting is a number from 0 to 1",
            Contract::CameraLimits => {
                "rt_Epsilon must be less than rt_HitDistance, and neither NaN"
            }
            Contract::TextureValues => {
                "divisions by rt_du and rt_dv, which may be 0, and numbers far from 0"
            }
            Contract::TextureFilter => {
                "the filter's width in texture coordinates is rt_du times rt_dsdu and so on"
            }
            Contract::SameBits => {
                "nothing in the class: this is a mistake of the compiler, please report it"
            }
            Contract::Budget => "the condition of a loop, above all for NaN and infinity",
            Contract::LightMeeting => {
                "emission is for rays that leave the scene: what they find is infinitely far away and has evaluatePDF; leave out emission, and rt_PDF does for samples alone, or let a shape emit what is near"
            }
        }
    }
}
