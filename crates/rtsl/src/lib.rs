//! RTSL, the Ray Tracing Shading Language, for programs that host it: compile text, make
//! instances of its classes, call their methods for many rays at once.
//!
//! # The way
//!
//! 1. A [`Compiler`] turns text into a [`Unit`], the classes of a file, or says what is wrong.
//! 2. An [`Instance`] is a class with its parameters set. It may refer to other instances.
//! 3. An [`Engine`] links an instance with those it refers to into a [`Program`], and makes
//!    [`Kernel`]s of its methods: machine code, or the interpreter where there is no LLVM.
//! 4. A kernel is [called](Kernel::call) with state and scratch for many rays
//!    ([`LaneBlock`]), the instance's data ([`InstanceBlock`]), and a [`Host`](host::Host) that
//!    answers `trace`, `illuminance` and their like. Hosts with packets of their own can have a
//!    [`Callback`] instead.
//!
//! Parameters are data: instances that differ only in their parameters share a program, and
//! changing one compiles nothing. A [`Variant`] says more of a kernel's callers, for faster code.
//!
//! [`pipeline`] names every stage of the compiler in order.
//!
//! This crate knows no scene, no acceleration structure, no image. Hosts need no other crate of
//! the project: what they use of those below is exported here.

pub mod aot;
mod background;
mod callback;
mod compiler;
mod defaults;
mod elements;
mod emit;
mod engine;
mod environment;
mod errors;
mod instance;
mod interpreted;
mod kernel;
mod kernel_cache;
mod lane_storage;
pub mod library;
mod link;
mod loader;
mod loops;
mod nesting;
mod options;
mod packet_kernel;
mod parameters;
pub mod pipeline;
mod prelude;
mod program;
mod specialised;
mod state;
mod touched;
mod tree;
mod unit;
mod value;
mod variant;

pub use callback::Callback;
pub use compiler::{Compiler, CompilerOptions};
pub use defaults::default_value;
pub use emit::{Emit, EmitRequest};
pub use engine::{Engine, KernelRequest};
pub use errors::unknown_class;
pub use instance::Instance;
pub use kernel::{Kernel, LeafKernel};
pub use loader::FileLoader;
pub use loops::LoopOwners;
pub use options::{Backend, EngineOptions, Math};
pub use packet_kernel::{PacketKernel, PacketRun};
pub use parameters::{place_words, scalar_name, type_name};
pub use program::{LinkedMethod, Placement, Program};
pub use specialised::SpecialisedKernel;
pub use state::{new_state, set_defaults};
pub use unit::{Compilation, Unit};
pub use value::{Numbers, Value};
pub use variant::{KnownMembers, Outputs, Variant};

pub use rtsl_abi::description;
pub use rtsl_abi::offsets::{
    NO_OBJECT, OBJECTS_IN_BLOCK, VERSION as KERNEL_ABI, call_mode_number, call_mode_of_number,
};
pub use rtsl_abi::{
    CallArguments, CallError, CallStatus, ComponentSet, HostArguments, HostLanes, InstanceBlock,
    Instances, LaneBlock, LaneIndices, LaneMask, LeafArguments, LeafTest, ObjectRow, Objects,
    in_huge_pages, prefetch,
};
pub use rtsl_abi::{CallMode, Layout, Mark, MarkWord, ObjectForm, RayRecord};
pub use rtsl_ir::class::{
    Annotation, AnnotationValue, Class, Element, Parameter, ParameterTarget, ParameterType,
    Reference,
};
pub use rtsl_ir::{Constant, Scalar, Variable, host};
pub use rtsl_jit::{CompiledCallback, ForkGuard, Llvm, LlvmError, OptLevel, Target};
pub use rtsl_packet::profile::{Count, Decision, Profile, Sides, Traffic};
pub use rtsl_source::{
    Code, CodeInfo, Diagnostic, Diagnostics, FileId, Messages, Position, Severity, SourceMap, Span,
    code_info, codes, diagnostic_codes, most_similar, render,
};
pub use rtsl_spec::{
    COLOR_COMPONENTS, Direction, Method, Role, StateType, StateVariable, lookup_state, rows,
    state_component_count, state_variables,
};
pub use rtsl_syntax::{IncludeError, IncludeLoader, IncludedFile, MemoryLoader, NoIncludes};

// The Rust texts of the README and of the book are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
#[cfg(doctest)]
#[doc = include_str!("../../../docs/src/how-to/embed-rust.md")]
struct EmbedRust;
#[cfg(doctest)]
#[doc = include_str!("../../../docs/src/reference/kernels.md")]
struct Kernels;
