//! Named spectra of the format.

/// The numbers of a named spectrum: three for a colour, one if it hardly depends on the wavelength.
pub fn named(name: &str) -> Option<&'static [f64]> {
    NAMED.iter().find(|(known, _)| *known == name).map(|(_, numbers)| *numbers)
}

/// The names.
pub fn names() -> impl Iterator<Item = &'static str> {
    NAMED.iter().map(|(name, _)| *name)
}

/// Metals: measured indices (SOPRA N&K database; brass, magnesium oxide and titanium dioxide from
/// refractiveindex.info), as pbrt-v4's tables have them (`src/pbrt/util/spectrum.cpp`). Refractive indices are the
/// spectra converted with the CIE 1931 observer. Extinction coefficients are chosen so that the reflectance at normal
/// incidence has the colour of the reflectance spectrum under D65, limited in each channel by the greatest reflectance
/// of any wavelength: converting eta and k independently makes the blue of gold and copper too dark by 5 %. Gold, whose
/// red is 1.022 because its colour is outside of the gamut, has the greatest red that is not brighter than white.
/// Glasses: Schott's indices at the d line, 587.6 nm. The format's names F5, F10 and F11 mean SF5, SF10 and SF11.
/// Lights: the spectra of the same tables, converted with the CIE 1931 observer to colours of luminance 1.
const NAMED: &[(&str, &[f64])] = &[
    ("metal-Ag-eta", &[0.1288, 0.1232, 0.1522]),
    ("metal-Ag-k", &[4.0816, 3.3279, 2.4211]),
    ("metal-Al-eta", &[1.3690, 0.9325, 0.5728]),
    ("metal-Al-k", &[7.5859, 6.6145, 5.2701]),
    ("metal-Au-eta", &[0.1217, 0.3929, 1.5871]),
    ("metal-Au-k", &[31.180, 2.3069, 1.7240]),
    ("metal-Cu-eta", &[0.1695, 0.9710, 1.2128]),
    ("metal-Cu-k", &[3.6194, 2.6204, 2.3673]),
    ("metal-CuZn-eta", &[0.4328, 0.5141, 1.1461]),
    ("metal-CuZn-k", &[4.0418, 2.6505, 1.8261]),
    ("metal-MgO-eta", &[1.7344, 1.7408, 1.7540]),
    ("metal-MgO-k", &[0.0, 0.0, 0.0]),
    ("metal-TiO2-eta", &[2.8698, 2.9540, 3.1949]),
    ("metal-TiO2-k", &[0.0, 0.0, 0.0]),
    ("glass-BK7", &[1.5168]),
    ("glass-BAF10", &[1.6700]),
    ("glass-FK51A", &[1.4866]),
    ("glass-LASF9", &[1.8503]),
    ("glass-F5", &[1.6727]),
    ("glass-F10", &[1.7283]),
    ("glass-F11", &[1.7847]),
    ("glass-SF5", &[1.6727]),
    ("glass-SF10", &[1.7283]),
    ("glass-SF11", &[1.7847]),
    ("stdillum-D65", &[1.0, 1.0, 1.0]),
    ("stdillum-A", &[1.8452, 0.8261, 0.2334]),
    ("stdillum-D50", &[1.0866, 0.9995, 0.7497]),
    ("illum-acesD60", &[1.0469, 0.9946, 0.9155]),
    ("stdillum-F1", &[0.9543, 1.0193, 0.9437]),
    ("stdillum-F2", &[1.3401, 0.9430, 0.5629]),
    ("stdillum-F3", &[1.5765, 0.8911, 0.3809]),
    ("stdillum-F4", &[1.8064, 0.8343, 0.2671]),
    ("stdillum-F5", &[0.9154, 1.0362, 0.8903]),
    ("stdillum-F6", &[1.3161, 0.9579, 0.4865]),
    ("stdillum-F7", &[1.0003, 1.0002, 0.9974]),
    ("stdillum-F8", &[1.1767, 0.9757, 0.7201]),
    ("stdillum-F9", &[1.3769, 0.9314, 0.5694]),
    ("stdillum-F10", &[1.1776, 0.9756, 0.7184]),
    ("stdillum-F11", &[1.4122, 0.9248, 0.5316]),
    ("stdillum-F12", &[1.7686, 0.8451, 0.2709]),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// The references are the CIE's chromaticities of the illuminants (CIE 15, 2004).
    #[test]
    fn lights_have_the_chromaticities_of_their_illuminants() {
        for (name, expected) in [
            ("stdillum-A", [0.4476, 0.4074]),
            ("stdillum-D65", [0.3127, 0.3290]),
            ("stdillum-F2", [0.3721, 0.3751]),
            ("stdillum-F7", [0.3129, 0.3292]),
            ("stdillum-F11", [0.3805, 0.3769]),
            ("illum-acesD60", [0.3217, 0.3377]),
        ] {
            let Some(&[red, green, blue]) = named(name) else { panic!("{name}") };
            assert!((0.2126 * red + 0.7152 * green + 0.0722 * blue - 1.0).abs() < 1e-3, "{name}");
            let x = 0.4124 * red + 0.3576 * green + 0.1805 * blue;
            let sum = x + 1.0 + 0.0193 * red + 0.1192 * green + 0.9505 * blue;
            for (found, expected) in [x / sum, 1.0 / sum].into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-3, "{name}: {found} for {expected}");
            }
        }
        for lamp in 1..=12 {
            assert!(named(&format!("stdillum-F{lamp}")).is_some(), "{lamp}");
        }
    }

    /// The reflectance at normal incidence.
    fn reflectance(metal: &str) -> Vec<f64> {
        let numbers = |of: &str| named(&format!("metal-{metal}-{of}")).expect("it has a name");
        let each = numbers("eta").iter().zip(numbers("k"));
        let square = |x: f64| x * x;
        let part = |(eta, k): (&f64, &f64)| {
            (square(eta - 1.0) + square(*k)) / (square(eta + 1.0) + square(*k))
        };
        each.map(part).collect()
    }

    /// The reference is the spectral reflectance, integrated with the observer under D65 in double precision; for the
    /// red of gold, which would be 1.022, nearly 1.
    #[test]
    fn metals_have_the_colours_of_their_spectra() {
        for (metal, expected) in [
            ("Ag", [0.9713, 0.9601, 0.9153]),
            ("Al", [0.9133, 0.9215, 0.9243]),
            ("Au", [0.9995, 0.7836, 0.3432]),
            ("Cu", [0.9531, 0.6387, 0.5380]),
            ("CuZn", [0.9059, 0.7793, 0.4227]),
            ("MgO", [0.0721, 0.0731, 0.0749]),
            ("TiO2", [0.2324, 0.2445, 0.2727]),
        ] {
            for (found, expected) in reflectance(metal).iter().zip(expected) {
                assert!((found - expected).abs() < 0.01 * expected, "{metal}: {found}");
            }
        }
    }
}
