//! The storage of texels: channels and bits of each.

use rtsl_memory::Amount;

/// The type of a channel's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// 8 bits, encoded.
    Byte,
    /// A binary16 number.
    Half,
    /// A binary32 number.
    Float,
}

impl Depth {
    /// The bits of a number.
    pub fn bits(self) -> usize {
        match self {
            Depth::Byte => 8,
            Depth::Half => 16,
            Depth::Float => 32,
        }
    }
}

/// The channels of a texel: 1 (grey), 3 (red, green, blue) or 4 (with opacity), and the type of their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TexelFormat {
    /// 1, 3 or 4.
    pub channels: usize,
    /// The type of the numbers.
    pub depth: Depth,
}

impl TexelFormat {
    /// Returns the bits of a texel in memory.
    pub fn bits(self) -> usize {
        match (self.depth, self.channels) {
            (Depth::Byte, 1) => 8,
            (Depth::Half, 1) => 16,
            (Depth::Byte, _) => 32,
            (Depth::Half, _) => 64,
            (Depth::Float, channels) => 32 * channels,
        }
    }

    /// Returns the words of `texels` texels in memory. Grey bytes and halves share words; colours of bytes take one
    /// word and colours of halves two, also without opacity.
    pub fn words(self, texels: usize) -> usize {
        match self.bits() {
            part @ (8 | 16) => texels.div_ceil(32 / part),
            bits => texels.saturating_mul(bits / 32),
        }
    }

    /// Returns the memory of `texels` texels as decoders give them: channel beside channel.
    pub fn decoded(self, texels: usize) -> Amount {
        Amount((self.channels * self.depth.bits() / 8) as u64).times(texels)
    }
}
