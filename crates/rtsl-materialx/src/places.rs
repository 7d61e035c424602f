//! Properties of the surface: places, directions, attributes, and relief by heights.

use rtsl_source::{Diagnostic, diagnostic_codes as codes};

use crate::document::{ElementId, Fault};
use crate::graph::Graph;
use crate::literal;
use crate::special::{At, converted};
use crate::statements::Value;
use crate::types::Type;

/// The coordinates of textures.
const UV: &str = "rt_TextureUV";
const POINT: &str = "rt_HitPoint";
const POINT_OF_OBJECT: &str = "pointToObject(rt_HitPoint)";
const NORMAL: &str = "rt_ShadingNormal";
const TANGENT: &str = "mxPlacement.tangentOf(rt_ShadingNormal, rt_dPdu)";
const BITANGENT: &str = "mxPlacement.bitangentOf(rt_ShadingNormal, rt_dPdu, rt_dPdv)";
const VIEW: &str = "normalize(rt_RayDirection)";

/// The widths that a ray sees along both coordinates.
const FOOTPRINT: &str = "vec2(rt_du, rt_dv)";

/// Properties by the names of MaterialX, with their expressions.
const PROPERTIES: [(&str, Type, &str); 12] = [
    ("UV0", Type::Vector2, UV),
    ("Pobject", Type::Vector3, POINT_OF_OBJECT),
    ("Pmodel", Type::Vector3, POINT_OF_OBJECT),
    ("Pworld", Type::Vector3, POINT),
    ("Nobject", Type::Vector3, "normalize(normalToObject(rt_ShadingNormal))"),
    ("Nworld", Type::Vector3, NORMAL),
    (
        "Tobject",
        Type::Vector3,
        "normalize(vectorToObject(mxPlacement.tangentOf(rt_ShadingNormal, rt_dPdu)))",
    ),
    ("Tworld", Type::Vector3, TANGENT),
    (
        "Bobject",
        Type::Vector3,
        "normalize(vectorToObject(mxPlacement.bitangentOf(rt_ShadingNormal, rt_dPdu, rt_dPdv)))",
    ),
    ("Bworld", Type::Vector3, BITANGENT),
    ("Vworld", Type::Vector3, VIEW),
    ("Vobject", Type::Vector3, "normalize(vectorToObject(rt_RayDirection))"),
];

/// Returns a property of the surface.
///
/// # Errors
/// If there is none of this name.
pub fn property(graph: &mut Graph<'_>, name: &str, at: ElementId) -> Result<Value, Fault> {
    if let Some((_, ty, expression)) = PROPERTIES.iter().find(|(other, _, _)| *other == name) {
        let value = graph.add(*ty, (*expression).to_owned());
        let footprint = (name == "UV0").then(|| FOOTPRINT.to_owned());
        return Ok(value.with_footprint(footprint));
    }
    let root = graph.document.root();
    let defined = graph.document.named(root, name);
    let defined = defined.filter(|it| graph.document.get(*it).tag == "geompropdef");
    if let Some(definition) = defined {
        let element = graph.document.get(definition);
        let of = element.attribute("geomprop").unwrap_or(name);
        let space = element.attribute("space").unwrap_or("object");
        let (of, space) = (of.to_owned(), space.to_owned());
        if let Some(value) = by_space(graph, &of, &space, at)? {
            return Ok(value);
        }
    }
    if name.starts_with("UV") {
        graph.warn(second_set(), at);
        return property(graph, "UV0", at);
    }
    let message = format!("unknown property `{name}` of surfaces");
    let diagnostic = Diagnostic::new(codes::MATERIALX_UNKNOWN, message);
    Err(Box::new(diagnostic.at(graph.document.get(at).span, "named here")))
}

fn second_set() -> String {
    "only the first set of texture coordinates is read: it takes the place of others".to_owned()
}

/// Returns the position or a direction in a space; `None` for other properties.
fn by_space(
    graph: &mut Graph<'_>,
    node: &str,
    space: &str,
    at: ElementId,
) -> Result<Option<Value>, Fault> {
    let letter = match node {
        "position" => "P",
        "normal" => "N",
        "tangent" => "T",
        "bitangent" => "B",
        "viewdirection" => "V",
        "texcoord" => return property(graph, "UV0", at).map(Some),
        _ => return Ok(None),
    };
    let space = if space == "world" { "world" } else { "object" };
    property(graph, &format!("{letter}{space}"), at).map(Some)
}

/// Returns the value of a node of this part; `None` for others.
///
/// # Errors
/// If an input cannot be computed.
pub fn value(at: &mut At<'_, '_>, tag: &str) -> Result<Option<Value>, Fault> {
    let value = match tag {
        "position" | "normal" | "tangent" | "bitangent" | "viewdirection" => {
            let default = if tag == "viewdirection" { "world" } else { "object" };
            let space = at.text("space")?.unwrap_or_else(|| default.to_owned());
            return by_space(at.graph, tag, &space, at.node);
        }
        "texcoord" => texcoord(at)?,
        "geomcolor" => color_of_vertices(at)?,
        "geompropvalue" | "geompropvalueuniform" => attribute(at, "geomprop", "default")?,
        "UsdPrimvarReader" => attribute(at, "varname", "fallback")?,
        "transformpoint" => transformed(at, "point", &[0.0; 3])?,
        "transformvector" => transformed(at, "vector", &[0.0; 3])?,
        "transformnormal" => transformed(at, "normal", &[0.0, 0.0, 1.0])?,
        "heighttonormal" => {
            let scale = at.input("scale", Type::Float, 1.0)?;
            normal_of_height(at, "in", &scale.text)?
        }
        "bump" => bump(at)?,
        _ => return Ok(None),
    };
    Ok(Some(value))
}

fn texcoord(at: &mut At<'_, '_>) -> Result<Value, Fault> {
    let index = at.input("index", Type::Integer, 0.0)?;
    if index.constant.is_none_or(|it| it[0] != 0.0) {
        at.graph.warn(second_set(), at.node);
    }
    let uv = property(at.graph, "UV0", at.node)?;
    let ty = at.ty();
    converted(at.graph, &uv, if ty == Type::Vector3 { ty } else { Type::Vector2 }, at.node)
}

/// The attribute of colours that meshes have.
const COLORS: &str = "Cd";

fn color_of_vertices(at: &mut At<'_, '_>) -> Result<Value, Fault> {
    let declaration = format!("attribute vec4 {COLORS} = vec4(1.0);");
    at.graph.attributes.insert(COLORS.to_owned(), declaration);
    let ty = at.ty();
    converted(at.graph, &Value::new(Type::Color4, COLORS), ty, at.node)
}

/// Names that stand for the coordinates of textures.
const COORDINATES: [&str; 5] = ["st", "uv", "UVMap", "st0", "UV0"];

/// An attribute of the object: a member of the class.
fn attribute(at: &mut At<'_, '_>, name: &str, default: &str) -> Result<Value, Fault> {
    let ty = at.ty();
    let given = at.text(name)?.unwrap_or_default();
    if ty == Type::Text {
        let fallback = at.text(default)?.unwrap_or_default();
        at.graph.warn(format!("the text `{given}` of the object is not read"), at.node);
        return Ok(Value::new(Type::Text, fallback));
    }
    if ty == Type::Vector2 && COORDINATES.contains(&given.as_str()) {
        return property(at.graph, "UV0", at.node);
    }
    let stored = match ty {
        Type::Boolean | Type::Integer => Type::Float,
        Type::Color3 => Type::Vector3,
        Type::Color4 => Type::Vector4,
        Type::Matrix33 | Type::Matrix44 => {
            return Err(at.graph.unsupported("attributes are no matrices".to_owned(), at.node));
        }
        other => other,
    };
    let identifier = identifier(&given);
    if identifier.is_empty() {
        let message = "a property of the object without a name";
        let diagnostic = Diagnostic::new(codes::MATERIALX_SYNTAX, message);
        let span = at.graph.document.get(at.node).span;
        return Err(Box::new(diagnostic.at(span, format!("expected the input `{name}`"))));
    }
    let fallback = at.input(default, ty, 0.0)?;
    let numbers = fallback.constant.unwrap_or_else(|| {
        let message =
            format!("the value for objects without `{given}` is computed: it counts as 0");
        at.graph.warn(message, at.node);
        vec![0.0; stored.count()]
    });
    let initial = literal::rtsl(&numbers, stored);
    let declaration = format!("attribute {} {identifier} = {initial};", stored.rtsl());
    let earlier = at.graph.attributes.insert(identifier.clone(), declaration.clone());
    if let Some(earlier) = earlier.filter(|it| *it != declaration) {
        at.graph.warn(format!("`{given}` has two defaults or types: the first counts"), at.node);
        at.graph.attributes.insert(identifier.clone(), earlier);
    }
    converted(at.graph, &Value::new(stored, identifier), ty, at.node)
}

/// A name of RTSL for a name of a document.
pub fn identifier(name: &str) -> String {
    let letters = name.chars().map(|it| if it.is_ascii_alphanumeric() { it } else { '_' });
    let mut identifier: String = letters.collect();
    while identifier.contains("__") {
        identifier = identifier.replace("__", "_");
    }
    if identifier.starts_with(|first: char| first.is_ascii_digit()) || identifier.starts_with("rt_")
    {
        identifier.insert_str(0, "the_");
    }
    identifier
}

fn transformed(at: &mut At<'_, '_>, what: &str, default: &[f64]) -> Result<Value, Fault> {
    let value = at.input_or("in", Type::Vector3, default)?;
    let is_world = |space: Option<String>| space.as_deref() == Some("world");
    let from = is_world(at.text("fromspace")?);
    let to = is_world(at.text("tospace")?);
    Ok(match (from, to) {
        (true, false) => at.add(Type::Vector3, format!("{what}ToObject({})", value.text)),
        (false, true) => at.add(Type::Vector3, format!("{what}ToWorld({})", value.text)),
        _ => value,
    })
}

/// The derivatives of a height by the coordinates: through these and through the point.
fn slope(at: &mut At<'_, '_>, height: &Value) -> Option<Value> {
    let of = |expression: &str| {
        let mut all = at.graph.statements.expressions(&height.text);
        all.find(|(_, other)| *other == expression).map(|(name, _)| name)
    };
    let through = |place: Option<String>, along: [&str; 2]| {
        let place = place?;
        let gradient = format!("gradient({}, {place})", height.text);
        Some(format!("vec2(dot({gradient}, {}), dot({gradient}, {}))", along[0], along[1]))
    };
    let uv = of(UV).map(|uv| format!("gradient({}, {uv})", height.text));
    let object = ["vectorToObject(rt_dPdu)", "vectorToObject(rt_dPdv)"];
    let object = through(of(POINT_OF_OBJECT), object);
    let world = through(of(POINT), ["rt_dPdu", "rt_dPdv"]);
    let terms: Vec<String> = [uv, object, world].into_iter().flatten().collect();
    if terms.is_empty() {
        return None;
    }
    Some(at.add(Type::Vector2, terms.join(" + ")))
}

/// The normal map of a height.
fn normal_of_height(at: &mut At<'_, '_>, name: &str, scale: &str) -> Result<Value, Fault> {
    let height = at.input(name, Type::Float, 0.0)?;
    Ok(match slope(at, &height) {
        Some(slope) => {
            let call = format!("mxPlacement.normalOfSlope({}, {scale})", slope.text);
            at.add(Type::Vector3, call)
        }
        None => Value::constant(Type::Vector3, vec![0.5, 0.5, 1.0]),
    })
}

fn bump(at: &mut At<'_, '_>) -> Result<Value, Fault> {
    let map = normal_of_height(at, "height", "1.0")?;
    let scale = at.input("scale", Type::Float, 1.0)?;
    let normal = at.input_or_property("normal", Type::Vector3, "Nworld")?;
    let tangent = at.input_or_property("tangent", Type::Vector3, "Tworld")?;
    let bitangent = at.input_or_property("bitangent", Type::Vector3, "Bworld")?;
    let call = format!(
        "mxPlacement.mappedNormal({}, vec2({}), {}, {}, {})",
        map.text, scale.text, normal.text, tangent.text, bitangent.text
    );
    Ok(at.add(Type::Vector3, call))
}
