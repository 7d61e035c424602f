//! Sets of state components.

// As few as hold the components: each call compares them.
const WORDS: usize = 3;

/// A set of state components, by component index.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ComponentSet {
    bits: [u64; WORDS],
}

impl ComponentSet {
    /// The bound of the component indices in a set, which exceeds the number of components.
    pub const CAPACITY: u32 = u64::BITS * WORDS as u32;

    /// Adds a component.
    ///
    /// # Panics
    /// If it is not below the capacity.
    pub fn insert(&mut self, component: u32) {
        assert!(component < ComponentSet::CAPACITY, "component {component}");
        self.bits[(component / u64::BITS) as usize] |= 1 << (component % u64::BITS);
    }

    /// True if the component is in the set.
    pub fn contains(&self, component: u32) -> bool {
        component < ComponentSet::CAPACITY
            && self.bits[(component / u64::BITS) as usize] >> (component % u64::BITS) & 1 != 0
    }

    /// True if the set contains all components of another.
    #[inline]
    pub fn contains_all(&self, others: &ComponentSet) -> bool {
        let missing = self.bits.iter().zip(others.bits).map(|(own, other)| other & !own);
        missing.fold(0, |all, word| all | word) == 0
    }

    /// Returns the components, in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = u32> {
        let words = self.bits.into_iter().zip((0..).step_by(u64::BITS as usize));
        words.flat_map(|(mut bits, first)| {
            std::iter::from_fn(move || {
                let lowest = (bits != 0).then(|| bits.trailing_zeros())?;
                bits &= bits - 1;
                Some(first + lowest)
            })
        })
    }
}

impl FromIterator<u32> for ComponentSet {
    fn from_iter<I: IntoIterator<Item = u32>>(components: I) -> ComponentSet {
        let mut set = ComponentSet::default();
        components.into_iter().for_each(|component| set.insert(component));
        set
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contains_the_inserted_components() {
        let set = ComponentSet::from_iter([0, 63, 64, 100]);
        assert_eq!(set.iter().collect::<Vec<_>>(), [0, 63, 64, 100]);
        assert!(set.contains_all(&ComponentSet::from_iter([64, 0])));
        assert!(!set.contains_all(&ComponentSet::from_iter([64, 1])));
        assert!(!set.contains(1000));
    }

    #[test]
    fn every_component_of_the_table_fits() {
        assert!(rtsl_spec::state_component_count() <= ComponentSet::CAPACITY);
    }

    #[test]
    fn components_come_in_ascending_order() {
        let components = [127, 0, 63, 64, 100, 7];
        let set = ComponentSet::from_iter(components);
        assert_eq!(set.iter().collect::<Vec<_>>(), [0, 7, 63, 64, 100, 127]);
        assert_eq!(ComponentSet::default().iter().next(), None);
    }
}
