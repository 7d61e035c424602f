//! Interleaving: the number of full chunks that one execution of the body processes together.
//!
//! A processor hides the latency of one chunk's operations behind the next chunk, within its out-of-order window. That
//! fails if the code of a chunk is long, and in loops, where the next chunk's loop starts only after the last
//! iteration. Two or four chunks in one body provide independent work. They cost registers and compile time.
//!
//! Nanoseconds per ray on Zen 3, W = 8, packets of 64, by the number of chunks interleaved, and cycles of waiting per
//! cycle of work by the [estimate](crate::Estimate):
//!
//! | kernel | waiting | 1 | 2 | 4 |
//! |---|---|---|---|---|
//! | torus, by sphere tracing | 3.7 | 38.0 | 24.4 | 17.9 |
//! | torus, zeros of a quartic | 2.2 | 99.8 | 65.3 | 56.4 |
//! | thin lens | 1.2 | 2.17 | 2.05 | 1.79 |
//! | pow | 1.1 | 1.41 | 1.22 | 1.11 |
//! | Ward | 1.05 | 2.14 | 1.97 | 2.09 |
//! | GGX, bound by the divider | 1.1 | 6.87 | 5.04 | 4.51 |
//! | dielectric | 1.05 | 3.05 | 2.69 | 3.12 |
//! | triangle | 0.6 | 1.27 | 1.26 | 1.31 |
//! | log | 0.7 | 0.50 | 0.50 | 0.41 |
//! | sphere | 0.6 | 0.86 | 0.89 | 0.95 |
//! | exp | 0.6 | 0.37 | 0.36 | 0.33 |
//! | noise, hashed, a loop | 0.6 | 19.8 | 17.5 | 20.9 |
//! | noise, from a table, a loop | 0.5 | 41.5 | 37.3 | 45.4 |
//!
//! Full chunks have a separate function even if they are not interleaved: without it, each chunk tests whether it is
//! full, which takes a tenth of a short kernel's time.

use rtsl_abi::CallMode;
use rtsl_ir::VariableKind;

use crate::kernel::{KernelVariable, OpKind, Region};
use crate::{Estimate, Kernel};

/// The possible numbers of interleaved chunks.
pub const FACTORS: [u32; 3] = [1, 2, 4];

/// The waiting cycles per cycle of work from which interleaving two chunks pays, and four.
const WAITING: [f32; 2] = [1.04, 1.19];

/// Like [`WAITING`], if the divider has half more cycles than all other units: spills then cost nothing.
const WAITING_FOR_DIVIDER: [f32; 2] = [0.4, 0.9];

/// Like [`WAITING`], if two chunks fit into the processor's window.
const WAITING_IN_SIGHT: [f32; 2] = [0.9, 1.1];

/// The greatest number of operations of a chunk that fits twice into the processor's window.
const IN_SIGHT: u32 = 100;

/// The number of operations up to which the loop over chunks is a considerable part of the work.
const SHORT: u32 = 50;

/// The greatest number of operations of all interleaved chunks, which bounds the compile time. The quartic's 235
/// operations interleaved by four take 1.2 to 1.4 times as long to compile with LLVM 22 as by two (on a Zen 5 11 ms
/// more), and run in 0.6 of the time at 16 lanes.
const MAX_OPERATIONS: u32 = 960;

/// The greatest number of operations without interleaving, where a full chunk saves only the tests of its mask.
const MAX_ALONE: u32 = 100;

/// The greatest number of bytes of the locals of all interleaved chunks: a part of the L1 cache.
const MAX_LOCAL_BYTES: u32 = 8192;

/// Returns the number of full chunks that `kernel` processes together: `forced` if that is possible, else a choice by
/// its code; `None` to process them like all others.
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
    // Kernels that accept hits store outputs only if there are hits, which are rarer the fewer rays are active.
    let accepts = kernel.accepted_output().is_some();
    // Straight-line code between early-out branches is faster than its estimate.
    let waits = |cycles: f32| waiting >= cycles && (estimate.loops || !accepts);
    if waits(for_four) || (is_short && !accepts) {
        4
    } else if waits(for_two) || is_short || estimate.loops {
        2
    } else {
        1
    }
}

/// True if `kernel` may interleave `factor` full chunks.
fn is_possible(kernel: &Kernel, factor: u32) -> bool {
    // The lane sets that hosts receive hold one chunk.
    let fits =
        !asks_host(&kernel.body) && local_bytes(kernel).saturating_mul(factor) <= MAX_LOCAL_BYTES;
    // Values shared by all lanes are read from the first lane before anything is stored, which would be too late for
    // the remaining chunks.
    let overwrites_shared =
        kernel.outputs.iter().any(|output| !kernel.variable(output.variable).varies);
    let many_rays = match kernel.mode {
        CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream => kernel.width > 1,
        CallMode::Leaf | CallMode::Single => false,
    };
    let known = FACTORS.contains(&factor);
    known && many_rays && !overwrites_shared && (factor == 1 || fits)
}

/// Returns the stack size of the locals of a chunk, in bytes.
fn local_bytes(kernel: &Kernel) -> u32 {
    let locals = kernel.variables.iter().filter(|it| it.variable.kind == VariableKind::Local);
    let lanes = |it: &KernelVariable| if it.varies { kernel.width } else { 1 };
    locals.map(|it| it.variable.len.saturating_mul(4 * lanes(it))).fold(0, u32::saturating_add)
}

fn asks_host(region: &Region) -> bool {
    region.ops.iter().any(|op| match &op.kind {
        OpKind::Trace { .. }
        | OpKind::Occluded { .. }
        | OpKind::LightSample { .. }
        | OpKind::Rand(_)
        | OpKind::Query { .. } => true,
        kind => kind.regions().any(asks_host),
    })
}
