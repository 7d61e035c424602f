//! Facts that a text does not show: implicit conversions, values that are the same for all rays, contracted operations.

use std::collections::{BTreeMap, BTreeSet};

use rtsl_sema::hir::{Expression, ExpressionKind, Function};

use crate::declaration::{Declaration, DeclarationKind, contains};
use crate::document::Document;
use crate::rate::{RayReaders, uniform_locals};
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
        let readers = RayReaders::of(&document.analysis.module);
        let locals = locals(document);
        for function in own {
            add_conversions(document, function, &mut hints);
            add_uniform(&readers, &locals, function, &mut hints);
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

/// The variables of functions of the text, by name and place.
type Locals<'d> = BTreeMap<(&'d str, u32), &'d Declaration>;

fn locals(document: &Document) -> Locals<'_> {
    let declared = document.declarations.iter().map(|(_, it)| it);
    let own =
        declared.filter(|it| it.kind == DeclarationKind::Local && it.span.file == document.file());
    own.map(|it| ((it.name.as_str(), it.span.start), it)).collect()
}

fn add_uniform(
    readers: &RayReaders<'_>,
    locals: &Locals<'_>,
    function: &Function,
    hints: &mut BTreeSet<Hint>,
) {
    for (local, span) in uniform_locals(readers, function) {
        let name = function.locals[local.0 as usize].name.as_str();
        let inside = locals.range((name, span.start)..=(name, span.end)).next();
        let Some((_, declared)) = inside.filter(|(_, it)| contains(span, it.span)) else {
            continue;
        };
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
