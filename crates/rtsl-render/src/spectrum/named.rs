//! Spectra that the format knows by name.

/// The numbers of a named spectrum: three for a colour, one where it hardly depends on the
/// wavelength.
pub fn named(name: &str) -> Option<&'static [f64]> {
    NAMED.iter().find(|(known, _)| *known == name).map(|(_, numbers)| *numbers)
}

/// The names.
pub fn names() -> impl Iterator<Item = &'static str> {
    NAMED.iter().map(|(name, _)| *name)
}

/// Metals: measured indices and extinctions of the SOPRA database, as seen through the CIE 1931 observer; brass
/// at 650, 550 and 450 nm (refractiveindex.info). Glasses: Schott's indices at the d line, 587.6 nm.
const NAMED: &[(&str, &[f64])] = &[
    ("metal-Ag-eta", &[0.1553, 0.1167, 0.1384]),
    ("metal-Ag-k", &[4.8283, 3.1222, 2.1471]),
    ("metal-Al-eta", &[1.6575, 0.8804, 0.5212]),
    ("metal-Al-k", &[9.2239, 6.2695, 4.8370]),
    ("metal-Au-eta", &[0.1431, 0.3750, 1.4425]),
    ("metal-Au-k", &[3.9832, 2.3857, 1.6032]),
    ("metal-Cu-eta", &[0.2004, 0.9240, 1.1022]),
    ("metal-Cu-k", &[3.9129, 2.4528, 2.1422]),
    ("metal-CuZn-eta", &[0.4440, 0.5270, 1.0940]),
    ("metal-CuZn-k", &[3.6950, 2.7650, 1.8290]),
    ("glass-BK7", &[1.5168]),
    ("glass-BAF10", &[1.6700]),
    ("glass-FK51A", &[1.4866]),
    ("glass-LASF9", &[1.8503]),
    ("glass-F5", &[1.6034]),
    ("glass-SF5", &[1.6727]),
    ("glass-SF10", &[1.7283]),
    ("glass-SF11", &[1.7847]),
    ("stdillum-D65", &[1.0, 1.0, 1.0]),
];
