//! The call convention of kernels: the offsets that generated code and its callers share.
//!
//! A kernel is a C function of one argument, a pointer to a `Call`. All pointers are to 4-byte words unless noted
//! otherwise; floats, integers and bools (0 and -1 as i32 in lane arrays, 0 and 1 in members) are words. Lane arrays
//! hold one word per ray. They are readable and writable up to the call's count rounded up to the kernel's width. The
//! words of inactive rays, and of rays past the count, keep their values: a kernel may write them back as it read them.
//!
//! | offset | field | meaning |
//! |---|---|---|
//! | 0 | `state: **u32` | the lane array of each state component, by component index; may be null for unused ones |
//! | 8 | `scratch: **u32` | the lane array of each scratch scalar, by the class layout |
//! | 16 | `mask: *i32` | 0 or -1 per ray; null: all rays |
//! | 24 | `accepted: *i32` | `intersect` writes 0 or -1 for each active ray, 0 for the others up to the count |
//! | 32 | `instance: *u8` | the block of the instance, or the one that objects share |
//! | 40 | `objects: *u8` | the objects, see below |
//! | 48 | `index: *u32` | stream mode: the object index of each ray |
//! | 56 | `host: *HostTable` | the functions below |
//! | 64 | `user: *void` | the first argument of those functions |
//! | 72 | `count: u32` | the number of rays; 1 in the single mode, which reads neither this nor the mask |
//! | 76 | `status: u32` | kernels set bits: [`STATUS_BUDGET`] |
//! | 80 | `test_count: u32` | leaf mode, `intersect`: the number of tests |
//! | 84 | `first: u32` | packet and stream modes with a mask, methods but `intersect`: the first ray of a chunk before which all rays are off; else 0 |
//! | 88 | `tests: *LeafTest` | leaf mode, `intersect`: the tests |
//!
//! `objects` points to object 0 of the blocks in the stream mode, and for `intersect` in the leaf mode; for other
//! methods in the leaf mode to the first object of the call; in the other modes to the first word of the call's object.
//!
//! In the leaf mode lanes are `count` consecutive objects, and all lanes share one ray. Blocks of objects are readable
//! for [`LANE_PADDING`] objects from the first of any block. `intersect` executes a list of tests, each of three words:
//! the lane of its ray in `state` and `scratch`; the index of its first object, a multiple of [`OBJECTS_IN_BLOCK`];
//! and, as a result, the index of the object with the nearest hit, or [`NO_OBJECT`]. It does not write `accepted`, and
//! stores the outputs of the nearest hit to the ray's lane. Other methods read the ray from lane 0, and store to the
//! lanes of the objects.
//!
//! An instance's block holds the members at the word offsets of the class layout. A buffer takes [`BUFFER_WORDS`] words
//! at an even offset: a 64-bit address of its words, the number of elements, and an unused word. Blocks are 8-byte
//! aligned.
//!
//! Objects are many instances of one program by index, in blocks of [`OBJECTS_IN_BLOCK`]. Word `w` of object `n` of
//! objects with `words` words lies `(n / 8 * words + w) * 32 + n % 8 * 4` bytes after the first block, which is 32-byte
//! aligned: a vector of consecutive objects is one load for each 8, and all words of one object are near each other.
//! Shared words are in a separate instance's block. Entries of buffers have no alignment in objects.
//!
//! The host table holds C function pointers in the order of the `HOST_` constants. Lane sets are passed as `(base: u32,
//! active: u32)`; lanes, queries and samples by pointers to structs of arrays of 16 words, 64-byte aligned:
//!
//! | function | signature |
//! |---|---|
//! | trace | `(user, base, active, rays: *RayLanes, radiance: *[[f32; 16]; COLORS])` |
//! | occluded | `(user, base, active, rays: *RayLanes) -> u32` lanes |
//! | light count | `(user) -> u32` |
//! | light sample | `(user, base, active, index: u32, query: *LightQueryLanes, light: *LightLanes) -> u32` lanes |
//! | ambient | `(user, color: *[f32; COLORS])` |
//! | rand | `(user, base, active, values: *[f32; 16])` |
//! | query | `(user, base, active, query: u32, operands: *[u32; 16], results: *[u32; 16])` |
//!
//! Only kernels of integrators call `query`, which the hosts of other kernels lack; its number is the index in the list
//! of all queries. `RayLanes` is origin (3 x 16), direction (3 x 16), limit (16), weight (16; for `trace` only);
//! `LightQueryLanes` is point (3 x 16), normal (3 x 16), cosine (16); `LightLanes` is direction (3 x 16), distance
//! (16), colour (COLORS x 16), density (16).

#![allow(missing_docs, reason = "the table above documents the offsets")]

use rtsl_ir::Scalar;

use crate::CallMode;

/// The version of this interface and of the descriptions in libraries. Any change of offsets or meanings changes it.
pub const VERSION: u32 = 3;

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
pub const CALL_TEST_COUNT: u32 = 80;
pub const CALL_FIRST: u32 = 84;
pub const CALL_TESTS: u32 = 88;
pub const CALL_SIZE: u32 = 96;

pub const TEST_RAY: u32 = 0;
pub const TEST_FIRST: u32 = 4;
pub const TEST_NEAREST: u32 = 8;
pub const TEST_SIZE: u32 = 12;

/// The number of objects in a block: the vector width of most machines.
pub const OBJECTS_IN_BLOCK: u32 = 8;

/// The index that denotes no object.
pub const NO_OBJECT: u32 = u32::MAX;

/// Status bit: a ray used up its budget of loop iterations.
pub const STATUS_BUDGET: u32 = 1;

/// The number of words of a buffer's entry in an instance's block.
pub const BUFFER_WORDS: u32 = 4;

/// The number of lanes of lane arrays is a multiple of this.
pub const LANE_PADDING: u32 = 16;

/// Flag of a parameter in libraries: the host must set it.
pub const PARAMETER_REQUIRED: u32 = 1;
/// Flag of a parameter: it is a buffer.
pub const PARAMETER_BUFFER: u32 = 2;
/// Flag of a parameter: it is a colour, linear RGB.
pub const PARAMETER_COLOR: u32 = 4;

/// Flag of a kernel in libraries: it reads scratch.
pub const METHOD_READS_SCRATCH: u32 = 1;
/// Flag of a kernel: it stores scratch.
pub const METHOD_WRITES_SCRATCH: u32 = 2;
/// Flag of a kernel: it stores zeros only, for any input. A `BSDF` with this flag is specular.
pub const METHOD_LEAVES_ZEROS: u32 = 4;

/// Returns the number of a call mode in libraries.
pub const fn call_mode_number(mode: CallMode) -> u32 {
    match mode {
        CallMode::Single => 0,
        CallMode::Packet => 1,
        CallMode::CommonOrigin => 2,
        CallMode::Stream => 3,
        CallMode::Leaf => 4,
    }
}

/// Returns the call mode with this number.
pub fn call_mode_of_number(number: u32) -> Option<CallMode> {
    CallMode::ALL.into_iter().find(|mode| call_mode_number(*mode) == number)
}

/// Returns the number of a scalar type in libraries.
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
pub const HOST_QUERY: u32 = 6;
pub const HOST_FUNCTIONS: u32 = 7;
