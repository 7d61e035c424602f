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
//! | torus, by sphere tracing | 3.7 | 58.2 | 41.8 | 32.0 |
//! | thin lens | 1.4 | 2.98 | 2.57 | 2.23 |
//! | Ward | 1.1 | 2.22 | 2.13 | 2.08 |
//! | dielectric | 1.0 | 3.04 | 3.01 | 3.28 |
//! | triangle | 1.0 | 1.52 | 1.57 | 1.91 |
//! | sphere | 0.7 | 1.12 | 1.05 | 1.05 |
//! | noise, hashed | 0.6 | 22.2 | 19.7 | 20.2 |
//! | noise, from a table | 0.5 | 46.1 | 44.3 | 48.8 |

use rtsl_ir::PlaceKind;

use crate::kernel::{KernelPlace, OpKind, Region};
use crate::{Estimate, Kernel, Shape};

/// The numbers of chunks that may be done at a time.
pub const FACTORS: [u32; 3] = [1, 2, 4];

/// Cycles of waiting for one of work from which two chunks at a time pay.
const WAITING_FOR_TWO: f32 = 1.05;

/// The same for four.
const WAITING_FOR_FOUR: f32 = 1.35;

/// Up to so many operations, with a division or a root among them, two chunks at a time pay because the
/// loop over chunks itself is a good part of the work.
const SHORT: u32 = 50;

/// The most operations, those of all chunks that are done at a time: they have to be compiled.
const MOST_OPERATIONS: u32 = 800;

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
    let waiting = estimate.waiting / estimate.busy.max(1.0);
    let is_short = estimate.uses_divider && estimate.operations <= SHORT;
    let wanted = match waiting {
        _ if waiting >= WAITING_FOR_FOUR => 4,
        _ if waiting >= WAITING_FOR_TWO || is_short => 2,
        _ => 1,
    };
    let fits = |factor: &u32| *factor > 1 && factor * estimate.operations <= MOST_OPERATIONS;
    [wanted, wanted / 2].into_iter().find(fits)
}

/// Whether `kernel` may do `factor` full chunks at a time.
fn is_possible(kernel: &Kernel, factor: u32) -> bool {
    let is_slot_in_lanes = |it: &KernelPlace| it.varies && it.place.kind == PlaceKind::Slot;
    // The lane sets that hosts take hold one chunk, and slots would need more of the stack.
    let one_at_a_time = kernel.places.iter().any(is_slot_in_lanes) || asks_host(&kernel.body);
    // What all lanes share is read from the first lane before anything is stored: too late for the
    // chunks that are left over.
    let overwrites_shared = kernel.outputs.iter().any(|output| !kernel.place(output.place).varies);
    let many_rays = match kernel.shape {
        Shape::Packet | Shape::CommonOrigin | Shape::Stream => kernel.width > 1,
        Shape::Leaf | Shape::Single => false,
    };
    let known = FACTORS.contains(&factor);
    known && many_rays && !overwrites_shared && (factor == 1 || !one_at_a_time)
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
