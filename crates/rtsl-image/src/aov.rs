//! Arbitrary output variables (AOVs): images of other quantities than colour, such as properties of the visible surface
//! or the cost of a pixel.

use rtsl_memory::{OutOfMemory, collected, filled};
use rtsl_source::{Diagnostic, diagnostic_codes as codes};

use super::{HeatScale, SrgbEncoder, logarithm};

/// An arbitrary output variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Aov {
    /// The albedo of the visible surface: its reflectance of uniform white light in each channel, averaged over all
    /// samples; of visible lights the emission, at most 1. Used for denoising.
    Albedo,
    /// The distance of the visible surface from the ray's origin, averaged over the samples of the pixel that hit
    /// anything; infinite if none does.
    Distance,
    /// The normal of the visible surface in world space, averaged over all samples; zero for samples without a hit.
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
}

impl Aov {
    /// All of them.
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
    pub fn name(self) -> &'static str {
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
        }
    }

    /// Returns the AOV with this name; `depth` is an alias of `distance`.
    pub fn from_name(name: &str) -> Option<Aov> {
        let name = if name == "depth" { "distance" } else { name };
        Aov::ALL.into_iter().find(|aov| aov.name() == name)
    }

    /// Checks that the renderer of this name supports the AOVs `asked`.
    ///
    /// # Errors
    /// If one is not supported; the error names the first.
    pub fn refuse_others(asked: &[Aov], made: &[Aov], renderer: &str) -> Result<(), Diagnostic> {
        let Some(other) = asked.iter().find(|aov| !made.contains(aov)) else { return Ok(()) };
        let message = format!("the {renderer} renderer makes no image `{}`", other.name());
        let names: Vec<&str> = made.iter().map(|aov| aov.name()).collect();
        Err(Diagnostic::new(codes::NO_SUCH_IMAGE, message)
            .help(format!("it makes {}", names.join(", "))))
    }

    /// True for colours, to which the precision of colours applies.
    pub fn is_color(self) -> bool {
        self == Aov::Albedo
    }

    /// Returns the names of its channels in a file.
    ///
    /// That of the distance is the standard name of OpenEXR.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Aov::Normal => &["normal.X", "normal.Y", "normal.Z"],
            Aov::Albedo => &["albedo.R", "albedo.G", "albedo.B"],
            Aov::Distance => &["Z"],
            Aov::Object => &["object"],
            Aov::Class => &["class"],
            Aov::Samples => &["samples"],
            Aov::Variance => &["variance"],
            Aov::Time => &["time"],
            Aov::Nodes => &["nodes"],
            Aov::Lanes => &["lanes"],
        }
    }
}

/// An image of an AOV.
#[derive(Clone, Debug, PartialEq)]
pub struct AovImage {
    /// The AOV.
    pub aov: Aov,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The values, row by row from the top. If there is one channel, the first component is used.
    pub pixels: Vec<[f32; 3]>,
}

impl AovImage {
    /// Creates an image of zeros.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn new(aov: Aov, width: usize, height: usize) -> Result<Self, OutOfMemory> {
        let pixels = filled(width.saturating_mul(height), [0.0; 3])?;
        Ok(AovImage { aov, width, height, pixels })
    }

    /// Converts the image to displayable sRGB bytes: albedo directly; quantities of any magnitude by their logarithms
    /// on the heat scale; fractions of lanes on the heat scale; normals as colours of their components; indices in
    /// distinct colours.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn to_srgb(&self) -> Result<Vec<u8>, OutOfMemory> {
        let count = 3 * self.pixels.len();
        match self.aov {
            Aov::Albedo => {
                let encoder = SrgbEncoder::new();
                collected(count, self.pixels.iter().flatten().map(|x| encoder.encode(*x)))
            }
            Aov::Distance | Aov::Samples | Aov::Variance | Aov::Time | Aov::Nodes => self.heat(),
            Aov::Lanes => {
                let scale = HeatScale::new();
                collected(count, self.pixels.iter().flat_map(|pixel| scale.color(pixel[0])))
            }
            Aov::Normal => {
                let encoder = SrgbEncoder::new();
                let shown = self.pixels.iter().flatten().map(|x| encoder.encode(0.5 * x + 0.5));
                collected(count, shown)
            }
            Aov::Object | Aov::Class => {
                collected(count, self.pixels.iter().flat_map(|it| color_of(it[0])))
            }
        }
    }

    /// Maps the values to the heat scale, of which the ends are the first and the last percentile, because outliers may
    /// be extreme.
    fn heat(&self) -> Result<Vec<u8>, OutOfMemory> {
        let finite = self.pixels.iter().map(|it| it[0]).filter(|value| value.is_finite());
        let mut sorted: Vec<f32> = collected(self.pixels.len(), finite.map(logarithm))?;
        // Unstable sorting is deterministic here, because equal numbers are identical.
        sorted.sort_unstable_by(f32::total_cmp);
        let spare = sorted.len() / 100;
        let (Some(least), Some(greatest)) = (sorted.get(spare), sorted.iter().nth_back(spare))
        else {
            return filled(3 * self.pixels.len(), 0);
        };
        let scale = HeatScale::new();
        let width = (greatest - least).max(f32::MIN_POSITIVE);
        let color = |pixel: &[f32; 3]| scale.color((logarithm(pixel[0]) - least) / width);
        collected(3 * self.pixels.len(), self.pixels.iter().flat_map(color))
    }
}

/// A colour for an index; black for -1.
fn color_of(number: f32) -> [u8; 3] {
    if number < 0.0 {
        return [0; 3];
    }
    let bits = rtsl_math::sampling::hash(number as u32, 0);
    // Bright enough to be distinct from black.
    [0, 8, 16].map(|shift| 64 + (bits >> shift) as u8 % 192)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back() {
        for aov in Aov::ALL {
            assert_eq!(Aov::from_name(aov.name()), Some(aov));
        }
        assert_eq!(Aov::from_name("depth"), Some(Aov::Distance));
        assert_eq!(Aov::from_name("colour"), None);
    }

    #[test]
    fn the_heat_scale_spans_what_is_finite() {
        let image = |aov: Aov, values: &[f32]| {
            let pixels = values.iter().map(|value| [*value, 0.0, 0.0]).collect();
            AovImage { aov, width: values.len(), height: 1, pixels }.to_srgb().unwrap()
        };
        let scale = HeatScale::new();
        let shown = image(Aov::Distance, &[0.5, f32::INFINITY, 8.0, 2.0]);
        assert_eq!(shown[0..3], scale.color(0.0));
        assert_eq!(shown[3..6], scale.color(1.0));
        assert_eq!(shown[6..9], scale.color(1.0));
        assert_eq!(shown[9..12], scale.color(0.5));
        // A quarter of the way from 2^4 to 2^8.
        assert_eq!(image(Aov::Time, &[16.0, 256.0, 32.0])[6..9], scale.color(0.25));
        assert_eq!(image(Aov::Distance, &[f32::INFINITY]), [0; 3]);
    }

    #[test]
    fn what_lies_far_out_does_not_spread_the_scale() {
        let mut pixels = vec![[1.0, 0.0, 0.0]; 150];
        pixels.extend([[4.0, 0.0, 0.0]; 149]);
        pixels.push([1e30, 0.0, 0.0]);
        let image = AovImage { aov: Aov::Distance, width: 300, height: 1, pixels };
        assert_eq!(image.to_srgb().unwrap()[3 * 200..3 * 201], HeatScale::new().color(1.0));
    }

    #[test]
    fn numbers_have_colors_of_their_own() {
        assert_eq!(color_of(-1.0), [0; 3]);
        assert_ne!(color_of(0.0), color_of(1.0));
    }
}
