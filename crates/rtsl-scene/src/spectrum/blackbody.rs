//! Blackbody emission.

use rtsl_math::exponential;

use super::matching::{color, luminance};

/// Planck's second radiation constant, in nanometres and kelvin.
const SECOND_CONSTANT: f64 = 1.438_776_877e7;

/// Returns the colour of a black body with luminance 1; components outside the sRGB gamut are 0.
pub fn blackbody(kelvin: f64) -> [f64; 3] {
    let seen = color(|wavelength| planck(wavelength, kelvin)).map(|component| component.max(0.0));
    let sum = luminance(seen);
    if sum > 0.0 { seen.map(|component| component / sum) } else { [0.0; 3] }
}

/// The radiance of a black body at a wavelength in nanometres, up to a factor that keeps it in range at every
/// temperature.
pub fn planck(wavelength: f64, kelvin: f64) -> f64 {
    let micrometres = wavelength / 1000.0;
    let fifth = micrometres * micrometres * micrometres * micrometres * micrometres;
    let exponent = SECOND_CONSTANT / kelvin * (1.0 / wavelength - 1.0 / 830.0);
    let scale = exponential(-SECOND_CONSTANT / (830.0 * kelvin));
    1.0 / (fifth * (exponential(exponent) - scale))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn daylight_is_nearly_white_and_lamps_are_warm() {
        let [red, green, blue] = blackbody(6500.0);
        for component in [red, green, blue] {
            assert!((component - 1.0).abs() < 0.08, "{component}");
        }
        let [red, green, blue] = blackbody(2700.0);
        assert!(red > 1.5 && green < 1.0 && blue < 0.35, "{red} {green} {blue}");
        assert!(blackbody(1.0).iter().chain(&blackbody(1e9)).all(|it| it.is_finite()));
    }
}
