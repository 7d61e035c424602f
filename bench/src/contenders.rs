//! The contenders of races.

use std::path::Path;
use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, Class, Compiler, Engine, EngineOptions, Instance, InstanceBlock,
    Instances, Kernel, Math, Program, Variant,
};

use crate::arena::{Arena, Memory};
use crate::measure::Subject;
use crate::packet::RAYS;
use crate::race::{Parameter, Race, Shader};
use crate::written::Written;

/// One form of a race's kernel.
pub struct Contender {
    /// The name in tables: `w8` and the like are RTSL at that width, `f8` with `--math=fast`, `h256` to `h512t`
    /// hand-written, `mvec` and `sleef10` from vector libraries, and `scalar`.
    pub name: String,
    code: Code,
    parameters: Vec<f32>,
}

enum Code {
    Compiled(Box<Compiled>),
    Written(Written),
}

/// A kernel of RTSL with its object.
struct Compiled {
    kernel: Arc<Kernel>,
    program: Arc<Program>,
    block: InstanceBlock,
}

impl Contender {
    /// Creates a contender from a hand-written kernel.
    pub fn written(race: &Race, name: &str, written: Written) -> Contender {
        Contender {
            name: name.to_owned(),
            code: Code::Written(written),
            parameters: race.numbers(),
        }
    }

    /// Compiles RTSL's kernel with `engine`.
    ///
    /// # Errors
    /// With a report, if the shader does not compile.
    pub fn compiled(race: &Race, name: &str, engine: &Engine) -> Result<Contender, String> {
        let code = Code::Compiled(Box::new(Compiled::new(race, engine)?));
        Ok(Contender { name: name.to_owned(), code, parameters: Vec::new() })
    }
}

impl Subject<Arena> for Contender {
    fn run(&self, arena: &mut Arena, times: u32) {
        match &self.code {
            Code::Compiled(compiled) => {
                for _ in 0..times {
                    arena.for_each(|packet| compiled.call(packet));
                }
            }
            // Hand-written code runs with subnormal numbers flushed to zero, RTSL's never does.
            Code::Written(written) => with_subnormals_flushed(|| {
                for _ in 0..times {
                    arena.for_each(|packet| {
                        let Memory { state, scratch, .. } = packet;
                        let (state, scratch) =
                            (state.float_memory_mut(), scratch.float_memory_mut());
                        written.run(state, scratch, &self.parameters);
                    });
                }
            }),
        }
    }
}

impl Compiled {
    fn new(race: &Race, engine: &Engine) -> Result<Compiled, String> {
        let instance = object(&class(race.shader)?, &race.parameters)?;
        let program = engine.program(&instance);
        let variant = Variant::new(race.shader.mode).reading(race.outputs().with_scratch());
        let kernel = program.kernel(race.shader.method, variant);
        let kernel = kernel.map_err(|error| error.message)?;
        let block = program.block(&instance);
        Ok(Compiled { kernel, program, block })
    }

    #[inline]
    fn call(&self, packet: &mut Memory) {
        let Memory { state, scratch, accepted, .. } = packet;
        let status = self.kernel.call(CallArguments {
            state,
            scratch,
            count: RAYS,
            mask: None,
            accepted: Some(accepted),
            instances: Instances::One(&self.block),
            host: &mut NoHost,
        });
        debug_assert!(!status.budget_exhausted, "races have no budget");
    }
}

/// Compiles the shader's class.
///
/// # Errors
/// With a report, if it does not compile.
pub(crate) fn class(shader: Shader) -> Result<Arc<Class>, String> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders").join(shader.file);
    let compilation = Compiler::default().compile_file(&file);
    let Some(unit) = &compilation.unit else { return Err(compilation.report(false)) };
    unit.class(shader.class).cloned().map_err(|error| error.message)
}

/// Creates an object of a class.
///
/// # Errors
/// If the class takes other parameters.
pub(crate) fn object(
    class: &Arc<Class>,
    parameters: &[Parameter],
) -> Result<Arc<Instance>, String> {
    let named = parameters.iter().filter_map(|it| Some((it.name?, it.value())));
    Instance::new(class, named).map_err(|errors| format!("{}: {errors:?}", class.name))
}

#[cfg(target_arch = "x86_64")]
fn with_subnormals_flushed(work: impl FnOnce()) {
    crate::rivals::subnormals::flushed(work);
}

#[cfg(not(target_arch = "x86_64"))]
fn with_subnormals_flushed(work: impl FnOnce()) {
    work();
}

/// The engines of RTSL's contenders.
pub struct Engines {
    engines: Vec<(String, Engine)>,
}

impl Engines {
    /// Creates engines of width 1, and of the widths of this processor's vectors with default and fast arithmetic, with
    /// this interleave factor.
    ///
    /// # Errors
    /// If there is no LLVM, or the factor is not supported.
    pub fn new(interleave: Option<u32>) -> Result<Engines, String> {
        let mut engines = vec![engine(1, Math::Contract, None)?];
        for width in vector_widths() {
            engines.push(engine(*width, Math::Contract, interleave)?);
            engines.push(engine(*width, Math::Fast, interleave)?);
        }
        Ok(Engines { engines })
    }

    /// Returns the versions of the compiler and the processor.
    pub fn describe(&self) -> String {
        let llvm = self.widest().and_then(Engine::llvm);
        llvm.map(|llvm| format!("LLVM {}, {}", llvm.version(), llvm.host().cpu()))
            .unwrap_or_default()
    }

    /// Returns the engine with default arithmetic for the widest vectors.
    pub fn widest(&self) -> Option<&Engine> {
        let exact = |engine: &&Engine| engine.options().math == Math::Contract;
        self.engines.iter().map(|(_, engine)| engine).filter(exact).max_by_key(|it| it.width())
    }

    /// Returns all contenders of a race.
    ///
    /// # Errors
    /// As for [`Contender::compiled`].
    pub fn contenders(&self, race: &Race) -> Result<Vec<Contender>, String> {
        let mut contenders = vec![Contender::written(race, "scalar", race.written.scalar)];
        for (name, engine) in &self.engines {
            contenders.push(Contender::compiled(race, name, engine)?);
        }
        let rivals = race.written.rivals.iter();
        contenders.extend(rivals.map(|(name, written)| Contender::written(race, name, *written)));
        Ok(contenders)
    }

    /// Returns the number of scratch arrays of the race's class.
    ///
    /// # Errors
    /// As for [`Contender::compiled`].
    pub fn scratch_arrays(&self, race: &Race) -> Result<usize, String> {
        let Some((_, engine)) = self.engines.first() else { return Ok(0) };
        let program = Compiled::new(race, engine)?.program;
        Ok(program.layout().scratch_arrays as usize)
    }
}

fn engine(width: u32, math: Math, interleave: Option<u32>) -> Result<(String, Engine), String> {
    let options = EngineOptions {
        backend: Backend::Jit,
        width: Some(width),
        interleave,
        math,
        ..Default::default()
    };
    let (engine, _) = Engine::new(options).map_err(|error| error.message)?;
    let prefix = if math == Math::Fast { "f" } else { "w" };
    Ok((format!("{prefix}{width}"), engine))
}

#[cfg(target_arch = "x86_64")]
fn vector_widths() -> &'static [u32] {
    if crate::rivals::has_avx512() { &[8, 16] } else { &[8] }
}

#[cfg(not(target_arch = "x86_64"))]
fn vector_widths() -> &'static [u32] {
    &[4]
}
