//! The film's response to radiance.

use crate::spectrum::white_balance;

/// The film's response to radiance: how a sample's colour follows from the radiance along its ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imaging {
    /// The factor of radiance: the product of exposure time and sensitivity, 1 for a second at ISO 100.
    pub scale: f32,
    /// The greatest CIE tristimulus value that a sample may have; brighter samples are scaled down.
    pub max_component: Option<f32>,
    /// The matrix of the white balance on linear sRGB, row by row.
    pub balance: Option<[[f32; 3]; 3]>,
}

impl Default for Imaging {
    /// Samples are radiances.
    fn default() -> Self {
        Imaging { scale: 1.0, max_component: None, balance: None }
    }
}

impl Imaging {
    /// True if samples are radiances.
    pub fn is_radiance(&self) -> bool {
        *self == Self::default()
    }

    /// Sets the temperature, in kelvin, of the light that appears white.
    pub fn set_white(&mut self, kelvin: f64) {
        let matrix = white_balance(kelvin);
        self.balance = Some(matrix.map(|row| row.map(|component| component as f32)));
    }

    /// True if colours are radiances.
    pub fn is_plain(&self) -> bool {
        self.scale == 1.0 && self.max_component.is_none() && self.balance.is_none()
    }

    /// Returns the colour of a sample for a radiance in linear sRGB.
    #[inline]
    pub fn develop(&self, radiance: [f32; 3]) -> [f32; 3] {
        let mut color = radiance.map(|component| component * self.scale);
        if let Some(max) = self.max_component {
            // The sensor's components are tristimulus values, so these are compared, as in pbrt.
            let values = product(&TRISTIMULUS, color);
            let greatest = values[0].max(values[1]).max(values[2]);
            if greatest > max {
                color = color.map(|component| component * (max / greatest));
            }
        }
        match &self.balance {
            Some(matrix) => product(matrix, color),
            None => color,
        }
    }
}

/// From linear sRGB to CIE XYZ (IEC 61966-2-1).
const TRISTIMULUS: [[f32; 3]; 3] = [
    [0.412_456_4, 0.357_576_1, 0.180_437_5],
    [0.212_672_9, 0.715_152_2, 0.072_175],
    [0.019_333_9, 0.119_192, 0.950_304_1],
];

#[inline]
fn product(matrix: &[[f32; 3]; 3], vector: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radiance_keeps_its_bits_by_default() {
        let imaging = Imaging::default();
        for radiance in [[0.1, 1e30, 3e-39], [-0.0, 0.7, f32::INFINITY]] {
            assert_eq!(imaging.develop(radiance).map(f32::to_bits), radiance.map(f32::to_bits));
        }
        assert!(imaging.develop([f32::NAN; 3])[0].is_nan());
    }

    #[test]
    fn bright_samples_are_scaled_down_by_their_greatest_tristimulus_value() {
        let imaging = Imaging { scale: 2.0, max_component: Some(1.0), ..Imaging::default() };
        let [red, green, blue] = imaging.develop([1.0, 1.0, 1.0]);
        // Z of white is 1.0888.
        assert!((red - 1.0 / 1.08883).abs() < 1e-5 && red == green && green == blue, "{red}");
        assert_eq!(imaging.develop([0.25, 0.25, 0.25]), [0.5; 3]);
        let [red, green, blue] = imaging.develop([5.0, 0.0, 0.0]);
        assert!((red - 1.0 / 0.412_456_4).abs() < 1e-5 && green == 0.0 && blue == 0.0, "{red}");
    }

    #[test]
    fn warm_light_is_balanced_to_white() {
        let mut imaging = Imaging::default();
        imaging.set_white(3000.0);
        let lamp = crate::spectrum::blackbody(3000.0).map(|component| component as f32);
        let [red, green, blue] = imaging.develop(lamp);
        assert!((red / green - 1.0).abs() < 0.02 && (blue / green - 1.0).abs() < 0.02);
        imaging.set_white(6500.0);
        for component in imaging.develop([0.5; 3]) {
            assert!((component - 0.5).abs() < 0.002, "{component}");
        }
    }
}
