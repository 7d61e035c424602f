//! The prelude has no errors or warnings, and implements every overload of every built-in function
//! that is lowered to it.

use rtsl_sema::hir::Type;
use rtsl_sema::prelude::{CheckedPrelude, prelude};
use rtsl_spec::builtins::{Lowering, Usable, all, overloads};

#[test]
fn the_prelude_checks() {
    let CheckedPrelude { sources, diagnostics, .. } = prelude();
    let text = rtsl_source::render::all_to_text(sources, diagnostics.iter(), false);
    assert_eq!(text, "");
}

/// Calls every overload of every built-in function on variables of its parameters' types.
#[test]
fn every_overload_finds_its_function() {
    let mut failures = String::new();
    for builtin in all().filter(|builtin| builtin.lowering == Lowering::Prelude) {
        for overload in overloads(builtin.name) {
            let (role, method) = match builtin.usable {
                Usable::Methods(_) => ("rt_Integrator", "radiance"),
                Usable::Anywhere | Usable::Prelude => ("rt_Texture", "lookup"),
            };
            let mut text = format!("class C : {role};\nvoid {method}() {{\n");
            for (index, parameter) in overload.parameters.iter().enumerate() {
                let ty = parameter.ty;
                text += &format!(
                    "    {ty} a{index} = {ty}({});\n",
                    if ty.to_string() == "bool" { "true" } else { "1" }
                );
            }
            let names: Vec<String> =
                (0..overload.parameters.len()).map(|index| format!("a{index}")).collect();
            let result = overload.result;
            let kept = if result.to_string() == "void" {
                String::new()
            } else {
                format!("{result} _result = ")
            };
            text += &format!("    {kept}{}({});\n}}\n", builtin.name, names.join(", "));
            let (module, _, _) = rtsl_testing::checked::check(&text);
            let report = rtsl_testing::checked::diagnostics(&text);
            let tree = format!("{:?}", module.functions.last());
            if !report.is_empty() || tree.contains("prelude: None") {
                failures += &format!("{overload}\n{report}");
            }
            assert_ne!(module.functions.last().unwrap().result, Type::Error);
        }
    }
    assert_eq!(failures, "");
}
