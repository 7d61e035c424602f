//! Calls whose chunks wait for one another.
//!
//! A kernel does the chunks of a call one after another, and what one chunk asks for is a request of `W` rays: few
//! for a host that traces packets. So the chunks of a kernel that asks for rays or light run side by side, each
//! on a stack of its own. At such a request a chunk is suspended; when all are suspended or have
//! ended, the requests of one kind are handed to the host together. The host runs on the stack of its
//! thread, and so may call kernels.
//!
//! Lanes know nothing of each other, so results are those of one chunk after another.

use std::ffi::c_void;

use corosensei::{Coroutine, CoroutineResult, Yielder};
use rtsl_ir::host::{
    LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, LightRequest, OcclusionRequest,
    RayLanes, TraceRequest,
};
use smallvec::SmallVec;

use crate::call::RawCall;
use crate::callbacks::{Color, HostCalls, HostTable};
use crate::chunk_stack::ChunkStack;
use crate::kernel::Entry;
use crate::lanes::LaneMask;

/// The most chunks side by side: a packet of 64 rays, four at a time.
const MOST_CHUNKS: usize = 16;

/// What a suspended chunk gets back: for requests that are answered by lanes, those.
type Answer = u32;

/// A chunk on its stack. It returns the status of its call.
type ChunkCall = Coroutine<Answer, Request, u32, ChunkStack>;

/// As many as there are chunks side by side, without memory from the heap: a short `shade` takes as long
/// as twenty allocations.
type PerChunk<T> = SmallVec<[T; MOST_CHUNKS]>;

/// What a chunk asks for. The pointers lead to the chunk's stack, and are good until it goes on.
#[derive(Clone, Copy)]
enum Request {
    Trace {
        lanes: LaneSet,
        rays: *const RayLanes,
        radiance: *mut LaneColors,
    },
    Occluded {
        lanes: LaneSet,
        rays: *const RayLanes,
    },
    LightSample {
        index: u32,
        lanes: LaneSet,
        query: *const LightQueryLanes,
        light: *mut LightLanes,
    },
    LightCount,
    Ambient(*mut Color),
    Rand {
        lanes: LaneSet,
        values: *mut LaneFloats,
    },
}

/// What requests have in common that the host answers together.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Trace,
    Occluded,
    LightSample(u32),
}

/// A chunk that is suspended.
struct Waiting {
    chunk: ChunkCall,
    kind: Kind,
    request: Request,
}

/// Runs the chunks of a call.
///
/// # Safety
/// `raw` is a complete call for `entry`, whose code may begin at any chunk of `width` rays; `mask` is the call's.
pub(crate) unsafe fn call_side_by_side(
    entry: Entry,
    raw: &mut RawCall,
    width: u32,
    mask: Option<&LaneMask>,
    host: &mut HostCalls<'_>,
) {
    let count = raw.count;
    let end_of = |begin: u32| count.min(begin + width);
    let has_rays =
        |begin: &u32| mask.is_none_or(|mask| mask.any_of(*begin as usize..end_of(*begin) as usize));
    let mut begins = (0..count).step_by(width as usize).filter(has_rays);
    loop {
        let group: PerChunk<u32> = begins.by_ref().take(MOST_CHUNKS).collect();
        let mut waiting = PerChunk::new();
        for begin in &group {
            raw.begin.write(*begin);
            raw.count = end_of(*begin);
            // One alone has nobody to wait for.
            let stack = if group.len() > 1 { ChunkStack::take() } else { None };
            match stack {
                // Safety: the caller's promise.
                None => unsafe { entry(raw) },
                Some(stack) => {
                    // Safety: the same; and below all are run to their ends.
                    let chunk = unsafe { chunk_on_stack(entry, raw, stack) };
                    waiting.extend(go_on(raw, host, chunk, 0));
                }
            }
        }
        while !waiting.is_empty() {
            answer_commonest(raw, host, &mut waiting);
        }
        if group.len() < MOST_CHUNKS {
            break;
        }
    }
}

/// The chunk that `raw` says, ready to start.
///
/// # Safety
/// As for [`call_side_by_side`]; and the chunk is run to its end while what `raw` points to is there.
unsafe fn chunk_on_stack(entry: Entry, raw: &RawCall, stack: ChunkStack) -> ChunkCall {
    let mut raw = RawCall { host: &SUSPENDING_TABLE, status: 0, ..*raw };
    Coroutine::with_stack(stack, move |yielder: &Yielder<Answer, Request>, _| {
        raw.user = std::ptr::from_ref(yielder).cast_mut().cast();
        // Safety: the caller's promise; the user pointer is what the table's functions take.
        unsafe { entry(&mut raw) };
        raw.status
    })
}

/// Lets a chunk go on with an answer, until it waits for others; `None` if it ends.
fn go_on(
    raw: &mut RawCall,
    host: &mut HostCalls<'_>,
    mut chunk: ChunkCall,
    mut answer: Answer,
) -> Option<Waiting> {
    loop {
        let request = match chunk.resume(answer) {
            CoroutineResult::Yield(request) => request,
            CoroutineResult::Return(status) => {
                raw.status |= status;
                chunk.into_stack().keep();
                return None;
            }
        };
        if let Some(kind) = request.kind() {
            return Some(Waiting { chunk, kind, request });
        }
        // Safety: the chunk is suspended, and asked just now.
        answer = unsafe { request.answer_now(host) };
    }
}

/// Answers the requests of the kind that most chunks wait for, and lets these chunks go on.
fn answer_commonest(raw: &mut RawCall, host: &mut HostCalls<'_>, waiting: &mut PerChunk<Waiting>) {
    let Some(kind) = commonest(waiting) else { return };
    let asking = waiting.iter().filter(|it| it.kind == kind).map(|it| it.request);
    // Safety: the chunks are suspended, and their requests are those that they asked last.
    let mut answers = unsafe { answer_together(host, kind, asking) }.into_iter();
    for Waiting { chunk, kind: other, request } in std::mem::take(waiting) {
        if other != kind {
            waiting.push(Waiting { chunk, kind: other, request });
        } else if let Some(answer) = answers.next() {
            waiting.extend(go_on(raw, host, chunk, answer));
        }
    }
}

/// The kind that most wait for, of equals that of the first.
fn commonest(waiting: &[Waiting]) -> Option<Kind> {
    let count = |kind: &Kind| waiting.iter().filter(|it| it.kind == *kind).count();
    waiting.iter().map(|it| it.kind).rev().max_by_key(count)
}

/// The host's answers to requests of one kind.
///
/// # Safety
/// The chunks that ask are suspended, and have not gone on since.
unsafe fn answer_together(
    host: &mut HostCalls<'_>,
    kind: Kind,
    requests: impl Iterator<Item = Request>,
) -> PerChunk<Answer> {
    match kind {
        Kind::Trace => {
            // Safety: the caller's promise; so for the others.
            let mut requests: PerChunk<_> =
                requests.filter_map(|it| unsafe { it.trace() }).collect();
            host.ask(|host| host.trace_together(&mut requests));
            SmallVec::from_elem(0, requests.len())
        }
        Kind::Occluded => {
            let mut requests: PerChunk<_> =
                requests.filter_map(|it| unsafe { it.occlusion() }).collect();
            host.ask(|host| host.occluded_together(&mut requests));
            requests.iter().map(|it| it.occluded & it.lanes.active).collect()
        }
        Kind::LightSample(index) => {
            let mut requests: PerChunk<_> =
                requests.filter_map(|it| unsafe { it.light() }).collect();
            host.ask(|host| host.light_sample_together(index, &mut requests));
            requests.iter().map(|it| it.reached & it.lanes.active).collect()
        }
    }
}

impl Request {
    /// With which others it is answered; `None` if at once.
    fn kind(self) -> Option<Kind> {
        match self {
            Request::Trace { .. } => Some(Kind::Trace),
            Request::Occluded { .. } => Some(Kind::Occluded),
            Request::LightSample { index, .. } => Some(Kind::LightSample(index)),
            Request::LightCount | Request::Ambient(_) | Request::Rand { .. } => None,
        }
    }

    /// Answers what needs no rays.
    ///
    /// # Safety
    /// As for [`answer_together`].
    unsafe fn answer_now(self, host: &mut HostCalls<'_>) -> Answer {
        match self {
            Request::LightCount => host.ask(|host| host.light_count()),
            Request::Ambient(color) => {
                // Safety: the caller's promise.
                unsafe { *color = host.ask(|host| host.ambient()) };
                0
            }
            Request::Rand { lanes, values } => {
                // Safety: the caller's promise.
                let values = unsafe { &mut *values };
                host.ask(|host| host.rand(lanes, values));
                0
            }
            Request::Trace { .. } | Request::Occluded { .. } | Request::LightSample { .. } => 0,
        }
    }

    /// # Safety
    /// As for [`answer_together`].
    unsafe fn trace<'a>(self) -> Option<TraceRequest<'a>> {
        let Request::Trace { lanes, rays, radiance } = self else { return None };
        // Safety: the caller's promise.
        let (rays, radiance) = unsafe { (&*rays, &mut *radiance) };
        Some(TraceRequest { lanes, rays, radiance })
    }

    /// # Safety
    /// As for [`answer_together`].
    unsafe fn occlusion<'a>(self) -> Option<OcclusionRequest<'a>> {
        let Request::Occluded { lanes, rays } = self else { return None };
        // Safety: the caller's promise.
        let rays = unsafe { &*rays };
        Some(OcclusionRequest { lanes, rays, occluded: 0 })
    }

    /// # Safety
    /// As for [`answer_together`].
    unsafe fn light<'a>(self) -> Option<LightRequest<'a>> {
        let Request::LightSample { index: _, lanes, query, light } = self else { return None };
        // Safety: the caller's promise.
        let (query, light) = unsafe { (&*query, &mut *light) };
        Some(LightRequest { lanes, query, light, reached: 0 })
    }
}

/// The host's functions for chunks on stacks of their own: each suspends the chunk, whose yielder is the user
/// pointer. Answers begin as zeros.
static SUSPENDING_TABLE: HostTable =
    HostTable { trace, occluded, light_count, light_sample, ambient, rand };

/// # Safety
/// `user` is the yielder of the running chunk.
unsafe fn suspend(user: *mut c_void, request: Request) -> Answer {
    // Safety: the caller's promise.
    let yielder: &Yielder<Answer, Request> = unsafe { &*user.cast() };
    yielder.suspend(request)
}

unsafe extern "C" fn trace(
    user: *mut c_void,
    base: u32,
    active: u32,
    rays: *const RayLanes,
    radiance: *mut LaneColors,
) {
    // Safety: kernels pass their user pointer, and lanes on their own stack.
    unsafe {
        radiance.write(LaneColors::default());
        suspend(user, Request::Trace { lanes: LaneSet { base, active }, rays, radiance });
    }
}

unsafe extern "C" fn occluded(
    user: *mut c_void,
    base: u32,
    active: u32,
    rays: *const RayLanes,
) -> u32 {
    // Safety: as for `trace`.
    unsafe { suspend(user, Request::Occluded { lanes: LaneSet { base, active }, rays }) }
}

unsafe extern "C" fn light_count(user: *mut c_void) -> u32 {
    // Safety: as for `trace`.
    unsafe { suspend(user, Request::LightCount) }
}

unsafe extern "C" fn light_sample(
    user: *mut c_void,
    base: u32,
    active: u32,
    index: u32,
    query: *const LightQueryLanes,
    light: *mut LightLanes,
) -> u32 {
    let lanes = LaneSet { base, active };
    // Safety: as for `trace`.
    unsafe {
        light.write(LightLanes::default());
        suspend(user, Request::LightSample { index, lanes, query, light })
    }
}

unsafe extern "C" fn ambient(user: *mut c_void, color: *mut Color) {
    // Safety: as for `trace`.
    unsafe {
        color.write(Color::default());
        suspend(user, Request::Ambient(color));
    }
}

unsafe extern "C" fn rand(user: *mut c_void, base: u32, active: u32, values: *mut LaneFloats) {
    let lanes = LaneSet { base, active };
    // Safety: as for `trace`.
    unsafe {
        values.write(LaneFloats::default());
        suspend(user, Request::Rand { lanes, values });
    }
}
