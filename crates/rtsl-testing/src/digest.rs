//! Short digests of pictures that tests pin.

/// Returns the hash of Fowler, Noll and Vo (FNV-1a) with 32 bits.
pub fn fnv1a(bytes: &[u8]) -> u32 {
    let step = |hash: u32, byte: &u8| (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193);
    bytes.iter().fold(0x811c_9dc5, step)
}
