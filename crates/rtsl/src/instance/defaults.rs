//! Defaults of parameters.

use rtsl_ir::VariableKind;
use rtsl_ir::class::{Class, Parameter, ParameterTarget};

use super::environment::Environment;

/// Returns the scalars that a parameter of `class` has by default, as bits, for hosts that show them; `None` for
/// structs, which have several variables, and for references and buffers, which have none.
pub fn default_value(class: &Class, parameter: &Parameter) -> Option<Vec<u32>> {
    let kind = match parameter.target {
        ParameterTarget::Constructor => VariableKind::Parameter,
        ParameterTarget::Member => VariableKind::Member,
    };
    let variables = class.initializer.variables.iter().chain(&class.members);
    let variable = variables.filter(|it| it.kind == kind).find(|it| it.name == parameter.name)?;
    let mut values = Environment::default();
    values.run(&class.initializer).ok()?;
    Some(values.take(variable))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::compiler::Compiler;

    #[test]
    fn members_and_constructor_parameters_have_defaults() {
        let text = "class A : rt_Texture; struct S { int a; };
            public vec2 both = vec2(1.0, 2.0); public int none; public S s; public float many[];
            constructor(float given = 3.0, bool asked) { both.x = 9.0; }";
        let compilation = Compiler::default().compile("a.rtsl", text);
        let unit =
            compilation.unit.as_ref().unwrap_or_else(|| panic!("{}", compilation.report(false)));
        let class = &unit.classes()[0];
        let defaults =
            class.parameters.iter().map(|it| (it.name.as_str(), default_value(class, it)));
        let one = |x: f32| x.to_bits();
        let expected = [
            ("given", Some(vec![one(3.0)])),
            ("asked", Some(vec![0])),
            ("both", Some(vec![one(1.0), one(2.0)])),
            ("none", Some(vec![0])),
            ("s", None),
            ("many", None),
        ];
        assert_eq!(defaults.collect::<Vec<_>>(), expected);
    }
}
