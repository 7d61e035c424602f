//! Every built-in function in every form compiles.

use std::fmt::Write;

use rtsl::{Compiler, CompilerOptions};
use rtsl_spec::builtins::{Overload, SpecType, Usable, all, overloads};

#[test]
fn every_overload_compiles() {
    for builtin in all().filter(|builtin| builtin.usable == Usable::Anywhere) {
        let mut text =
            String::from("class Caller : rt_Texture;\nvoid lookup() {\n    float sum = 0.0;\n");
        for overload in overloads(builtin.name) {
            // References are members of classes and have tests of their own.
            if overload.parameters.iter().all(|parameter| parameter.ty != SpecType::Reference) {
                write_call(&mut text, overload);
            }
        }
        text.push_str("    rt_FloatTextureValue = sum;\n}\n");
        let compilation = Compiler::new(CompilerOptions::default()).compile("caller.rtsl", &text);
        assert!(!compilation.diagnostics.has_errors(), "{}", compilation.report(false));
    }
}

fn write_call(text: &mut String, overload: &Overload) {
    text.push_str("    {\n");
    let mut arguments = Vec::new();
    for (index, parameter) in overload.parameters.iter().enumerate() {
        let (ty, name) = (parameter.ty, format!("argument{index}"));
        writeln!(text, "        {ty} {name} = {ty}({});", one_of(ty)).unwrap();
        arguments.push(name);
    }
    let call = format!("{}({})", overload.builtin.name, arguments.join(", "));
    match overload.result {
        SpecType::Void => writeln!(text, "        {call};").unwrap(),
        result => writeln!(text, "        sum += {};", as_float(result, &call)).unwrap(),
    }
    text.push_str("    }\n");
}

fn one_of(ty: SpecType) -> &'static str {
    match ty {
        SpecType::Mat(..) => "2.0",
        _ => "rt_TextureUV.x",
    }
}

fn as_float(ty: SpecType, call: &str) -> String {
    match ty {
        SpecType::Vec(..) => format!("float({call}.x)"),
        SpecType::Mat(..) => format!("{call}[0][0]"),
        SpecType::Color => format!("luminance({call})"),
        _ => format!("float({call})"),
    }
}
