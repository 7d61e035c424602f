//! The images of a scene, which are decoded before instances take them.

use super::reachable::reachable;
use super::{Earlier, Loader};
use crate::description::EntityId;
use crate::pbrt::NamedImage;

impl Loader<'_, '_> {
    /// Decodes the images that the scene uses, unless instances of an earlier load have them.
    pub(super) fn read_images(&mut self) {
        let description = self.description;
        let Earlier { made, changed, .. } = self.earlier;
        let is_new = |id: &EntityId| {
            changed.contains(id) || made.get(id.0).is_none_or(|earlier| earlier.is_none())
        };
        let used = reachable(description, &self.names).into_iter().filter(is_new);
        let images: Vec<NamedImage<'_>> =
            used.flat_map(|id| NamedImage::of(&description.entities[id.0])).collect();
        self.images.read_ahead(&images, self.files);
    }
}
