//! The standard nodes of MaterialX: their inputs, defaults and expressions.
//!
//! A row has four parts: the node; the type of its output; the inputs with their defaults; the expression in RTSL. `T`
//! is the type of the node, and `I` the type of the first input that is marked with it. An input without a type has
//! the type `T`, or `I` if the output has another; `*` accepts every type. A default with `@` is a property of the
//! surface. In the expression, `{in}` stands for an input, `{T}` for the type in RTSL, `{S}` for the ending of the
//! function that gives as many numbers.

mod color;
mod math;
mod procedural;

use std::collections::BTreeMap;
use std::sync::LazyLock;

use crate::document::{ElementId, Fault};
use crate::graph::{Graph, ScopeId};
use crate::statements::Value;
use crate::types::Type;
use crate::{literal, places, special};

/// A row of the table.
#[derive(Clone, Debug)]
struct Row {
    output: Option<Type>,
    inputs: Vec<Input>,
    expression: &'static str,
}

/// An input of a row.
#[derive(Clone, Debug)]
struct Input {
    name: &'static str,
    ty: InputType,
    default: &'static str,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum InputType {
    /// The type of the node.
    OfNode,
    /// The type of the first such input.
    OfInput,
    /// Every type.
    Any,
    Fixed(Type),
}

static ROWS: LazyLock<BTreeMap<&'static str, Vec<Row>>> = LazyLock::new(|| {
    let mut rows: BTreeMap<&str, Vec<Row>> = BTreeMap::new();
    for line in math::ROWS.iter().chain(color::ROWS).chain(procedural::ROWS) {
        let (name, row) = parse(line).expect("tests parse every row");
        rows.entry(name).or_default().push(row);
    }
    rows
});

fn parse(line: &'static str) -> Option<(&'static str, Row)> {
    let mut parts = line.splitn(4, '|').map(str::trim);
    let (name, output) = (parts.next()?, parts.next()?);
    let (inputs, expression) = (parts.next()?, parts.next()?);
    let output = match output {
        "T" => None,
        name => Some(Type::named(name)?),
    };
    let inputs: Option<Vec<Input>> = inputs.split_whitespace().map(parse_input).collect();
    Some((name, Row { output, inputs: inputs?, expression }))
}

fn parse_input(text: &'static str) -> Option<Input> {
    let (declared, default) = text.split_once('=')?;
    let (name, ty) = match declared.split_once(':') {
        None => (declared, InputType::OfNode),
        Some((name, "I")) => (name, InputType::OfInput),
        Some((name, "*")) => (name, InputType::Any),
        Some((name, ty)) => (name, InputType::Fixed(Type::named(ty)?)),
    };
    Some(Input { name, ty, default })
}

/// The names of the nodes that are supported, in order: those of the table, and those that need more than a row.
pub fn nodes() -> impl Iterator<Item = &'static str> {
    let mut names: Vec<&str> = ROWS.keys().copied().chain(special::NODES.iter().copied()).collect();
    names.sort_unstable();
    names.dedup();
    names.into_iter()
}

/// True for nodes of the table.
pub fn is_known(name: &str) -> bool {
    ROWS.contains_key(name)
}

/// Returns the value of a node of the table; `None` if the table has no row for it and its type.
///
/// # Errors
/// If an input cannot be computed.
pub fn value(
    graph: &mut Graph<'_>,
    scope: ScopeId,
    node: ElementId,
) -> Result<Option<Value>, Fault> {
    let element = graph.document.get(node);
    let Some(rows) = ROWS.get(element.tag.as_str()) else { return Ok(None) };
    let of_node = element.attribute("type").and_then(Type::named);
    let exact = rows.iter().find(|row| row.output.is_some() && row.output == of_node);
    let Some(row) = exact.or_else(|| rows.iter().find(|row| row.output.is_none())).or(rows.first())
    else {
        return Ok(None);
    };
    let Some(ty) = row.output.or(of_node) else { return Ok(None) };
    Evaluation { graph, scope, node, row, ty }.value().map(Some)
}

struct Evaluation<'g, 'd> {
    graph: &'g mut Graph<'d>,
    scope: ScopeId,
    node: ElementId,
    row: &'static Row,
    ty: Type,
}

impl Evaluation<'_, '_> {
    fn value(mut self) -> Result<Value, Fault> {
        let (row, ty) = (self.row, self.ty);
        let mut generic: Option<Type> = None;
        let mut expression = row.expression.to_owned();
        let mut footprint = None;
        for input in &row.inputs {
            let given = self.graph.input(self.scope, self.node, input.name)?;
            let wanted = match input.ty {
                InputType::Fixed(ty) => Some(ty),
                InputType::OfNode => Some(ty),
                InputType::OfInput => {
                    let of_input = generic.or(given.as_ref().map(|it| it.ty));
                    generic = Some(of_input.unwrap_or(Type::Vector3));
                    generic
                }
                InputType::Any => None,
            };
            let value = match given {
                Some(value) => value,
                None => self.default(input.default, wanted)?,
            };
            // Numbers are added to all elements of a matrix.
            let is_matrix = matches!(wanted, Some(Type::Matrix33 | Type::Matrix44));
            let value = match wanted {
                Some(_) if is_matrix && value.ty == Type::Float => value,
                Some(wanted) => special::converted(self.graph, &value, wanted, self.node)?,
                None => value,
            };
            if footprint.is_none() {
                footprint = value.footprint.clone();
            }
            expression = expression.replace(&format!("{{{}}}", input.name), &value.text);
        }
        let expression = self.with_types(expression, generic);
        let footprint = self.footprint(footprint)?;
        Ok(self.graph.add(ty, expression).with_footprint(footprint))
    }

    fn with_types(&self, expression: String, generic: Option<Type>) -> String {
        let ending = match self.ty.count() {
            1 => "",
            2 => "2",
            3 => "s",
            _ => "4",
        };
        let generic = generic.unwrap_or(self.ty);
        expression
            .replace("{T}", self.ty.rtsl())
            .replace("{I}", generic.rtsl())
            .replace("{S}", ending)
    }

    fn default(&mut self, text: &str, wanted: Option<Type>) -> Result<Value, Fault> {
        if let Some(property) = text.strip_prefix('@') {
            return places::property(self.graph, property, self.node);
        }
        let ty = match wanted {
            Some(ty) => ty,
            None if text == "true" || text == "false" => Type::Boolean,
            None => Type::Float,
        };
        if matches!(ty, Type::Matrix33 | Type::Matrix44) {
            return Ok(Value::new(ty, format!("{}({}.0)", ty.rtsl(), text)));
        }
        let text = match (ty, text) {
            (Type::Boolean, "1") => "true",
            (Type::Boolean, "0") => "false",
            (_, text) => text,
        };
        let numbers = literal::numbers(text, ty).unwrap_or_else(|| vec![0.0; ty.count()]);
        Ok(Value::constant(ty, numbers))
    }

    /// The widths that a ray sees of coordinates after a node that scales them.
    fn footprint(&mut self, before: Option<String>) -> Result<Option<String>, Fault> {
        let tag = self.graph.document.get(self.node).tag.clone();
        let Some(before) = before.filter(|_| self.ty == Type::Vector2) else { return Ok(None) };
        let factor = match tag.as_str() {
            "multiply" => "in2",
            "divide" => "in2",
            "place2d" | "UsdTransform2d" => "scale",
            _ => return Ok(Some(before)),
        };
        let Some(factor) = self.graph.input(self.scope, self.node, factor)? else {
            return Ok(Some(before));
        };
        let factor = special::converted(self.graph, &factor, Type::Vector2, self.node)?;
        let operator =
            if matches!(tag.as_str(), "multiply" | "UsdTransform2d") { "*" } else { "/" };
        Ok(Some(format!("({before} {operator} abs({}))", factor.text)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_names_its_inputs() {
        for line in math::ROWS.iter().chain(color::ROWS).chain(procedural::ROWS) {
            let (name, row) = parse(line).unwrap_or_else(|| panic!("{line}"));
            for input in &row.inputs {
                let place = format!("{{{}}}", input.name);
                let unused = ["note", "filtertype"].contains(&input.name);
                assert!(unused || row.expression.contains(&place), "{name}: {place}");
            }
            let mut rest = row.expression;
            while let Some(start) = rest.find('{') {
                let end = rest[start..].find('}').unwrap() + start;
                let name = &rest[start + 1..end];
                let is_input = row.inputs.iter().any(|input| input.name == name);
                assert!(is_input || ["T", "I", "S"].contains(&name), "{line}");
                rest = &rest[end..];
            }
        }
    }
}
