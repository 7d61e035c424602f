//! Smooth spectra of colours: sigmoids of polynomials of the second degree (Jakob and Hanika, "A Low-Dimensional
//! Function Space for Efficient Spectral Upsampling", Computer Graphics Forum 38, 2019). pbrt-v4 takes them for
//! colours.

use super::color_space::{Matrix, inverse, transformed};
use super::daylight::daylight_weights;

/// The greatest coefficient: the spectra of colours at the border of the gamut are steps, which have none.
const MAX_COEFFICIENT: f64 = 200.0;

/// The way from grey to a colour is taken in steps, each of which begins near its end.
const STEPS: usize = 16;
const ITERATIONS: usize = 20;

/// Wavelengths in nanometres, with the weights by which a spectrum at them sums to the colour of a surface in daylight.
pub struct Wavelengths {
    weights: Vec<(f64, [f64; 3])>,
}

impl Default for Wavelengths {
    fn default() -> Self {
        let wavelengths: Vec<f64> = (0..48).map(|index| 360.0 + 10.0 * f64::from(index)).collect();
        let weights = daylight_weights(&wavelengths);
        Wavelengths { weights: wavelengths.into_iter().zip(weights).collect() }
    }
}

impl Wavelengths {
    /// Returns the colour of a surface with this reflectance.
    pub fn surface_color(&self, reflectance: impl Fn(f64) -> f64) -> [f64; 3] {
        self.weights.iter().fold([0.0; 3], |sum, (wavelength, weight)| {
            let value = reflectance(*wavelength);
            std::array::from_fn(|channel| sum[channel] + weight[channel] * value)
        })
    }

    /// Returns the smooth spectrum of a colour whose components may exceed 1: that of a reflectance, scaled.
    pub fn spectrum_of(&self, color: [f64; 3]) -> SmoothSpectrum {
        let scale = 2.0 * color.into_iter().fold(0.0, f64::max);
        if scale <= 0.0 || !scale.is_finite() {
            return SmoothSpectrum { scale: 0.0, coefficients: [0.0; 3] };
        }
        SmoothSpectrum { scale, coefficients: self.fit(color.map(|part| part.max(0.0) / scale)) }
    }

    /// The coefficients of the sigmoid whose colour this is, or is near where none has it.
    fn fit(&self, color: [f64; 3]) -> [f64; 3] {
        let grey = (color.iter().sum::<f64>() / 3.0).clamp(1e-4, 1.0 - 1e-4);
        let mut found = [0.0, 0.0, (grey - 0.5) / (grey * (1.0 - grey)).sqrt()];
        for step in 1..=STEPS {
            let part = step as f64 / STEPS as f64;
            found = self.refine(found, color.map(|component| grey + part * (component - grey)));
        }
        found
    }

    /// Newton's method, whose steps are halved until they lead closer.
    fn refine(&self, mut found: [f64; 3], color: [f64; 3]) -> [f64; 3] {
        let mut before = self.distance2(found, color);
        for _ in 0..ITERATIONS {
            if before < 1e-16 {
                break;
            }
            let (difference, jacobian) = self.residual(found, color);
            let step = transformed(&inverse(&jacobian), difference);
            let halves = (0..10).map(|count| f64::from(1 << count).recip());
            let tried =
                halves.map(|part| std::array::from_fn(|axis| found[axis] - part * step[axis]));
            let is_closer = |next: &[f64; 3]| {
                next.iter().all(|it| it.abs() <= MAX_COEFFICIENT)
                    && self.distance2(*next, color) < before
            };
            let Some(next) = tried.into_iter().find(is_closer) else { break };
            (found, before) = (next, self.distance2(next, color));
        }
        found
    }

    fn distance2(&self, coefficients: [f64; 3], color: [f64; 3]) -> f64 {
        let seen = self.surface_color(|wavelength| sigmoid(polynomial(coefficients, wavelength)));
        (0..3)
            .map(|channel| (seen[channel] - color[channel]) * (seen[channel] - color[channel]))
            .sum()
    }

    /// The difference of the colour, and its derivatives by the coefficients.
    fn residual(&self, coefficients: [f64; 3], color: [f64; 3]) -> ([f64; 3], Matrix) {
        let mut difference = color.map(|component| -component);
        let mut jacobian = [[0.0; 3]; 3];
        for (wavelength, weight) in &self.weights {
            let x = place(*wavelength);
            let p = polynomial(coefficients, *wavelength);
            let root = (1.0 + p * p).sqrt();
            let slope = 0.5 / (root * root * root);
            for channel in 0..3 {
                difference[channel] += weight[channel] * sigmoid(p);
                for (entry, power) in jacobian[channel].iter_mut().zip([x * x, x, 1.0]) {
                    *entry += weight[channel] * slope * power;
                }
            }
        }
        (difference, jacobian)
    }
}

/// A smooth spectrum.
#[derive(Clone, Copy, Debug)]
pub struct SmoothSpectrum {
    scale: f64,
    coefficients: [f64; 3],
}

impl SmoothSpectrum {
    /// Returns the value at a wavelength.
    pub fn at(&self, wavelength: f64) -> f64 {
        self.scale * sigmoid(polynomial(self.coefficients, wavelength))
    }
}

fn polynomial([square, linear, constant]: [f64; 3], wavelength: f64) -> f64 {
    let x = place(wavelength);
    (square * x + linear) * x + constant
}

/// Maps visible wavelengths to numbers from -1 to 1.
fn place(wavelength: f64) -> f64 {
    (wavelength - 595.0) / 235.0
}

fn sigmoid(x: f64) -> f64 {
    0.5 + 0.5 * x / (1.0 + x * x).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spectra_have_their_colours() {
        let wavelengths = Wavelengths::default();
        for color in [
            [0.032, 0.17, 0.48],
            [2.19, 2.62, 3.0],
            [0.5, 0.5, 0.5],
            [0.8, 0.1, 0.3],
            [1e-3, 2e-3, 3e-3],
        ] {
            let spectrum = wavelengths.spectrum_of(color);
            let seen = wavelengths.surface_color(|wavelength| spectrum.at(wavelength));
            for (seen, color) in seen.into_iter().zip(color) {
                assert!((seen - color).abs() < 1e-5 * spectrum.scale, "{seen} {color}");
            }
        }
    }

    /// No spectrum is saturated, black or infinite: the nearest is bounded.
    #[test]
    fn spectra_of_impossible_colours_are_bounded() {
        let wavelengths = Wavelengths::default();
        for color in [
            [0.0, 0.0, 1.0],
            [0.0; 3],
            [f64::INFINITY, 0.0, 1.0],
            [f64::NAN, 1.0, 1.0],
            [-1.0, 0.5, 1.0],
        ] {
            let spectrum = wavelengths.spectrum_of(color);
            for wavelength in [360.0, 500.0, 830.0] {
                let value = spectrum.at(wavelength);
                assert!((0.0..=2.0).contains(&value), "{color:?} {value}");
            }
        }
    }

    #[test]
    fn greys_are_even() {
        let spectrum = Wavelengths::default().spectrum_of([3.0; 3]);
        for wavelength in [360.0, 500.0, 830.0] {
            assert!((spectrum.at(wavelength) - 3.0).abs() < 1e-3);
        }
    }
}
