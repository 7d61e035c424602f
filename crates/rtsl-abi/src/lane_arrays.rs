//! Lane arrays of either owner.

use crate::component_set::ComponentSet;

/// The properties of lane arrays that the checks need.
pub(crate) trait LaneArrays {
    /// Returns the number of lanes of each array, without padding.
    fn lanes(&self) -> usize;

    /// Returns the first of these components that has no array.
    fn missing_component(&self, components: &ComponentSet) -> Option<u32>;

    /// Returns the first missing array of the first `arrays`.
    fn missing_array(&self, arrays: u32) -> Option<u32>;
}
