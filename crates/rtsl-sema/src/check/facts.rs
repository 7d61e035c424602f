//! The facts about a function that its callers depend on: its calls, and its uses of features that
//! only some methods may use.

use rtsl_source::Span;
use rtsl_spec::builtins::{Overload, ReferenceMethod};

use super::Checker;
use crate::hir::{FunctionId, MemberId, StateId};

/// The facts about one function.
#[derive(Clone, Debug, Default)]
pub(super) struct Facts {
    /// The calls that it makes.
    pub(super) calls: Vec<Call>,
    /// Its uses of features that only some methods may use.
    pub(super) uses: Vec<Use>,
}

impl Facts {
    /// True if the function itself writes state or members.
    pub(super) fn sets_something(&self) -> bool {
        let mut kinds = self.uses.iter().map(|done| done.kind);
        kinds.any(|kind| matches!(kind, UseKind::WriteState(_) | UseKind::WriteMember(_)))
    }
}

/// A call of a function of the module.
#[derive(Clone, Copy, Debug)]
pub(super) struct Call {
    pub(super) callee: FunctionId,
    pub(super) span: Span,
    /// True if the call is in the body of an `illuminance`.
    pub(super) lit: bool,
    /// True if it computes a parameter, which the constructor does not.
    pub(super) of_parameter: bool,
}

/// A use of a feature that only some methods may use.
#[derive(Clone, Copy, Debug)]
pub(super) struct Use {
    pub(super) kind: UseKind,
    pub(super) span: Span,
    /// True if the use is in the body of an `illuminance`.
    pub(super) lit: bool,
}

/// The feature that is used.
#[derive(Clone, Copy, Debug)]
pub(super) enum UseKind {
    /// A read of a state variable.
    ReadState(StateId),
    /// A write to a state variable.
    WriteState(StateId),
    /// A write to a member.
    WriteMember(MemberId),
    /// A read of a member that may be a texture.
    ReadTextured(MemberId),
    /// A read of a scratch member.
    ReadScratch(MemberId),
    /// A read of an attribute.
    ReadAttribute(MemberId),
    /// A call of a built-in function that is not usable everywhere.
    Builtin(&'static Overload),
    /// A call of a method of a referenced shader.
    Reference(&'static ReferenceMethod),
    /// An `illuminance` statement.
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
        self.note_call_of(callee, span, false);
    }

    /// Notes that the function being checked reads a parameter that `function` computes.
    pub(super) fn note_computation(&mut self, function: FunctionId, span: Span) {
        self.note_call_of(function, span, true);
    }

    fn note_call_of(&mut self, callee: FunctionId, span: Span, of_parameter: bool) {
        let lit = self.function.illuminance_depth > 0;
        self.function.facts.calls.push(Call { callee, span, lit, of_parameter });
        self.function_info[callee.0 as usize].called.get_or_insert(span);
        self.want_instance(callee);
    }
}
