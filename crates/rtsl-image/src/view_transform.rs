//! View transforms from linear colours to a display.

use rtsl_math::power_of_two;

use super::SrgbEncoder;

/// A mapping of linear colours to the bytes of a PNG.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViewTransform {
    /// sRGB, clamped at 1.
    #[default]
    Standard,
    /// A filmic curve: contrast in the middle, and bright colours that desaturate towards white.
    ///
    /// A tenth of each channel is mixed into the others, so that bright saturated colours have some of all; the curve
    /// `f(x) = k x (x + a) / (x^2 + b x + c)` is applied; then the mixing is inverted and the result encoded as sRGB.
    /// `a` is 0.05, and the other constants are such that mid-grey (0.18) is preserved, that its contrast is 1.2 (the
    /// slope of f over logarithms), and that 16, six and a half stops above it, is white.
    Filmic,
    /// Linear: a byte is 255 times the colour.
    Raw,
}

impl ViewTransform {
    /// All of them.
    pub const ALL: [ViewTransform; 3] =
        [ViewTransform::Standard, ViewTransform::Filmic, ViewTransform::Raw];

    /// Returns the name.
    pub fn name(self) -> &'static str {
        match self {
            ViewTransform::Standard => "standard",
            ViewTransform::Filmic => "filmic",
            ViewTransform::Raw => "raw",
        }
    }

    /// Returns the view transform with this name.
    pub fn from_name(name: &str) -> Option<ViewTransform> {
        ViewTransform::ALL.into_iter().find(|view| view.name() == name)
    }
}

/// Encodes colours for a display, after a multiplication by a power of two.
///
/// ```
/// use rtsl_image::{ViewEncoder, ViewTransform};
///
/// let bright = [4.0, 4.0, 4.0];
/// assert_eq!(ViewEncoder::new(ViewTransform::Standard, 0.0).encode(bright), [255; 3]);
/// // Two stops darker.
/// assert_eq!(ViewEncoder::new(ViewTransform::Raw, -2.0).encode(bright), [255; 3]);
/// assert!(ViewEncoder::new(ViewTransform::Filmic, 0.0).encode(bright) < [255; 3]);
/// ```
#[derive(Clone, Debug)]
pub struct ViewEncoder {
    view: ViewTransform,
    scale: f32,
    srgb: SrgbEncoder,
    curve: FilmicCurve,
}

impl ViewEncoder {
    /// Creates an encoder with an exposure in stops.
    pub fn new(view: ViewTransform, exposure: f32) -> Self {
        ViewEncoder {
            view,
            scale: exposure_scale(exposure),
            srgb: SrgbEncoder::new(),
            curve: FilmicCurve::new(),
        }
    }

    /// Returns the bytes of a colour; negative values and NaN become 0.
    pub fn encode(&self, color: [f32; 3]) -> [u8; 3] {
        let scaled = color.map(|value| value * self.scale);
        match self.view {
            ViewTransform::Standard => scaled.map(|value| self.srgb.encode(value)),
            ViewTransform::Filmic => self.curve.color(scaled).map(|value| self.srgb.encode(value)),
            // NaN becomes 0.
            ViewTransform::Raw => scaled.map(|value| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8),
        }
    }
}

/// The constants of the curve of [`ViewTransform::Filmic`].
#[derive(Clone, Copy, Debug)]
struct FilmicCurve {
    k: f32,
    b: f32,
    c: f32,
}

/// The toe: smaller values make shadows darker.
const TOE: f64 = 0.05;
const MIDDLE: f64 = 0.18;
const CONTRAST: f64 = 1.2;
const WHITE: f64 = 16.0;
/// The share of each channel that is mixed into each other one.
const SHARE: f32 = 0.1;

impl FilmicCurve {
    /// Solves the three conditions, which are linear in k, b and c.
    fn new() -> Self {
        let (a, m, w) = (TOE, MIDDLE, WHITE);
        // From the contrast at m: b = k p - 2 m. With that, from f(m) = m: c = k q + m^2.
        let p = ((m + a) * (1.0 - CONTRAST) + m) / m;
        let q = m + a - p * m;
        // From f(w) = 1.
        let k = (w - m) * (w - m) / (w * (w + a) - w * p - q);
        FilmicCurve { k: k as f32, b: (k * p - 2.0 * m) as f32, c: (k * q + m * m) as f32 }
    }

    fn color(&self, color: [f32; 3]) -> [f32; 3] {
        // Removes negative values and NaN; the curve reaches white long before the limit.
        let color = color.map(|value| if value > 0.0 { value.min(1e6) } else { 0.0 });
        let sum = color[0] + color[1] + color[2];
        let own = 1.0 - 3.0 * SHARE;
        let curved = color.map(|value| self.value(own * value + SHARE * sum));
        let sum = curved[0] + curved[1] + curved[2];
        curved.map(|value| (value - SHARE * sum) / own)
    }

    fn value(&self, x: f32) -> f32 {
        let x = x.min(WHITE as f32);
        self.k * x * (x + TOE as f32) / (x * x + self.b * x + self.c)
    }
}

/// Returns the factor of an exposure in stops.
pub fn exposure_scale(stops: f32) -> f32 {
    if stops.is_nan() { 1.0 } else { power_of_two(f64::from(stops)) as f32 }
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "the platform's logarithm is the reference")]
mod tests {
    use super::*;

    fn gray(view: ViewTransform, value: f32) -> u8 {
        let [red, green, blue] = ViewEncoder::new(view, 0.0).encode([value; 3]);
        assert!(red == green && green == blue);
        red
    }

    #[test]
    fn names_lead_back() {
        for view in ViewTransform::ALL {
            assert_eq!(ViewTransform::from_name(view.name()), Some(view));
        }
    }

    #[test]
    fn raw_is_linear() {
        let values = [-1.0, 0.0, 0.5, 1.0, 7.0, f32::NAN, f32::INFINITY];
        let expected = [0, 0, 128, 255, 255, 0, 255];
        assert_eq!(values.map(|value| gray(ViewTransform::Raw, value)), expected);
    }

    #[test]
    fn the_filmic_curve_keeps_its_conditions() {
        let curve = FilmicCurve::new();
        assert!((curve.value(0.18) - 0.18).abs() < 1e-6);
        assert!((curve.value(16.0) - 1.0).abs() < 1e-6);
        let contrast = (curve.value(0.19) / curve.value(0.17)).log2() / (0.19_f32 / 0.17).log2();
        assert!((contrast - 1.2).abs() < 1e-3, "{contrast}");
        // Neither black nor white is reached early, and the curve is monotonic.
        let steps: Vec<f32> = (0..1600).map(|step| curve.value(step as f32 / 100.0)).collect();
        assert!(steps.is_sorted_by(|a, b| a < b));
        let expected = [0, 118, 218, 255, 255, 0, 0];
        let values = [0.0, 0.18, 1.0, 16.0, f32::INFINITY, f32::NAN, -3.0];
        assert_eq!(values.map(|value| gray(ViewTransform::Filmic, value)), expected);
    }

    #[test]
    fn bright_colors_run_into_white_and_dim_ones_keep_theirs() {
        let encoder = ViewEncoder::new(ViewTransform::Filmic, 0.0);
        let [red, green, blue] = encoder.encode([100.0, 0.0, 0.0]);
        assert!(red == 255 && green > 200 && green == blue, "{red} {green} {blue}");
        let [red, green, blue] = encoder.encode([0.2, 0.02, 0.02]);
        assert!(red > 3 * green && green == blue, "{red} {green} {blue}");
    }

    #[test]
    fn exposure_comes_first() {
        for view in ViewTransform::ALL {
            let (plain, brighter) = (ViewEncoder::new(view, 0.0), ViewEncoder::new(view, 2.0));
            assert_eq!(brighter.encode([0.1, 0.2, 0.05]), plain.encode([0.4, 0.8, 0.2]));
        }
    }

    #[test]
    fn exposure_counts_stops() {
        assert_eq!(exposure_scale(0.0), 1.0);
        assert_eq!(exposure_scale(-3.0), 0.125);
        assert_eq!(exposure_scale(0.5), std::f32::consts::SQRT_2);
    }
}
