//! The order in which a pass takes the tiles of an image.

/// A permutation of the rows of tiles that distributes them over the image's height: any number of rows is
/// representative of the whole, so that the remaining time can be estimated. Within a row tiles are consecutive,
/// because neighbours share cached parts of the scene.
#[derive(Clone, Copy, Debug)]
pub struct TileOrder {
    columns: usize,
    rows: usize,
    /// The distance between successive rows; coprime to the number of rows.
    step: usize,
}

impl TileOrder {
    /// For `tiles` tiles in rows of `columns`.
    pub fn new(tiles: usize, columns: usize) -> Self {
        let columns = columns.max(1);
        let rows = tiles.div_ceil(columns).max(1);
        TileOrder { columns, rows, step: step(rows) }
    }

    /// Returns the tile at a position in the order.
    pub fn tile(&self, index: usize) -> usize {
        let (turn, column) = (index / self.columns, index % self.columns);
        turn * self.step % self.rows * self.columns + column
    }
}

/// The golden ratio gives the most even distribution.
fn step(rows: usize) -> usize {
    let golden = (rows * 377 / 610).max(1);
    (golden..rows).find(|step| greatest_divisor(*step, rows) == 1).unwrap_or(1)
}

/// The greatest common divisor.
fn greatest_divisor(one: usize, other: usize) -> usize {
    if other == 0 { one } else { greatest_divisor(other, one % other) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tile_has_its_turn() {
        for (columns, rows) in [(1, 1), (3, 1), (5, 2), (2, 7), (64, 64), (125, 125), (16, 90)] {
            let order = TileOrder::new(columns * rows, columns);
            let mut tiles: Vec<usize> =
                (0..columns * rows).map(|index| order.tile(index)).collect();
            tiles.sort_unstable();
            assert!(tiles.into_iter().eq(0..columns * rows), "{columns} by {rows}");
        }
    }

    #[test]
    fn a_tenth_is_like_the_whole() {
        let (columns, rows) = (125, 125);
        let order = TileOrder::new(columns * rows, columns);
        let mut in_quarter = [0; 4];
        let tenth = columns * rows / 10;
        for index in 0..tenth {
            in_quarter[order.tile(index) / columns * 4 / rows] += 1;
        }
        let share = tenth / 4;
        let off_by = in_quarter.map(|count: usize| count.abs_diff(share));
        assert!(off_by.iter().all(|off| *off <= columns), "{in_quarter:?}");
    }
}
