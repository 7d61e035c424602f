//! Colour spaces: conversions to linear values with the primaries of Rec. 709.

/// The encoding of a space's values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoding {
    /// Linear.
    Linear,
    /// By the curve of sRGB.
    Srgb,
    /// By a power.
    Gamma(f64),
}

/// A colour space.
#[derive(Clone, Copy, Debug)]
pub struct ColorSpace {
    /// The encoding.
    pub encoding: Encoding,
    /// The rows of the matrix to Rec. 709; `None` if the space has its primaries.
    pub matrix: Option<[[f64; 3]; 3]>,
}

/// From the primaries of ACEScg (AP1, white of ACES adapted to D65).
const FROM_AP1: [[f64; 3]; 3] = [
    [1.705_051, -0.621_792, -0.083_259],
    [-0.130_256, 1.140_805, -0.010_548],
    [-0.024_003, -0.128_969, 1.152_972],
];

/// From those of Adobe RGB (1998).
const FROM_ADOBE: [[f64; 3]; 3] =
    [[1.398_356, -0.398_356, 0.0], [0.0, 1.0, 0.0], [0.0, -0.042_926, 1.042_926]];

/// From those of Display P3.
const FROM_P3: [[f64; 3]; 3] = [
    [1.224_940, -0.224_940, 0.0],
    [-0.042_057, 1.042_057, 0.0],
    [-0.019_638, -0.078_636, 1.098_274],
];

const SPACES: [(&str, ColorSpace); 16] = [
    ("", space(Encoding::Linear, None)),
    ("none", space(Encoding::Linear, None)),
    ("raw", space(Encoding::Linear, None)),
    ("lin_rec709", space(Encoding::Linear, None)),
    ("srgb_texture", space(Encoding::Srgb, None)),
    ("rec709_display", space(Encoding::Gamma(2.4), None)),
    ("g18_rec709", space(Encoding::Gamma(1.8), None)),
    ("g22_rec709", space(Encoding::Gamma(2.2), None)),
    ("gamma22", space(Encoding::Gamma(2.2), None)),
    ("acescg", space(Encoding::Linear, Some(FROM_AP1))),
    ("lin_ap1", space(Encoding::Linear, Some(FROM_AP1))),
    ("g22_ap1", space(Encoding::Gamma(2.2), Some(FROM_AP1))),
    ("lin_adobergb", space(Encoding::Linear, Some(FROM_ADOBE))),
    ("adobergb", space(Encoding::Gamma(563.0 / 256.0), Some(FROM_ADOBE))),
    ("srgb_displayp3", space(Encoding::Srgb, Some(FROM_P3))),
    ("lin_displayp3", space(Encoding::Linear, Some(FROM_P3))),
];

const fn space(encoding: Encoding, matrix: Option<[[f64; 3]; 3]>) -> ColorSpace {
    ColorSpace { encoding, matrix }
}

impl ColorSpace {
    /// Returns the space with this name in documents.
    pub fn named(name: &str) -> Option<ColorSpace> {
        SPACES.iter().find(|(other, _)| *other == name).map(|(_, space)| *space)
    }

    /// Converts the first three components of a colour.
    pub fn convert(self, color: &mut [f64]) {
        for value in color.iter_mut().take(3) {
            *value = match self.encoding {
                Encoding::Linear => *value,
                Encoding::Srgb if *value <= 0.040_45 => *value / 12.92,
                Encoding::Srgb => libm::pow((*value + 0.055) / 1.055, 2.4),
                Encoding::Gamma(gamma) => libm::pow(value.max(0.0), gamma),
            };
        }
        if let (Some(rows), [r, g, b, ..]) = (self.matrix, &mut *color) {
            let old = [*r, *g, *b];
            let dot = |row: [f64; 3]| row[0] * old[0] + row[1] * old[1] + row[2] * old[2];
            [*r, *g, *b] = rows.map(dot);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_stays_white() {
        for (name, space) in SPACES {
            let mut white = [1.0; 3];
            space.convert(&mut white);
            assert!(white.iter().all(|value| (value - 1.0).abs() < 1e-5), "{name}: {white:?}");
        }
    }

    #[test]
    fn grey_of_srgb_is_darker() {
        let mut grey = [0.5, 0.5, 0.5, 0.5];
        ColorSpace::named("srgb_texture").unwrap().convert(&mut grey);
        assert!((grey[0] - 0.214_041).abs() < 1e-5);
        assert_eq!(grey[3], 0.5);
    }
}
