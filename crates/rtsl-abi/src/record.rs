//! Rays as a host keeps them, for functions that a host's own code can call back.
//!
//! A kernel for a record is a C function of one argument too, but the argument is a struct of the host's: the
//! record says where in it the rays, their mask and the instance's data are found. It does one packet, of as many
//! rays as the kernel is wide, and needs none of the tables that a [call](crate::offsets) leads to.

use std::collections::BTreeMap;

/// How a host keeps a packet of rays, and how it asks about them. Offsets are bytes of the function's argument.
///
/// Rays are rows of one word a ray: row `r` of ray `i` is the word `r * width + i`, where `width` is the number of rays.
/// Rows are 4-byte aligned; those of state components hold floats.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RayRecord {
    /// Where the address of the first row stands.
    pub rays: u32,
    /// Where the address of the mask stands: a word a ray, 0 for those that are left out. All rays take part where `None`.
    pub mask: Option<u32>,
    /// Where the address of the block of the first instance stands. Blocks are 8-byte aligned and lie one after the other.
    pub instances: u32,
    /// Where the number of the instance stands, a u32; the first one's where `None`.
    pub number: Option<u32>,
    /// The row of each state component that the record has.
    pub rows: BTreeMap<u32, u32>,
    /// What else is written for rays with a hit.
    pub marks: Vec<Mark>,
}

/// A word that is written to a row, for rays with a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Mark {
    /// The row.
    pub row: u32,
    /// What is written.
    pub word: MarkWord,
}

/// A word that the caller gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MarkWord {
    /// Always these bits.
    Constant(u32),
    /// What stands there in the argument.
    Argument(u32),
    /// What stands so many bytes behind the address that stands there in the argument.
    Behind {
        /// Where the address stands.
        pointer: u32,
        /// How many bytes.
        offset: u32,
    },
}
