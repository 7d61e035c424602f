//! The colour matching functions of the CIE 1931 observer.

use rtsl_math::exponential;

/// The range of wavelengths, in nanometres, over which spectra are integrated.
pub const VISIBLE: std::ops::RangeInclusive<u32> = 360..=830;

/// The functions at a wavelength in nanometres, as sums of Gaussians after Wyman, Sloan and Shirley, "Simple Analytic
/// Approximations to the CIE XYZ Color Matching Functions" (JCGT, 2013).
pub fn matching(wavelength: f64) -> [f64; 3] {
    let lobe = |height: f64, mean: f64, below: f64, above: f64| {
        let t = (wavelength - mean) * if wavelength < mean { below } else { above };
        height * exponential(-0.5 * t * t)
    };
    [
        lobe(1.056, 599.8, 0.0264, 0.0323)
            + lobe(0.362, 442.0, 0.0624, 0.0374)
            + lobe(-0.065, 501.1, 0.0490, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725),
    ]
}

/// The colour of a spectrum, relative to the luminance of a spectrum that is 1 everywhere.
pub fn color(spectrum: impl Fn(f64) -> f64) -> [f64; 3] {
    let mut sums = [0.0; 3];
    let mut white = 0.0;
    for wavelength in VISIBLE {
        let wavelength = f64::from(wavelength);
        let value = spectrum(wavelength);
        let observer = matching(wavelength);
        for (sum, weight) in sums.iter_mut().zip(observer) {
            *sum += weight * value;
        }
        white += observer[1];
    }
    linear_srgb(sums.map(|sum| sum / white))
}

/// The weights of red, green and blue in the luminance.
pub fn luminance([red, green, blue]: [f64; 3]) -> f64 {
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

/// Converts CIE tristimulus values to linear sRGB (IEC 61966-2-1).
fn linear_srgb([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
        -0.969_266 * x + 1.876_010_8 * y + 0.041_556 * z,
        0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
    ]
}
