//! The whole compiler, stage by stage.

use rtsl_ir::Function;
use rtsl_packet::{Layout, Shape};
use rtsl_source::{Diagnostic, diagnostic_codes as codes};
use rtsl_spec::Method;

use crate::engine::Shared;
use crate::errors;
use crate::kernel::Kernel;
use crate::link::{self, Linked};
use crate::options::EngineOptions;
use crate::tree::ClassTree;

/// Links a method with those that it calls through references, and optimises the whole.
pub(crate) fn link(
    tree: &ClassTree,
    method: Method,
    _options: &EngineOptions,
) -> Result<Linked, Diagnostic> {
    link::link(tree, method).unwrap_or_else(|| Err(errors::missing_method(&tree.class, method)))
}

/// Makes the kernel of a linked method.
pub(crate) fn kernel(
    function: &Function,
    _shape: Shape,
    _layout: &Layout,
    _shared: &Shared,
) -> Result<Kernel, Diagnostic> {
    Err(Diagnostic::new(
        codes::CODE_GENERATION,
        format!("`{}` can't be compiled by this build", function.name),
    ))
}
