//! Colours as surfaces: `convert` to the type `surfaceshader`, which MaterialX's standard library defines as a
//! `surface_unlit` with the colour as its emission and the alpha of the colour as its opacity.

use crate::document::{Document, ElementId};

/// Replaces each such conversion of a document by the surface.
pub fn replace(document: &mut Document) {
    for id in document.ids() {
        let element = document.get(id);
        if element.tag == "convert" && element.attribute("type") == Some("surfaceshader") {
            replace_node(document, id);
        }
    }
}

fn replace_node(document: &mut Document, node: ElementId) {
    let span = document.get(node).span;
    document.get_mut(node).tag = "surface_unlit".to_owned();
    let Some(port) = document.input(node, "in") else {
        // The default of the node is black, and that of the surface white.
        let port = document.add(node, "input", span);
        let black = [("name", "emission_color"), ("type", "color3"), ("value", "0, 0, 0")];
        black.iter().for_each(|(name, value)| document.get_mut(port).set(name, *value));
        return;
    };
    document.get_mut(port).set("name", "emission_color");
    if document.get(port).attribute("type") == Some("color4")
        && let Some(parent) = document.get(node).parent
    {
        // A blank is in no name of a document.
        let name = format!("{} alpha", document.get(node).name());
        let alpha = document.add(parent, "extract", span);
        document.get_mut(alpha).set("name", name.as_str());
        document.get_mut(alpha).set("type", "float");
        let of = document.copy(port, alpha);
        document.get_mut(of).set("name", "in");
        let index = document.add(alpha, "input", span);
        let fourth = [("name", "index"), ("type", "integer"), ("value", "3")];
        fourth.iter().for_each(|(name, value)| document.get_mut(index).set(name, *value));
        let opacity = document.add(node, "input", span);
        let link = [("name", "opacity"), ("type", "float"), ("nodename", name.as_str())];
        link.iter().for_each(|(name, value)| document.get_mut(opacity).set(name, *value));
    }
}
