//! Specialised kernels, made in the background.

use std::sync::Arc;

use rtsl_abi::InstanceBlock;
use rtsl_source::Diagnostic;

use super::background::{Answer, Background, wait};
use crate::codegen::kernel::Kernel;
use crate::codegen::variant::{KnownMembers, Variant};
use crate::instance::instance::Instance;
use crate::program::kernel_request::KernelRequest;

/// The kernel of a method for one instance: the general kernel at first, and once a background thread has made it, one
/// that takes the instance's members for constants. Both give the same bits.
///
/// [`Engine::specialise`](crate::Engine::specialise) makes one. It may be called from many threads.
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
/// use rtsl::{KernelRequest, Method, CallMode};
///
/// let request = KernelRequest::new(&program, Method::ComputeNormal, CallMode::Packet);
/// let mut normal = engine.specialise(&request, &ball)?;
/// normal.wait();
/// // A change never waits for the compiler: the next call uses the general kernel.
/// let changed = rtsl::Instance::new(class, [("radius", 3.0.into())])?;
/// normal.set_instance(&changed);
/// let (kernel, block) = (normal.kernel(), normal.block());
/// # let _ = (kernel, block);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct SpecialisedKernel {
    request: KernelRequest,
    general: Arc<Kernel>,
    background: Arc<Background>,
    block: InstanceBlock,
    special: Answer<Arc<Kernel>>,
}

impl SpecialisedKernel {
    pub(crate) fn new(
        background: &Arc<Background>,
        request: &KernelRequest,
        instance: &Instance,
    ) -> Result<SpecialisedKernel, Diagnostic> {
        let known = KnownMembers::default();
        let variant = Variant { known, ..request.variant.clone() };
        let mut kernel = SpecialisedKernel {
            general: request.program.kernel(request.method, variant.clone())?,
            request: KernelRequest { variant, ..request.clone() },
            background: background.clone(),
            block: request.program.block(instance),
            special: Answer::default(),
        };
        kernel.special = kernel.start(instance);
        Ok(kernel)
    }

    /// Returns the fastest kernel made so far. Call it with [`SpecialisedKernel::block`]: for another
    /// instance's data its results are unspecified.
    pub fn kernel(&self) -> &Arc<Kernel> {
        self.special.get().and_then(|it| it.as_ref().ok()).unwrap_or(&self.general)
    }

    /// The data of the instance.
    pub fn block(&self) -> &InstanceBlock {
        &self.block
    }

    /// Changes the instance. Calls use the general kernel until the one for the new values is made. Requests for values
    /// that have changed again meanwhile are cancelled; kernels for recent values are kept.
    ///
    /// # Panics
    /// If the instance belongs to another program.
    pub fn set_instance(&mut self, instance: &Instance) {
        self.block = self.request.program.block(instance);
        self.special = self.start(instance);
    }

    /// True if [`SpecialisedKernel::kernel`] is the one for the instance's values.
    pub fn is_specialised(&self) -> bool {
        self.special.get().is_some_and(Result::is_ok)
    }

    /// The reason why the specialised kernel could not be made; the general kernel remains in use.
    pub fn error(&self) -> Option<&Diagnostic> {
        self.special.get().and_then(|special| special.as_ref().err())
    }

    /// Waits until the background has made the kernel for the instance's values, or failed to.
    pub fn wait(&self) {
        wait(&self.special);
    }

    fn start(&self, instance: &Instance) -> Answer<Arc<Kernel>> {
        let KernelRequest { program, method, variant } = self.request.clone();
        let known = program.known_members(instance);
        let variant = Variant { known, ..variant };
        match program.made(method, &variant) {
            Some(made) => Arc::new(made.into()),
            None => self.background.start(move || program.kernel(method, variant)),
        }
    }
}
