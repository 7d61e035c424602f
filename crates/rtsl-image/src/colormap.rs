//! A perceptually uniform colour map.
//!
//! It runs from black over violet and red to pale yellow, along a spiral in Oklab (Ottosson, "A perceptual color space
//! for image processing", 2020): lightness increases linearly and the hue turns by half a circle, so the scale remains
//! monotonic in greyscale. Chroma is greatest in the middle, limited by the sRGB gamut.

use rtsl_math::sine_and_cosine_of_degrees;

use super::SrgbEncoder;

/// The lightness of the ends of the scale.
const DARKEST: f64 = 0.12;
const LIGHTEST: f64 = 0.97;
/// The greatest chroma that keeps the whole spiral inside the sRGB gamut, with a small margin.
const CHROMA: f64 = 0.18;
/// The hue at the dark end and the angle of the turn, in degrees.
const FIRST_HUE: f64 = 280.0;
const TURN: f64 = 180.0;

/// The heat scale as a table.
#[derive(Clone, Debug)]
pub struct HeatScale {
    colors: [[u8; 3]; 256],
}

impl HeatScale {
    /// Computes the table.
    pub fn new() -> Self {
        let encoder = SrgbEncoder::new();
        let color = |index: usize| {
            oklab_to_linear(spiral(index as f64 / 255.0)).map(|x| encoder.encode(x as f32))
        };
        HeatScale { colors: std::array::from_fn(color) }
    }

    /// Returns the colour of a number from 0 to 1 as 8-bit sRGB. Numbers outside are clamped, NaN counts as 0.
    pub fn color(&self, x: f32) -> [u8; 3] {
        self.colors[(x.clamp(0.0, 1.0) * 255.0 + 0.5) as usize]
    }
}

impl Default for HeatScale {
    fn default() -> Self {
        Self::new()
    }
}

/// An approximate logarithm to base 2 of a number that is not negative, linear between powers of two: the bits of the
/// float interpreted as an integer. -127 for 0.
pub fn logarithm(value: f32) -> f32 {
    value.max(0.0).to_bits() as f32 / 8_388_608.0 - 127.0
}

/// The point of the spiral in Oklab.
fn spiral(x: f64) -> [f64; 3] {
    let chroma = CHROMA * 4.0 * x * (1.0 - x);
    let (sine, cosine) = sine_and_cosine_of_degrees(FIRST_HUE + TURN * x);
    [DARKEST + (LIGHTEST - DARKEST) * x, chroma * cosine, chroma * sine]
}

/// Converts Oklab to linear sRGB by the matrices of its definition.
fn oklab_to_linear([lightness, a, b]: [f64; 3]) -> [f64; 3] {
    let cone = |of_a: f64, of_b: f64| {
        let root = lightness + of_a * a + of_b * b;
        root * root * root
    };
    let long = cone(0.396_337_777_4, 0.215_803_757_3);
    let middle = cone(-0.105_561_345_8, -0.063_854_172_8);
    let short = cone(-0.089_484_177_5, -1.291_485_548);
    [
        4.076_741_662_1 * long - 3.307_711_591_3 * middle + 0.230_969_929_2 * short,
        -1.268_438_004_6 * long + 2.609_757_401_1 * middle - 0.341_319_396_5 * short,
        -0.004_196_086_3 * long - 0.703_418_614_7 * middle + 1.707_614_701 * short,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_steps_look_equal() {
        let points: Vec<[f64; 3]> = (0..=100).map(|step| spiral(f64::from(step) / 100.0)).collect();
        let distance = |pair: &[[f64; 3]]| {
            let square =
                |axis: usize| (pair[1][axis] - pair[0][axis]) * (pair[1][axis] - pair[0][axis]);
            (square(0) + square(1) + square(2)).sqrt()
        };
        let steps: Vec<f64> = points.windows(2).map(distance).collect();
        let mean = steps.iter().sum::<f64>() / steps.len() as f64;
        assert!(steps.iter().all(|step| (0.9..1.1).contains(&(step / mean))), "{steps:?}");
    }

    #[test]
    fn every_color_is_one_of_srgb() {
        for step in 0..=255 {
            let color = oklab_to_linear(spiral(f64::from(step) / 255.0));
            assert!(color.iter().all(|channel| (0.0..=1.0).contains(channel)), "{step}: {color:?}");
        }
    }

    #[test]
    fn the_scale_goes_from_dark_to_light() {
        let scale = HeatScale::new();
        assert_eq!(scale.color(f32::NAN), scale.color(-1.0));
        assert_eq!(scale.color(7.0), scale.color(1.0));
        let sum = |x: f32| scale.color(x).map(u32::from).iter().sum::<u32>();
        assert!(sum(0.0) < 30 && sum(1.0) > 600, "{:?}", [scale.color(0.0), scale.color(1.0)]);
    }

    /// Checks the matrices against the definition: white maps to white.
    #[test]
    fn oklab_keeps_white() {
        for channel in oklab_to_linear([1.0, 0.0, 0.0]) {
            assert!((channel - 1.0).abs() < 1e-6, "{channel}");
        }
    }
}
