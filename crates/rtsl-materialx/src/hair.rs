//! Hair: a surface whose only closure is `chiang_hair_bsdf` becomes a class that derives from the library's `Hair`.

use crate::class::{self, Header};
use crate::document::{ElementId, Fault};
use crate::graph::{Graph, ScopeId};
use crate::shader::Shader;
use crate::special::At;
use crate::statements::Value;
use crate::surface::Setting;
use crate::types::Type;
use crate::{closure, limits};

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

/// A surface of hair.
pub struct Hair {
    index: Value,
    absorption: Value,
    /// The call that makes the strand.
    strand: String,
    /// The colours by which the lobes are scaled.
    tints: Vec<Value>,
    /// The opacity, an expression; `None` if it is 1.
    pub opacity: Option<String>,
}

/// Reads the surface of a shader, and its closure, a node in a scope.
///
/// # Errors
/// If an input cannot be computed.
pub fn hair(
    graph: &mut Graph<'_>,
    shader: &Shader,
    scope: ScopeId,
    node: ElementId,
) -> Result<Hair, Fault> {
    warn_of_ignored(graph, shader.node, &["edf"]);
    warn_of_ignored(graph, node, &["normal", "curve_direction"]);
    let opacity = closure::opacity(graph, shader.scope, shader.node)?;
    let mut at = At { graph, scope, node };
    Ok(Hair {
        index: at.input("ior", Type::Float, 1.55)?,
        absorption: at.input("absorption_coefficient", Type::Vector3, 0.0)?,
        strand: strand(&mut at)?,
        tints: tints(&mut at)?,
        opacity,
    })
}

/// Returns the text of the class of a surface of hair.
pub fn class(graph: &Graph<'_>, header: &Header<'_>, hair: &Hair) -> String {
    let mut text = header.text(CLASS, "");
    class::write_members(graph, &mut text);
    class::write_settings(graph, &[Setting::of_float("eta", &hair.index)], &mut text);
    let absorbed = format!("color(max({}, vec3(0.0)))", hair.absorption.text);
    class::write_function(graph, "color absorption(float azimuthal)", &absorbed, &mut text);
    class::write_function(graph, "Strand strandHere()", &hair.strand, &mut text);
    if let Some(opacity) = &hair.opacity {
        class::write_presence(graph, opacity, &mut text);
    }
    write_tints(graph, &hair.tints, &mut text);
    text
}

fn warn_of_ignored(graph: &mut Graph<'_>, node: ElementId, names: &[&str]) {
    for name in names {
        if let Some(port) = graph.port(node, name) {
            graph.warn(format!("the input `{name}` has no effect on hair"), port);
        }
    }
}

/// The angle of the scales is turned the other way, and 0.5 is none.
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

/// Light that is reflected inside again has that of the last.
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
