//! How a kernel is called: the offsets that generated code and its callers agree on.
//!
//! A kernel is a C function of one argument, a pointer to a `Call`. All pointers are to 4-byte words
//! unless said otherwise; floats, integers and bools (0 and -1 as i32 in lane arrays, 0 and 1 in
//! members) are words. Lane arrays hold one word a ray. They are readable and writable up to the call's count
//! rounded up to the kernel's width; rays that the mask leaves out, and rays past the
//! count, are not changed in meaning: a kernel may write their words back as it read them.
//!
//! | offset | field | meaning |
//! |---|---|---|
//! | 0 | `state: **u32` | a lane array for each state component, by component index of the one table; only those that the kernel names need be there |
//! | 8 | `scratch: **u32` | a lane array for each scratch scalar, by the class layout |
//! | 16 | `mask: *i32` | 0 or -1 a ray; null: all rays |
//! | 24 | `accepted: *i32` | `intersect` writes 0 or -1 for every ray of the mask, 0 for the others up to the count |
//! | 32 | `instance: *u8` | the block of the instance, or of what objects share |
//! | 40 | `objects: *u8` | blocks of objects: stream shape, and `intersect` in the leaf shape, from object 0 on; else in the leaf shape from the first object on; else the object's first word |
//! | 48 | `index: *u32` | stream shape: the object number of each ray |
//! | 56 | `host: *HostTable` | the functions below |
//! | 64 | `user: *void` | passed to them |
//! | 72 | `count: u32` | rays; 1 in the single shape, which looks at neither this nor the mask |
//! | 76 | `status: u32` | kernels set bits: [`STATUS_BUDGET`] |
//! | 80 | `begin: u32` | kernels that [begin at any chunk](crate::Signature::separate_chunks): the ray that the first chunk starts with, a multiple of the width |
//! | 84 | `test_count: u32` | leaf shape, `intersect`: how many tests |
//! | 88 | `tests: *LeafTest` | leaf shape, `intersect`: the tests |
//!
//! In the leaf shape lanes are `count` objects in a row, and all lanes share one ray.
//! Blocks of objects are readable for [`LANE_PADDING`] objects from the first of any block. `intersect` does one
//! test after another, each as three words: the lane of its ray in `state` and `scratch`; the number of its
//! first object, a multiple of [`OBJECTS_IN_BLOCK`]; and, to be written, that of the object with the nearest
//! hit, or [`NO_OBJECT`]. It leaves `accepted` alone, and stores what the nearest hit gave to the ray's lane. Other
//! methods find the ray in lane 0, and store to the lanes of the objects.
//!
//! An instance's block holds the members at the word offsets of the class layout. A buffer takes
//! [`BUFFER_WORDS`] words at an even offset: a 64-bit address of its words, the number of elements, and a
//! word unused. Blocks are 8-byte aligned.
//!
//! Objects are many instances of one program by number, in blocks of [`OBJECTS_IN_BLOCK`]. Word `w` of object `n` of
//! objects with `words` words lies `(n / 8 * words + w) * 32 + n % 8 * 4` bytes after the first block, which is 32-byte
//! aligned: a vector of objects in a row is one load for each 8, and all words of one object lie near each
//! other. What is the same for all of them stands in one instance's block beside. Entries of buffers have
//! no alignment in objects.
//!
//! The host table holds C function pointers in the order of the `HOST_` constants. Lane sets are
//! passed as `(base: u32, active: u32)`; lanes, queries and samples by pointers to structs of
//! arrays of 16 words, 64-byte aligned:
//!
//! | function | signature |
//! |---|---|
//! | trace | `(user, base, active, rays: *RayLanes, radiance: *[[f32; 16]; COLORS])` |
//! | occluded | `(user, base, active, rays: *RayLanes) -> u32` lanes |
//! | light count | `(user) -> u32` |
//! | light sample | `(user, base, active, index: u32, query: *LightQueryLanes, light: *LightLanes) -> u32` lanes |
//! | ambient | `(user, color: *[f32; COLORS])` |
//! | rand | `(user, base, active, values: *[f32; 16])` |
//!
//! `RayLanes` is origin (3 x 16), direction (3 x 16), limit (16), weight (16; of `trace` only); `LightQueryLanes` point (3 x 16), normal (3 x 16),
//! cosine (16); `LightLanes` direction (3 x 16), distance (16), colour (COLORS x 16), density (16).

#![allow(missing_docs, reason = "the table above documents the offsets")]

use rtsl_ir::Scalar;

use crate::CallMode;

/// The version of all this, and of what libraries say of themselves. Other offsets or meanings are another version.
pub const VERSION: u32 = 1;

pub const CALL_STATE: u32 = 0;
pub const CALL_SCRATCH: u32 = 8;
pub const CALL_MASK: u32 = 16;
pub const CALL_ACCEPTED: u32 = 24;
pub const CALL_INSTANCE: u32 = 32;
pub const CALL_OBJECTS: u32 = 40;
pub const CALL_INDEX: u32 = 48;
pub const CALL_HOST: u32 = 56;
pub const CALL_USER: u32 = 64;
pub const CALL_COUNT: u32 = 72;
pub const CALL_STATUS: u32 = 76;
pub const CALL_BEGIN: u32 = 80;
pub const CALL_TEST_COUNT: u32 = 84;
pub const CALL_TESTS: u32 = 88;
pub const CALL_SIZE: u32 = 96;

pub const TEST_RAY: u32 = 0;
pub const TEST_FIRST: u32 = 4;
pub const TEST_NEAREST: u32 = 8;
pub const TEST_SIZE: u32 = 12;

/// Objects in a block: as many as the vectors of most machines have lanes.
pub const OBJECTS_IN_BLOCK: u32 = 8;

/// No object's number.
pub const NO_OBJECT: u32 = u32::MAX;

/// A ray used up its budget of loop iterations.
pub const STATUS_BUDGET: u32 = 1;

/// Words that a buffer takes in an instance's block.
pub const BUFFER_WORDS: u32 = 4;

/// Lane arrays are allocated for a multiple of this many rays.
pub const LANE_PADDING: u32 = 16;

/// Parameters of libraries: the host must set it.
pub const PARAMETER_REQUIRED: u32 = 1;
/// It is a buffer.
pub const PARAMETER_BUFFER: u32 = 2;
/// It is a colour: linear RGB.
pub const PARAMETER_COLOR: u32 = 4;

/// Kernels of libraries: it reads scratch.
pub const METHOD_READS_SCRATCH: u32 = 1;
/// It sets scratch.
pub const METHOD_WRITES_SCRATCH: u32 = 2;
/// It leaves zeros in all that it sets, whatever it is called for: a `BSDF` that does so is specular.
pub const METHOD_LEAVES_ZEROS: u32 = 4;

/// The number of a shape in libraries.
pub const fn shape_number(shape: CallMode) -> u32 {
    match shape {
        CallMode::Single => 0,
        CallMode::Packet => 1,
        CallMode::CommonOrigin => 2,
        CallMode::Stream => 3,
        CallMode::Leaf => 4,
    }
}

/// The shape of this number.
pub fn shape_of_number(number: u32) -> Option<CallMode> {
    CallMode::ALL.into_iter().find(|shape| shape_number(*shape) == number)
}

/// The number of a type of scalar in libraries.
pub const fn scalar_number(scalar: Scalar) -> u32 {
    match scalar {
        Scalar::F32 => 0,
        Scalar::I32 => 1,
        Scalar::U32 => 2,
        Scalar::Bool => 3,
    }
}

pub const HOST_TRACE: u32 = 0;
pub const HOST_OCCLUDED: u32 = 1;
pub const HOST_LIGHT_COUNT: u32 = 2;
pub const HOST_LIGHT_SAMPLE: u32 = 3;
pub const HOST_AMBIENT: u32 = 4;
pub const HOST_RAND: u32 = 5;
pub const HOST_FUNCTIONS: u32 = 6;
