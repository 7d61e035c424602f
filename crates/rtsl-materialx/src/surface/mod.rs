//! Surfaces: the materials of the library that take the place of MaterialX's surface nodes.
//!
//! A parameter of the material has an expression of the node's inputs. If the document gives the inputs as numbers, the
//! class has another initial value of the parameter; if one is connected, a function computes it. Parameters whose
//! inputs the document does not give keep the value of the library, unless that differs from the node's.

mod gltf;
mod models;
mod usd;

use crate::document::{ElementId, Fault};
use crate::graph::{Graph, ScopeId};
use crate::special::converted;
use crate::statements::Value;
use crate::types::Type;
use crate::{literal, places};

/// A surface node, and the material that takes its place.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// The node.
    pub node: &'static str,
    /// The class of the library.
    pub class: &'static str,
    /// Inputs `name:type` that are parameters of the same name, but for its spelling.
    pub direct: &'static str,
    /// Parameters that are computed.
    pub computed: &'static [Parameter],
    /// The input that is the normal, and the expression of the normal in world space.
    pub normal: Option<(&'static str, &'static str)>,
    /// Inputs without effect.
    pub ignored: &'static [&'static str],
}

/// A parameter that is an expression of inputs.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// The parameter of the class, and its type in RTSL.
    pub name: &'static str,
    /// `float`, `color`, `vec3` or `bool`.
    pub ty: &'static str,
    /// The inputs, as `name:type=default`. One with `!` makes the parameter differ from the library's if it is given;
    /// `!` alone, always.
    pub inputs: &'static str,
    /// The expression of the inputs in RTSL.
    pub expression: &'static str,
}

/// The function of materials that returns the surface's normal.
pub const NORMAL: &str = "surfaceNormal";

/// Shortens rows of tables.
const fn parameter(
    name: &'static str,
    ty: &'static str,
    inputs: &'static str,
    expression: &'static str,
) -> Parameter {
    Parameter { name, ty, inputs, expression }
}

/// The surfaces.
pub const SURFACES: [Surface; 6] = [
    models::OPEN_PBR,
    models::STANDARD_SURFACE,
    models::DISNEY_PRINCIPLED,
    models::UNLIT,
    gltf::GLTF_PBR,
    usd::PREVIEW_SURFACE,
];

/// Returns the surface of a node.
pub fn named(node: &str) -> Option<&'static Surface> {
    SURFACES.iter().find(|surface| surface.node == node)
}

/// A parameter of a class, with the value that the document gives it.
#[derive(Clone, Debug)]
pub struct Setting {
    /// The parameter.
    pub name: String,
    /// Its type in RTSL.
    pub ty: &'static str,
    /// The expression.
    pub value: String,
    /// True if the expression is an initial value; else a function returns it, with the statements that it needs.
    pub is_constant: bool,
}

impl Setting {
    /// A parameter that is a number.
    pub fn of_float(name: &str, value: &Value) -> Self {
        Setting {
            name: name.to_owned(),
            ty: "float",
            value: value.text.clone(),
            is_constant: value.constant.is_some(),
        }
    }

    /// True if the parameter says how much of the surface there is, and this is not always all of it.
    pub fn makes_holes(&self) -> bool {
        let is_one = matches!(self.value.as_str(), "1.0" | "color(vec3(1.0))");
        matches!(self.name.as_str(), "geometryOpacity" | "opacity") && !(self.is_constant && is_one)
    }
}

/// Returns the settings of a surface node.
///
/// # Errors
/// If an input cannot be computed.
pub fn settings(
    graph: &mut Graph<'_>,
    surface: &Surface,
    scope: ScopeId,
    node: ElementId,
) -> Result<Vec<Setting>, Fault> {
    let mut reader = Reader { graph, scope, node, settings: Vec::new() };
    for input in surface.direct.split_whitespace() {
        let Some((name, ty)) = input.split_once(':') else { continue };
        reader.direct(name, ty)?;
    }
    for parameter in surface.computed {
        reader.computed(parameter)?;
    }
    if let Some((name, expression)) = surface.normal {
        reader.normal(name, expression)?;
    }
    reader.warn_of_ignored(surface);
    Ok(reader.settings)
}

struct Reader<'g, 'd> {
    graph: &'g mut Graph<'d>,
    scope: ScopeId,
    node: ElementId,
    settings: Vec<Setting>,
}

impl Reader<'_, '_> {
    fn direct(&mut self, name: &str, ty: &str) -> Result<(), Fault> {
        let Some(value) = self.graph.input(self.scope, self.node, name)? else { return Ok(()) };
        let wanted = Type::named(ty).unwrap_or(Type::Float);
        let value = converted(self.graph, &value, wanted, self.node)?;
        let own = match wanted {
            Type::Boolean => "bool",
            Type::Color3 => "color",
            _ => "float",
        };
        self.set(&camel_case(name), own, &value.text, value.constant.is_some());
        Ok(())
    }

    fn computed(&mut self, parameter: &Parameter) -> Result<(), Fault> {
        let mut expression = parameter.expression.to_owned();
        let mut is_constant = true;
        let mut is_wanted = false;
        for input in parameter.inputs.split_whitespace() {
            if input == "!" {
                is_wanted = true;
                continue;
            }
            let (declared, default) = input.split_once('=').unwrap_or((input, "0"));
            let (name, ty) = declared.split_once(':').unwrap_or((declared, "float"));
            let (name, decides) = match name.strip_prefix('!') {
                Some(name) => (name, true),
                None => (name, false),
            };
            let ty = Type::named(ty).unwrap_or(Type::Float);
            let value = match self.graph.input(self.scope, self.node, name)? {
                Some(value) => {
                    is_wanted |= decides;
                    converted(self.graph, &value, ty, self.node)?
                }
                None => self.default(default, ty)?,
            };
            is_constant &= value.constant.is_some();
            expression = expression.replace(&format!("{{{name}}}"), &value.text);
        }
        if is_wanted {
            let is_known = is_constant && !expression.contains("rt_");
            self.set(parameter.name, parameter.ty, &expression, is_known);
        }
        Ok(())
    }

    fn default(&mut self, text: &str, ty: Type) -> Result<Value, Fault> {
        match text.strip_prefix('@') {
            Some(property) => places::property(self.graph, property, self.node),
            None => {
                let numbers = literal::numbers(text, ty).unwrap_or_else(|| vec![0.0; ty.count()]);
                Ok(Value::constant(ty, numbers))
            }
        }
    }

    fn set(&mut self, name: &str, ty: &'static str, expression: &str, is_constant: bool) {
        let expression = match ty {
            "color" => format!("color({expression})"),
            _ => expression.to_owned(),
        };
        if ty == "bool" && !is_constant {
            let message =
                format!("`{name}` is connected; it keeps its value, since it cannot vary");
            self.graph.warn(message, self.node);
            return;
        }
        self.settings.push(Setting { name: name.to_owned(), ty, value: expression, is_constant });
    }

    fn normal(&mut self, name: &str, expression: &str) -> Result<(), Fault> {
        let Some(value) = self.graph.input(self.scope, self.node, name)? else { return Ok(()) };
        let own = places::property(self.graph, "Nworld", self.node)?;
        if value.text == own.text {
            return Ok(());
        }
        let value = converted(self.graph, &value, Type::Vector3, self.node)?;
        let normal = expression.replace("{}", &value.text);
        self.settings.push(Setting {
            name: NORMAL.to_owned(),
            ty: "vec3",
            value: format!(
                "mxPlacement.usableNormal({normal}, rt_ShadingNormal, rt_GeometricNormal)"
            ),
            is_constant: false,
        });
        Ok(())
    }

    fn warn_of_ignored(&mut self, surface: &Surface) {
        let document = self.graph.document;
        let given: Vec<ElementId> = document.children(self.node, "input").collect();
        for input in given {
            let name = document.get(input).name();
            if surface.ignored.contains(&name) {
                let message = format!("the input `{name}` of `{}` has no effect", surface.node);
                self.graph.warn(message, input);
            }
        }
    }
}

/// The spelling of parameters: `specular_IOR` is `specularIor`.
fn camel_case(name: &str) -> String {
    let mut spelled = String::new();
    for (index, word) in name.split('_').enumerate() {
        let mut letters = word.chars();
        match letters.next() {
            Some(first) if index > 0 => {
                spelled.push(first.to_ascii_uppercase());
                spelled.extend(letters.map(|letter| letter.to_ascii_lowercase()));
            }
            _ => spelled.push_str(word),
        }
    }
    spelled
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_spelled_like_those_of_the_library() {
        assert_eq!(camel_case("specular_IOR"), "specularIor");
        assert_eq!(camel_case("base"), "base");
    }

    #[test]
    fn expressions_name_their_inputs() {
        for parameter in SURFACES.iter().flat_map(|surface| surface.computed) {
            let mut rest = parameter.expression;
            while let Some(start) = rest.find('{') {
                let end = rest[start..].find('}').unwrap() + start;
                let name = &rest[start + 1..end];
                let declared = parameter.inputs.split_whitespace();
                let mut names = declared.map(|it| it.split([':', '=']).next().unwrap_or_default());
                let is_declared = names.any(|it| it.trim_start_matches('!') == name);
                assert!(is_declared, "{}: {name}", parameter.name);
                rest = &rest[end..];
            }
        }
    }
}
