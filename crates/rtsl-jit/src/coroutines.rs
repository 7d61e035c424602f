//! Calls whose chunks wait for one another.
//!
//! A kernel does the chunks of a call one after another, and what one chunk asks for is a request of `W` rays: few
//! for a host that traces packets. So the chunks of a kernel that asks for rays or light run side by side, each
//! on a stack of its own. At such a request a chunk is suspended; when all are suspended or have
//! ended, the requests of one kind are handed to the host together. The host answers them on the stack of its
//! thread, and so may call kernels. What needs no rays it is asked at once, on the chunk's stack.
//!
//! Lanes know nothing of each other, so results are those of one chunk after another.

use std::ffi::c_void;

use corosensei::{Coroutine, CoroutineResult, Yielder};
use rtsl_abi::{CallError, Color, HOST_TABLE, HostCalls, HostTable, RawCall};
use rtsl_ir::host::{
    LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, LightRequest, OcclusionRequest,
    RayLanes, TraceRequest,
};
use smallvec::SmallVec;

use crate::chunk_stack::ChunkStack;
use crate::kernel::Entry;

/// The most chunks side by side: a packet of 64 rays, four at a time.
const MAX_CHUNKS: usize = 16;

/// Larger frames do not wait on the caller's stack while a host answers: answers call kernels, which ask again.
pub(crate) const LARGE_FRAME_BYTES: usize = 16 << 10;

/// What a suspended chunk gets back: for requests that are answered by lanes, those.
type Answer = u32;

/// A chunk on its stack. It returns the status of its call.
type ChunkCall = Coroutine<Answer, (LaneSet, Request), u32, ChunkStack>;

/// As many as there are chunks side by side, without memory from the heap.
type PerChunk<T> = SmallVec<[T; MAX_CHUNKS]>;

/// What a chunk asks for. The pointers lead to the chunk's stack, and are good until it goes on.
#[derive(Clone, Copy)]
enum Request {
    Trace { rays: *const RayLanes, radiance: *mut LaneColors },
    Occluded { rays: *const RayLanes },
    LightSample { index: u32, query: *const LightQueryLanes, light: *mut LightLanes },
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
    /// Taken when it has ended.
    chunk: Option<ChunkCall>,
    lanes: LaneSet,
    request: Request,
}

/// What the user pointer of a chunk points to.
struct ChunkUser<'a> {
    yielder: &'a Yielder<Answer, (LaneSet, Request)>,
    /// The user pointer of the whole call.
    call: *mut c_void,
}

/// Runs the chunks of a call, as many side by side as there are stacks.
///
/// # Errors
/// If there is not one stack for a kernel with a large frame; nothing has run then.
///
/// # Safety
/// `raw` is a complete call for `entry`, whose code may begin at any chunk of `width` rays and takes no more stack than
/// `frame_bytes`; `mask` is the call's.
pub(crate) unsafe fn call_in_coroutines(
    entry: Entry,
    raw: &mut RawCall,
    width: u32,
    frame_bytes: usize,
    mask: Option<&[i32]>,
) -> Result<(), CallError> {
    let is_large = frame_bytes > LARGE_FRAME_BYTES;
    let mut first = if is_large { Some(large_stack(frame_bytes)?) } else { None };
    let count = raw.count;
    let end_of = |begin: u32| count.min(begin + width);
    let has_rays = |begin: &u32| {
        mask.is_none_or(|mask| {
            mask[*begin as usize..end_of(*begin) as usize].iter().any(|it| *it != 0)
        })
    };
    let mut begins = (0..count).step_by(width as usize).filter(has_rays);
    loop {
        let group: PerChunk<u32> = begins.by_ref().take(MAX_CHUNKS).collect();
        let mut waiting = PerChunk::new();
        for begin in &group {
            // One alone has nobody to wait for.
            let has_own_stack = group.len() > 1 || is_large;
            let take = || if has_own_stack { ChunkStack::take(frame_bytes) } else { None };
            let mut stack = first.take().or_else(take);
            if is_large && stack.is_none() {
                // Those before it end and leave theirs. Small frames have room on the caller's stack.
                // Safety: the chunks are suspended.
                unsafe { answer_all(raw, &mut waiting) };
                stack = take();
            }
            raw.begin.write(*begin);
            raw.count = end_of(*begin);
            // Safety: the caller's promise; and below all are run to their ends.
            waiting.extend(unsafe { start(entry, raw, stack) });
        }
        // Safety: the chunks have just been suspended.
        unsafe { answer_all(raw, &mut waiting) };
        if group.len() < MAX_CHUNKS {
            return Ok(());
        }
    }
}

/// A stack for a frame that does not wait on the caller's: hosts whose answers call kernels would run out of theirs.
fn large_stack(frame_bytes: usize) -> Result<ChunkStack, CallError> {
    ChunkStack::take(frame_bytes).ok_or(CallError::NoStack)
}

/// Runs a whole call on a stack of its own. The host answers what it asks on the stack of its thread.
///
/// # Errors
/// If there is no stack; nothing has run then.
///
/// # Safety
/// `raw` is a complete call for `entry`, whose code takes no more stack than `frame_bytes`.
pub(crate) unsafe fn call_on_own_stack(
    entry: Entry,
    raw: &mut RawCall,
    frame_bytes: usize,
) -> Result<(), CallError> {
    let stack = large_stack(frame_bytes)?;
    // Safety: the caller's promise; and it is run to its end just below.
    let mut waiting = unsafe { start(entry, raw, Some(stack)) }.into_iter().collect();
    // Safety: it has just been suspended.
    unsafe { answer_all(raw, &mut waiting) };
    Ok(())
}

/// Answers requests until all chunks have ended.
///
/// # Safety
/// The chunks are suspended, and their requests are those that they asked last.
unsafe fn answer_all(raw: &mut RawCall, waiting: &mut PerChunk<Waiting>) {
    while !waiting.is_empty() {
        // Safety: the caller's promise, which holds again for those that are left.
        unsafe { answer_commonest(raw, waiting) };
    }
}

/// Runs the chunk that `raw` says until it waits for others; `None` if it ends, as it does without a stack of its own.
///
/// # Safety
/// As for [`chunk_on_stack`].
unsafe fn start(entry: Entry, raw: &mut RawCall, stack: Option<ChunkStack>) -> Option<Waiting> {
    let Some(stack) = stack else {
        // Safety: the caller's promise.
        unsafe { entry(raw) };
        return None;
    };
    // Safety: the caller's promise.
    let chunk = unsafe { chunk_on_stack(entry, raw, stack) };
    go_on(raw, chunk, 0)
}

/// The chunk that `raw` says, ready to start.
///
/// # Safety
/// As for [`call_in_coroutines`]; and the chunk is run to its end while what `raw` points to is there.
unsafe fn chunk_on_stack(entry: Entry, raw: &RawCall, stack: ChunkStack) -> ChunkCall {
    let mut raw = RawCall { host: &SUSPENDING_TABLE, status: 0, ..*raw };
    Coroutine::with_stack(stack, move |yielder: &Yielder<_, _>, _| {
        let mut user = ChunkUser { yielder, call: raw.user };
        raw.user = (&raw mut user).cast();
        // Safety: the caller's promise; the user pointer is what the table's functions take.
        unsafe { entry(&mut raw) };
        raw.status
    })
}

/// Lets a chunk go on with an answer, until it waits for others; `None` if it ends.
fn go_on(raw: &mut RawCall, mut chunk: ChunkCall, answer: Answer) -> Option<Waiting> {
    match chunk.resume(answer) {
        CoroutineResult::Yield((lanes, request)) => {
            Some(Waiting { chunk: Some(chunk), lanes, request })
        }
        CoroutineResult::Return(status) => {
            raw.status |= status;
            chunk.into_stack().keep();
            None
        }
    }
}

impl Waiting {
    fn kind(&self) -> Kind {
        match self.request {
            Request::Trace { .. } => Kind::Trace,
            Request::Occluded { .. } => Kind::Occluded,
            Request::LightSample { index, .. } => Kind::LightSample(index),
        }
    }
}

/// Answers the requests of the kind that most chunks wait for, and lets these chunks go on.
///
/// # Safety
/// As for [`answers`].
unsafe fn answer_commonest(raw: &mut RawCall, waiting: &mut PerChunk<Waiting>) {
    let Some(kind) = commonest(waiting) else { return };
    let asking = waiting.iter().filter(|it| it.kind() == kind);
    // Safety: the user pointer is the call's; nothing else uses what it points to, since all chunks are suspended.
    let host = unsafe { &mut *raw.user.cast() };
    // Safety: the caller's promise.
    let mut answers = unsafe { answers(host, kind, asking) }.into_iter();
    for asking in waiting.iter_mut().filter(|it| it.kind() == kind) {
        let answer = answers.next().unwrap_or_default();
        if let Some(again) = asking.chunk.take().and_then(|chunk| go_on(raw, chunk, answer)) {
            *asking = again;
        }
    }
    waiting.retain(|it| it.chunk.is_some());
}

/// The kind that most wait for, of equals that of the first.
fn commonest(waiting: &[Waiting]) -> Option<Kind> {
    let first = waiting.first()?.kind();
    if waiting.iter().all(|it| it.kind() == first) {
        return Some(first);
    }
    let count = |kind: &Kind| waiting.iter().filter(|it| it.kind() == *kind).count();
    waiting.iter().map(Waiting::kind).rev().max_by_key(count)
}

/// The host's answers to requests of one kind.
///
/// # Safety
/// The chunks that ask are suspended, and have not gone on since.
unsafe fn answers<'a>(
    host: &mut HostCalls<'_>,
    kind: Kind,
    asking: impl Iterator<Item = &'a Waiting>,
) -> PerChunk<Answer> {
    match kind {
        Kind::Trace => {
            // Safety: the caller's promise.
            let mut requests: PerChunk<_> = asking.filter_map(|it| unsafe { it.trace() }).collect();
            host.ask(|host| host.trace_together(&mut requests));
            SmallVec::from_elem(0, requests.len())
        }
        Kind::Occluded => {
            // Safety: the caller's promise.
            let mut requests: PerChunk<_> =
                asking.filter_map(|it| unsafe { it.occlusion() }).collect();
            host.ask(|host| host.occluded_together(&mut requests));
            requests.iter().map(|it| it.occluded & it.lanes.active).collect()
        }
        Kind::LightSample(index) => {
            // Safety: the caller's promise.
            let mut requests: PerChunk<_> = asking.filter_map(|it| unsafe { it.light() }).collect();
            host.ask(|host| host.light_sample_together(index, &mut requests));
            requests.iter().map(|it| it.reached & it.lanes.active).collect()
        }
    }
}

impl Waiting {
    /// # Safety
    /// As for [`answers`].
    unsafe fn trace<'a>(&self) -> Option<TraceRequest<'a>> {
        let Request::Trace { rays, radiance } = self.request else { return None };
        // Safety: the caller's promise.
        let (rays, radiance) = unsafe { (&*rays, &mut *radiance) };
        Some(TraceRequest { lanes: self.lanes, rays, radiance })
    }

    /// # Safety
    /// As for [`answers`].
    unsafe fn occlusion<'a>(&self) -> Option<OcclusionRequest<'a>> {
        let Request::Occluded { rays } = self.request else { return None };
        // Safety: the caller's promise.
        let rays = unsafe { &*rays };
        Some(OcclusionRequest { lanes: self.lanes, rays, occluded: 0 })
    }

    /// # Safety
    /// As for [`answers`].
    unsafe fn light<'a>(&self) -> Option<LightRequest<'a>> {
        let Request::LightSample { index: _, query, light } = self.request else { return None };
        // Safety: the caller's promise.
        let (query, light) = unsafe { (&*query, &mut *light) };
        Some(LightRequest { lanes: self.lanes, query, light, reached: 0 })
    }
}

/// The host's functions for chunks on stacks of their own. What needs rays suspends the chunk; its answers begin as
/// zeros.
static SUSPENDING_TABLE: HostTable =
    HostTable { trace, occluded, light_count, light_sample, ambient, rand };

/// # Safety
/// `user` is that of the running chunk.
unsafe fn suspend(user: *mut c_void, base: u32, active: u32, request: Request) -> Answer {
    // Safety: the caller's promise.
    let user: &ChunkUser<'_> = unsafe { &*user.cast() };
    user.yielder.suspend((LaneSet { base, active }, request))
}

/// The user pointer of the whole call, for what is asked at once.
///
/// # Safety
/// `user` is that of the running chunk.
unsafe fn user_of_call(user: *mut c_void) -> *mut c_void {
    // Safety: the caller's promise.
    let user: &ChunkUser<'_> = unsafe { &*user.cast() };
    user.call
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
        suspend(user, base, active, Request::Trace { rays, radiance });
    }
}

unsafe extern "C" fn occluded(
    user: *mut c_void,
    base: u32,
    active: u32,
    rays: *const RayLanes,
) -> u32 {
    // Safety: as for `trace`.
    unsafe { suspend(user, base, active, Request::Occluded { rays }) }
}

unsafe extern "C" fn light_sample(
    user: *mut c_void,
    base: u32,
    active: u32,
    index: u32,
    query: *const LightQueryLanes,
    light: *mut LightLanes,
) -> u32 {
    // Safety: as for `trace`.
    unsafe {
        light.write(LightLanes::default());
        suspend(user, base, active, Request::LightSample { index, query, light })
    }
}

unsafe extern "C" fn light_count(user: *mut c_void) -> u32 {
    // Safety: as for `trace`; the host is not asked elsewhere while a chunk runs.
    unsafe { (HOST_TABLE.light_count)(user_of_call(user)) }
}

unsafe extern "C" fn ambient(user: *mut c_void, color: *mut Color) {
    // Safety: as for `light_count`.
    unsafe { (HOST_TABLE.ambient)(user_of_call(user), color) };
}

unsafe extern "C" fn rand(user: *mut c_void, base: u32, active: u32, values: *mut LaneFloats) {
    // Safety: as for `light_count`.
    unsafe { (HOST_TABLE.rand)(user_of_call(user), base, active, values) };
}
