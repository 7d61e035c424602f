//! The binary interface of kernels: what a call takes, as callers write it and as code reads it.
//!
//! [`offsets`] describes the struct that a kernel is called with. A [`CallMode`] says which of its
//! inputs differ from lane to lane, a [`Layout`] where a class's data lies, a [`Signature`] what a kernel needs of a call,
//! and [`LaneBlock`], [`InstanceBlock`] and [`Objects`] are the memory that it is given. [`description`] tells hosts
//! without a compiler the same about a class.
//!
//! Machine code, the interpreter of packet code and the writers of object files and C++ share it. This crate knows no
//! representation of code: no packet code, no LLVM.
#![allow(unsafe_code, reason = "hands out the pointers that machine code follows")]

mod call;
mod call_error;
mod component_set;
pub mod description;
mod host_lanes;
mod host_table;
mod huge_pages;
mod instance;
mod lanes;
mod layout;
mod leaf;
mod object_form;
mod objects;
pub mod offsets;
mod prefetch;
mod record;
mod shape;
mod signature;

pub use call::{CallArguments, CallStatus, Instances, RawCall};
pub use call_error::CallError;
pub use component_set::ComponentSet;
pub use host_lanes::{HostArguments, HostLanes};
pub use host_table::{Color, HOST_TABLE, HostCalls, HostTable};
pub use huge_pages::{PAGE_BYTES, in_huge_pages, with_capacity_in_huge_pages};
pub use instance::{BoundBuffer, BufferEntry, InstanceBlock};
pub use lanes::{LaneBlock, LaneIndices, LaneMask};
pub use layout::{DataLocation, Layout};
pub use leaf::{LeafArguments, LeafTest};
pub use object_form::ObjectForm;
pub use objects::{ObjectRow, Objects};
pub use prefetch::prefetch;
pub use record::{Mark, MarkWord, RayRecord};
pub use shape::CallMode;
pub use signature::Signature;
