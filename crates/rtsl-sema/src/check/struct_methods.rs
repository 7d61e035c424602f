//! Methods of the language's structs: `surface.BSDF(direction)`.

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_spec::builtins::{self, SpecStruct};
use rtsl_syntax::ast;

use super::Checker;
use super::access::Access;
use super::candidates::{Candidate, Choice, choose};
use super::expressions::error_expression;
use crate::hir::{Expression, Type};

impl Checker<'_> {
    /// Checks a method call whose receiver, a struct of the language, becomes the first argument.
    pub(super) fn check_struct_method(
        &mut self,
        receiver: Expression,
        of: SpecStruct,
        method: &ast::Identifier,
        written: &[ast::Expression],
        span: Span,
    ) -> Expression {
        let overloads = builtins::method_overloads(of, &method.name);
        let mut arguments = vec![receiver];
        arguments.extend(self.check_arguments(written));
        let Some(first) = overloads.first() else {
            arguments.iter().for_each(|argument| self.note_access(argument, Access::Read));
            let known: Vec<&str> = builtins::methods_of(of).map(|each| each.name).collect();
            return self.report_unknown_method(&arguments[0].ty, method, &known, span);
        };
        if arguments.iter().any(|argument| argument.ty == Type::Error) {
            return error_expression(span);
        }
        match choose(overloads.iter().map(Candidate::Builtin), &arguments) {
            Choice::One(Candidate::Builtin(overload)) => {
                self.note_builtin(overload.builtin.name, method.span);
                self.call_builtin(overload, arguments, span)
            }
            Choice::One(Candidate::Function(..)) | Choice::Ambiguous(..) | Choice::None => {
                let types = arguments[1..].iter().map(|argument| self.show(&argument.ty));
                let types: Vec<String> = types.collect();
                let message = format!("no `{}` takes `({})`", method.name, types.join(", "));
                self.report(
                    Diagnostic::new(codes::NO_MATCHING_FUNCTION, message).at(span, "").note(
                        format!("there is `{first}`, whose first argument is before the dot"),
                    ),
                );
                error_expression(span)
            }
        }
    }
}
