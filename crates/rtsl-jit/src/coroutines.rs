//! Calls whose chunks run as coroutines, so that their requests can be combined.
//!
//! A kernel processes the chunks of a call one after another, and a request of one chunk has `W` rays: few for a host
//! that traces packets. So the chunks of a kernel that requests rays or light run as coroutines, each on a separate
//! stack. At such a request a chunk is suspended; when all are suspended or have ended, the requests of one kind are
//! passed to the host together. The host answers them on the stack of its thread, and so may call kernels. Requests for
//! other data are answered immediately, on the chunk's stack.
//!
//! Lanes are independent of each other, so results are the same as without coroutines.

use std::ffi::c_void;

use corosensei::{Coroutine, CoroutineResult, Yielder};
use rtsl_abi::{CallError, Color, HOST_TABLE, HostCalls, HostTable, RawCall};
use rtsl_ir::host::{
    LaneColors, LaneFloats, LaneSet, LaneWords, LightLanes, LightQueryLanes, LightRequest,
    OcclusionRequest, RayLanes, TraceRequest,
};
use smallvec::SmallVec;

use crate::chunk_stack::ChunkStack;
use crate::entry::Entry;

/// The greatest number of chunks that run as coroutines: a packet of 64 rays, four at a time.
const MAX_CHUNKS: usize = 16;

/// The least size of a frame that is not on the caller's stack while a host answers: answers may call kernels
/// recursively.
pub(crate) const LARGE_FRAME_BYTES: usize = 16 << 10;

/// The value with which a suspended chunk resumes: for requests that are answered by a lane set, that set.
type Answer = u32;

/// A chunk on its stack. It returns the status of its call.
type ChunkCall = Coroutine<Answer, (LaneSet, Request), u32, ChunkStack>;

/// One value per coroutine, without heap memory.
type PerChunk<T> = SmallVec<[T; MAX_CHUNKS]>;

/// A request of a chunk. The pointers are to the chunk's stack, and valid until it resumes.
#[derive(Clone, Copy)]
enum Request {
    Trace { rays: *const RayLanes, radiance: *mut LaneColors },
    Occluded { rays: *const RayLanes },
    LightSample { index: u32, query: *const LightQueryLanes, light: *mut LightLanes },
}

/// The kind of a request; the host answers requests of the same kind together.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Trace,
    Occluded,
    LightSample(u32),
}

/// A chunk that is suspended.
struct Waiting {
    /// `None` once it has ended.
    chunk: Option<ChunkCall>,
    lanes: LaneSet,
    request: Request,
}

/// The value behind the user pointer of a chunk.
struct ChunkUser<'a> {
    yielder: &'a Yielder<Answer, (LaneSet, Request)>,
    /// The user pointer of the whole call.
    call: *mut c_void,
}

/// Runs the chunks of a call, as many concurrently as there are stacks.
///
/// # Errors
/// If there is no stack for a kernel with a large frame; nothing has run then.
///
/// # Safety
/// `raw` is a complete call for `entry`, whose code may begin at any chunk of `width` rays and needs no more stack than
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
            // A single chunk need not wait for others.
            let has_own_stack = group.len() > 1 || is_large;
            let take = || if has_own_stack { ChunkStack::take(frame_bytes) } else { None };
            let mut stack = first.take().or_else(take);
            if is_large && stack.is_none() {
                // The previous chunks end and free their stacks. Small frames fit on the caller's stack.
                // Safety: the chunks are suspended.
                unsafe { answer_all(raw, &mut waiting) };
                stack = take();
            }
            raw.begin.write(*begin);
            raw.count = end_of(*begin);
            // Safety: the caller's promise; and all chunks are run to their ends below.
            waiting.extend(unsafe { start(entry, raw, stack) });
        }
        // Safety: the chunks have just been suspended.
        unsafe { answer_all(raw, &mut waiting) };
        if group.len() < MAX_CHUNKS {
            return Ok(());
        }
    }
}

/// Returns a stack for a frame too large for the caller's stack, which hosts whose answers call kernels would exhaust.
fn large_stack(frame_bytes: usize) -> Result<ChunkStack, CallError> {
    ChunkStack::take(frame_bytes).ok_or(CallError::NoStack)
}

/// Runs a whole call on a separate stack. The host answers its requests on the stack of its thread.
///
/// # Errors
/// If there is no stack; nothing has run then.
///
/// # Safety
/// `raw` is a complete call for `entry`, whose code needs no more stack than `frame_bytes`.
pub(crate) unsafe fn call_on_own_stack(
    entry: Entry,
    raw: &mut RawCall,
    frame_bytes: usize,
) -> Result<(), CallError> {
    let stack = large_stack(frame_bytes)?;
    // Safety: the caller's promise; and the chunk is run to its end below.
    let mut waiting = unsafe { start(entry, raw, Some(stack)) }.into_iter().collect();
    // Safety: it has just been suspended.
    unsafe { answer_all(raw, &mut waiting) };
    Ok(())
}

/// Answers requests until all chunks have ended.
///
/// # Safety
/// The chunks are suspended, and their requests are their latest.
unsafe fn answer_all(raw: &mut RawCall, waiting: &mut PerChunk<Waiting>) {
    while !waiting.is_empty() {
        // Safety: the caller's promise, which also holds for the remaining chunks.
        unsafe { answer_commonest(raw, waiting) };
    }
}

/// Runs the chunk of `raw` until it is suspended; `None` if it ends, as it always does without a separate stack.
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

/// Returns the chunk of `raw`, ready to start.
///
/// # Safety
/// As for [`call_in_coroutines`]; and the chunk is run to its end while the data that `raw` points to is valid.
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

/// Resumes a chunk with an answer, until it is suspended again; `None` if it ends.
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

/// Answers the requests of the kind that most chunks wait for, and resumes these chunks.
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

/// Returns the commonest kind of request; in case of a tie that of the first chunk.
fn commonest(waiting: &[Waiting]) -> Option<Kind> {
    let first = waiting.first()?.kind();
    if waiting.iter().all(|it| it.kind() == first) {
        return Some(first);
    }
    let count = |kind: &Kind| waiting.iter().filter(|it| it.kind() == *kind).count();
    waiting.iter().map(Waiting::kind).rev().max_by_key(count)
}

/// Returns the host's answers to requests of one kind.
///
/// # Safety
/// The requesting chunks are suspended, and have not resumed since their requests.
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

/// The host's functions for chunks on separate stacks. Requests for rays or light suspend the chunk; their answers are
/// initially zero.
static SUSPENDING_TABLE: HostTable =
    HostTable { trace, occluded, light_count, light_sample, ambient, rand, query };

/// Suspends the running chunk with a request, and returns the answer.
///
/// # Safety
/// `user` is that of the running chunk.
unsafe fn suspend(user: *mut c_void, base: u32, active: u32, request: Request) -> Answer {
    // Safety: the caller's promise.
    let user: &ChunkUser<'_> = unsafe { &*user.cast() };
    user.yielder.suspend((LaneSet { base, active }, request))
}

/// Returns the user pointer of the whole call, for requests answered immediately.
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
    // Safety: as for `trace`; the host is not used elsewhere while a chunk runs.
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

/// Kernels with queries do not run on separate stacks.
unsafe extern "C" fn query(
    user: *mut c_void,
    base: u32,
    active: u32,
    query: u32,
    operands: *const LaneWords,
    results: *mut LaneWords,
) {
    // Safety: as for `light_count`.
    unsafe { (HOST_TABLE.query)(user_of_call(user), base, active, query, operands, results) };
}
