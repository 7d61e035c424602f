//! Reads arbitrary bytes as an image.

use rtsl_image::{Encoding, Mipmap, Picture, has_opacity};
use rtsl_memory::{Amount, InputBudget};

/// The readers for scenes of pbrt and of glTF, with memory for 32 MiB. What they accept has all its texels, what is
/// held suffices for them, and nothing is held without them. Pictures for glTF have the opacity that their first bytes
/// tell.
pub fn picture(data: &[u8]) {
    for read in [Picture::read, Picture::read_for_gltf] {
        let budget = InputBudget::new(Some(Amount(32 << 20)));
        if let Ok((picture, held)) = read(data, Encoding::Srgb, &budget) {
            let (texels, format) = (picture.width * picture.height, picture.format());
            assert!(budget.taken() >= Picture::memory(picture.width, picture.height, format));
            assert_eq!(picture.colors().count(), texels);
            let levels = Mipmap::new(picture).expect("the memory is held");
            assert!(levels.words.len() >= format.words(texels));
            drop(held);
        }
        assert_eq!(budget.taken(), Amount(0));
    }
    if let (Ok((picture, _)), Ok(has_opacity)) = (
        Picture::read_for_gltf(data, Encoding::Srgb, &InputBudget::new(Some(Amount(32 << 20)))),
        has_opacity(data),
    ) {
        assert_eq!(picture.channels == 4, has_opacity);
    }
}
