//! What the compiler makes on the way, for people to look at.

use rtsl_jit::{Llvm, Target};
use rtsl_source::Diagnostic;
use rtsl_spec::Method;

use crate::codegen::kernel_compiler as pipeline;
use crate::codegen::kernel_compiler::Job;
use crate::codegen::variant::Variant;
use crate::engine::engine;
use crate::program::program::{LinkedMethod, Program};
use crate::{errors, nesting};

/// A form of a method on its way to machine code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Emit {
    /// The single-ray representation, linked and optimised.
    Ir,
    /// Packet code.
    Packet,
    /// LLVM text, as LLVM gets it.
    Llvm,
    /// LLVM text after LLVM's passes.
    OptimizedLlvm,
    /// Assembly text.
    Assembly,
}

/// What to emit and for what.
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
/// use rtsl::{Emit, EmitRequest, Method, CallMode};
///
/// let request = EmitRequest { emit: Emit::Ir, method: Method::Intersect, variant: CallMode::Packet.into(), target: None };
/// let text = String::from_utf8(program.emit(&request)?)?;
/// assert!(text.starts_with("function Ball.intersect"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct EmitRequest {
    /// The form.
    pub emit: Emit,
    /// The method.
    pub method: Method,
    /// For which callers.
    pub variant: Variant,
    /// The machine; the host where `None`.
    pub target: Option<Target>,
}

impl Program {
    /// A method in one of its forms; as text.
    ///
    /// # Errors
    /// As for [`Program::kernel`]; without LLVM, for the forms that need it.
    pub fn emit(&self, request: &EmitRequest) -> Result<Vec<u8>, Diagnostic> {
        let method = self.method(request.method)?;
        nesting::bear(method.nesting, || self.emit_linked(&method, request))
    }

    fn emit_linked(
        &self,
        method: &LinkedMethod,
        request: &EmitRequest,
    ) -> Result<Vec<u8>, Diagnostic> {
        let variant = self.canonical(method, request.variant.clone());
        let function = &*self.specialise(method, &variant);
        if request.emit == Emit::Ir {
            return Ok(function.to_string().into_bytes());
        }
        let layout = variant.layout(self.layout());
        let job = Job::new(function, &variant, &layout, self.shared());
        let packet = pipeline::packet(job, self.shared())?;
        if request.emit == Emit::Packet {
            return Ok(packet.to_string().into_bytes());
        }
        // The host's features are known by LLVM alone; text for a named target needs none.
        let llvm = Llvm::load();
        let target = match (&request.target, &llvm) {
            (Some(target), _) => target,
            (None, Ok(llvm)) => llvm.host(),
            (None, Err(error)) => return Err(engine::no_llvm(error)),
        };
        let text = pipeline::llvm_text(&packet, target);
        if request.emit == Emit::Llvm {
            return Ok(text.into_bytes());
        }
        let llvm = llvm.as_ref().map_err(engine::no_llvm)?;
        let level = self.shared().options.optimization;
        let result = level.compile_for_work(packet.work(), |level| match request.emit {
            Emit::Ir | Emit::Packet | Emit::Llvm | Emit::OptimizedLlvm => {
                llvm.optimized(&text, target, level).map(String::into_bytes)
            }
            Emit::Assembly => llvm.assembly(&text, target, level).map(String::into_bytes),
        });
        result.map_err(|error| errors::machine_code(&function.name, packet.width, &error))
    }
}
