//! The forms of a method between text and machine code, for people to read.

use rtsl_ir::Function;
use rtsl_jit::{Llvm, Target};
use rtsl_source::Diagnostic;
use rtsl_spec::Method;
use rtsl_stages::{Sizes, StageSizes};

use super::kernel_compiler::{KernelCompiler, llvm_text};
use super::kernel_source::KernelSource;
use super::variant::Variant;
use crate::errors;

/// A form of a method between text and machine code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Emit {
    /// The single-ray representation, linked and optimised.
    Ir,
    /// The single-ray representation, split into stages where a path waits for the renderer, with their sizes.
    Stages,
    /// Packet code.
    Packet,
    /// LLVM text before LLVM's passes.
    Llvm,
    /// LLVM text after LLVM's passes.
    OptimizedLlvm,
    /// Assembly text.
    Assembly,
}

/// A request for a form of a method.
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
/// let (emit, method, variant) = (Emit::Ir, Method::Intersect, CallMode::Packet.into());
/// let request = EmitRequest { emit, method, variant, target: None };
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
    /// The callers.
    pub variant: Variant,
    /// The machine; the host where `None`.
    pub target: Option<Target>,
}

impl EmitRequest {
    /// Returns the form; `source` is that of the method and variant. The caller's stack must bear the nesting of the
    /// function.
    pub(crate) fn emit(
        &self,
        source: KernelSource<'_>,
        compiler: &KernelCompiler,
    ) -> Result<Vec<u8>, Diagnostic> {
        if self.emit == Emit::Ir {
            return Ok(source.function.to_string().into_bytes());
        }
        if self.emit == Emit::Stages {
            return stages(source.function);
        }
        let packet = compiler.packet(source)?;
        if self.emit == Emit::Packet {
            return Ok(packet.to_string().into_bytes());
        }
        // Only LLVM knows the host's features; text for a named target needs no LLVM.
        let llvm = Llvm::load();
        let target = match (&self.target, &llvm) {
            (Some(target), _) => target,
            (None, Ok(llvm)) => llvm.host(),
            (None, Err(error)) => return Err(errors::no_llvm(error)),
        };
        let text = llvm_text(&packet, target);
        if self.emit == Emit::Llvm {
            return Ok(text.into_bytes());
        }
        let llvm = llvm.as_ref().map_err(errors::no_llvm)?;
        let level = compiler.options().optimization;
        let name = &source.function.name;
        let result = level.compile_kernels([(name.as_str(), &packet)], |level| match self.emit {
            Emit::Ir | Emit::Stages | Emit::Packet | Emit::Llvm | Emit::OptimizedLlvm => {
                llvm.optimized(&text, target, level).map(String::into_bytes)
            }
            Emit::Assembly => llvm.assembly(&text, target, level).map(String::into_bytes),
        });
        result.map_err(|error| errors::machine_code(name, packet.width, &error))
    }
}

/// Returns the stages of a function as text, after comments with their sizes.
fn stages(function: &Function) -> Result<Vec<u8>, Diagnostic> {
    let stages = rtsl_stages::split(function);
    let stages = stages.map_err(|error| errors::splitting(&function.name, &error))?;
    let Sizes { slots, frame_bytes, stages: sizes } = stages.sizes();
    let mut text = format!("// {slots} slots, {frame_bytes} bytes a path\n");
    for (index, StageSizes { live, changed, operations }) in sizes.iter().enumerate() {
        text += &format!(
            "// stage {index}: {live} slots live, {changed} changed, {operations} operations\n"
        );
    }
    Ok((text + &stages.to_string()).into_bytes())
}
