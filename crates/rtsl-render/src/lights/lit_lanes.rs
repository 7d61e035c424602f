//! The lanes of a batch for which lights of one class are sampled.

/// Some lanes of a batch, in ascending order.
#[derive(Default)]
pub struct LitLanes {
    lanes: Vec<u32>,
}

impl LitLanes {
    /// Selects those of the first `count` lanes for which `is_lit` holds.
    pub fn select(&mut self, count: usize, is_lit: impl Fn(u32) -> bool) {
        self.lanes.clear();
        self.lanes.extend((0..count as u32).filter(|lane| is_lit(*lane)));
    }

    /// Returns the number of lanes.
    pub fn count(&self) -> usize {
        self.lanes.len()
    }

    /// Iterates over the lanes.
    pub fn iter(&self) -> impl Iterator<Item = usize> {
        self.lanes.iter().map(|lane| *lane as usize)
    }

    /// Gathers the lanes' elements.
    pub fn gather<T: Copy>(&self, from: &[T], to: &mut [T]) {
        to.iter_mut().zip(self.iter()).for_each(|(to, lane)| *to = from[lane]);
    }

    /// Scatters results to the lanes.
    pub fn scatter<T: Copy>(&self, from: &[T], to: &mut [T]) {
        from.iter().zip(self.iter()).for_each(|(from, lane)| to[lane] = *from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lanes_have_is_taken_and_given_back() {
        let mut lanes = LitLanes::default();
        lanes.select(8, |lane| lane < 2 || lane == 7);
        let mut all: [u32; 9] = std::array::from_fn(|lane| 10 * lane as u32);
        let mut some = [0; 9];
        lanes.gather(&all, &mut some);
        assert_eq!(some, [0, 10, 70, 0, 0, 0, 0, 0, 0]);
        lanes.scatter(&some.map(|it| it + 1), &mut all);
        assert_eq!(all, [1, 11, 20, 30, 40, 50, 60, 71, 80]);
    }
}
