//! The images of a scene, which are decoded before instances take them.

use super::Loader;
use super::reachable::textures_of_lights;
use crate::pbrt::{Images, NamedImage};

impl Loader<'_, '_> {
    /// Decodes the images that the scene uses, unless instances of an earlier load have them.
    pub(super) fn read_images(&mut self) {
        let description = self.description;
        self.images = Images::new(textures_of_lights(description, &self.names));
        let used = self.new_entities().into_iter();
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
