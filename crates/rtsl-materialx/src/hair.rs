//! Hair: a surface whose only closure is `chiang_hair_bsdf` becomes a class that derives from the library's `Hair`.

use crate::class::{self, Header};
use crate::document::{ElementId, Fault};
use crate::graph::{Graph, ScopeId};
use crate::limits;
use crate::special::At;
use crate::statements::Value;
use crate::surface::Setting;
use crate::types::Type;

/// The closure.
const NODE: &str = "chiang_hair_bsdf";

/// The class of the library.
pub const CLASS: &str = "Hair";

/// Returns the closure of a surface if it is one of hair.
///
/// # Errors
/// If the document connects it to something that does not exist.
pub fn closure_of(
    graph: &mut Graph<'_>,
    scope: ScopeId,
    surface: ElementId,
) -> Result<Option<(ScopeId, ElementId)>, Fault> {
    let mut found = graph.connected(scope, surface, "bsdf")?;
    for _ in 0..limits::DEPTH {
        let Some((scope, node, _)) = found else { return Ok(None) };
        match graph.document.get(node).tag.as_str() {
            NODE => return Ok(Some((scope, node))),
            "dot" => found = graph.connected(scope, node, "in")?,
            _ => return Ok(None),
        }
    }
    Ok(None)
}

/// True for the closure of hair.
pub fn is_closure(tag: &str) -> bool {
    tag == NODE
}

/// Returns the text of the class for a surface with the closure `node`.
///
/// # Errors
/// If an input cannot be computed.
pub fn class(
    graph: &mut Graph<'_>,
    header: &Header<'_>,
    surface: ElementId,
    (scope, node): (ScopeId, ElementId),
) -> Result<String, Fault> {
    warn_of_ignored(graph, surface, &["edf", "opacity"]);
    warn_of_ignored(graph, node, &["normal", "curve_direction"]);
    let mut at = At { graph, scope, node };
    let index = at.input("ior", Type::Float, 1.55)?;
    let absorption = at.input("absorption_coefficient", Type::Vector3, 0.0)?;
    let strand = strand(&mut at)?;
    let tints = tints(&mut at)?;
    let mut text = header.text(CLASS, "");
    class::write_members(graph, &mut text);
    class::write_settings(graph, &[index_setting(&index)], &mut text);
    let absorbed = format!("color(max({}, vec3(0.0)))", absorption.text);
    class::write_function(graph, "color absorption(float azimuthal)", &absorbed, &mut text);
    class::write_function(graph, "Strand strandHere()", &strand, &mut text);
    write_tints(graph, &tints, &mut text);
    Ok(text)
}

fn warn_of_ignored(graph: &mut Graph<'_>, node: ElementId, names: &[&str]) {
    for name in names {
        if let Some(port) = graph.port(node, name) {
            graph.warn(format!("the input `{name}` has no effect on hair"), port);
        }
    }
}

fn index_setting(index: &Value) -> Setting {
    match index.constant {
        Some(_) => Setting::Initial(format!("public texture float eta = {};", index.text)),
        None => Setting::Computed { header: "float eta".to_owned(), result: index.text.clone() },
    }
}

/// The call that makes the strand. The angle of the scales is turned the other way, and 0.5 is none.
fn strand(at: &mut At<'_, '_>) -> Result<String, Fault> {
    let mut arguments = Vec::new();
    for (name, roughness) in [("roughness_R", 0.1), ("roughness_TT", 0.05), ("roughness_TRT", 0.2)]
    {
        let value = at.input(name, Type::Vector2, roughness)?;
        arguments.push(format!("mxHair.usable({})", value.text));
    }
    let angle = at.input("cuticle_angle", Type::Float, 0.5)?;
    Ok(format!("strandOfLobes({}, radians(90.0 - 180.0 * {}))", arguments.join(", "), angle.text))
}

/// The colours by which the lobes are scaled. Light that is reflected inside again has that of the last.
fn tints(at: &mut At<'_, '_>) -> Result<Vec<Value>, Fault> {
    let names = ["tint_R", "tint_TT", "tint_TRT", "tint_TRT"];
    names.into_iter().map(|name| at.input(name, Type::Color3, 1.0)).collect()
}

fn write_tints(graph: &Graph<'_>, tints: &[Value], text: &mut String) {
    let is_white = |tint: &Value| tint.constant.as_deref() == Some(&[1.0; 3]);
    let colored: Vec<(usize, &str)> = tints
        .iter()
        .enumerate()
        .filter(|(_, tint)| !is_white(tint))
        .map(|(lobe, tint)| (lobe, tint.text.as_str()))
        .collect();
    if colored.is_empty() {
        return;
    }
    let all: Vec<&str> = colored.iter().map(|(_, tint)| *tint).collect();
    text.push_str(
        "\nvoid attenuations(Strand strand, vec2 view, vec2 within, out color parts[LOBES]) {\n    \
         super.attenuations(strand, view, within, parts);\n",
    );
    graph.statements.write(&all.join(" "), text);
    for (lobe, tint) in colored {
        text.push_str(&format!("    parts[{lobe}] *= color(max({tint}, vec3(0.0)));\n"));
    }
    text.push_str("}\n");
}
