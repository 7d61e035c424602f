//! A compiled method, safe to call.

use std::panic::resume_unwind;
use std::sync::Arc;

use rtsl_packet::{Shape, abi};

use crate::call::{CallArguments, CallStatus, Instances, RawCall};
use crate::callbacks::{HOST_TABLE, HostCalls};
use crate::components::ComponentSet;
use crate::error::JitError;
use crate::module::Module;

type Entry = unsafe extern "C" fn(*mut RawCall);

/// What a kernel takes; calls are checked against it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signature {
    /// The components of the state that it reads or writes.
    pub state: ComponentSet,
    /// Scratch arrays of the class's layout.
    pub scratch_arrays: u32,
    /// Words of an instance's block.
    pub block_words: u32,
    /// What the lanes of a call have in common.
    pub shape: Shape,
    /// Whether it says which rays it found a hit for.
    pub accepts: bool,
}

impl Signature {
    /// Checks that a call's arguments have the sizes that code relies on.
    ///
    /// # Panics
    /// If they have not: the caller mixed up classes or shapes.
    pub fn check(&self, call: &CallArguments<'_>) {
        let CallArguments { state, scratch, count, mask, accepted, instances, host: _ } = call;
        assert!(*count <= u32::MAX as usize / 2, "at most 2^31 rays a call");
        assert!(state.has_all(&self.state), "the state has every array that the kernel touches");
        let lanes = self.lanes(*count);
        assert!(state.lanes() >= lanes, "the state has room for every ray");
        let arrays = self.scratch_arrays as usize;
        assert!(
            scratch.components() >= arrays && !scratch.is_sparse(),
            "the scratch is that of the class"
        );
        assert!(arrays == 0 || scratch.lanes() >= lanes, "scratch has room for every ray");
        assert!(mask.is_none_or(|mask| mask.lanes() >= *count), "the mask has every ray");
        if self.shape != Shape::Leaf {
            assert!(!self.accepts || accepted.is_some(), "`intersect` reports accepted hits");
            assert!(
                accepted.as_ref().is_none_or(|accepted| accepted.lanes() >= *count),
                "there is room for every ray's acceptance"
            );
        }
        if self.shape == Shape::Single {
            assert!(*count == 1 && mask.is_none(), "the single shape takes one ray and no mask");
        }
        self.check_instances(*instances, *count);
    }

    /// The lanes of state and scratch that a call for `count` rays or objects reads and writes.
    fn lanes(&self, count: usize) -> usize {
        match self.shape {
            Shape::Leaf if self.accepts => 1,
            Shape::Leaf => count.max(1),
            Shape::Packet | Shape::CommonOrigin | Shape::Stream | Shape::Single => count,
        }
    }

    fn check_instances(&self, instances: Instances<'_>, count: usize) {
        match (self.shape, instances) {
            (Shape::Packet | Shape::CommonOrigin | Shape::Single, Instances::One(block)) => {
                self.check_block_size(block.words().len());
            }
            (Shape::Stream, Instances::Many(table, indices)) => {
                let indices = indices.as_slice();
                assert!(indices.len() >= count, "every ray has an instance");
                let number = table.blocks().len();
                assert!(
                    number > 0 && indices.iter().all(|index| (*index as usize) < number),
                    "every ray's instance is in the table"
                );
                self.check_block_size(table.least_words());
            }
            (Shape::Leaf, Instances::Range(members, first)) => {
                let end = (first as usize).checked_add(count);
                let number = members.instances().len();
                assert!(end.is_some_and(|end| end <= number), "the block has all objects");
                assert!(number <= abi::NO_OBJECT as usize, "objects have numbers");
                self.check_block_size(members.least_words());
            }
            (shape, Instances::One(_) | Instances::Many(..) | Instances::Range(..)) => {
                panic!("the {} shape takes its instances in another form", shape.name())
            }
        }
    }

    fn check_block_size(&self, words: usize) {
        assert!(words >= self.block_words as usize, "the instance is one of the class");
    }
}

/// A compiled method. Cheap to clone; the code lives as long as any handle to it.
#[derive(Clone, Debug)]
pub struct CompiledKernel {
    /// Keeps the code in memory.
    _module: Arc<Module>,
    entry: Entry,
    signature: Signature,
}

impl CompiledKernel {
    /// The function `name` of `module`.
    ///
    /// The module must be code that RTSL's own code generator made for `signature`: nothing can
    /// check that machine code keeps to it.
    ///
    /// # Errors
    /// [`JitError::MissingFunction`].
    pub fn new(
        module: Arc<Module>,
        name: &str,
        signature: Signature,
    ) -> Result<CompiledKernel, JitError> {
        let address = module.function(name)?;
        // Safety: the function is a kernel, by the contract above.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry>(address) };
        Ok(CompiledKernel { _module: module, entry, signature })
    }

    /// What it takes.
    pub fn signature(&self) -> &Signature {
        &self.signature
    }

    /// Runs the method for all rays of the call.
    ///
    /// # Panics
    /// If the arguments' sizes do not fit the kernel, and with a panic of the host.
    pub fn call(&self, call: CallArguments<'_>) -> CallStatus {
        self.signature.check(&call);
        let CallArguments { state, scratch, count, mask, accepted, instances, host } = call;
        let mut host = HostCalls { host, panic: None };
        let mut raw = RawCall {
            state: state.table_mut(),
            scratch: scratch.table_mut(),
            mask: mask.map_or(std::ptr::null(), |mask| mask.pointer().cast_const()),
            accepted: accepted.map_or(std::ptr::null_mut(), |accepted| accepted.pointer()),
            instance: std::ptr::null(),
            instances: std::ptr::null(),
            index: std::ptr::null(),
            host: &HOST_TABLE,
            user: (&raw mut host).cast(),
            count: count as u32,
            status: 0,
            members: std::ptr::null(),
            first: 0,
            nearest: abi::NO_OBJECT,
        };
        match instances {
            Instances::One(block) => raw.instance = block.pointer(),
            Instances::Many(table, indices) => {
                raw.instances = table.pointers();
                raw.index = indices.pointer();
            }
            Instances::Range(members, first) => {
                raw.members = members.table();
                raw.first = first;
            }
        }
        // Safety: the pointers are to memory that the arguments borrow, of the sizes just
        // checked; the code keeps to the interface.
        unsafe { (self.entry)(&mut raw) };
        if let Some(panic) = host.panic {
            resume_unwind(panic);
        }
        CallStatus {
            budget_exhausted: raw.status & abi::STATUS_BUDGET != 0,
            nearest: (raw.nearest != abi::NO_OBJECT).then_some(raw.nearest),
        }
    }
}
