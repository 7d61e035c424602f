//! Daylight, and colours of surfaces in it.

use super::matching::color;

/// The spectrum of the CIE's illuminant D65 every 10 nm from 360 to 830 nm.
const D65: [f64; 48] = [
    46.6383, 52.0891, 49.9755, 54.6482, 82.7549, 91.486, 93.4318, 86.6823, 104.865, 117.008,
    117.812, 114.861, 115.923, 108.811, 109.354, 107.802, 104.79, 107.689, 104.405, 104.046, 100.0,
    96.3342, 95.788, 88.6856, 90.0062, 89.5991, 87.6987, 83.2886, 83.6992, 80.0268, 80.2146,
    82.2778, 78.2842, 69.7213, 71.6091, 74.349, 61.604, 69.8856, 75.087, 63.5927, 46.4182, 66.8054,
    63.3828, 64.304, 59.4519, 51.959, 57.4406, 60.3125,
];

fn d65(wavelength: f64) -> f64 {
    let place = ((wavelength - 360.0) / 10.0).clamp(0.0, 47.0);
    let below = (place as usize).min(46);
    let part = place - below as f64;
    (1.0 - part) * D65[below] + part * D65[below + 1]
}

/// Returns for each of these increasing wavelengths the red, green and blue in daylight of a surface that reflects all
/// light there, none at the other wavelengths, and between them linearly less. Beyond the ends, surfaces reflect as at
/// the ends. The sum of these colours, each times a reflectance, is the colour of a surface.
pub fn daylight_weights(wavelengths: &[f64]) -> Vec<[f64; 3]> {
    let white = color(d65);
    let part_at = |index: usize, wavelength: f64| {
        let at = wavelengths[index];
        let neighbour = if wavelength < at { index.checked_sub(1) } else { Some(index + 1) };
        match neighbour.and_then(|it| wavelengths.get(it)) {
            Some(other) => (1.0 - (wavelength - at) / (other - at)).max(0.0),
            None => 1.0,
        }
    };
    let weight = |index: usize| {
        let seen = color(|wavelength| part_at(index, wavelength) * d65(wavelength));
        std::array::from_fn(|channel| seen[channel] / white[channel])
    };
    (0..wavelengths.len()).map(weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn daylight_is_white() {
        // The observer is an approximation.
        assert!(
            color(d65).iter().all(|it| (it / color(d65)[1] - 1.0).abs() < 0.02),
            "{:?}",
            color(d65)
        );
    }

    #[test]
    fn weights_give_the_colours_of_surfaces() {
        let wavelengths = [360.0, 450.0, 500.0, 610.0, 830.0];
        let values = [0.1, 0.9, 0.4, 0.2, 0.7];
        let reflectance = |wavelength: f64| {
            let after = wavelengths.partition_point(|it| *it <= wavelength).clamp(1, 4);
            let [start, end] = [wavelengths[after - 1], wavelengths[after]];
            let part = (wavelength - start) / (end - start);
            values[after - 1] + (values[after] - values[after - 1]) * part
        };
        let white = color(d65);
        let expected = color(|wavelength| reflectance(wavelength) * d65(wavelength));
        let weights = daylight_weights(&wavelengths);
        let ends = daylight_weights(&[500.0, 600.0]);
        for channel in 0..3 {
            let found: f64 =
                weights.iter().zip(values).map(|(it, value)| it[channel] * value).sum();
            let expected = expected[channel] / white[channel];
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
            let grey: f64 = ends.iter().map(|it| it[channel]).sum();
            assert!((grey - 1.0).abs() < 1e-9, "{grey}");
        }
    }
}
