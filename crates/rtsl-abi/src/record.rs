//! Rays in a host's data structures, for functions that the host calls back directly.
//!
//! A kernel for a record is also a C function of one argument, but the argument is a struct of the host: the record
//! describes the offsets of the rays, their mask and the instance's data in it. It processes one packet, of as many
//! rays as the kernel's width, and needs none of the tables of a [call](crate::offsets).

use std::collections::BTreeMap;

/// The layout of a packet of rays in a host's struct. Offsets are bytes of the function's argument.
///
/// Rays are rows of one word per ray: row `r` of ray `i` is the word `r * width + i`, where `width` is the number of
/// rays. Rows are 4-byte aligned; those of state components hold floats.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RayRecord {
    /// The offset of the address of the first row.
    pub rays: u32,
    /// The offset of the address of the mask: a word per ray, 0 for inactive rays. All rays are active if `None`.
    pub mask: Option<u32>,
    /// The offset of the address of the block of the first instance. Blocks are 8-byte aligned and contiguous.
    pub instances: u32,
    /// The offset of the index of the instance, a u32; the first instance is used if `None`.
    pub number: Option<u32>,
    /// The row of each state component that the record has.
    pub rows: BTreeMap<u32, u32>,
    /// Additional words written for rays with a hit.
    pub marks: Vec<Mark>,
}

/// A word written to a row for rays with a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Mark {
    /// The row.
    pub row: u32,
    /// The word.
    pub word: MarkWord,
}

/// The source of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MarkWord {
    /// A constant.
    Constant(u32),
    /// The word at this offset of the argument.
    Argument(u32),
    /// The word at an offset behind an address in the argument.
    Behind {
        /// The offset of the address in the argument.
        pointer: u32,
        /// The offset from that address, in bytes.
        offset: u32,
    },
}
