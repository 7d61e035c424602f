//! Arbitrary output variables (AOVs): images of other quantities than colour, such as properties of the visible
//! surface, the outputs of an integrator, or the cost of a pixel.

use std::sync::Arc;

/// An arbitrary output variable.
///
/// Its name decides what it shows: an output of the integrator with this name, if the class has one, else the image of
/// this name that the renderer makes.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Aov {
    /// The output `albedo` of the integrator: by convention the reflectance of uniform white light of the visible
    /// surface in each channel; of visible lights the emission, at most 1. Used for denoising.
    Albedo,
    /// The distance of the visible surface from the ray's origin, averaged over the samples of the pixel that hit
    /// anything; infinite if none does.
    Distance,
    /// The output `normal` of the integrator: by convention the normal of the visible surface in world space; zero for
    /// samples without a hit. Used for denoising.
    Normal,
    /// The index of the object that the first sample hits, in the order of the scene; -1 for none.
    Object,
    /// The index of that object's class, in the order of their first objects in the scene; -1 for none.
    Class,
    /// The number of the pixel's samples.
    Samples,
    /// The variance of the pixel's mean luminance, estimated from its samples.
    Variance,
    /// The nanoseconds per sample; the same for the 64 pixels of a tile.
    Time,
    /// The number of nodes and leaves of the hierarchy that a camera ray of the pixel visits, averaged over all
    /// samples.
    Nodes,
    /// The fraction of SIMD lanes that are active in calls of `intersect` and `shade`, for the rays of the pixel and
    /// all rays that they spawn; the same for the 64 pixels of a tile, which are traced together.
    Lanes,
    /// The output of the integrator with this name.
    Output(Arc<str>),
}

impl Aov {
    /// All of them except outputs of other names.
    pub const ALL: [Aov; 10] = [
        Aov::Albedo,
        Aov::Distance,
        Aov::Normal,
        Aov::Object,
        Aov::Class,
        Aov::Samples,
        Aov::Variance,
        Aov::Time,
        Aov::Nodes,
        Aov::Lanes,
    ];

    /// Returns the name.
    pub fn name(&self) -> &str {
        match self {
            Aov::Albedo => "albedo",
            Aov::Distance => "distance",
            Aov::Normal => "normal",
            Aov::Object => "object",
            Aov::Class => "class",
            Aov::Samples => "samples",
            Aov::Variance => "variance",
            Aov::Time => "time",
            Aov::Nodes => "nodes",
            Aov::Lanes => "lanes",
            Aov::Output(name) => name,
        }
    }

    /// Returns the AOV with this name. A name of none in [`Aov::ALL`] is that of an output of the integrator.
    pub fn from_name(name: &str) -> Aov {
        let known = Aov::ALL.into_iter().find(|aov| aov.name() == name);
        known.unwrap_or_else(|| Aov::Output(name.into()))
    }

    /// Returns the AOV that shows the integrator's output of this name.
    pub fn of_output(name: &str) -> Aov {
        match name {
            "albedo" => Aov::Albedo,
            "normal" => Aov::Normal,
            _ => Aov::Output(name.into()),
        }
    }

    /// Returns the type of the values of an image that the renderer makes; `None` for outputs of the integrator, whose
    /// class decides.
    pub fn renderer_type(&self) -> Option<AovType> {
        match self {
            Aov::Albedo | Aov::Normal | Aov::Output(_) => None,
            Aov::Object | Aov::Class => Some(AovType::Integer),
            Aov::Distance | Aov::Samples | Aov::Variance | Aov::Time | Aov::Nodes | Aov::Lanes => {
                Some(AovType::Float)
            }
        }
    }

    /// Returns the names of its channels in a file, for values of this type.
    ///
    /// That of the distance is the standard name of OpenEXR. An output with the name of a standard channel has another
    /// one, so that readers do not take it for a part of the picture.
    pub fn channels(&self, ty: AovType) -> Vec<String> {
        const STANDARD: [&str; 5] = ["R", "G", "B", "A", "Z"];
        let name = self.name();
        match ty.suffixes() {
            _ if *self == Aov::Distance => vec!["Z".to_owned()],
            [] if STANDARD.contains(&name) => vec![format!("{name}.V")],
            [] => vec![name.to_owned()],
            suffixes => suffixes.iter().map(|suffix| format!("{name}.{suffix}")).collect(),
        }
    }
}

/// The type of the values of an AOV.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AovType {
    /// A number.
    Float,
    /// A whole number.
    Integer,
    /// 0 for false, 1 for true.
    Bool,
    /// A linear colour, to which the precision of colours applies.
    Color,
    /// A vector of 2 to 4 numbers.
    Vector(u8),
    /// A vector of 2 to 4 whole numbers.
    IntegerVector(u8),
}

impl AovType {
    /// The number of channels.
    pub fn channels(self) -> usize {
        self.suffixes().len().max(1)
    }

    /// True if the value of a pixel is the mean over its samples; false if it is that of the first sample.
    pub fn is_mean(self) -> bool {
        match self {
            AovType::Float | AovType::Color | AovType::Vector(_) => true,
            AovType::Integer | AovType::Bool | AovType::IntegerVector(_) => false,
        }
    }

    /// The suffixes of the channels' names; none if there is one channel.
    fn suffixes(self) -> &'static [&'static str] {
        match self {
            AovType::Float | AovType::Integer | AovType::Bool => &[],
            AovType::Color => &["R", "G", "B"],
            AovType::Vector(count) | AovType::IntegerVector(count) => {
                &["X", "Y", "Z", "W"][..usize::from(count.min(4))]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back() {
        for aov in Aov::ALL {
            assert_eq!(Aov::from_name(aov.name()), aov);
        }
        assert_eq!(Aov::from_name("thickness"), Aov::Output("thickness".into()));
        assert_eq!(Aov::of_output("albedo"), Aov::Albedo);
        assert_eq!(Aov::of_output("distance"), Aov::Output("distance".into()));
    }

    #[test]
    fn channels_have_the_usual_names() {
        let names = |name: &str, ty: AovType| Aov::from_name(name).channels(ty).join(" ");
        assert_eq!(names("distance", AovType::Float), "Z");
        assert_eq!(names("depth", AovType::Float), "depth");
        assert_eq!(names("albedo", AovType::Color), "albedo.R albedo.G albedo.B");
        assert_eq!(names("normal", AovType::Vector(3)), "normal.X normal.Y normal.Z");
        assert_eq!(names("at", AovType::Vector(4)), "at.X at.Y at.Z at.W");
        assert_eq!(names("cell", AovType::IntegerVector(2)), "cell.X cell.Y");
        // Not the channels of the picture or of the distance.
        assert_eq!(names("R", AovType::Float), "R.V");
        assert_eq!(names("Z", AovType::Integer), "Z.V");
        assert_eq!(names("Z", AovType::Vector(2)), "Z.X Z.Y");
    }

    #[test]
    fn channels_are_counted() {
        let types = [AovType::Float, AovType::Bool, AovType::Color, AovType::Vector(4)];
        assert_eq!(types.map(AovType::channels), [1, 1, 3, 4]);
        assert_eq!(AovType::IntegerVector(2).channels(), 2);
    }
}
