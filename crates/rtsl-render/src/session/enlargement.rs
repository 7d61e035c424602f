//! The enlargement of a picture of fewer pixels: bilinear between pixels that show the same object, so that surfaces
//! are smooth and their outlines sharp, without blocks.

/// A picture, row by row, with the object that each pixel shows.
pub struct Preview {
    pub size: (usize, usize),
    pub pixels: Vec<PreviewPixel>,
}

/// A pixel of a preview.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PreviewPixel {
    /// `0x00RRGGBB`.
    pub color: u32,
    /// The index of the object that the pixel's ray hit first; -1 for none.
    pub object: i32,
}

/// A preview on its way to a size.
pub struct Enlargement {
    preview: Preview,
    /// For each pixel of the preview, true if another object is visible beside it.
    is_edge: Vec<bool>,
    /// Its colours, spread.
    colors: Vec<u64>,
    /// For each column of the result, columns of the preview.
    columns: Vec<Neighbours>,
    /// For each row of the result, rows of the preview.
    rows: Vec<Neighbours>,
}

/// The pixels of the preview, along one axis, that have a part in a pixel of the result.
#[derive(Clone, Copy, Debug)]
struct Neighbours {
    /// The two whose centres are nearest, and the weight of the second, of [`WHOLE`], in colours.
    two: [u32; 2],
    second: u32,
    /// The one that covers the pixel between those beside it, and their weights, of [`WHOLE`], in outlines.
    three: [u32; 3],
    weights: [u32; 3],
}

/// The sum of the weights along one axis. Products of two with a channel's 8 bits fit into [`CHANNEL`] bits.
const WHOLE: u32 = 1 << 6;

/// The distance of the channels of a spread colour, in bits: weighted means are of all channels at once.
const CHANNEL: u32 = 21;

/// The weight in outlines that a pixel of the preview has besides where it covers the result, so that objects of the
/// size of one pixel stay.
const COVERING: u32 = WHOLE * WHOLE / 16;

impl Enlargement {
    /// Enlarges to this size.
    pub fn new(preview: Preview, size: (usize, usize)) -> Self {
        let columns = Neighbours::along(preview.size.0, size.0);
        let rows = Neighbours::along(preview.size.1, size.1);
        let colors = preview.pixels.iter().map(|pixel| spread(pixel.color)).collect();
        Enlargement { is_edge: preview.edges(), colors, preview, columns, rows }
    }

    /// Returns the colour of a pixel of the result.
    pub fn pixel(&self, x: usize, y: usize) -> u32 {
        let (column, row) = (&self.columns[x], &self.rows[y]);
        let width = self.preview.size.0;
        let ([left, right], [upper, lower]) = (column.two, row.two.map(|row| row as usize * width));
        let [left, right] = [left as usize, right as usize];
        let around = [upper + left, upper + right, lower + left, lower + right];
        let (first, above) = (WHOLE - column.second, WHOLE - row.second);
        let weights =
            [first * above, column.second * above, first * row.second, column.second * row.second];
        if self.is_edge[row.three[1] as usize * width + column.three[1] as usize] {
            return self.at_edge(column, row, around, weights);
        }
        let rounding = spread(0x0001_0101) * u64::from(WHOLE * WHOLE / 2);
        let sum = self.weighted(around, weights) + rounding;
        let channel = |index: u32| (sum >> (CHANNEL * index) & SPREAD) as u32 / (WHOLE * WHOLE);
        channel(2) << 16 | channel(1) << 8 | channel(0)
    }

    /// Returns the same where objects meet: the colour of the visible object.
    fn at_edge(
        &self,
        column: &Neighbours,
        row: &Neighbours,
        around: [usize; 4],
        mut weights: [u32; 4],
    ) -> u32 {
        let visible = self.visible(column, row);
        for (weight, place) in weights.iter_mut().zip(around) {
            let is_visible = self.preview.pixels[place].object == visible.object;
            *weight = if is_visible { *weight } else { 0 };
        }
        let total: u32 = weights.iter().sum();
        if total == 0 {
            return visible.color;
        }
        let sum = self.weighted(around, weights);
        let channel = |index: u32| {
            let of_channel = (sum >> (CHANNEL * index) & SPREAD) as u32;
            (of_channel + total / 2) / total
        };
        channel(2) << 16 | channel(1) << 8 | channel(0)
    }

    /// Returns the weighted sum of colours, spread.
    fn weighted(&self, around: [usize; 4], weights: [u32; 4]) -> u64 {
        let weighted = around.into_iter().zip(weights);
        weighted.map(|(place, weight)| self.colors[place] * u64::from(weight)).sum()
    }

    /// Returns the pixel of the preview, of those around a pixel of the result, whose object is visible there: that with
    /// the greatest weight. Quadratic B-splines as weights make outlines smooth.
    fn visible(&self, column: &Neighbours, row: &Neighbours) -> PreviewPixel {
        let mut around = [(PreviewPixel::default(), 0); 9];
        for (place, entry) in around.iter_mut().enumerate() {
            let (x, y) = (place % 3, place / 3);
            let covering = if place == 4 { COVERING } else { 0 };
            let pixel = self.preview.at(column.three[x] as usize, row.three[y] as usize);
            *entry = (pixel, column.weights[x] * row.weights[y] + covering);
        }
        let of_object = |object: i32| {
            let pixels = around.iter().filter(|(pixel, _)| pixel.object == object);
            pixels.map(|(_, weight)| *weight).sum::<u32>()
        };
        let rank = |(pixel, weight): &(PreviewPixel, u32)| (of_object(pixel.object), *weight);
        around.into_iter().max_by_key(rank).map_or(PreviewPixel::default(), |(pixel, _)| pixel)
    }
}

impl Preview {
    fn at(&self, x: usize, y: usize) -> PreviewPixel {
        self.pixels[y * self.size.0 + x]
    }

    /// Returns for each pixel if it, or one of the eight beside it, shows another object than the others.
    fn edges(&self) -> Vec<bool> {
        let (width, height) = self.size;
        let mut edges = Vec::with_capacity(self.pixels.len());
        for y in 0..height {
            for x in 0..width {
                let object = self.at(x, y).object;
                let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
                let columns = x.saturating_sub(1)..=(x + 1).min(width - 1);
                let is_other = |y| columns.clone().any(|x| self.at(x, y).object != object);
                edges.push(rows.into_iter().any(is_other));
            }
        }
        edges
    }
}

/// The bits of a channel of a spread colour.
const SPREAD: u64 = (1 << CHANNEL) - 1;

fn spread(color: u32) -> u64 {
    let channel = |index: u32| u64::from(color >> (8 * index) & 0xFF) << (CHANNEL * index);
    channel(2) | channel(1) | channel(0)
}

impl Neighbours {
    /// Returns those of each of `to` pixels that cover the same line as `from`. Beyond the outer pixels, these continue.
    fn along(from: usize, to: usize) -> Vec<Neighbours> {
        let last = from - 1;
        let fixed = |weight: f64| (weight * f64::from(WHOLE)).round() as u32;
        let neighbours = |index: usize| {
            let place = (index as f64 + 0.5) * from as f64 / to as f64;
            let centre = (place - 0.5).clamp(0.0, last as f64);
            let (first, covering) = (centre as usize, last.min(place as usize));
            // From the centre of the pixel that covers it.
            let offset = place - covering as f64 - 0.5;
            let beside = [0.5 - offset, 0.5 + offset].map(|it| fixed(0.5 * it * it));
            Neighbours {
                two: [first, last.min(first + 1)].map(|it| it as u32),
                second: fixed(centre - first as f64),
                three: [covering.saturating_sub(1), covering, last.min(covering + 1)]
                    .map(|it| it as u32),
                weights: [beside[0], WHOLE - beside[0] - beside[1], beside[1]],
            }
        };
        (0..to).map(neighbours).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn enlarged(preview: Preview, size: (usize, usize)) -> Vec<u32> {
        let enlargement = Enlargement::new(preview, size);
        let places = (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y)));
        places.map(|(x, y)| enlargement.pixel(x, y)).collect()
    }

    fn grey(level: u32) -> u32 {
        level << 16 | level << 8 | level
    }

    /// Eight columns of two rows: a dark object with a gradient at the left, a bright one at the right.
    fn two_objects() -> Preview {
        let row = (0..8).map(|x| match x {
            0..5 => PreviewPixel { color: grey(8 * x), object: 3 },
            _ => PreviewPixel { color: grey(200), object: 7 },
        });
        Preview { size: (8, 2), pixels: row.clone().chain(row).collect() }
    }

    #[test]
    fn edges_between_objects_are_sharp_and_surfaces_are_smooth() {
        for factor in 1..=4 {
            let width = 8 * factor;
            let pixels = enlarged(two_objects(), (width, 2 * factor));
            let (left, right) = pixels[..width].split_at(5 * factor);
            assert_eq!(right, vec![grey(200); 3 * factor], "no dark pixel at the edge");
            for (x, pixel) in left.iter().enumerate() {
                let center = (x as f64 + 0.5) / factor as f64 - 0.5;
                let expected = 8.0 * center.clamp(0.0, 4.0);
                let level = f64::from(pixel & 0xFF);
                assert!((level - expected).abs() <= 0.55, "{factor}, {x}: {level}, {expected}");
            }
            assert_eq!(pixels[..width], pixels[pixels.len() - width..], "rows are alike");
        }
    }

    #[test]
    fn an_object_of_one_pixel_keeps_its_place() {
        let mut pixels = vec![PreviewPixel { color: grey(10), object: 0 }; 9];
        pixels[4] = PreviewPixel { color: grey(250), object: 1 };
        let enlarged = enlarged(Preview { size: (3, 3), pixels }, (6, 6));
        let bright: Vec<usize> = (0..36).filter(|place| enlarged[*place] == grey(250)).collect();
        assert_eq!(bright, [14, 15, 20, 21]);
        assert!(enlarged.iter().all(|pixel| [grey(10), grey(250)].contains(pixel)));
    }

    #[test]
    fn outlines_are_smooth_at_a_quarter_of_the_resolution() {
        // Below the diagonal is another object.
        let pixel = |place: usize| match place / 8 > place % 8 {
            true => PreviewPixel { color: grey(200), object: 2 },
            false => PreviewPixel { color: grey(100), object: 1 },
        };
        let preview = Preview { size: (8, 8), pixels: (0..64).map(pixel).collect() };
        let enlarged = enlarged(preview, (32, 32));
        let ends: Vec<usize> = (8..24)
            .map(|y| enlarged[32 * y..][..32].iter().position(|it| *it == grey(100)).unwrap())
            .collect();
        assert!(ends.windows(2).all(|rows| rows[1] - rows[0] <= 2), "{ends:?}");
        assert!(enlarged.iter().all(|pixel| [grey(100), grey(200)].contains(pixel)));
    }

    #[test]
    fn any_size_is_filled() {
        let pixels = vec![PreviewPixel { color: 0x00FF_8001, object: -1 }; 15];
        for size in [(1, 1), (2, 7), (13, 4), (50, 50)] {
            let preview = Preview { size: (5, 3), pixels: pixels.clone() };
            assert_eq!(enlarged(preview, size), vec![0x00FF_8001; size.0 * size.1]);
        }
    }
}
