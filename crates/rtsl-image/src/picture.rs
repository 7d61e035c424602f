//! Images that scenes refer to: linear texels, mipmaps for textures, cumulative sums for environment lights.

use rtsl_memory::{Amount, OutOfMemory, OverBudget};

/// The greatest number of texels, independent of the available memory.
const MAX_TEXELS: usize = 1 << 26;

/// The greatest memory of a texel of an environment map until it is converted to the arguments of a class: 16 bytes,
/// and 12 for the colour and 4 for sums, which exist twice while they are copied.
const SKY_TEXEL: Amount = Amount(16 + 2 * (12 + 4));

/// An image in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear red, green and blue, and the texel's value as a scalar: its opacity, or the mean of the three if the
    /// picture is opaque. Rows from the top.
    pub texels: Vec<[f32; 4]>,
}

/// An error of reading an image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PictureError {
    /// The file is not an image, or is damaged. The text is a clause, to be preceded by the name of the file.
    Malformed(String),
    /// The image would take too much memory.
    OverBudget(OverBudget),
}

impl From<String> for PictureError {
    fn from(problem: String) -> Self {
        PictureError::Malformed(problem)
    }
}

impl From<&str> for PictureError {
    fn from(problem: &str) -> Self {
        PictureError::Malformed(problem.to_owned())
    }
}

impl From<OverBudget> for PictureError {
    fn from(error: OverBudget) -> Self {
        PictureError::OverBudget(error)
    }
}

impl From<OutOfMemory> for PictureError {
    fn from(error: OutOfMemory) -> Self {
        PictureError::Malformed(error.to_string())
    }
}

impl From<exr::error::Error> for PictureError {
    fn from(error: exr::error::Error) -> Self {
        PictureError::Malformed(error.to_string())
    }
}

impl From<png::DecodingError> for PictureError {
    fn from(error: png::DecodingError) -> Self {
        PictureError::Malformed(error.to_string())
    }
}

impl Picture {
    /// Returns the greatest memory of a picture until it is converted to the arguments of a class.
    pub fn memory(width: usize, height: usize) -> Amount {
        // For a texture all levels, which exist twice while they are copied.
        let area = |(width, height): (usize, usize)| width.saturating_mul(height);
        let texels = level_sizes(width, height).map(area).fold(0, usize::saturating_add);
        let texture = Amount::of::<[f32; 4]>(texels).times(2);
        texture.max(SKY_TEXEL.times(area((width, height))))
    }

    /// Returns the texels of the mipmap: this picture and its levels down to one texel, one after the other, each half
    /// the size of the previous one, rounded down.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn levels(self) -> Result<Vec<[f32; 4]>, OutOfMemory> {
        let Picture { mut width, mut height, mut texels } = self;
        // Square levels take a third more than the picture, levels of a single row or column as much again.
        let all = level_sizes(width, height).map(|(width, height)| width * height).sum::<usize>();
        texels
            .try_reserve_exact(all - texels.len())
            .map_err(|_| OutOfMemory(Amount::of::<[f32; 4]>(all)))?;
        let mut start = 0;
        for (columns, rows) in level_sizes(width, height).skip(1) {
            let level = Level { start, width, height };
            for place in 0..columns * rows {
                let texel =
                    level.mean(&texels, (place / columns, rows), (place % columns, columns));
                texels.push(texel);
            }
            start += width * height;
            (width, height) = (columns, rows);
        }
        Ok(texels)
    }
}

/// The sizes of the levels of a mipmap.
fn level_sizes(width: usize, height: usize) -> impl Iterator<Item = (usize, usize)> {
    let smaller = |(width, height): &(usize, usize)| {
        (width.max(height) > &1).then(|| ((width / 2).max(1), (height / 2).max(1)))
    };
    std::iter::successors(Some((width, height)), smaller)
}

/// A level of a mipmap.
struct Level {
    start: usize,
    width: usize,
    height: usize,
}

impl Level {
    /// The mean of the texels in one cell of a grid over the level.
    fn mean(
        &self,
        texels: &[[f32; 4]],
        (row, of_rows): (usize, usize),
        (column, of_columns): (usize, usize),
    ) -> [f32; 4] {
        let part =
            |place: usize, count: usize, of: usize| place * of / count..(place + 1) * of / count;
        let (rows, columns) =
            (part(row, of_rows, self.height), part(column, of_columns, self.width));
        let count = (rows.len() * columns.len()) as f32;
        let mut sum = [0.0; 4];
        for row in rows {
            for texel in &texels[self.start + row * self.width..][columns.clone()] {
                for (sum, value) in sum.iter_mut().zip(texel) {
                    *sum += value;
                }
            }
        }
        sum.map(|sum| sum / count)
    }
}

impl Picture {
    /// Returns cumulative distributions of an environment map's light: one over the rows, and one over the columns of
    /// each row, each ending with 1. `row_weight` is the solid angle of a row's texels, to any scale.
    pub fn sums(&self, row_weight: impl Fn(usize) -> f64) -> (Vec<f32>, Vec<f32>) {
        let luminance = |texel: &[f32; 4]| {
            let [red, green, blue, _] = texel.map(f64::from);
            (0.2126 * red + 0.7152 * green + 0.0722 * blue).max(0.0)
        };
        let brightness: Vec<f64> = self.texels.iter().map(luminance).collect();
        let mut columns = Vec::with_capacity((self.width + 1) * self.height);
        let mut totals = Vec::with_capacity(self.height);
        for (row, line) in brightness.chunks(self.width).enumerate() {
            columns.extend(running(line));
            totals.push(line.iter().sum::<f64>() * row_weight(row));
        }
        (running(&totals), columns)
    }
}

/// The fractions of the sum before each number, and 1. If all are 0 they are weighted equally.
fn running(numbers: &[f64]) -> Vec<f32> {
    let total: f64 = numbers.iter().sum();
    let mut sum = 0.0;
    let mut parts = vec![0.0];
    for (index, number) in numbers.iter().enumerate() {
        sum += number;
        let part =
            if total > 0.0 { sum / total } else { (index + 1) as f64 / numbers.len() as f64 };
        parts.push(part.min(1.0) as f32);
    }
    if let Some(last) = parts.last_mut() {
        *last = 1.0;
    }
    parts
}

/// Checks that a picture has texels, and not too many.
pub fn check_size(width: usize, height: usize) -> Result<(), String> {
    match width.checked_mul(height) {
        Some(1..=MAX_TEXELS) => Ok(()),
        Some(_) | None => Err(format!("it has {width} x {height} texels, at most 2^26 are read")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: usize, height: usize) -> Picture {
        let texels = (0..width * height).map(|index| [index as f32, 1.0, 2.0, 1.0]).collect();
        Picture { width, height, texels }
    }

    #[test]
    fn levels_end_with_the_mean() {
        assert!(level_sizes(8, 4).eq([(8, 4), (4, 2), (2, 1), (1, 1)]));
        assert!(level_sizes(5, 3).eq([(5, 3), (2, 1), (1, 1)]));
        let levels = picture(8, 4).levels().unwrap();
        assert_eq!((levels.len(), levels[32][0], levels[40][0]), (43, 4.5, 13.5));
        assert_eq!(levels[42], [15.5, 1.0, 2.0, 1.0]);
        assert_eq!(picture(6, 4).levels().unwrap().last().map(|it| it[0]), Some(11.5));
        assert_eq!(picture(1, 1).levels().unwrap().len(), 1);
    }

    #[test]
    fn sums_rise_to_one() {
        let (rows, columns) = picture(3, 2).sums(|_| 1.0);
        assert_eq!((rows.len(), columns.len()), (3, 8));
        assert!(
            rows.is_sorted() && columns[..4].is_sorted() && rows[2] == 1.0 && columns[3] == 1.0
        );
        let dark = Picture { texels: vec![[0.0; 4]; 4], width: 2, height: 2 };
        assert_eq!(dark.sums(|_| 1.0).0, [0.0, 0.5, 1.0]);
    }
}
