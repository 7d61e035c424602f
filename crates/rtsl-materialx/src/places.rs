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
        let index = element.attribute("index").and_then(|it| it.parse().ok());
        if let ("texcoord", Some(set)) = (of.as_str(), index) {
            return coordinates(graph, set, at);
        }
        if let Some(value) = by_space(graph, &of, &space, at)? {
            return Ok(value);
        }
    }
    if let Some(set) = set_of_coordinates(name) {
        return coordinates(graph, set, at);
    }
    let message = format!("unknown property `{name}` of surfaces");
    let diagnostic = Diagnostic::new(codes::MATERIALX_UNKNOWN, message);
    Err(Box::new(diagnostic.at(graph.document.get(at).span, "named here")))
}

/// The last set of texture coordinates.
const LAST_SET: usize = 7;

/// The attribute of a set of texture coordinates after the first, as files of glTF name it.
fn attribute_of_set(set: usize) -> String {
    format!("uv{set}")
}

/// Returns texture coordinates. Those of further sets are attributes, whose widths are not known.
fn coordinates(graph: &mut Graph<'_>, set: usize, at: ElementId) -> Result<Value, Fault> {
    if set == 0 {
        return property(graph, "UV0", at);
    }
    if set > LAST_SET {
        let message = format!("texture coordinates of the set {set}: {LAST_SET} is the last");
        return Err(graph.unsupported(message, at));
    }
    let name = attribute_of_set(set);
    let declaration = format!("attribute vec2 {name} = vec2(0.0);");
    graph.attributes.insert(name.clone(), declaration);
    Ok(graph.add(Type::Vector2, name))
}

/// The set of texture coordinates that a name stands for in MaterialX, USD, Maya and Blender.
fn set_of_coordinates(name: &str) -> Option<usize> {
    if matches!(name, "st" | "uv" | "UV" | "UVMap") {
        return Some(0);
    }
    if let Some(number) = name.strip_prefix("map") {
        return number.parse::<usize>().ok()?.checked_sub(1);
    }
    let prefixes = ["st", "uv", "UV", "texcoord_", "TEXCOORD_", "UVMap.", "UVMap_"];
    prefixes.iter().find_map(|prefix| name.strip_prefix(prefix)?.parse().ok())
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
    let set = index.constant.map(|it| it[0].max(0.0) as usize);
    if set.is_none() {
        let message = "the set of texture coordinates is computed: the first one counts";
        at.graph.warn(message.to_owned(), at.node);
    }
    let uv = coordinates(at.graph, set.unwrap_or(0), at.node)?;
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

/// An attribute of the object: a member of the class.
fn attribute(at: &mut At<'_, '_>, name: &str, default: &str) -> Result<Value, Fault> {
    let ty = at.ty();
    let given = at.text(name)?.unwrap_or_default();
    if ty == Type::Text {
        let fallback = at.text(default)?.unwrap_or_default();
        at.graph.warn(format!("the text `{given}` of the object is not read"), at.node);
        return Ok(Value::new(Type::Text, fallback));
    }
    if let (Type::Vector2, Some(set)) = (ty, set_of_coordinates(&given)) {
        return coordinates(at.graph, set, at.node);
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
    // Further sets count as the first, since their directions are not known.
    let sets = (1..=LAST_SET).map(attribute_of_set).filter_map(|set| of(&set));
    let uvs = of(UV).into_iter().chain(sets);
    let uvs: Vec<String> = uvs.map(|uv| format!("gradient({}, {uv})", height.text)).collect();
    let object = ["vectorToObject(rt_dPdu)", "vectorToObject(rt_dPdv)"];
    let object = through(of(POINT_OF_OBJECT), object);
    let world = through(of(POINT), ["rt_dPdu", "rt_dPdv"]);
    let terms: Vec<String> = uvs.into_iter().chain(object).chain(world).collect();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_of_coordinates_are_known_by_their_names() {
        for name in ["st", "UV0", "map1", "UVMap"] {
            assert_eq!(set_of_coordinates(name), Some(0), "{name}");
        }
        for name in ["st1", "UV1", "uv1", "map2", "UVMap.001", "TEXCOORD_1"] {
            assert_eq!(set_of_coordinates(name), Some(1), "{name}");
        }
        for name in ["map", "map0", "uvs", "stretch", "height"] {
            assert_eq!(set_of_coordinates(name), None, "{name}");
        }
    }
}
