//! A call of a method for whole arrays: chunk by chunk, on threads.
//!
//! Kernels work on an array for each component, while arrays of Python have a row for each ray. A chunk of rays is read
//! from the rows into a block that stays in the processor's cache, and its results are written back: the arrays
//! themselves are never copied. Every chunk gives the same bits on any thread.

use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use numpy::{PyReadonlyArray2, PyReadwriteArray2};
use pyo3::prelude::*;
use rtsl::{
    CallArguments, CallMode, Derivation, InstanceBlock, Instances, Kernel, LaneBlock, LaneMask,
    LinkedMethod, LoopOwners, Method, Program, Role, StateVariable, default_components,
    derived_components, lookup_state, state_component_count,
};

use crate::array_host::{ArrayHost, HostAnswers};
use crate::columns::{Input, LaneAxis, Output, VectorInput};
use crate::detached::detached;
use crate::engine::PyEngine;
use crate::error::Exception;
use crate::instance::PyInstance;
use crate::method::method_of_name;

/// The rays of a chunk: few enough that their state stays in the first caches, and enough that a call of a kernel
/// costs nothing beside them.
const CHUNK: usize = 1024;

/// The interval of looking for interrupts.
const SIGNALS_EVERY: Duration = Duration::from_millis(50);

/// The stack of a thread, for methods on the interpreter.
const STACK_BYTES: usize = 16 << 20;

/// Calls a method of an instance for `lanes` rays.
///
/// State and results are arrays by the names of variables, with a row for each ray; scratch has a column for each ray.
/// A mask and the accepted hits are bytes of 0 and 1.
#[pyfunction]
#[pyo3(signature = (
    engine, instance, method, lanes, inputs, outputs, *, scratch=None, scratch_out=None, hit=None,
    mask=None, host=None, threads=None
))]
#[allow(clippy::too_many_arguments, reason = "the keywords of one call of Python")]
pub fn call(
    py: Python<'_>,
    engine: &PyEngine,
    instance: &PyInstance,
    method: &str,
    lanes: usize,
    inputs: Vec<(String, PyReadonlyArray2<'_, f32>)>,
    outputs: Vec<(String, PyReadwriteArray2<'_, f32>)>,
    scratch: Option<PyReadonlyArray2<'_, u32>>,
    scratch_out: Option<PyReadwriteArray2<'_, u32>>,
    hit: Option<PyReadwriteArray2<'_, u8>>,
    mask: Option<PyReadonlyArray2<'_, u8>>,
    host: Option<HostAnswers>,
    threads: Option<usize>,
) -> PyResult<()> {
    let method = method_of_name(method)?;
    let program = engine.program(&instance.instance);
    let block = program.block(&instance.instance);
    let made = detached(py, || {
        let linked = program.method(method)?;
        Ok((linked, program.kernel(method, CallMode::Packet)?))
    })?;
    let (linked, kernel) = made.map_err(|problem| Exception::Error.of_diagnostic(&problem))?;
    let mut state = StatePlan::new(&program, method, &linked, &kernel);
    for (name, array) in &inputs {
        state.set_input(variable(name)?, Input::all(array, LaneAxis::Rows));
    }
    if let Some(role) = program.class().role_of(method) {
        state.derive(role, method);
    }
    let mut results = Vec::new();
    for (name, array) in &outputs {
        let first = variable(name)?.first_component;
        let columns = Output::all(array, LaneAxis::Rows)?;
        results.extend((first..).zip(columns));
    }
    let call = ArrayCall {
        kernel: &kernel,
        program: &program,
        method,
        block: &block,
        fills: state.into_fills(&results),
        results,
        scratch: scratch.as_ref().map(|array| Input::all(array, LaneAxis::Columns)),
        scratch_results: match &scratch_out {
            Some(array) => Output::all(array, LaneAxis::Columns)?,
            None => Vec::new(),
        },
        hit: match &hit {
            Some(array) => Output::all(array, LaneAxis::Rows)?.pop(),
            None => None,
        },
        mask: mask.as_ref().and_then(|array| Input::all(array, LaneAxis::Rows).pop()),
        host: ArrayHost::new(host),
        lanes,
        next: AtomicUsize::new(0),
        stop: AtomicBool::new(false),
        is_exhausted: AtomicBool::new(false),
        problem: Mutex::default(),
    };
    detached(py, || call.run(threads))??;
    call.finish(engine)
}

/// Returns the state variable of this name.
fn variable(name: &str) -> PyResult<&'static StateVariable> {
    lookup_state(name)
        .ok_or_else(|| Exception::Error.with_text(&format!("there is no state variable `{name}`")))
}

/// The origin of a component's values before a call.
enum Fill<'a> {
    /// A value for each lane.
    Lanes(Input<'a, f32>),
    /// Values of this component and the two that follow it.
    Vectors(VectorInput<'a>),
    /// That of a component before.
    Done,
    /// The same for all lanes.
    Value(f32),
    /// Computed from other components.
    Derived(Derivation),
}

/// A component with the origin of its values.
struct ComponentFill<'a> {
    component: u32,
    fill: Fill<'a>,
    /// True if the method may change it, so that every chunk begins with its values again.
    is_changed: bool,
}

/// The state of a call while it is planned.
struct StatePlan<'a> {
    fills: Vec<Option<Fill<'a>>>,
    given: Vec<bool>,
    needed: Vec<bool>,
    changed: Vec<bool>,
}

impl<'a> StatePlan<'a> {
    /// Begins with the defaults of the class's role.
    fn new(program: &Program, method: Method, linked: &LinkedMethod, kernel: &Kernel) -> Self {
        let count = state_component_count() as usize;
        let mut fills: Vec<Option<Fill<'a>>> = (0..count).map(|_| None).collect();
        if let Some(role) = program.class().role_of(method) {
            for (component, value) in default_components(role) {
                fills[component as usize] = Some(Fill::Value(value));
            }
        }
        let mut needed = vec![false; count];
        kernel.state_components().iter().for_each(|it| needed[it as usize] = true);
        let mut changed = vec![false; count];
        for variable in &linked.writes {
            components(variable).for_each(|it| changed[it as usize] = true);
        }
        StatePlan { fills, given: vec![false; count], needed, changed }
    }

    fn set_input(&mut self, variable: &StateVariable, columns: Vec<Input<'a, f32>>) {
        if let Some(vectors) = Input::vectors(&columns) {
            self.set_vectors(variable, vectors);
            return;
        }
        for (component, column) in components(variable).zip(columns) {
            self.given[component as usize] = true;
            let fill = column.uniform().map_or_else(|| Fill::Lanes(column), Fill::Value);
            self.fills[component as usize] = Some(fill);
        }
    }

    /// Sets all components of a vector at once.
    fn set_vectors(&mut self, variable: &StateVariable, vectors: VectorInput<'a>) {
        let range = variable.first_component as usize..components(variable).end as usize;
        self.given[range.clone()].fill(true);
        self.needed[range.clone()].fill(true);
        for fill in &mut self.fills[range.clone()] {
            *fill = Some(Fill::Done);
        }
        self.fills[range.start] = Some(Fill::Vectors(vectors));
    }

    /// Plans what hosts compute for every ray, such as the reciprocal of its direction.
    fn derive(&mut self, role: Role, method: Method) {
        let is_given = |it: &StateVariable| self.given[it.first_component as usize];
        let derived = derived_components(role, method, is_given);
        // What is computed from others needs them, so it comes before them here.
        for (component, derivation) in derived.into_iter().rev() {
            if self.needed[component as usize] {
                derivation.sources().iter().for_each(|it| self.needed[*it as usize] = true);
                self.fills[component as usize] = Some(Fill::Derived(derivation));
            }
        }
    }

    /// Returns the components that the call has, those that others are derived from first.
    fn into_fills(self, results: &[(u32, Output<'a, f32>)]) -> Vec<ComponentFill<'a>> {
        let StatePlan { fills, mut needed, changed, .. } = self;
        results.iter().for_each(|(component, _)| needed[*component as usize] = true);
        let fills = (0..).zip(fills).filter(|(component, _)| needed[*component as usize]);
        let mut fills: Vec<ComponentFill<'a>> = fills
            .map(|(component, fill)| ComponentFill {
                component,
                fill: fill.unwrap_or(Fill::Value(0.0)),
                is_changed: changed[component as usize],
            })
            .collect();
        fills.sort_by_key(|it| match it.fill {
            Fill::Derived(Derivation::SameAs(_)) => 2,
            Fill::Derived(_) => 1,
            Fill::Lanes(_) | Fill::Vectors(_) | Fill::Done | Fill::Value(_) => 0,
        });
        fills
    }
}

fn components(variable: &StateVariable) -> std::ops::Range<u32> {
    variable.first_component..variable.first_component + variable.ty.components()
}

/// A call in progress.
struct ArrayCall<'a> {
    kernel: &'a Kernel,
    program: &'a Program,
    method: Method,
    block: &'a InstanceBlock,
    fills: Vec<ComponentFill<'a>>,
    /// The results by component.
    results: Vec<(u32, Output<'a, f32>)>,
    /// By array of scratch.
    scratch: Option<Vec<Input<'a, u32>>>,
    scratch_results: Vec<Output<'a, u32>>,
    hit: Option<Output<'a, u8>>,
    mask: Option<Input<'a, u8>>,
    host: ArrayHost,
    lanes: usize,
    /// The first chunk that nobody has taken.
    next: AtomicUsize,
    stop: AtomicBool,
    is_exhausted: AtomicBool,
    problem: Mutex<Option<String>>,
}

/// The memory of a thread for its chunks.
struct ChunkMemory {
    state: LaneBlock,
    scratch: LaneBlock,
    mask: LaneMask,
    accepted: LaneMask,
    host: ArrayHost,
    bytes: Vec<u8>,
}

impl ArrayCall<'_> {
    /// Makes the call on threads. The calling thread, which takes part, looks for interrupts.
    ///
    /// # Errors
    /// The exception of an interrupt.
    fn run(&self, threads: Option<usize>) -> PyResult<()> {
        let chunks = self.lanes.div_ceil(CHUNK);
        let processors = || std::thread::available_parallelism().map_or(1, usize::from);
        // The system takes long to tell its processors, compared with a call for a few rays.
        let wanted = if chunks > 1 { threads.unwrap_or_else(processors) } else { 1 };
        let threads = wanted.clamp(1, chunks.max(1));
        std::thread::scope(|scope| {
            for _ in 1..threads {
                let thread = std::thread::Builder::new().stack_size(STACK_BYTES);
                // With fewer threads than wanted the results are the same.
                let _ = thread.spawn_scoped(scope, || self.take_chunks(&mut || Ok(())));
            }
            let mut looked = Instant::now();
            self.take_chunks(&mut || {
                if looked.elapsed() < SIGNALS_EVERY {
                    return Ok(());
                }
                looked = Instant::now();
                Python::attach(|py| py.check_signals())
            })
        })
    }

    fn take_chunks(&self, check: &mut dyn FnMut() -> PyResult<()>) -> PyResult<()> {
        let mut memory = self.memory();
        loop {
            let chunk = self.next.fetch_add(1, Ordering::Relaxed);
            let first = chunk.saturating_mul(CHUNK);
            if first >= self.lanes || self.stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            let count = CHUNK.min(self.lanes - first);
            if let Err(problem) = self.call_chunk(&mut memory, first, count) {
                let mut kept = self.problem.lock().unwrap_or_else(PoisonError::into_inner);
                kept.get_or_insert(problem);
                self.stop.store(true, Ordering::Relaxed);
            }
            if let Err(interrupt) = check() {
                self.stop.store(true, Ordering::Relaxed);
                return Err(interrupt);
            }
        }
    }

    fn memory(&self) -> ChunkMemory {
        let lanes = CHUNK.min(self.lanes);
        let present: Vec<u32> = self.fills.iter().map(|it| it.component).collect();
        let mut state = LaneBlock::sparse(state_component_count() as usize, &present, lanes);
        for ComponentFill { component, fill, .. } in &self.fills {
            if let Fill::Value(value) = fill {
                state.floats_mut(*component as usize).fill(*value);
            }
        }
        ChunkMemory {
            state,
            scratch: self.program.new_scratch(lanes),
            mask: LaneMask::new(lanes),
            accepted: LaneMask::new(lanes),
            host: self.host.clone(),
            bytes: vec![0; lanes],
        }
    }

    fn call_chunk(
        &self,
        memory: &mut ChunkMemory,
        first: usize,
        count: usize,
    ) -> Result<(), String> {
        self.fill_state(&mut memory.state, first, count);
        self.fill_scratch(&mut memory.scratch, first, count);
        if let Some(mask) = &self.mask {
            mask.read(first, &mut memory.bytes[..count]);
            for (word, byte) in memory.mask.words_mut().iter_mut().zip(&memory.bytes[..count]) {
                *word = if *byte == 0 { 0 } else { u32::MAX };
            }
        }
        memory.host.begin(first, count);
        let status = self.kernel.try_call(CallArguments {
            state: &mut memory.state,
            scratch: &mut memory.scratch,
            count,
            mask: self.mask.as_ref().map(|_| &memory.mask),
            accepted: Some(&mut memory.accepted),
            instances: Instances::One(self.block),
            host: &mut memory.host,
        });
        let status = status.map_err(|error| error.to_string())?;
        if status.budget_exhausted {
            self.is_exhausted.store(true, Ordering::Relaxed);
        }
        for (component, column) in &self.results {
            column.write(first, &memory.state.floats(*component as usize)[..count]);
        }
        for (array, column) in self.scratch_results.iter().enumerate() {
            column.write(first, &memory.scratch.words(array)[..count]);
        }
        if let Some(hit) = &self.hit {
            let words = memory.accepted.words().iter();
            for (byte, word) in memory.bytes.iter_mut().zip(words) {
                *byte = u8::from(*word != 0);
            }
            hit.write(first, &memory.bytes[..count]);
        }
        Ok(())
    }

    fn fill_state(&self, state: &mut LaneBlock, first: usize, count: usize) {
        for ComponentFill { component, fill, is_changed } in &self.fills {
            let component = *component as usize;
            match fill {
                Fill::Value(value) if *is_changed => state.floats_mut(component).fill(*value),
                Fill::Value(_) | Fill::Done => {}
                Fill::Vectors(input) => {
                    let parts = state.vectors_mut::<3>(component);
                    input.read(first, count, parts.map(|it| &mut it[..count]));
                }
                Fill::Lanes(input) => {
                    input.read(first, &mut state.floats_mut(component)[..count]);
                }
                Fill::Derived(derivation) => derivation.set(state, component as u32, count),
            }
        }
    }

    /// Sets scratch to what an earlier call left, or to zeros.
    fn fill_scratch(&self, scratch: &mut LaneBlock, first: usize, count: usize) {
        for array in 0..scratch.components() {
            let words = &mut scratch.words_mut(array)[..count];
            match self.scratch.as_ref().and_then(|arrays| arrays.get(array)) {
                Some(input) => input.read(first, words),
                None => words.fill(0),
            }
        }
    }

    /// Reports what went wrong.
    fn finish(self, engine: &PyEngine) -> PyResult<()> {
        let problem = self.problem.into_inner().unwrap_or_else(PoisonError::into_inner);
        if let Some(problem) = problem {
            return Err(Exception::Error.with_text(&problem));
        }
        if self.is_exhausted.into_inner() {
            let owners = LoopOwners::of(&self.program.class().name, self.method, [self.program]);
            let budget = engine.engine.options().loop_budget.unwrap_or(u32::MAX);
            let message = format!(
                "{} used up its budget of {budget} loop iterations; its loop may never end",
                owners.subject()
            );
            return Err(Exception::Error.with_text(&message));
        }
        Ok(())
    }
}
