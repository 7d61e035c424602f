//! Conversion between the lanes of requests, which cover a window of lanes each, and those of a packet.

use rtsl::host::{LaneSet, MAX_LANES};

/// Copies a request's lanes to those of a packet or batch.
#[inline(always)]
pub fn to_packet<T: Copy, const N: usize>(lanes: LaneSet, from: &[T; MAX_LANES], to: &mut [T; N]) {
    copy(lanes, from, &mut to[(lanes.base as usize).min(N)..]);
}

/// Copies those of a packet or batch to a request's.
#[inline(always)]
pub fn from_packet<T: Copy, const N: usize>(
    lanes: LaneSet,
    from: &[T; N],
    to: &mut [T; MAX_LANES],
) {
    copy(lanes, &from[(lanes.base as usize).min(N)..], to);
}

/// Copies up to the last requesting lane, rounded up to whole vectors; the lanes after these belong to other requests.
#[inline(always)]
fn copy<T: Copy>(lanes: LaneSet, from: &[T], to: &mut [T]) {
    match 32 - lanes.active.leading_zeros() {
        0 => {}
        1..=4 => copy_step::<4, T>(from, to),
        5..=8 => copy_step::<8, T>(from, to),
        _ => copy_step::<16, T>(from, to),
    }
}

#[inline(always)]
fn copy_step<const STEP: usize, T: Copy>(from: &[T], to: &mut [T]) {
    match (from.first_chunk::<STEP>(), to.first_chunk_mut::<STEP>()) {
        (Some(from), Some(to)) => *to = *from,
        // The last lanes of a packet, if requests are not as wide as vectors.
        _ => to.iter_mut().zip(from).for_each(|(to, from)| *to = *from),
    }
}
