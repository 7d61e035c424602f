//! Descriptions of kernels, for hosts without a compiler.

use rtsl_abi::description::KernelDescription;
use rtsl_link::LinkedMethod;
use rtsl_spec::{Method, StateVariable};

use crate::codegen::variant::Variant;

/// Describes a kernel of a canonical variant.
pub(crate) fn describe_kernel(
    method: Method,
    linked: &LinkedMethod,
    variant: &Variant,
    width: u32,
    symbol: String,
) -> KernelDescription {
    let linked = linked.in_mode(variant.mode);
    let components = |variable: &&StateVariable| {
        variable.first_component..variable.first_component + variable.ty.components()
    };
    let outputs = &variant.outputs;
    let written = linked.writes.iter().filter(|variable| outputs.has_state(variable));
    KernelDescription {
        method,
        mode: variant.mode,
        width,
        symbol,
        reads: linked.reads.iter().flat_map(components).collect(),
        writes: written.flat_map(components).collect(),
        reads_scratch: linked.reads_scratch,
        writes_scratch: linked.sets_scratch && outputs.has_scratch(),
        leaves_zeros: linked.writes.iter().all(|variable| linked.leaves_zero(variable)),
    }
}
