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

/// From those of ACES2065-1 (AP0, white of ACES adapted to D65).
const FROM_AP0: [[f64; 3]; 3] = [
    [2.521_686, -1.134_131, -0.387_555],
    [-0.276_480, 1.372_719, -0.096_239],
    [-0.015_378, -0.152_975, 1.168_353],
];

/// From those of Rec. 2020.
const FROM_2020: [[f64; 3]; 3] = [
    [1.660_491, -0.587_641, -0.072_850],
    [-0.124_550, 1.132_900, -0.008_350],
    [-0.018_151, -0.100_579, 1.118_730],
];

/// The gamma of Adobe RGB (1998).
const ADOBE_GAMMA: f64 = 563.0 / 256.0;

/// The spaces by the names of MaterialX, of the Color Interop Forum, and of the configurations of ACES and of programs,
/// spelled as [`spelled`] does.
const SPACES: [(&[&str], ColorSpace); 16] = [
    (
        &["", "none", "raw", "data", "unknown", "utility_raw", "non_color"],
        space(Encoding::Linear, None),
    ),
    (
        &[
            "lin_rec709",
            "lin_rec709_scene",
            "lin_srgb",
            "linear",
            "linear_srgb",
            "linear_rec_709",
            "linear_rec_709_srgb",
            "scene_linear",
            "scene_linear_rec_709_srgb",
            "utility_linear_rec_709",
            "utility_linear_srgb",
        ],
        space(Encoding::Linear, None),
    ),
    (
        &[
            "srgb_texture",
            "srgb",
            "srgb_tx",
            "srgb_rec709_scene",
            "srgb_encoded_rec_709_srgb",
            "utility_srgb_texture",
            "input_generic_srgb_texture",
        ],
        space(Encoding::Srgb, None),
    ),
    (&["rec709_display"], space(Encoding::Gamma(2.4), None)),
    (&["g18_rec709", "g18_rec709_scene"], space(Encoding::Gamma(1.8), None)),
    (&["g22_rec709", "g22_rec709_scene", "gamma22"], space(Encoding::Gamma(2.2), None)),
    (
        &["acescg", "lin_ap1", "lin_ap1_scene", "aces_acescg"],
        space(Encoding::Linear, Some(FROM_AP1)),
    ),
    (&["g22_ap1", "g22_ap1_scene"], space(Encoding::Gamma(2.2), Some(FROM_AP1))),
    (&["srgb_ap1", "srgb_ap1_scene"], space(Encoding::Srgb, Some(FROM_AP1))),
    (
        &["lin_ap0", "lin_ap0_scene", "aces2065_1", "aces_aces2065_1"],
        space(Encoding::Linear, Some(FROM_AP0)),
    ),
    (
        &["lin_rec2020", "lin_rec2020_scene", "linear_rec_2020"],
        space(Encoding::Linear, Some(FROM_2020)),
    ),
    (&["lin_adobergb", "lin_adobergb_scene"], space(Encoding::Linear, Some(FROM_ADOBE))),
    (&["adobergb", "g22_adobergb_scene"], space(Encoding::Gamma(ADOBE_GAMMA), Some(FROM_ADOBE))),
    (&["srgb_displayp3", "srgb_p3d65_scene"], space(Encoding::Srgb, Some(FROM_P3))),
    (
        &["lin_displayp3", "lin_p3d65_scene", "linear_p3_d65"],
        space(Encoding::Linear, Some(FROM_P3)),
    ),
    (&["g22_p3d65_scene"], space(Encoding::Gamma(2.2), Some(FROM_P3))),
];

/// A name in lower case, with one `_` for all other signs between words.
fn spelled(name: &str) -> String {
    let name = name.to_ascii_lowercase();
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric());
    words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join("_")
}

const fn space(encoding: Encoding, matrix: Option<[[f64; 3]; 3]>) -> ColorSpace {
    ColorSpace { encoding, matrix }
}

impl ColorSpace {
    /// Returns the space with this name in documents.
    pub fn named(name: &str) -> Option<ColorSpace> {
        let name = spelled(name);
        let found = SPACES.iter().find(|(names, _)| names.contains(&name.as_str()));
        found.map(|(_, space)| *space)
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
        for (names, space) in SPACES {
            let mut white = [1.0; 3];
            space.convert(&mut white);
            assert!(white.iter().all(|value| (value - 1.0).abs() < 1e-5), "{names:?}: {white:?}");
        }
    }

    #[test]
    fn names_are_found_in_all_spellings() {
        for name in ["sRGB", "Utility - sRGB - Texture", "srgb_texture", "sRGB_tx"] {
            assert_eq!(ColorSpace::named(name).unwrap().encoding, Encoding::Srgb, "{name}");
        }
        for name in ["ACES - ACEScg", "acescg", "lin_ap1_scene"] {
            assert_eq!(ColorSpace::named(name).unwrap().matrix, Some(FROM_AP1), "{name}");
        }
        assert!(ColorSpace::named("mine").is_none());
        let all: Vec<&str> = SPACES.iter().flat_map(|(names, _)| names.iter().copied()).collect();
        assert!(all.iter().all(|name| spelled(name) == *name));
    }

    #[test]
    fn grey_of_srgb_is_darker() {
        let mut grey = [0.5, 0.5, 0.5, 0.5];
        ColorSpace::named("srgb_texture").unwrap().convert(&mut grey);
        assert!((grey[0] - 0.214_041).abs() < 1e-5);
        assert_eq!(grey[3], 0.5);
    }
}
