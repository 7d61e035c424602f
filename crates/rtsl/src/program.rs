//! A class linked with those it refers to, and its kernels.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use rtsl_ir::class::Class;
use rtsl_ir::{Function, OpKind, Place, PlaceId, PlaceKind, Region};
use rtsl_jit::{InstanceBlock, LaneBlock};
use rtsl_packet::{Layout, Shape};
use rtsl_source::Diagnostic;
use rtsl_spec::{Method, StateVariable, lookup_state};

use crate::engine::{KernelRequest, Shared};
use crate::kernel::Kernel;
use crate::pipeline::{self, Job};
use crate::tree::{ClassTree, TreePlaces};
use crate::{Instance, errors};

/// A class, linked with the classes of the instances that it refers to. Its methods become
/// kernels when they are first asked for.
#[derive(Debug)]
pub struct Program {
    shared: Arc<Shared>,
    tree: ClassTree,
    places: TreePlaces,
    layout: Layout,
    methods: BTreeMap<Method, OnceLock<Result<Arc<LinkedMethod>, Diagnostic>>>,
    kernels: Mutex<BTreeMap<(Method, Shape), Arc<KernelCell>>>,
}

type KernelCell = OnceLock<Result<Arc<Kernel>, Diagnostic>>;

/// A method without references, optimised.
#[derive(Clone, Debug)]
pub struct LinkedMethod {
    /// What it does.
    pub function: Arc<Function>,
    /// What linking warned about.
    pub warnings: Vec<Diagnostic>,
    /// The state variables that it reads.
    pub reads: Vec<&'static StateVariable>,
    /// The state variables that it sets.
    pub writes: Vec<&'static StateVariable>,
}

impl Program {
    pub(crate) fn new(shared: Arc<Shared>, tree: ClassTree) -> Program {
        let places = tree.places();
        let layout = places.layout();
        let methods = tree.class.methods.keys().map(|method| (*method, OnceLock::new())).collect();
        Program { shared, tree, places, layout, methods, kernels: Mutex::default() }
    }

    /// The class.
    pub fn class(&self) -> &Arc<Class> {
        &self.tree.class
    }

    /// Whether the class has the method, itself or implied by others.
    pub fn has(&self, method: Method) -> bool {
        self.methods.contains_key(&method)
    }

    /// Where data lies.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The per-ray storage of the class, leaf by leaf; a leaf's arrays start at
    /// [`Layout::scratch`].
    pub fn scratch(&self) -> &[Place] {
        &self.places.scratch
    }

    /// Scratch for `lanes` rays, all zero.
    pub fn new_scratch(&self, lanes: usize) -> LaneBlock {
        LaneBlock::new(self.layout.scratch_arrays as usize, lanes)
    }

    /// The data of an instance, as this program's kernels read it.
    ///
    /// # Panics
    /// If the instance belongs to another program.
    pub fn block(&self, instance: &Instance) -> InstanceBlock {
        assert_eq!(ClassTree::of(instance).key(), self.tree.key(), "an instance of this program");
        instance.block(&self.layout)
    }

    /// A method, linked.
    ///
    /// # Errors
    /// If the class has no such method, or linking passes a limit.
    pub fn method(&self, method: Method) -> Result<Arc<LinkedMethod>, Diagnostic> {
        let Some(cell) = self.methods.get(&method) else {
            return Err(errors::missing_method(self.class(), method));
        };
        cell.get_or_init(|| {
            let linked = pipeline::link(&self.tree, method, &self.shared.options)?;
            Ok(Arc::new(LinkedMethod::new(linked.function, linked.warnings)))
        })
        .clone()
    }

    /// The kernel of a method, made at the first call.
    ///
    /// # Errors
    /// As for [`Program::method`], or if code generation fails.
    pub fn kernel(&self, method: Method, shape: Shape) -> Result<Arc<Kernel>, Diagnostic> {
        self.cell(method, shape).get_or_init(|| self.make_kernel(method, shape)).clone()
    }

    fn cell(&self, method: Method, shape: Shape) -> Arc<KernelCell> {
        let mut kernels = self.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        kernels.entry((method, shape)).or_default().clone()
    }

    /// Whether the kernel has been made, well or not.
    pub(crate) fn has_made(&self, method: Method, shape: Shape) -> bool {
        self.cell(method, shape).get().is_some()
    }

    /// Makes kernels together. What fails is left to be made one by one, so that each gets its own
    /// error.
    pub(crate) fn make_together(requests: &[&KernelRequest], shared: &Shared) {
        let methods = requests.iter().map(|(program, method, _)| program.method(*method));
        let Ok(methods) = methods.collect::<Result<Vec<_>, _>>() else { return };
        let jobs = requests.iter().zip(&methods).map(|((program, _, shape), method)| Job {
            function: &method.function,
            shape: *shape,
            layout: &program.layout,
        });
        let Ok(kernels) = pipeline::kernels(&jobs.collect::<Vec<_>>(), shared) else { return };
        for ((program, method, shape), kernel) in requests.iter().zip(kernels) {
            // Somebody may have been faster; one kernel is as good as the other.
            let _ = program.cell(*method, *shape).set(Ok(Arc::new(kernel)));
        }
    }

    pub(crate) fn shared(&self) -> &Shared {
        &self.shared
    }

    fn make_kernel(&self, method: Method, shape: Shape) -> Result<Arc<Kernel>, Diagnostic> {
        let method = self.method(method)?;
        let job = Job { function: &method.function, shape, layout: &self.layout };
        let mut kernels = pipeline::kernels(&[job], &self.shared)?;
        Ok(Arc::new(kernels.remove(0)))
    }
}

impl LinkedMethod {
    fn new(function: Function, warnings: Vec<Diagnostic>) -> LinkedMethod {
        let reads = state_places(&function, |function, place| is_loaded(&function.body, place));
        let writes = state_places(&function, |function, place| {
            function.outputs.iter().any(|output| output.place == place)
        });
        LinkedMethod { function: Arc::new(function), warnings, reads, writes }
    }
}

/// The variables of the state places for which `wanted` holds, in the order of the one table.
fn state_places(
    function: &Function,
    wanted: impl Fn(&Function, PlaceId) -> bool,
) -> Vec<&'static StateVariable> {
    let places = (0..).map(PlaceId).zip(&function.places);
    let states =
        places.filter(|(id, place)| place.kind == PlaceKind::State && wanted(function, *id));
    let mut variables: Vec<_> = states.filter_map(|(_, place)| lookup_state(&place.name)).collect();
    variables.sort_by_key(|variable| variable.index);
    variables
}

fn is_loaded(region: &Region, place: PlaceId) -> bool {
    region.ops.iter().any(|op| match &op.kind {
        OpKind::Load(loaded, _) => *loaded == place,
        kind => kind.regions().any(|region| is_loaded(region, place)),
    })
}
