//! Kernels of the instances of one program, and the selection of instances for a call.

use std::sync::Arc;

use rtsl::{
    CallMode, Diagnostic, Diagnostics, Engine, Instances, Kernel, KernelRequest, LaneIndices,
    Method, Objects, Outputs, Program, QueryForm, QueryRequest, Variant,
};

/// The selection of instances for calls.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Batching {
    /// This one for all lanes.
    One(u32),
    /// One for each lane, by index.
    Each,
}

impl Batching {
    /// Returns the call mode of kernels for such calls.
    pub fn shape(self) -> CallMode {
        match self {
            Batching::One(_) => CallMode::Packet,
            Batching::Each => CallMode::Stream,
        }
    }

    /// Returns the instances of a call.
    pub fn instances<'a>(self, objects: &'a Objects, indices: &'a LaneIndices) -> Instances<'a> {
        match self {
            Batching::One(index) => Instances::Object(objects, index),
            Batching::Each => Instances::Many(objects, indices),
        }
    }
}

/// Compiles kernels. A builder that needs many runs twice: first to collect its requests, so that all are compiled in
/// parallel, then with the kernels.
pub struct KernelMaker<'a> {
    engine: &'a Engine,
    /// The requests so far; `None` once kernels are compiled.
    requests: Option<Requests>,
    diagnostics: Diagnostics,
}

/// Requests for kernels.
#[derive(Default)]
struct Requests {
    methods: Vec<KernelRequest>,
    queries: Vec<QueryRequest>,
}

impl<'a> KernelMaker<'a> {
    /// Runs `build` to collect requests, compiles them, and runs it again.
    ///
    /// # Errors
    /// If a kernel cannot be compiled.
    pub fn build_with<T>(
        engine: &'a Engine,
        mut build: impl FnMut(&mut KernelMaker<'a>) -> T,
    ) -> Result<(T, Diagnostics), Diagnostics> {
        let mut maker = KernelMaker {
            engine,
            requests: Some(Requests::default()),
            diagnostics: Diagnostics::new(),
        };
        build(&mut maker);
        let Requests { methods, queries } = maker.requests.take().unwrap_or_default();
        // Programs keep the compiled kernels.
        drop(engine.compile_all(&methods));
        drop(engine.compile_queries(&queries));
        let built = build(&mut maker);
        if maker.diagnostics.has_errors() {
            Err(maker.diagnostics)
        } else {
            Ok((built, maker.diagnostics))
        }
    }

    /// Returns the kernel of a method for these objects; `None` if the class has no such method, or while requests are
    /// collected.
    pub fn kernel(
        &mut self,
        program: &Arc<Program>,
        method: Method,
        of: Batching,
        objects: &Objects,
        outputs: Outputs,
    ) -> Option<Arc<Kernel>> {
        let variant = Variant::new(of.shape()).of_objects(objects.form().clone()).reading(outputs);
        self.kernel_of(program, method, variant.knowing(program.known_choices(objects)))
    }

    /// The same for any variant.
    pub fn kernel_of(
        &mut self,
        program: &Arc<Program>,
        method: Method,
        variant: Variant,
    ) -> Option<Arc<Kernel>> {
        if !program.has(method) {
            return None;
        }
        if let Some(requests) = &mut self.requests {
            requests.methods.push(KernelRequest::new(program, method, variant));
            return None;
        }
        self.note(program.kernel(method, variant))
    }

    /// Returns a kernel that answers a query about these objects, which may have placements; `None` while requests are
    /// collected.
    pub fn query(
        &mut self,
        program: &Arc<Program>,
        of: Batching,
        objects: &Objects,
        is_placed: bool,
        form: QueryForm,
    ) -> Option<Arc<Kernel>> {
        let variant = Variant::new(of.shape()).of_objects(objects.form().clone());
        let variant = variant.knowing(program.known_choices(objects));
        let variant = if is_placed { variant.placed() } else { variant };
        let request = QueryRequest { program: program.clone(), form, variant };
        if let Some(requests) = &mut self.requests {
            requests.queries.push(request);
            return None;
        }
        self.note(request.kernel())
    }

    /// Returns the engine.
    pub fn engine(&self) -> &'a Engine {
        self.engine
    }

    /// Unwraps a result; the first error is reported once at the end.
    fn note<T>(&mut self, made: Result<T, Diagnostic>) -> Option<T> {
        match made {
            Ok(made) => Some(made),
            Err(problem) => {
                if !self.diagnostics.iter().any(|known| known.message == problem.message) {
                    self.diagnostics.push(problem);
                }
                None
            }
        }
    }
}
