//! What a function does that concerns others: whom it calls, and what only some methods may do.

use rtsl_source::Span;
use rtsl_spec::builtins::{Builtin, ReferenceMethod};

use super::Checker;
use crate::hir::{FunctionId, MemberId, StateId};

/// The facts about one function.
#[derive(Clone, Debug, Default)]
pub(super) struct Facts {
    /// Whom it calls.
    pub(super) calls: Vec<Call>,
    /// What it does that only some methods may do.
    pub(super) uses: Vec<Use>,
}

/// A call of a function of the module.
#[derive(Clone, Copy, Debug)]
pub(super) struct Call {
    pub(super) callee: FunctionId,
    pub(super) span: Span,
    /// It stands in the body of an `illuminance`.
    pub(super) lit: bool,
}

/// Something that only some methods may do.
#[derive(Clone, Copy, Debug)]
pub(super) struct Use {
    pub(super) kind: UseKind,
    pub(super) span: Span,
    /// It stands in the body of an `illuminance`.
    pub(super) lit: bool,
}

/// What is done.
#[derive(Clone, Copy, Debug)]
pub(super) enum UseKind {
    /// A state variable is read.
    ReadState(StateId),
    /// A state variable is written.
    WriteState(StateId),
    /// A member is written.
    WriteMember(MemberId),
    /// A scratch member is read.
    ReadScratch(MemberId),
    /// A built-in function is called that is not usable everywhere.
    Builtin(&'static Builtin),
    /// A method of a referenced shader is called.
    Reference(&'static ReferenceMethod),
    /// `illuminance`.
    Illuminance,
}

impl Checker<'_> {
    /// Notes that the function being checked does `kind` at `span`.
    pub(super) fn note_use(&mut self, kind: UseKind, span: Span) {
        let lit = self.function.illuminance_depth > 0;
        self.function.facts.uses.push(Use { kind, span, lit });
    }

    /// Notes that the function being checked calls `callee` at `span`.
    pub(super) fn note_call(&mut self, callee: FunctionId, span: Span) {
        let lit = self.function.illuminance_depth > 0;
        self.function.facts.calls.push(Call { callee, span, lit });
        self.function_info[callee.0 as usize].called.get_or_insert(span);
    }
}
