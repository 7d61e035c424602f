//! Reads arbitrary bytes as an image.

use rtsl_image::{Encoding, Mipmap, Picture};
use rtsl_memory::{Amount, InputBudget};

/// The reader, with memory for 32 MiB. What it accepts has all its texels, what is held suffices for them, and nothing
/// is held without them.
pub fn picture(data: &[u8]) {
    let budget = InputBudget::new(Some(Amount(32 << 20)));
    if let Ok((picture, held)) = Picture::read(data, Encoding::Srgb, &budget) {
        let (texels, format) = (picture.width * picture.height, picture.format());
        assert!(budget.taken() >= Picture::memory(picture.width, picture.height, format));
        assert_eq!(picture.colors().count(), texels);
        let levels = Mipmap::new(picture).expect("the memory is held");
        assert!(levels.words.len() >= format.words(texels));
        drop(held);
    }
    assert_eq!(budget.taken(), Amount(0));
}
