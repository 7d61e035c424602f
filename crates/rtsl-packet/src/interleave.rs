//! How many chunks are done at a time where all rays take part.
//!
//! A processor hides the latency of one chunk's operations behind the next chunk, as far as it looks
//! ahead. That fails where the code of a chunk is long, and in loops, of which the next chunk's comes
//! only after the last round. Two or four chunks in one body give it what to do meanwhile. It costs
//! registers, and time to compile.
//!
//! Nanoseconds a ray on Zen 3, W = 8, packets of 64, by chunks at a time, and cycles of
//! waiting for one cycle of work by the [estimate](crate::Estimate):
//!
//! | kernel | waiting | 1 | 2 | 4 |
//! |---|---|---|---|---|
//! | torus, by sphere tracing | 3.7 | 38.0 | 24.4 | 17.9 |
//! | torus, zeros of a quartic | 2.2 | 99.8 | 65.3 | 56.4 |
//! | thin lens | 1.2 | 2.17 | 2.05 | 1.79 |
//! | pow | 1.1 | 1.41 | 1.22 | 1.11 |
//! | Ward | 1.05 | 2.14 | 1.97 | 2.09 |
//! | GGX, of which the divider does most | 1.1 | 6.87 | 5.04 | 4.51 |
//! | dielectric | 1.05 | 3.05 | 2.69 | 3.12 |
//! | triangle | 0.6 | 1.27 | 1.26 | 1.31 |
//! | log | 0.7 | 0.50 | 0.50 | 0.41 |
//! | sphere | 0.6 | 0.86 | 0.89 | 0.95 |
//! | exp | 0.6 | 0.37 | 0.36 | 0.33 |
//! | noise, hashed, a loop | 0.6 | 19.8 | 17.5 | 20.9 |
//! | noise, from a table, a loop | 0.5 | 41.5 | 37.3 | 45.4 |
//!
//! Full chunks have a function of their own even where they are done one by one: without it, each
//! tests whether it is full, which takes a tenth of a short kernel's time.

use rtsl_abi::CallMode;
use rtsl_ir::VariableKind;

use crate::kernel::{KernelVariable, OpKind, Region};
use crate::{Estimate, Kernel};

/// The numbers of chunks that may be done at a time.
pub const FACTORS: [u32; 3] = [1, 2, 4];

/// Cycles of waiting for one of work from which two chunks at a time pay, and four.
const WAITING: [f32; 2] = [1.04, 1.19];

/// The same where the divider does half more cycles than all else: what the registers do not
/// hold then costs nothing.
const WAITING_FOR_DIVIDER: [f32; 2] = [0.4, 0.9];

/// The same where two chunks fit into what the processor looks ahead.
const WAITING_IN_SIGHT: [f32; 2] = [0.9, 1.1];

/// So many operations of a chunk fit twice.
const IN_SIGHT: u32 = 100;

/// Up to so many operations, the loop over chunks itself is a good part of the work.
const SHORT: u32 = 50;

/// The most operations, those of all chunks that are done at a time: they have to be compiled. The quartic's 235
/// by two take 42 ms with LLVM 22, by four 1.4 times as long.
const MAX_OPERATIONS: u32 = 700;

/// The most where chunks are done one by one, and a full one saves no more than the tests of its mask.
const MAX_ALONE: u32 = 100;

/// The most bytes that local arrays may take for all chunks that are done at a time: a part of the first cache.
const MAX_SLOT_BYTES: u32 = 8192;

/// How many full chunks `kernel` does at a time: `forced` of them where that is possible, else what suits
/// its code; `None` where it treats them as all others.
pub fn choose(kernel: &Kernel, forced: Option<u32>) -> Option<u32> {
    match forced {
        Some(factor) => is_possible(kernel, factor).then_some(factor),
        None => suitable(kernel).filter(|factor| is_possible(kernel, *factor)),
    }
}

fn suitable(kernel: &Kernel) -> Option<u32> {
    let estimate = Estimate::new(kernel);
    let wanted = wanted(kernel, &estimate);
    let fits = |factor: &u32| match factor {
        1 => estimate.operations <= MAX_ALONE,
        _ => factor * estimate.operations <= MAX_OPERATIONS,
    };
    FACTORS.into_iter().rev().filter(|factor| *factor <= wanted).find(fits)
}

fn wanted(kernel: &Kernel, estimate: &Estimate) -> u32 {
    let waiting = estimate.waiting / estimate.busy().max(1.0);
    let divides = estimate.divider > 1.5 * estimate.issue;
    let [for_two, for_four] = match (divides, estimate.operations <= IN_SIGHT) {
        (true, _) => WAITING_FOR_DIVIDER,
        (false, true) => WAITING_IN_SIGHT,
        (false, false) => WAITING,
    };
    let is_short = estimate.operations <= SHORT;
    // What accepts hits stores them only if there are any: the fewer rays are asked, the rarer.
    let accepts = kernel.accepted_output().is_some();
    // Straight code between branches that leave early is done sooner than its estimate says.
    let waits = |cycles: f32| waiting >= cycles && (estimate.loops || !accepts);
    if waits(for_four) || (is_short && !accepts) {
        4
    } else if waits(for_two) || is_short || estimate.loops {
        2
    } else {
        1
    }
}

/// Whether `kernel` may do `factor` full chunks at a time.
fn is_possible(kernel: &Kernel, factor: u32) -> bool {
    // The lane sets that hosts take hold one chunk.
    let fits =
        !asks_host(&kernel.body) && slot_bytes(kernel).saturating_mul(factor) <= MAX_SLOT_BYTES;
    // What all lanes share is read from the first lane before anything is stored: too late for the
    // chunks that are left over.
    let overwrites_shared =
        kernel.outputs.iter().any(|output| !kernel.variable(output.variable).varies);
    let many_rays = match kernel.shape {
        CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream => kernel.width > 1,
        CallMode::Leaf | CallMode::Single => false,
    };
    // Their chunks may be called side by side, each alone.
    let alone = kernel.begins_at_any_chunk();
    let known = FACTORS.contains(&factor);
    known && !alone && many_rays && !overwrites_shared && (factor == 1 || fits)
}

/// Bytes of the stack that local arrays take for a chunk.
fn slot_bytes(kernel: &Kernel) -> u32 {
    let locals = kernel.variables.iter().filter(|it| it.variable.kind == VariableKind::Local);
    let lanes = |it: &KernelVariable| if it.varies { kernel.width } else { 1 };
    locals.map(|it| it.variable.len.saturating_mul(4 * lanes(it))).fold(0, u32::saturating_add)
}

fn asks_host(region: &Region) -> bool {
    region.ops.iter().any(|op| match &op.kind {
        OpKind::Trace { .. }
        | OpKind::Occluded { .. }
        | OpKind::LightSample { .. }
        | OpKind::Rand(_) => true,
        kind => kind.regions().any(asks_host),
    })
}
