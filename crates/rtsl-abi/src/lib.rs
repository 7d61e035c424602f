//! The binary interface of kernels: the memory layout of a call and of its data.
//!
//! [`offsets`] describes the struct with which a kernel is called. A [`CallMode`] determines the inputs that vary from
//! lane to lane, a [`Layout`] the location of a class's data, and a [`Signature`] the requirements of a kernel on a
//! call. [`LaneBlock`], [`InstanceBlock`] and [`Objects`] are the memory passed to kernels. [`description`] describes a
//! class to hosts without a compiler.
//!
//! Machine code, the interpreter of packet code and the writers of object files and C++ share it. This crate does not
//! depend on a representation of code: neither packet code nor LLVM.
#![allow(unsafe_code, reason = "hands out the pointers that machine code follows")]

mod call;
mod call_error;
mod call_mode;
mod component_set;
pub mod description;
mod host_lanes;
mod host_table;
mod instance;
mod instance_run;
mod lane_arrays;
mod lanes;
mod layout;
mod leaf;
mod object_form;
mod objects;
pub mod offsets;
mod record;
mod signature;
mod stack;

pub use call::{CallArguments, CallStatus, Instances, RawCall};
pub use call_error::CallError;
pub use call_mode::CallMode;
pub use component_set::ComponentSet;
pub use host_lanes::{HostArguments, HostLanes};
pub use host_table::{Color, HOST_TABLE, HostCalls, HostTable};
pub use instance::{BoundBuffer, BufferEntry, InstanceBlock};
pub use instance_run::InstanceRun;
pub use lanes::{LaneBlock, LaneIndices, LaneMask};
pub use layout::{DataLocation, Layout};
pub use leaf::{LeafArguments, LeafTest};
pub use object_form::ObjectForm;
pub use objects::{ObjectRow, Objects};
pub use record::{Mark, MarkWord, RayRecord};
pub use signature::Signature;
pub use stack::{HOST_STACK_BYTES, check_stack};
