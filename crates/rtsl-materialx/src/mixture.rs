//! Mixtures of surfaces that are materials of the library: a class that derives from `Mix`, which refers to both.

use crate::class::{self, Header};
use crate::document::Fault;
use crate::graph::Graph;
use crate::shader::Shader;
use crate::special::At;
use crate::surface::Setting;
use crate::translation::Part;
use crate::types::Type;

/// The class of the library.
pub const CLASS: &str = "Mix";

/// The member for the surface where the amount is 1.
pub const FRONT: &str = "second";

/// The member for the surface where the amount is 0.
pub const BACK: &str = "first";

/// Returns the text of the class of a mixture.
///
/// # Errors
/// If the amount cannot be computed.
pub fn class(
    graph: &mut Graph<'_>,
    header: &Header<'_>,
    shader: &Shader,
    parts: &[Part],
) -> Result<String, Fault> {
    let mut at = At { graph, scope: shader.scope, node: shader.node };
    let amount = at.input("mix", Type::Float, 0.0)?;
    for (name, member) in [("bg", BACK), ("fg", FRONT)] {
        if parts.iter().all(|part| part.member != member) {
            let message = format!("the input `{name}` of a mixture is not connected: it is black");
            graph.warn(message, shader.node);
        }
    }
    let classes = parts.iter().map(|it| format!("`{}` is a `{}`", it.member, it.material.class));
    let classes: Vec<String> = classes.collect();
    let more = format!("\n///\n/// In it, {}.", classes.join(" and "));
    let mut text = header.text(CLASS, &more);
    class::write_members(graph, &mut text);
    let setting = match amount.constant {
        Some(_) => Setting::Initial(format!("public texture float amount = {};", amount.text)),
        None => Setting::Computed { header: "float amount".to_owned(), result: amount.text },
    };
    class::write_settings(graph, &[setting], &mut text);
    Ok(text)
}
