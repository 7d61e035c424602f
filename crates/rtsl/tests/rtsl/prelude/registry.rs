//! Every built-in function in every form compiles.

use std::fmt::Write;

use rtsl::{Compiler, CompilerOptions};
use rtsl_spec::builtins::{
    Chapter, Overload, SpecStruct, SpecType, Usable, all, method_overloads, methods_of, overloads,
};

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

#[test]
fn every_function_and_method_of_integrators_compiles() {
    let functions = all().filter(|builtin| builtin.chapter == Chapter::Integrators);
    let functions = functions.flat_map(|builtin| overloads(builtin.name));
    let methods = SpecStruct::ALL.into_iter().flat_map(|of| {
        methods_of(of)
            .flat_map(move |method| method_overloads(of, method.name))
            .map(|it| (true, it))
    });
    let mut text = String::from("class Caller : rt_Integrator;\nvoid radiance() {\n");
    for (is_method, overload) in functions.map(|it| (false, it)).chain(methods) {
        writeln!(text, "    {{").unwrap();
        let mut arguments = Vec::new();
        for (index, parameter) in overload.parameters.iter().enumerate() {
            let (ty, name) = (parameter.ty, format!("argument{index}"));
            let value = match ty {
                SpecType::Struct(_) => "nearestHit()".to_owned(),
                ty => format!("{ty}(rt_RayOrigin.x)"),
            };
            writeln!(text, "        {ty} {name} = {value};").unwrap();
            arguments.push(name);
        }
        let name = overload.builtin.name;
        let call = match is_method {
            true => format!("{}.{name}({})", arguments[0], arguments[1..].join(", ")),
            false => format!("{name}({})", arguments.join(", ")),
        };
        match overload.result {
            SpecType::Void => writeln!(text, "        {call};").unwrap(),
            SpecType::Struct(_) => {
                writeln!(text, "        rt_SampleColor += color({call}.direction);").unwrap();
            }
            result => {
                let value = as_float(result, &call);
                writeln!(text, "        rt_SampleColor += color({value});").unwrap();
            }
        }
        writeln!(text, "    }}").unwrap();
    }
    text.push_str("}\n");
    let compilation = Compiler::new(CompilerOptions::default()).compile("caller.rtsl", &text);
    assert!(compilation.diagnostics.is_empty(), "{}", compilation.report(false));
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
