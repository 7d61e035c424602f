//! Kernels of instances of one program, and which instances a call of them is for.

use std::sync::Arc;

use rtsl::{
    CallMode, Diagnostic, Diagnostics, Engine, Instances, Kernel, KernelRequest, LaneIndices,
    Method, ObjectForm, Objects, Outputs, Program, Variant,
};

/// Which of several instances calls are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Batching {
    /// This one, for all lanes.
    One(u32),
    /// One for each lane, by its number.
    Each,
}

impl Batching {
    /// The shape of kernels for such calls.
    pub fn shape(self) -> CallMode {
        match self {
            Batching::One(_) => CallMode::Packet,
            Batching::Each => CallMode::Stream,
        }
    }

    /// The instances of a call.
    pub fn instances<'a>(self, objects: &'a Objects, numbers: &'a LaneIndices) -> Instances<'a> {
        match self {
            Batching::One(number) => Instances::Object(objects, number),
            Batching::Each => Instances::Many(objects, numbers),
        }
    }
}

/// Makes kernels. What needs many is put together twice: first to learn which it needs, so that all are
/// compiled at a time, then with them.
pub struct KernelMaker<'a> {
    engine: &'a Engine,
    /// What was asked for; `None` once kernels are made.
    requests: Option<Vec<KernelRequest>>,
    problems: Diagnostics,
}

impl<'a> KernelMaker<'a> {
    /// Makes what `build` asks for, and builds with it.
    ///
    /// # Errors
    /// What hinders a kernel from being made.
    pub fn build_with<T>(
        engine: &'a Engine,
        mut build: impl FnMut(&mut KernelMaker<'a>) -> T,
    ) -> Result<(T, Diagnostics), Diagnostics> {
        let mut maker =
            KernelMaker { engine, requests: Some(Vec::new()), problems: Diagnostics::new() };
        build(&mut maker);
        let requests = maker.requests.take().unwrap_or_default();
        // Programs keep them.
        drop(engine.compile_all(&requests));
        let built = build(&mut maker);
        if maker.problems.has_errors() { Err(maker.problems) } else { Ok((built, maker.problems)) }
    }

    /// A kernel of a method for objects of a form; `None` if the class has no such method, and while it is
    /// only asked for.
    pub fn kernel(
        &mut self,
        program: &Arc<Program>,
        method: Method,
        (of, form): (Batching, &ObjectForm),
        outputs: Outputs,
    ) -> Option<Arc<Kernel>> {
        let variant = Variant::new(of.shape()).of_objects(form.clone()).reading(outputs);
        self.kernel_of(program, method, variant)
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
            requests.push(KernelRequest::new(program, method, variant));
            return None;
        }
        self.note(program.kernel(method, variant))
    }

    /// The engine.
    pub fn engine(&self) -> &'a Engine {
        self.engine
    }

    /// What was made; a failure is reported in the end, once.
    fn note<T>(&mut self, made: Result<T, Diagnostic>) -> Option<T> {
        match made {
            Ok(made) => Some(made),
            Err(problem) => {
                if !self.problems.iter().any(|known| known.message == problem.message) {
                    self.problems.push(problem);
                }
                None
            }
        }
    }
}
