//! Kernels of the stages of integrators.

use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};

use rtsl_abi::Layout;
use rtsl_ir::{Function, Index, OpKind, Query, VariableKind};
use rtsl_source::Diagnostic;
use rtsl_spec::lookup_state;
use rtsl_stages::Port;

use super::engine::{Engine, into_modules, on_threads};
use crate::codegen::kernel::Kernel;
use crate::codegen::kernel_source::KernelSource;
use crate::codegen::variant::Variant;
use crate::link::unread_slots;
use crate::program::staged_program::{PATH_COLUMNS, StageRequest, StagedProgram};

/// A kernel of a stage, with the data that it reads and sets.
#[derive(Debug)]
pub struct StageKernel {
    /// The kernel.
    pub kernel: Arc<Kernel>,
    /// The scratch arrays of the stage that it reads.
    pub reads: Vec<usize>,
    /// The scratch arrays of ports that it stores.
    pub ports: Vec<usize>,
    /// The scratch arrays of the integrator that it stores for paths that end.
    pub outputs: Vec<usize>,
    /// The components of state that it stores for paths that end.
    pub state: Vec<usize>,
    /// The queries that it asks of the host.
    pub queries: BTreeSet<Query>,
    /// The components of state that it reads.
    pub reads_state: Vec<usize>,
}

/// A linked stage on its way to code.
struct Linked {
    function: Function,
    layout: Layout,
    variant: Variant,
}

impl Engine {
    /// Makes kernels of stages on all processors; the results are in the order of the requests, which are those for all
    /// stages and all surfaces of a scene: kernels leave out what none of them reads.
    pub fn stage_kernels(
        &self,
        program: &StagedProgram,
        requests: &[StageRequest],
    ) -> Vec<Result<StageKernel, Diagnostic>> {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let linked: Vec<OnceLock<Result<Linked, Diagnostic>>> =
            requests.iter().map(|_| OnceLock::new()).collect();
        on_threads(threads, requests.len(), |index| {
            let made =
                crate::nesting::with_deep_stack(|| program.link(&requests[index], self.compiler()));
            let made = made.map(|(function, layout, variant)| Linked { function, layout, variant });
            let _ = linked[index].set(made);
        });
        let mut linked = linked;
        let made = linked.iter_mut().zip(requests).filter_map(|(linked, request)| {
            Some((request.stage, &mut linked.get_mut()?.as_mut().ok()?.function))
        });
        crate::nesting::with_deep_stack(|| unread_slots::remove(&mut made.collect::<Vec<_>>()));
        let usable: Vec<usize> = (0..requests.len())
            .filter(|index| matches!(linked[*index].get(), Some(Ok(_))))
            .collect();
        let kernels: Vec<OnceLock<Result<Kernel, Diagnostic>>> =
            requests.iter().map(|_| OnceLock::new()).collect();
        let source = |index: usize| -> Option<KernelSource<'_>> {
            let Linked { function, layout, variant } = linked[index].get()?.as_ref().ok()?;
            Some(KernelSource::new(function, variant, layout, self.width()))
        };
        let size = |index: &usize| source(*index).map_or(0, |it| it.function.values.len());
        let sizes: Vec<usize> = usable.iter().map(size).collect();
        let modules = into_modules(&sizes, threads);
        on_threads(threads, modules.len(), |module| {
            let members: Vec<usize> = modules[module].iter().map(|it| usable[*it]).collect();
            let sources: Vec<KernelSource<'_>> =
                members.iter().filter_map(|index| source(*index)).collect();
            if let Ok(made) = self.compiler().kernels(&sources) {
                for (index, kernel) in members.iter().zip(made) {
                    let _ = kernels[*index].set(Ok(kernel));
                }
                return;
            }
            // One by one, so that each has an error of its own.
            for (index, source) in members.iter().zip(sources) {
                let made = self.compiler().kernels(&[source]);
                let _ = kernels[*index].set(made.map(|mut made| made.remove(0)));
            }
        });
        let finished = linked.into_iter().zip(kernels);
        finished
            .map(|(linked, kernel)| {
                let linked = linked.into_inner().expect("every request was linked")?;
                let kernel = kernel.into_inner().expect("every linked stage was compiled")?;
                Ok(StageKernel::new(kernel, &linked))
            })
            .collect()
    }
}

impl StageKernel {
    fn new(kernel: Kernel, Linked { function, layout, .. }: &Linked) -> StageKernel {
        let mut made = StageKernel {
            kernel: Arc::new(kernel),
            reads: Vec::new(),
            ports: Vec::new(),
            outputs: Vec::new(),
            state: Vec::new(),
            queries: BTreeSet::new(),
            reads_state: Vec::new(),
        };
        let (mut reads, mut read_state) = (BTreeSet::new(), BTreeSet::new());
        function.body.for_each_op(&mut |op| match &op.kind {
            OpKind::Load(variable, index) => {
                let variable = function.variable(*variable);
                let is_own =
                    Port::of(variable).is_some() || PATH_COLUMNS.contains(&variable.name.as_str());
                if variable.kind == VariableKind::Scratch && is_own {
                    debug_assert_eq!(*index, Index::Constant(0), "ports have one scalar");
                    reads.insert(layout.scratch[&variable.name] as usize);
                }
                if variable.kind == VariableKind::State
                    && let Some(state) = lookup_state(&variable.name)
                {
                    let first = state.first_component as usize;
                    read_state.extend(first..first + variable.len as usize);
                }
            }
            OpKind::Query(query, _) => {
                made.queries.insert(*query);
            }
            _ => {}
        });
        made.reads = reads.into_iter().collect();
        made.reads_state = read_state.into_iter().collect();
        for output in &function.outputs {
            let variable = function.variable(output.variable);
            let component = output.component as usize;
            match variable.kind {
                VariableKind::Scratch => {
                    let array = layout.scratch[&variable.name] as usize + component;
                    let is_port = Port::of(variable).is_some()
                        || PATH_COLUMNS.contains(&variable.name.as_str());
                    if is_port { &mut made.ports } else { &mut made.outputs }.push(array);
                }
                VariableKind::State => {
                    let first = lookup_state(&variable.name).map_or(0, |it| it.first_component);
                    made.state.push(first as usize + component);
                }
                _ => {}
            }
        }
        made
    }
}
