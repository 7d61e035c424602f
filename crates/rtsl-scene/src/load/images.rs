//! The images of a scene, which are decoded before instances take them.

use super::reachable::{reachable, textures_of_lights};
use super::{Earlier, Loader};
use crate::description::EntityId;
use crate::pbrt::{Images, NamedImage};

impl Loader<'_, '_> {
    /// Decodes the images that the scene uses, unless instances of an earlier load have them.
    pub(super) fn read_images(&mut self) {
        let description = self.description;
        let Earlier { made, changed, .. } = self.earlier;
        let is_new = |id: &EntityId| {
            changed.contains(id) || made.get(id.0).is_none_or(|earlier| earlier.is_none())
        };
        self.images = Images::new(textures_of_lights(description, &self.names));
        let used = reachable(description, &self.names).into_iter().filter(is_new);
        let images: Vec<NamedImage<'_>> =
            used.flat_map(|id| NamedImage::of(&description.entities[id.0], &self.images)).collect();
        self.images.read_ahead(&images, self.files);
    }

    /// Reports what images of lights have that is no light, once for each.
    pub(super) fn warn_of_images(&mut self) {
        for warning in self.images.take_warnings() {
            self.warn_once(warning);
        }
    }
}
