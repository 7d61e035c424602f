//! The instance under test, with its program.

use std::cell::RefCell;
use std::ops::Range;
use std::sync::Arc;

use rtsl::host::Host;
use rtsl::{
    CallArguments, CallMode, Engine, Instance, InstanceBlock, Instances, LaneMask, Method, Program,
    Query, Role, lookup_state, new_state, set_defaults,
};

use crate::contract::Contract;
use crate::options::Options;
use crate::random::Stream;
use crate::rays::{RandomHost, Rays};
use crate::report::{Finding, Inputs};
use crate::stop::Stop;
use crate::tally::Tally;

/// A number of rays whose state fits into a processor's cache.
const BATCH: usize = 2048;

/// The instance under test.
pub struct Subject<'a> {
    pub options: &'a Options,
    program: Arc<Program>,
    block: InstanceBlock,
    /// True if `BSDF` gives other shaders another shading normal than its own.
    pub turns_normals: bool,
    /// The outcomes of calls with respect to their budget.
    calls: RefCell<Tally>,
}

impl<'a> Subject<'a> {
    pub fn new(engine: &Engine, instance: &Arc<Instance>, options: &'a Options) -> Subject<'a> {
        let program = engine.program(instance);
        let block = program.block(instance);
        let calls = RefCell::new(Tally::new(Contract::Budget));
        let turns_normals = lookup_state("rt_ShadingNormal")
            .is_some_and(|normal| instance.passes_state(Method::Bsdf, normal));
        Subject { options, program, block, turns_normals, calls }
    }

    /// Returns the random numbers for one kind of test.
    pub fn stream(&self, contract: Contract) -> Stream {
        Stream::new(self.options.seed).at(contract as u64)
    }

    /// True if the class has the method, or it is implied by others.
    pub fn has(&self, method: Method) -> bool {
        self.program.has(method)
    }

    /// True if a method makes each of these queries.
    ///
    /// # Errors
    /// If the method cannot be linked.
    pub fn asks(&self, method: Method, queries: &[Query]) -> Result<bool, Stop> {
        if !self.has(method) {
            return Ok(false);
        }
        let linked = self.program.method(method)?;
        Ok(queries.iter().all(|query| linked.asks(*query)))
    }

    /// Returns rays with the defaults of a role. Their indices select the values of `rand()`.
    pub fn rays(&self, role: Role, stream: Stream, numbers: Range<u64>) -> Rays {
        let count = (numbers.end - numbers.start) as usize;
        let mut state = new_state(count);
        set_defaults(&mut state, role);
        Rays {
            state,
            scratch: self.program.new_scratch(count),
            accepted: LaneMask::new(count),
            host: RandomHost::new(stream, numbers.start, count),
            count,
        }
    }

    /// Calls a method for all rays.
    ///
    /// # Errors
    /// If the method cannot be compiled or does not terminate.
    pub fn call(&self, method: Method, rays: &mut Rays) -> Result<(), Stop> {
        self.call_with(method, rays, None)
    }

    /// Calls a method for all rays with this host instead of theirs.
    ///
    /// # Errors
    /// If the method cannot be compiled or does not terminate.
    pub fn call_with(
        &self,
        method: Method,
        rays: &mut Rays,
        host: Option<&mut dyn Host>,
    ) -> Result<(), Stop> {
        let kernel = self.program.kernel(method, CallMode::Packet)?;
        let Rays { state, scratch, accepted, host: own, count } = rays;
        let status = kernel.call(CallArguments {
            state,
            scratch,
            count: *count,
            mask: None,
            accepted: (method == Method::Intersect).then_some(accepted),
            instances: Instances::One(&self.block),
            host: host.unwrap_or(own),
        });
        let ends = !status.budget_exhausted;
        self.calls
            .borrow_mut()
            .test(ends, || format!("{} ran past its budget of loop iterations", method.name()));
        if ends { Ok(()) } else { Err(Stop::Endless) }
    }

    /// Returns the inputs of a method in one ray's state.
    ///
    /// # Errors
    /// If the method cannot be compiled or does not terminate.
    pub fn inputs(&self, method: Method, rays: &Rays, ray: usize) -> Result<Inputs, Stop> {
        let linked = self.program.method(method)?;
        let state = linked.reads.iter().map(|variable| {
            let first = variable.first_component as usize;
            let components = first..first + variable.ty.components() as usize;
            (variable.name, components.map(|it| rays.state.floats(it)[ray]).collect())
        });
        Ok(Inputs { method, state: state.collect() })
    }

    /// Returns the finding that all calls terminated within their budget.
    pub fn budget_finding(self) -> Finding {
        self.calls.into_inner().finish("nothing was called")
    }
}

/// Splits a range into batches.
pub fn batches(numbers: Range<u64>) -> impl Iterator<Item = Range<u64>> {
    let end = numbers.end;
    numbers.step_by(BATCH).map(move |start| start..end.min(start + BATCH as u64))
}
