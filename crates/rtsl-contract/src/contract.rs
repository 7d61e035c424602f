//! The promises.

/// Something that a class promises to renderers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Contract {
    /// Directions of `sampleBSDF` have unit length.
    ScatteredDirections,
    /// Values of a material are finite and not negative.
    ScatteredValues,
    /// `sampleBSDF` gives what `BSDF` and `evaluatePDF` give for its direction.
    ScatteredAgreement,
    /// The integral of `evaluatePDF` is the part of samples that have a density.
    ScatteredIntegral,
    /// Directions of `sampleBSDF` are distributed as `evaluatePDF` says.
    ScatteredDistribution,
    /// A material scatters no more light than it receives.
    Energy,
    /// Light takes the same way back.
    Reciprocity,
    /// Normals for shading that differ from the surface's do no harm.
    TiltedNormals,
    /// Rays along the surface, tangents of no length and the like do no harm.
    ExtremeRays,
    /// No method runs past its budget of loop iterations.
    Budget,
}

impl Contract {
    /// What is promised, in a few words.
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
            Contract::Budget => "every call comes to its end",
        }
    }

    /// Where to look when it is broken.
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
            Contract::Budget => "the condition of a loop, above all for NaN and infinity",
        }
    }
}
