//! Kernels: methods that are called for many rays.

use std::sync::Arc;

use rtsl_abi::{
    CallArguments, CallError, CallStatus, ComponentSet, HostArguments, Instances, LaneBlock,
    LaneMask, LeafArguments, Objects,
};
use rtsl_ir::host::Host;
use rtsl_jit::CompiledKernel;

use super::counted::CountedKernel;
use super::interpreted::InterpretedKernel;

/// A method that is called for many rays. Machine code and the interpreter are called alike and give the same bits.
///
/// ```
/// # let text = "class Ball : rt_Primitive; [[min 0]] public float radius = 1.0;
/// #     void intersect() { hit(-rt_RayOrigin.z - radius); }
/// #     void computeNormal() { rt_GeometricNormal = rt_HitPoint; }";
/// # let unit = rtsl::Compiler::default().compile("ball.rtsl", text).unit.expect("it compiles");
/// # let class = unit.class("Ball")?;
/// # let (engine, _) = rtsl::Engine::new(rtsl::EngineOptions::default())?;
/// # let ball = rtsl::Instance::new(class, [("radius", 2.0.into())])?;
/// # let program = engine.program(&ball);
/// use rtsl::{CallArguments, Instances, LaneMask, Method, Role, CallMode, host::NoHost, lookup_state};
///
/// let kernel = program.kernel(Method::Intersect, CallMode::Packet)?;
/// let mut state = rtsl::new_state(100);
/// rtsl::set_defaults(&mut state, Role::Primitive);
/// let first = |name| lookup_state(name).expect("the table has it").first_component as usize;
/// state.floats_mut(first("rt_RayOrigin") + 2).fill(-5.0);
/// let mut accepted = LaneMask::new(100);
/// let status = kernel.call(CallArguments {
///     state: &mut state,
///     scratch: &mut program.new_scratch(100),
///     count: 100,
///     mask: None,
///     accepted: Some(&mut accepted),
///     instances: Instances::One(&program.block(&ball)),
///     host: &mut NoHost,
/// });
/// assert!(accepted.get(99) && !status.budget_exhausted);
/// assert_eq!(state.floats(first("rt_HitDistance"))[99], 3.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Kernel {
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Compiled(CompiledKernel),
    Interpreted(Box<InterpretedKernel>),
    Counted(Box<CountedKernel>),
}

/// Calls an interpreter. The arguments are separate, because those of calls of machine code would otherwise be written
/// to memory as well, where only this function reads them.
#[cold]
#[inline(never)]
fn interpret(
    kernel: &Kind,
    (state, scratch): (&mut LaneBlock, &mut LaneBlock),
    count: usize,
    mask: Option<&LaneMask>,
    accepted: Option<&mut LaneMask>,
    instances: Instances<'_>,
    host: &mut dyn Host,
) -> Result<CallStatus, CallError> {
    let call = CallArguments { state, scratch, count, mask, accepted, instances, host };
    match kernel {
        Kind::Compiled(kernel) => kernel.try_call(call),
        Kind::Interpreted(kernel) => kernel.try_call(call),
        Kind::Counted(kernel) => kernel.try_call(call),
    }
}

impl Kernel {
    pub(crate) fn compiled(kernel: CompiledKernel) -> Kernel {
        Kernel { kind: Kind::Compiled(kernel) }
    }

    pub(crate) fn interpreted(kernel: InterpretedKernel) -> Kernel {
        Kernel { kind: Kind::Interpreted(Box::new(kernel)) }
    }

    pub(crate) fn counted(kernel: CountedKernel) -> Kernel {
        Kernel { kind: Kind::Counted(Box::new(kernel)) }
    }

    /// Runs the method for all rays of the call.
    ///
    /// # Panics
    /// If the arguments' sizes do not fit the kernel, if the stack has no room for it, and with a panic of the host.
    // Inlined for the same reason as `CompiledKernel::call`.
    #[inline(always)]
    pub fn call(&self, call: CallArguments<'_>) -> CallStatus {
        match self.try_call(call) {
            Ok(status) => status,
            Err(error) => error.refuse(),
        }
    }

    /// Like [`Kernel::call`], but returns an error if the call is not possible.
    ///
    /// # Errors
    /// If the arguments' sizes do not fit the kernel, or the stack has no room for it.
    ///
    /// # Panics
    /// With a panic of the host.
    #[inline(always)]
    pub fn try_call(&self, call: CallArguments<'_>) -> Result<CallStatus, CallError> {
        match &self.kind {
            Kind::Compiled(kernel) => kernel.try_call(call),
            kernel => {
                let CallArguments { state, scratch, count, mask, accepted, instances, host } = call;
                interpret(kernel, (state, scratch), count, mask, accepted, instances, host)
            }
        }
    }

    /// Runs the method for all rays of a host's own arrays; machine code works on them in place.
    ///
    /// ```
    /// # let text = "class Ball : rt_Primitive; [[min 0]] public float radius = 1.0;
    /// #     void intersect() { hit(-rt_RayOrigin.z - radius); }
    /// #     void computeNormal() { rt_GeometricNormal = rt_HitPoint; }";
    /// # let unit = rtsl::Compiler::default().compile("ball.rtsl", text).unit.expect("it compiles");
    /// # let class = unit.class("Ball")?;
    /// # let (engine, _) = rtsl::Engine::new(rtsl::EngineOptions::default())?;
    /// # let ball = rtsl::Instance::new(class, [("radius", 2.0.into())])?;
    /// # let program = engine.program(&ball);
    /// use rtsl::{HostArguments, HostLanes, Instances, Method, CallMode, host::NoHost, lookup_state};
    ///
    /// // The host's own arrays, each with room for whole vectors.
    /// let (mut depth, mut start, mut least) = ([f32::INFINITY; 16], [-5.0; 16], [1e-4; 16]);
    /// let mut state = HostLanes::new(rtsl::state_component_count() as usize, 16);
    /// let first = |name| lookup_state(name).expect("the table has it").first_component as usize;
    /// state.bind(first("rt_HitDistance"), &mut depth);
    /// state.bind(first("rt_RayOrigin") + 2, &mut start);
    /// state.bind(first("rt_Epsilon"), &mut least);
    /// let kernel = program.kernel(Method::Intersect, CallMode::Packet)?;
    /// let mut accepted = [0; 16];
    /// kernel.call_host(HostArguments {
    ///     state: &mut state,
    ///     scratch: &mut HostLanes::new(0, 16),
    ///     count: 10,
    ///     mask: None,
    ///     accepted: Some(&mut accepted),
    ///     instances: Instances::One(&program.block(&ball)),
    ///     host: &mut NoHost,
    /// })?;
    /// assert_eq!((accepted[9], depth[9], depth[10]), (-1, 3.0, f32::INFINITY));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// If the arguments do not fit the kernel, or the stack has no room for it.
    ///
    /// # Panics
    /// With a panic of the host.
    pub fn call_host(&self, call: HostArguments<'_, '_>) -> Result<CallStatus, CallError> {
        match &self.kind {
            Kind::Compiled(kernel) => kernel.call_host(call),
            Kind::Interpreted(kernel) => kernel.call_host(call),
            Kind::Counted(kernel) => kernel.call_host(call),
        }
    }

    /// Returns the address of the machine code, a function that takes a pointer to a call as described by the C header
    /// ([`kernel_header`](crate::aot::kernel_header)); `None` on the interpreter. The code lives as long as the kernel.
    pub fn address(&self) -> Option<*const std::ffi::c_void> {
        match &self.kind {
            Kind::Compiled(kernel) => Some(kernel.address()),
            Kind::Interpreted(_) | Kind::Counted(_) => None,
        }
    }

    /// Returns `intersect` in the call mode `leaf` for calls with these objects, which need few checks each.
    ///
    /// # Panics
    /// If it is of another method or call mode, or made for objects of another form.
    pub fn for_leaves(&self, objects: Arc<Objects>) -> LeafKernel {
        let kind = match &self.kind {
            Kind::Compiled(kernel) => {
                LeafKind::Compiled(rtsl_jit::LeafKernel::new(kernel, objects))
            }
            Kind::Interpreted(kernel) => {
                kernel.signature().check_leaf_objects(&objects);
                LeafKind::Interpreted(kernel.clone(), objects)
            }
            Kind::Counted(kernel) => {
                kernel.signature().check_leaf_objects(&objects);
                LeafKind::Counted(kernel.clone(), objects)
            }
        };
        LeafKernel { kind }
    }

    /// Returns the state components whose arrays a call must have.
    pub fn state_components(&self) -> ComponentSet {
        match &self.kind {
            Kind::Compiled(kernel) => kernel.signature().state,
            Kind::Interpreted(kernel) => kernel.signature().state,
            Kind::Counted(kernel) => kernel.signature().state,
        }
    }

    /// True for machine code.
    pub fn is_compiled(&self) -> bool {
        match self.kind {
            Kind::Compiled(_) => true,
            Kind::Interpreted(_) | Kind::Counted(_) => false,
        }
    }
}

/// `intersect` in the call mode `leaf` and the objects that it is called for, checked once to fit each other; see
/// [`Kernel::for_leaves`].
///
/// ```
/// # let text = "class Ball : rt_Primitive; [[min 0]] public float radius = 1.0;
/// #     void intersect() { hit(-rt_RayOrigin.z - radius); }
/// #     void computeNormal() { rt_GeometricNormal = rt_HitPoint; }";
/// # let unit = rtsl::Compiler::default().compile("ball.rtsl", text).unit.expect("it compiles");
/// # let class = unit.class("Ball")?;
/// # let (engine, _) = rtsl::Engine::new(rtsl::EngineOptions::default())?;
/// # let ball = rtsl::Instance::new(class, [("radius", 2.0.into())])?;
/// # let program = engine.program(&ball);
/// use std::sync::Arc;
/// use rtsl::{LeafArguments, LeafTest, Method, Role, CallMode, host::NoHost, lookup_state};
///
/// // One ray against many objects.
/// let far = rtsl::Instance::new(class, [("radius", 1.0.into())])?;
/// let objects = Arc::new(program.objects([&*far, &*ball]));
/// let kernel = program.kernel(Method::Intersect, CallMode::Leaf)?.for_leaves(objects);
/// let mut state = rtsl::new_state(1);
/// rtsl::set_defaults(&mut state, Role::Primitive);
/// let z = lookup_state("rt_RayOrigin").expect("the table has it").first_component as usize + 2;
/// state.floats_mut(z)[0] = -5.0;
/// let mut tests = [LeafTest::new(0, 0)];
/// let (scratch, host) = (&mut program.new_scratch(1), &mut NoHost);
/// let _ = kernel.call(LeafArguments { state: &mut state, scratch, count: 2, tests: &mut tests, host });
/// assert_eq!(tests[0].nearest(), Some(1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct LeafKernel {
    kind: LeafKind,
}

#[derive(Clone, Debug)]
enum LeafKind {
    Compiled(rtsl_jit::LeafKernel),
    Interpreted(Box<InterpretedKernel>, Arc<Objects>),
    Counted(Box<CountedKernel>, Arc<Objects>),
}

impl LeafKernel {
    /// Runs the tests.
    ///
    /// # Panics
    /// If there are no such objects, the rays' blocks do not fit the kernel, and with a panic of the
    /// host.
    // Inlined for the same reason as `Kernel::call`.
    #[inline(always)]
    pub fn call(&self, call: LeafArguments<'_>) -> CallStatus {
        match &self.kind {
            LeafKind::Compiled(kernel) => kernel.call(call),
            LeafKind::Interpreted(kernel, objects) => kernel.make_tests(call, objects),
            LeafKind::Counted(kernel, objects) => kernel.make_tests(call, objects),
        }
    }

    /// The objects.
    pub fn objects(&self) -> &Arc<Objects> {
        match &self.kind {
            LeafKind::Compiled(kernel) => kernel.objects(),
            LeafKind::Interpreted(_, objects) | LeafKind::Counted(_, objects) => objects,
        }
    }
}
