//! The lanes of a batch for which lights of one class are sampled.

use crate::integrate::rows::BATCH_LANES;

/// Some lanes of a batch, in ascending order.
#[derive(Default)]
pub struct LitLanes {
    /// The lanes; the last is repeated up to a multiple of eight.
    lanes: Vec<u32>,
    /// Their number without the repetitions.
    count: usize,
}

impl LitLanes {
    /// Selects those of the first `count` lanes for which `is_lit` holds.
    pub fn select(&mut self, count: usize, is_lit: impl Fn(u32) -> bool) {
        self.lanes.clear();
        self.lanes.extend((0..count as u32).filter(|lane| is_lit(*lane)));
        self.count = self.lanes.len();
        if let Some(last) = self.lanes.last() {
            self.lanes.resize(self.count.next_multiple_of(8), *last);
        }
    }

    /// Returns the number of lanes.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Iterates over the lanes, with the last repeated up to a multiple of eight.
    pub fn padded(&self) -> impl Iterator<Item = usize> {
        self.lanes.iter().map(|lane| *lane as usize)
    }

    /// Gathers the lanes' elements, with the last repeated up to a multiple of eight.
    pub fn gather<T: Copy>(&self, from: &[T; BATCH_LANES], to: &mut [T; BATCH_LANES]) {
        if self.are_first() && self.count > 0 {
            to[..self.count].copy_from_slice(&from[..self.count]);
            to[self.count..self.lanes.len()].fill(from[self.count - 1]);
            return;
        }
        for (to, lane) in to.iter_mut().zip(self.padded()) {
            *to = from[lane];
        }
    }

    /// Scatters results to the lanes.
    pub fn scatter<T: Copy>(&self, from: &[T; BATCH_LANES], to: &mut [T; BATCH_LANES]) {
        if self.are_first() {
            to[..self.count].copy_from_slice(&from[..self.count]);
            return;
        }
        for (from, lane) in from.iter().zip(self.padded().take(self.count)) {
            to[lane] = *from;
        }
    }

    /// True if they are consecutive from the first lane on, as in scenes whose lights have one class: they are then
    /// copied in one piece.
    fn are_first(&self) -> bool {
        self.lanes.last().is_none_or(|last| *last as usize + 1 == self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gathers numbers that are ten times the lane, adds 1 and scatters them back.
    fn moved(count: usize, is_lit: impl Fn(u32) -> bool) -> (Vec<u32>, Vec<u32>) {
        let mut lanes = LitLanes::default();
        lanes.select(count, is_lit);
        let mut all = std::array::from_fn(|lane| 10 * lane as u32);
        let mut some = [0; BATCH_LANES];
        lanes.gather(&all, &mut some);
        let gathered = some[..lanes.count().next_multiple_of(8)].to_vec();
        lanes.scatter(&some.map(|it| it + 1), &mut all);
        (gathered, all[..9].to_vec())
    }

    #[test]
    fn what_lanes_have_is_taken_and_given_back() {
        let (gathered, all) = moved(8, |lane| lane < 4 || lane == 7);
        assert_eq!(gathered, [0, 10, 20, 30, 70, 70, 70, 70]);
        assert_eq!(all, [1, 11, 21, 31, 40, 50, 60, 71, 80]);
        let (gathered, all) = moved(5, |_| true);
        assert_eq!(gathered, [0, 10, 20, 30, 40, 40, 40, 40]);
        assert_eq!(all, [1, 11, 21, 31, 41, 50, 60, 70, 80]);
        assert!(moved(8, |_| false).0.is_empty());
    }
}
