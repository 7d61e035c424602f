//! Spectra tabulated at some wavelengths.

use super::matching::{color, luminance};

/// Values at increasing wavelengths in nanometres, interpolated linearly and 0 outside, as in pbrt.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampled(Vec<(f64, f64)>);

impl Sampled {
    /// Creates a spectrum from alternating wavelengths and values; `None` unless wavelengths increase.
    pub fn from_pairs(numbers: &[f64]) -> Option<Sampled> {
        let (pairs, rest) = numbers.as_chunks::<2>();
        let pairs: Vec<(f64, f64)> =
            pairs.iter().map(|[wavelength, value]| (*wavelength, *value)).collect();
        let rises = pairs.windows(2).all(|two| two[0].0 < two[1].0);
        (rest.is_empty() && !pairs.is_empty() && rises).then_some(Sampled(pairs))
    }

    /// Parses the text of a file: pairs of numbers, with comments after `#`.
    pub fn from_text(text: &str) -> Option<Sampled> {
        let lines = text.lines().map(|line| line.split('#').next().unwrap_or(""));
        let numbers = lines.flat_map(str::split_whitespace).map(|word| word.parse::<f64>().ok());
        let numbers: Option<Vec<f64>> = numbers.map(|it| it.filter(|it| it.is_finite())).collect();
        Sampled::from_pairs(&numbers?)
    }

    /// Returns the value at a wavelength.
    pub fn at(&self, wavelength: f64) -> f64 {
        let after = self.0.partition_point(|(other, _)| *other <= wavelength);
        let before = self.0[..after].last();
        match (before, self.0.get(after)) {
            (Some((start, first)), Some((end, second))) => {
                first + (second - first) * (wavelength - start) / (end - start)
            }
            (Some((last, value)), None) if *last == wavelength => *value,
            (Some(_), None) | (None, _) => 0.0,
        }
    }

    /// Returns the colour of a surface with this reflectance in white light; a constant spectrum is grey.
    pub fn surface_color(&self) -> [f64; 3] {
        let white = color(|_| 1.0);
        let seen = color(|wavelength| self.at(wavelength));
        std::array::from_fn(|channel| (seen[channel] / white[channel]).max(0.0))
    }

    /// Returns the colour of a light with this spectrum, with luminance 1.
    pub fn light_color(&self) -> [f64; 3] {
        let seen = color(|wavelength| self.at(wavelength)).map(|component| component.max(0.0));
        let sum = luminance(seen);
        if sum > 0.0 { seen.map(|component| component / sum) } else { [0.0; 3] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_everywhere_is_grey() {
        let grey = Sampled::from_pairs(&[360.0, 0.25, 830.0, 0.25]).unwrap();
        for component in grey.surface_color() {
            assert!((component - 0.25).abs() < 1e-12);
        }
    }

    #[test]
    fn long_waves_are_red() {
        let red = Sampled::from_text("# reddish\n580 0\n620 1 # and on\n830 1\n").unwrap();
        assert_eq!([red.at(600.0), red.at(830.0)], [0.5, 1.0]);
        assert_eq!([red.at(579.0), red.at(831.0)], [0.0, 0.0]);
        let [r, g, b] = red.surface_color();
        assert!(r > 0.75 && g < 0.3 && b < 0.05, "{r} {g} {b}");
    }

    #[test]
    fn wavelengths_rise() {
        assert_eq!(Sampled::from_pairs(&[500.0, 1.0, 400.0, 1.0]), None);
        assert_eq!(Sampled::from_pairs(&[500.0]), None);
        assert_eq!(Sampled::from_pairs(&[]), None);
        assert_eq!(Sampled::from_text("400 x"), None);
    }
}
