//! White balance: the colours of things in the light of one temperature, as they appear in daylight.

use super::blackbody::planck;
use super::color_space::{ColorSpace, Matrix, inverse, multiplied, transformed, tristimulus};
use super::matching::{VISIBLE, matching};

/// The responses of the eye's cones to CIE tristimulus values, after Bradford.
const CONES: Matrix =
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];

/// The temperature below which no daylight is defined, in kelvin.
const COLDEST_DAYLIGHT: f64 = 4000.0;

/// Returns the matrix, row by row, that maps linear sRGB colours seen in the light of a temperature to those seen in
/// the white of sRGB.
pub fn white_balance(kelvin: f64) -> [[f64; 3]; 3] {
    let to_xyz = ColorSpace::SRGB.to_xyz();
    let cones = multiplied(&CONES, &to_xyz);
    let source = transformed(&CONES, tristimulus(light_chromaticity(kelvin)));
    let target = transformed(&cones, [1.0; 3]);
    let mut balanced = cones;
    for (row, (target, source)) in balanced.iter_mut().zip(target.into_iter().zip(source)) {
        row.iter_mut().for_each(|component| *component *= target / source);
    }
    multiplied(&inverse(&cones), &balanced)
}

/// The chromaticity of daylight of a temperature, or of a black body where there is no daylight.
fn light_chromaticity(kelvin: f64) -> [f64; 2] {
    // The scale of temperatures was revised after the definition of the daylights.
    let t = kelvin * 1.4388 / 1.4380;
    if t < COLDEST_DAYLIGHT {
        return blackbody_chromaticity(t);
    }
    let x = if t <= 7000.0 {
        -4.607e9 / (t * t * t) + 2.9678e6 / (t * t) + 99.11 / t + 0.244_063
    } else {
        -2.0064e9 / (t * t * t) + 1.9018e6 / (t * t) + 247.48 / t + 0.237_04
    };
    [x, -3.0 * x * x + 2.870 * x - 0.275]
}

fn blackbody_chromaticity(kelvin: f64) -> [f64; 2] {
    let mut sums = [0.0; 3];
    for wavelength in VISIBLE {
        let wavelength = f64::from(wavelength);
        let value = planck(wavelength, kelvin);
        for (sum, weight) in sums.iter_mut().zip(matching(wavelength)) {
            *sum += weight * value;
        }
    }
    let sum = sums[0] + sums[1] + sums[2];
    [sums[0] / sum, sums[1] / sum]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The references are CIE's chromaticities of D50, of D75 and of the Planckian locus at 2856 K.
    #[test]
    fn lights_have_their_chromaticities() {
        for (kelvin, expected) in
            [(5000.0, [0.3457, 0.3585]), (7500.0, [0.2990, 0.3149]), (2856.0, [0.4476, 0.4074])]
        {
            let found = light_chromaticity(kelvin);
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 3e-3, "{kelvin}: {found} for {expected}");
            }
        }
    }
}
