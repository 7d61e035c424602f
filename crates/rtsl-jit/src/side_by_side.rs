//! Calls whose chunks wait for one another.
//!
//! A kernel does the chunks of a call one after another, and what one chunk asks for is a request of `W` rays: few
//! for a host that traces packets. So the chunks of a kernel that asks for rays or light run side by side, each
//! on a stack of its own. At such a request a chunk is suspended; when all are suspended or have
//! ended, the requests of one kind are handed to the host together. The host runs on the stack of its
//! thread, and so may call kernels.
//!
//! Lanes know nothing of each other, so results are those of one chunk after another.

use std::cell::RefCell;
use std::ffi::c_void;

use corosensei::stack::DefaultStack;
use corosensei::{Coroutine, CoroutineResult, Yielder};
use rtsl_ir::host::{
    LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, LightRequest, OcclusionRequest,
    RayLanes, TraceRequest,
};

use crate::call::RawCall;
use crate::callbacks::{Color, HostCalls, HostTable};
use crate::kernel::Entry;
use crate::lanes::LaneMask;

/// The most chunks side by side: a packet of 64 rays, four at a time.
const MOST_CHUNKS: usize = 16;

/// Room for the largest frames that kernels have: local arrays are limited to a quarter of it by
/// `rtsl_packet::lower::MAX_SLOT_WORDS`. Pages that are not touched take no memory.
const STACK_BYTES: usize = 1 << 20;

/// Keeps the stacks of chunks from starting at the same place in their pages: the first cache would have few
/// places for all of them.
const STAGGER_BYTES: usize = 448;

/// What a suspended chunk gets back: for requests that are answered by lanes, those.
type Answer = u32;

/// A chunk on its stack. It returns the status of its call.
type ChunkCall = Coroutine<Answer, Request, u32, DefaultStack>;

thread_local! {
    /// Stacks not in use. As many are in use as chunks are suspended, at all depths of calls from hosts.
    static STACKS: RefCell<Vec<DefaultStack>> = const { RefCell::new(Vec::new()) };
}

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

/// The first rays of the chunks that have any to do.
pub(crate) fn chunks_with_rays(count: usize, width: usize, mask: Option<&LaneMask>) -> Vec<u32> {
    let has_rays =
        |begin: &usize| mask.is_none_or(|mask| mask.any_of(*begin..count.min(begin + width)));
    (0..count).step_by(width).filter(has_rays).map(|begin| begin as u32).collect()
}

/// Runs the chunks that start with the rays of `begins`.
///
/// # Safety
/// `raw` is a complete call for `entry`, whose code may begin at any chunk of `width` rays.
pub(crate) unsafe fn call_side_by_side(
    entry: Entry,
    raw: &mut RawCall,
    width: u32,
    begins: &[u32],
    host: &mut HostCalls<'_>,
) {
    let count = raw.count;
    for begins in begins.chunks(MOST_CHUNKS) {
        let mut waiting = Vec::with_capacity(MOST_CHUNKS);
        for (place, begin) in begins.iter().enumerate() {
            raw.begin.write(*begin);
            raw.count = count.min(begin + width);
            // One alone has nobody to wait for.
            let stack = if begins.len() > 1 { take_stack() } else { None };
            match stack {
                // Safety: the caller's promise.
                None => unsafe { entry(raw) },
                Some(stack) => {
                    // Safety: the same; and below all are run to their ends.
                    let chunk = unsafe { chunk_on_stack(entry, raw, place, stack) };
                    resume(raw, host, chunk, 0, &mut waiting);
                }
            }
        }
        while !waiting.is_empty() {
            answer_commonest(raw, host, &mut waiting);
        }
    }
}

/// A stack not in use; `None` if the system has none to give.
fn take_stack() -> Option<DefaultStack> {
    let kept = STACKS.with_borrow_mut(Vec::pop);
    kept.or_else(|| DefaultStack::new(STACK_BYTES).ok())
}

/// The chunk that `raw` says, ready to start.
///
/// # Safety
/// As for [`call_side_by_side`]; and the chunk is run to its end while what `raw` points to is there.
unsafe fn chunk_on_stack(
    entry: Entry,
    raw: &RawCall,
    place: usize,
    stack: DefaultStack,
) -> ChunkCall {
    let mut raw = RawCall { host: &SUSPENDING_TABLE, status: 0, ..*raw };
    Coroutine::with_stack(stack, move |yielder: &Yielder<Answer, Request>, _| {
        raw.user = std::ptr::from_ref(yielder).cast_mut().cast();
        at_depth(place, &mut || {
            // Safety: the caller's promise; the user pointer is what the table's functions take.
            unsafe { entry(&mut raw) };
        });
        raw.status
    })
}

/// Calls `inner` so many steps further down the stack.
#[inline(never)]
fn at_depth(steps: usize, inner: &mut dyn FnMut()) {
    let room = [0_u8; STAGGER_BYTES];
    std::hint::black_box(&room);
    match steps.checked_sub(1) {
        Some(rest) => at_depth(rest, inner),
        None => inner(),
    }
    // Not the last call, so that the room stays.
    std::hint::black_box(&room);
}

/// Lets a chunk go on with an answer, until it waits for others or ends.
fn resume(
    raw: &mut RawCall,
    host: &mut HostCalls<'_>,
    mut chunk: ChunkCall,
    mut answer: Answer,
    waiting: &mut Vec<Waiting>,
) {
    loop {
        let request = match chunk.resume(answer) {
            CoroutineResult::Yield(request) => request,
            CoroutineResult::Return(status) => {
                raw.status |= status;
                return STACKS.with_borrow_mut(|stacks| stacks.push(chunk.into_stack()));
            }
        };
        if let Some(kind) = request.kind() {
            return waiting.push(Waiting { chunk, kind, request });
        }
        // Safety: the chunk is suspended, and asked just now.
        answer = unsafe { request.answer_now(host) };
    }
}

/// Answers the requests of the kind that most chunks wait for, and lets these chunks go on.
fn answer_commonest(raw: &mut RawCall, host: &mut HostCalls<'_>, waiting: &mut Vec<Waiting>) {
    let Some(kind) = commonest(waiting) else { return };
    let (asking, others): (Vec<_>, Vec<_>) =
        std::mem::take(waiting).into_iter().partition(|it| it.kind == kind);
    *waiting = others;
    let requests = asking.iter().map(|it| it.request);
    // Safety: the chunks are suspended, and their requests are those that they asked last.
    let answers = unsafe { answer_together(host, kind, requests) };
    for (Waiting { chunk, .. }, answer) in asking.into_iter().zip(answers) {
        resume(raw, host, chunk, answer, waiting);
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
) -> Vec<Answer> {
    match kind {
        Kind::Trace => {
            // Safety: the caller's promise; so for the others.
            let mut requests: Vec<_> = requests.filter_map(|it| unsafe { it.trace() }).collect();
            host.ask(|host| host.trace_together(&mut requests));
            vec![0; requests.len()]
        }
        Kind::Occluded => {
            let mut requests: Vec<_> =
                requests.filter_map(|it| unsafe { it.occlusion() }).collect();
            host.ask(|host| host.occluded_together(&mut requests));
            requests.iter().map(|it| it.occluded & it.lanes.active).collect()
        }
        Kind::LightSample(index) => {
            let mut requests: Vec<_> = requests.filter_map(|it| unsafe { it.light() }).collect();
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
