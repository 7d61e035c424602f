//! Colour spaces of the format, and the conversion of their colours to linear sRGB.

/// A linear colour space.
#[derive(Debug, PartialEq)]
pub struct ColorSpace {
    /// Its name in the format.
    pub name: &'static str,
    /// The chromaticities of red, green and blue.
    primaries: [[f64; 2]; 3],
    /// The chromaticity of white.
    white: [f64; 2],
}

const D65: [f64; 2] = [0.3127, 0.3290];

const SPACES: [ColorSpace; 4] = [
    ColorSpace { name: "srgb", primaries: [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06]], white: D65 },
    ColorSpace {
        name: "dci-p3",
        primaries: [[0.68, 0.32], [0.265, 0.69], [0.15, 0.06]],
        white: D65,
    },
    ColorSpace {
        name: "rec2020",
        primaries: [[0.708, 0.292], [0.17, 0.797], [0.131, 0.046]],
        white: D65,
    },
    ColorSpace {
        name: "aces2065-1",
        primaries: [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077]],
        white: [0.32168, 0.33767],
    },
];

impl ColorSpace {
    /// The space of sRGB's primaries.
    pub const SRGB: &'static ColorSpace = &SPACES[0];

    /// Returns the space with this name, in letters of either case.
    pub fn named(name: &str) -> Option<&'static ColorSpace> {
        static ALL: [ColorSpace; 4] = SPACES;
        ALL.iter().find(|space| space.name.eq_ignore_ascii_case(name))
    }

    /// Returns the names of all spaces.
    pub fn names() -> impl Iterator<Item = &'static str> {
        SPACES.into_iter().map(|space| space.name)
    }

    /// True if it is sRGB's.
    pub fn is_srgb(&self) -> bool {
        self.name == Self::SRGB.name
    }

    /// Converts the colour of a light to linear sRGB. A colour beyond its gamut has negative components.
    pub fn light_to_srgb(&self, color: [f64; 3]) -> [f64; 3] {
        if self.is_srgb() {
            return color;
        }
        transformed(&inverse(&Self::SRGB.to_xyz()), transformed(&self.to_xyz(), color))
    }

    /// Converts the colour of a surface to linear sRGB: equal components, which are the same reflectance at all
    /// wavelengths, stay equal whatever the space's white is.
    pub fn surface_to_srgb(&self, color: [f64; 3]) -> [f64; 3] {
        if self.is_srgb() {
            return color;
        }
        let (seen, white) = (self.light_to_srgb(color), self.light_to_srgb([1.0; 3]));
        std::array::from_fn(|channel| seen[channel] / white[channel])
    }

    /// The matrix from the space's colours to CIE tristimulus values, row by row; white has luminance 1.
    pub fn to_xyz(&self) -> Matrix {
        let columns = self.primaries.map(tristimulus);
        let matrix = std::array::from_fn(|row| columns.map(|column| column[row]));
        let scales = transformed(&inverse(&matrix), tristimulus(self.white));
        matrix.map(|row: [f64; 3]| std::array::from_fn(|column| row[column] * scales[column]))
    }
}

/// A matrix, row by row.
pub type Matrix = [[f64; 3]; 3];

/// Returns the tristimulus values of a chromaticity, with luminance 1.
pub fn tristimulus([x, y]: [f64; 2]) -> [f64; 3] {
    [x / y, 1.0, (1.0 - x - y) / y]
}

/// Returns the product of a matrix and a vector.
pub fn transformed(matrix: &Matrix, vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2])
}

/// Returns the product of two matrices.
pub fn multiplied(first: &Matrix, second: &Matrix) -> Matrix {
    let columns: Matrix =
        std::array::from_fn(|column| transformed(first, second.map(|row| row[column])));
    std::array::from_fn(|row| columns.map(|column| column[row]))
}

/// Returns the inverse of a matrix that has one.
pub fn inverse(m: &Matrix) -> Matrix {
    let cofactor = |row: usize, column: usize| {
        let (r, c) = ([(row + 1) % 3, (row + 2) % 3], [(column + 1) % 3, (column + 2) % 3]);
        m[r[0]][c[0]] * m[r[1]][c[1]] - m[r[0]][c[1]] * m[r[1]][c[0]]
    };
    let determinant: f64 = (0..3).map(|column| m[0][column] * cofactor(0, column)).sum();
    std::array::from_fn(|row| std::array::from_fn(|column| cofactor(column, row) / determinant))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(found: [f64; 3], expected: [f64; 3]) {
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 2e-3, "{found} for {expected}");
        }
    }

    /// The references are the matrices of BT.2087 and of the ACES documentation, rounded.
    #[test]
    fn primaries_of_other_spaces_are_converted() {
        let space = |name: &str| ColorSpace::named(name).unwrap();
        assert_near(space("rec2020").light_to_srgb([1.0, 0.0, 0.0]), [1.6605, -0.1246, -0.0182]);
        assert_near(space("REC2020").light_to_srgb([1.0; 3]), [1.0; 3]);
        assert_near(space("dci-p3").light_to_srgb([0.0, 1.0, 0.0]), [-0.2249, 1.0421, -0.0786]);
        assert_eq!(space("srgb").light_to_srgb([0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
        assert!(ColorSpace::named("adobe").is_none());
    }

    #[test]
    fn the_white_of_aces_is_warm_as_light_and_grey_as_a_surface() {
        let aces = ColorSpace::named("aces2065-1").unwrap();
        let [red, green, blue] = aces.light_to_srgb([1.0; 3]);
        assert!(red > 1.03 && (green - 1.0).abs() < 0.02 && blue < 0.95, "{red} {green} {blue}");
        assert_near(aces.surface_to_srgb([0.25; 3]), [0.25; 3]);
    }
}
