//! RTSL, the Ray Tracing Shading Language, for programs that host it: compile text, make instances of its classes, call
//! their methods for many rays at once.
//!
//! # Use
//!
//! 1. A [`Compiler`] turns text into a [`Unit`], the classes of a file, or into diagnostics.
//! 2. An [`Instance`] is a class with values for its parameters. It may refer to other instances.
//! 3. An [`Engine`] links an instance with those it refers to into a [`Program`], and makes [`Kernel`]s of its methods:
//!    machine code, or the interpreter if there is no LLVM.
//! 4. A kernel is [called](Kernel::call) with state and scratch for many rays ([`LaneBlock`]), the instance's data
//!    ([`InstanceBlock`]), and a [`Host`](host::Host) that answers `trace`, `illuminance` and other requests. A
//!    [`Callback`] serves hosts that have packets of rays.
//!
//! Parameters are data: instances that differ only in their parameters share a program, and changing one compiles
//! nothing. A [`Variant`] describes the callers of a kernel, for faster code.
//!
//! # Source
//!
//! The folders are the stages of the compiler; each uses those before it. Between `compile` and the others,
//! `rtsl-link` makes one function of a method and those that it calls, and `rtsl-integrate` links the stages of
//! integrators.
//!
//! - `compile`: text to classes. `compile/compiler.rs` runs the steps in their order.
//! - `instance`: classes with values for their parameters.
//! - `codegen`: linked methods to kernels. `codegen/kernel_compiler.rs` runs the steps in their order, from linking to
//!   machine code.
//! - `program`: the kernels of one linked class, each made once.
//! - `aot`: libraries of classes for hosts without a compiler.
//! - `engine`: the programs of a host; compilation on several threads and in the background.
//!
//! This crate reads no scene, and has no acceleration structure and no image; renderers tell it what stages need of a
//! scene ([`StageScene`]). Hosts need no other crate of the project: what they use of those below is exported here.

pub mod aot;
mod at_work;
mod codegen;
mod compile;
mod engine;
mod errors;
mod instance;
mod nesting;
mod program;
mod state;
mod threads;
mod type_name;

pub use at_work::begin_work;
pub use codegen::callback::Callback;
pub use codegen::emit::{Emit, EmitRequest};
pub use codegen::kernel::{Kernel, LeafKernel};
pub use codegen::line_costs::{LineCosts, TextCosts};
pub use codegen::options::{Backend, EngineOptions, Math};
pub use codegen::packet_kernel::{PacketKernel, PacketRun};
pub use codegen::recording::{Recording, TraceEntry, TraceKind, TracedValue};
pub use codegen::stepped_lines::{SteppedLines, SteppedText};
pub use codegen::trace::{Trace, TraceDetail, TraceLimits};
pub use codegen::variant::{KnownMembers, Variant};
pub use compile::analysis::Analysis;
pub use compile::compiler::{Compiler, CompilerOptions, DEFAULT_LOOP_BUDGET};
pub use compile::library;
pub use compile::loader::{DiskIncludes, FileLoader, IncludeFiles, Unread};
pub use compile::outline::{ClassOutline, FunctionOutline, Outline, ParameterOutline, Passing};
pub use compile::unit::{Compilation, Unit};
pub use engine::engine::Engine;
pub use engine::host_function::HostFunction;
pub use engine::light_selector::LightSelector;
pub use engine::renderer_function::RendererFunction;
pub use engine::sampler_numbers::SamplerNumbers;
pub use engine::specialised::SpecialisedKernel;
pub use engine::stage_kernels::{
    EarlierKernels, PreparedOperand, PreparedSurface, ReadResults, StageKernel, StageKernels,
};
pub use engine::tiered_kernel::TieredKernel;
pub use errors::unknown_class;
pub use instance::defaults::default_value;
pub use instance::instance::{Instance, OutsideRange};
pub use instance::parameters::place_words;
pub use instance::value::{Numbers, Value};
pub use instance::wording::Wording;
pub use program::camera_program::{CameraArrays, CameraProgram, CameraView};
pub use program::kernel_request::KernelRequest;
pub use program::loop_owners::LoopOwners;
pub use program::program::{Placement, Program};
pub use program::query_request::{QueryForm, QueryRequest};
pub use program::searched_scene::{SearchedClass, SearchedItem, SearchedObject, SearchedScene};
pub use program::stage_lights::{StageAreaLight, StageLight, StageLights};
pub use program::staged_program::{ParameterValues, StageRequest, StageScene, StagedProgram};
pub use program::surface_class::{
    GroupPlace, ShapeClass, ShapeObject, SurfaceClass, SurfaceObject,
};
pub use rtsl_integrate::area_light::PROVIDED_BY_LIGHT_SAMPLES;
pub use rtsl_integrate::contribution::MAX_CONTRIBUTIONS;
pub use rtsl_integrate::indexed_lights::SHADOW_LIMIT;
pub use rtsl_integrate::light_selection::{LightContent, LightNode, LightSelection};
pub use rtsl_integrate::lights::MAX_LIGHTS as MAX_STAGE_LIGHTS;
pub use rtsl_integrate::query_columns::{HostQuery, QueryColumns, SurfaceNeeds, Weighing};
pub use rtsl_integrate::sequences::SEQUENCES_OF_SEARCH;
pub use rtsl_integrate::spawning::{MAX_SPAWNS, SPAWN_FLOATS, SPAWN_SCALARS};
pub use rtsl_link::AttributeTable;
pub use rtsl_link::Outputs;
pub use rtsl_link::{HitPlacement, LinkedMethod};
pub use state::{Derivation, default_components, derived_components, new_state, set_defaults};
pub use type_name::{scalar_name, type_name};

pub use rtsl_abi::description;
pub use rtsl_abi::offsets::{
    NO_OBJECT, OBJECTS_IN_BLOCK, VERSION as KERNEL_ABI, call_mode_number, call_mode_of_number,
};
pub use rtsl_abi::{
    CallArguments, CallError, CallStatus, ComponentSet, HostArguments, HostLanes, InstanceBlock,
    InstanceRun, Instances, LaneBlock, LaneIndices, LaneMask, LeafArguments, LeafTest, ObjectRow,
    Objects,
};
pub use rtsl_abi::{CallMode, Layout, Mark, MarkWord, ObjectForm, RayRecord};
pub use rtsl_ir::class::{
    Annotation, AnnotationValue, Attribute, Class, Element, Parameter, ParameterTarget,
    ParameterType, Reference, ReferenceCount,
};
pub use rtsl_ir::{
    Constant, EventValue as TracedVariable, Place, Query, SURFACE_SCALARS, Scalar, Source,
    ValueScope, Variable, host,
};
pub use rtsl_jit::{
    CodeCache, CodeCacheError, CompiledCallback, Llvm, LlvmError, OptLevel, Target,
};
pub use rtsl_memory::{
    Refused, SharedWords, UnderWay, in_huge_pages, lies_within, open_regular_file, open_within,
    prefetch, real_place,
};
pub use rtsl_opt::defer;
pub use rtsl_packet::line_work::LineWork;
pub use rtsl_packet::profile::{Count, Decision, Profile, Sides, Traffic};
pub use rtsl_source::{
    Code, CodeInfo, Diagnostic, Diagnostics, FileId, Label, Messages, Position, Severity,
    SourceMap, Span, Suggestion, code_info, codes, diagnostic_codes, encoding, most_similar,
    render, with_article,
};
pub use rtsl_spec::{
    ATTRIBUTES, COLOR_COMPONENTS, Direction, MAX_ATTRIBUTE_SCALARS, Method, RayType, Role,
    StateType, StateVariable, TO_OBJECT, TO_WORLD, lookup_state, rows, state_component_count,
    state_variables,
};
pub use rtsl_stages::{
    END, MAX_ANSWERS, MAX_REQUEST, Port, ResumedBy, SlotId, Stage, Surface as StageSurface, waits,
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
