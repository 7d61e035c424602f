//! The renderer's texts: what surrounds an integrator, in RTSL, for one ray. They are parsed and checked once per
//! process, and each function is lowered and optimised when it is first used.
//!
//! Linking [copies](crate::text_call) their bodies into stages, and [`link_alone`](crate::text_call::link_alone) makes
//! functions of them that hosts call for many rays. Their operations are precise: all give the same bits.

use std::collections::BTreeMap;
use std::sync::{LazyLock, OnceLock};

use rtsl_lower::{LoweredFunction, lower_function};
use rtsl_sema::check::check_on_prelude;
use rtsl_sema::hir::{FunctionId, Module};
use rtsl_sema::prelude::{RENDERER, parse_texts, prelude};
use rtsl_source::{Diagnostics, deep_stack};

/// The checked texts, with the functions that they declare.
struct RendererTexts {
    module: Module,
    functions: BTreeMap<String, (FunctionId, OnceLock<LoweredFunction>)>,
}

static TEXTS: LazyLock<RendererTexts> = LazyLock::new(|| {
    let _span = tracing::debug_span!("renderer texts").entered();
    let prelude = prelude();
    let mut sources = prelude.sources.clone();
    let mut diagnostics = Diagnostics::new();
    let units = parse_texts(RENDERER, &mut sources, &mut diagnostics);
    let module = deep_stack::run(|| check_on_prelude(&units, &prelude.checked, &mut diagnostics));
    let faults: Vec<&str> = diagnostics.iter().map(|it| it.message.as_str()).collect();
    assert!(faults.is_empty(), "the renderer's texts have errors, which a test finds: {faults:?}");
    let declared = (0..).map(FunctionId).zip(&module.functions);
    let functions = declared
        .skip(prelude.checked.module().functions.len())
        .map(|(id, function)| (function.name.clone(), (id, OnceLock::new())))
        .collect();
    RendererTexts { module, functions }
});

/// Returns a function of the texts, optimised.
///
/// # Panics
/// If there is none of this name.
pub(crate) fn text_function(name: &str) -> &'static LoweredFunction {
    let (id, made) = TEXTS.functions.get(name).unwrap_or_else(|| panic!("a text has {name}"));
    made.get_or_init(|| {
        let lowered = lower_function(&TEXTS.module, *id);
        let mut lowered = lowered.unwrap_or_else(|error| panic!("{name}: {}", error.message));
        let options = rtsl_opt::Options {
            contract: false,
            // Branches on what is known of operands disappear when the body is copied.
            select: false,
            ..rtsl_opt::Options::default()
        };
        rtsl_opt::optimize(&mut lowered.function, &options);
        lowered
    })
}

#[cfg(test)]
mod tests {
    use rtsl_ir::{OpKind, Scalar};

    use super::*;

    #[test]
    fn the_texts_are_valid() {
        for name in TEXTS.functions.keys() {
            let LoweredFunction { function, .. } = text_function(name);
            rtsl_ir::verify::verify(function).expect("it is valid");
            function.body.for_each_op(&mut |op| match op.kind {
                OpKind::Binary(_, a, _) if function.scalar(a) == Scalar::F32 => {
                    assert!(op.precise, "{name}: {:?}", op.kind);
                }
                _ => assert!(!matches!(op.kind, OpKind::Fma(..)), "{name} is contracted"),
            });
        }
    }
}
