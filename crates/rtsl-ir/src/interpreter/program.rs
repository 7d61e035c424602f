//! The interpreter's flat programs.

use std::sync::Arc;

use crate::evaluate::{BinaryFunction, UnaryFunction};
use crate::{Event, Output, Place, Query, VariableId};

/// An index into the registers.
pub(super) type Register = u32;

/// A program without regions.
#[derive(Debug)]
pub(super) struct Program {
    /// The instructions, run from the first until past the last.
    pub instructions: Vec<Instruction>,
    /// The operand registers of instructions with many operands, which hold the index of their first.
    pub operands: Vec<Register>,
    /// The content of the registers before the first run.
    pub registers: Vec<u32>,
    /// The size of all locals together.
    pub local_scalars: u32,
    /// The outputs except the accepted one.
    pub outputs: Vec<(Output, Register)>,
    /// The register of the accepted output.
    pub accepted: Option<Register>,
    /// The reports of an observed program.
    pub observed: Option<Observed>,
}

/// The additions of an observed program.
#[derive(Debug, Default)]
pub(super) struct Observed {
    pub events: Vec<Arc<Event>>,
    /// For each instruction, the operation if its result is an f32 that it computes.
    pub computed: Vec<Option<Computed>>,
}

/// An operation that computes an f32.
#[derive(Clone, Debug)]
pub(super) struct Computed {
    pub to: Register,
    /// The operands that are f32.
    pub floats: [Option<Register>; 3],
    pub place: Option<Place>,
}

/// An instruction. Results go to `to`, or to consecutive registers from it.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "as the operations that they are made of")]
pub(super) enum Instruction {
    Unary {
        function: UnaryFunction,
        to: Register,
        a: Register,
    },
    Binary {
        function: BinaryFunction,
        to: Register,
        a: Register,
        b: Register,
    },
    Select {
        to: Register,
        condition: Register,
        a: Register,
        b: Register,
    },
    Fma {
        to: Register,
        a: Register,
        b: Register,
        c: Register,
    },
    Copy {
        to: Register,
        from: Register,
    },
    Load {
        to: Register,
        variable: VariableId,
        index: u32,
    },
    LoadAt {
        to: Register,
        variable: VariableId,
        index: Register,
        len: u32,
    },
    LoadBuffer {
        to: Register,
        variable: VariableId,
        index: u32,
    },
    LoadBufferAt {
        to: Register,
        variable: VariableId,
        index: Register,
        len: u32,
    },
    LoadLocal {
        to: Register,
        address: u32,
    },
    LoadLocalAt {
        to: Register,
        index: Register,
        base: u32,
        len: u32,
    },
    StoreLocal {
        address: u32,
        value: Register,
    },
    StoreLocalAt {
        value: Register,
        index: Register,
        base: u32,
        len: u32,
    },
    Length {
        to: Register,
        variable: VariableId,
    },
    Jump {
        target: u32,
    },
    JumpIf {
        condition: Register,
        target: u32,
    },
    JumpUnless {
        condition: Register,
        target: u32,
    },
    Trace {
        to: Register,
        operands: u32,
    },
    Occluded {
        to: Register,
        operands: u32,
    },
    LightCount {
        to: Register,
    },
    LightSample {
        to: Register,
        operands: u32,
    },
    Ambient {
        to: Register,
    },
    Rand {
        to: Register,
    },
    Query {
        query: Query,
        to: Register,
        operands: u32,
    },
    ReportBudget,
    /// The event and the operands, in an observed program.
    Report {
        event: u32,
        operands: u32,
    },
}
