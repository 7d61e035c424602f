//! The images of a scene, which are decoded before instances take them.

use super::Loader;
use crate::pbrt::NamedImage;

impl Loader<'_, '_> {
    /// Decodes the images that the scene uses, unless instances of an earlier load have them.
    pub(super) fn read_images(&mut self) {
        let description = self.description;
        let used = self.new_entities().into_iter();
        let images: Vec<NamedImage<'_>> =
            used.flat_map(|id| NamedImage::of(&description.entities[id.0])).collect();
        self.images.read_ahead(&images, self.files);
    }
}
