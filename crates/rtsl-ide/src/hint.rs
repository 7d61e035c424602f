//! Facts that a text does not show: implicit conversions, values that are the same for all rays, contracted operations.

use std::collections::BTreeSet;

use rtsl::Span;
use rtsl_sema::hir::{Expression, ExpressionKind, Function};

use crate::declaration::DeclarationKind;
use crate::document::Document;
use crate::rate::uniform_locals;
use crate::visit::for_each_expression;

/// A hint between the characters of a text.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Hint {
    /// The offset at which it stands.
    pub offset: u32,
    /// The hint.
    pub label: String,
    /// The description.
    pub tooltip: String,
}

/// Returns the hints of a text, in its order.
pub fn hints(document: &Document) -> Vec<Hint> {
    let mut hints = BTreeSet::new();
    let functions = &document.analysis.module.functions[document.analysis.prelude.1..];
    let own = functions.iter().filter(|function| function.span.file == document.file());
    rtsl_source::deep_stack::run(|| {
        for function in own {
            add_conversions(document, function, &mut hints);
            add_uniform(document, function, &mut hints);
        }
    });
    for span in document.analysis.contractions() {
        hints.insert(Hint {
            offset: span.end,
            label: "fma".to_owned(),
            tooltip: "A product and a sum here are one operation, which rounds once. `precise` prevents it.".to_owned(),
        });
    }
    hints.into_iter().collect()
}

fn add_conversions(document: &Document, function: &Function, hints: &mut BTreeSet<Hint>) {
    let file = document.file();
    for_each_expression(function, &mut |expression: &Expression| {
        let ExpressionKind::Convert(operand) = &expression.kind else { return };
        let span = operand.span;
        // A conversion that is written spans more than its operand.
        if span.file != file || span != expression.span || span.start == span.end {
            return;
        }
        let ty = rtsl_sema::print::type_name(&document.analysis.module, &expression.ty);
        let from = rtsl_sema::print::type_name(&document.analysis.module, &operand.ty);
        let tooltip = format!("Converted from `{from}` to `{ty}`.");
        let (start, label) = (span.start, format!("{ty}("));
        hints.insert(Hint { offset: start, label, tooltip: tooltip.clone() });
        hints.insert(Hint { offset: span.end, label: ")".to_owned(), tooltip });
    });
}

fn add_uniform(document: &Document, function: &Function, hints: &mut BTreeSet<Hint>) {
    let uniform = uniform_locals(&document.analysis.module, function);
    let inside = |span: Span| {
        document.declarations.iter().filter(move |(_, it)| {
            it.kind == DeclarationKind::Local && crate::declaration::contains(span, it.span)
        })
    };
    for (local, span) in uniform {
        let name = &function.locals[local.0 as usize].name;
        let Some((_, declared)) = inside(span).find(|(_, it)| it.name == *name) else { continue };
        if declared.text.starts_with("const ") {
            continue;
        }
        hints.insert(Hint {
            offset: declared.span.end,
            label: ": uniform".to_owned(),
            tooltip: "The same for all rays of a packet: computed once, without masks.".to_owned(),
        });
    }
}
