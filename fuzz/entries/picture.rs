//! Reads arbitrary bytes as an image.

use rtsl_image::{Encoding, Picture};
use rtsl_memory::{Amount, InputBudget};

/// The reader, with memory for 32 MiB. What it accepts has all its texels, and no more is held than they take.
pub fn picture(data: &[u8]) {
    let budget = InputBudget::new(Some(Amount(32 << 20)));
    if let Ok((picture, _held)) = Picture::read(data, Encoding::Srgb, &budget) {
        assert_eq!(picture.texels.len(), picture.width * picture.height);
        assert_eq!(budget.taken(), Picture::memory(picture.width, picture.height));
    }
}
