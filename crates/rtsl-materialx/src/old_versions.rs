//! Documents of the versions 1.22 to 1.38: their elements are changed to those of 1.39.

use rtsl_source::Span;

use crate::document::{Document, ElementId};
use crate::limits;

/// The old names of nodes.
const RENAMED: [(&str, &str); 10] = [
    ("diffuse_brdf", "oren_nayar_diffuse_bsdf"),
    ("burley_diffuse_brdf", "burley_diffuse_bsdf"),
    ("diffuse_btdf", "translucent_bsdf"),
    ("subsurface_brdf", "subsurface_bsdf"),
    ("sheen_brdf", "sheen_bsdf"),
    ("dielectric_brdf", "dielectric_bsdf"),
    ("dielectric_btdf", "dielectric_bsdf"),
    ("generalized_schlick_brdf", "generalized_schlick_bsdf"),
    ("conductor_brdf", "conductor_bsdf"),
    ("geomattrvalue", "geompropvalue"),
];

/// Changes the elements of old versions to those of the current one.
pub fn upgrade(document: &mut Document) {
    for id in document.ids() {
        upgrade_names(document, id);
    }
    for id in document.ids() {
        upgrade_node(document, id);
    }
    let root = document.root();
    let materials: Vec<ElementId> = document.children(root, "material").collect();
    for material in materials {
        upgrade_material(document, material);
    }
}

/// The minor version of an element's document; 39 without one.
fn version(document: &Document, id: ElementId) -> u32 {
    let version = document.inherited(id, "version").unwrap_or("1.39");
    version.split_once('.').and_then(|(_, minor)| minor.parse().ok()).unwrap_or(39)
}

fn upgrade_names(document: &mut Document, id: ElementId) {
    let element = document.get_mut(id);
    let tag = element.tag.clone();
    if matches!(tag.as_str(), "parameter" | "bindinput" | "bindparam") {
        element.tag = "input".to_owned();
    }
    if let Some((_, new)) = RENAMED.iter().find(|(old, _)| *old == tag) {
        element.tag = (*new).to_owned();
    }
    if tag == "opgraph" {
        element.tag = "nodegraph".to_owned();
    }
    if let Some(name) = element.attribute("attrname").map(str::to_owned) {
        element.set("geomprop", name);
    }
    if element.attribute("type") == Some("matrix") {
        element.set("type", "matrix44");
    }
    if let (Some(graph), Some(output)) = (
        element.attribute("opgraph").map(str::to_owned),
        element.attribute("graphoutput").map(str::to_owned),
    ) {
        element.set("nodegraph", graph);
        element.set("output", output);
    }
}

fn upgrade_node(document: &mut Document, id: ElementId) {
    let tag = document.get(id).tag.clone();
    let ty = document.get(id).attribute("type").unwrap_or_default().to_owned();
    match tag.as_str() {
        "invert" if ty.starts_with("matrix") => rename(document, id, "invertmatrix"),
        "rotate" if ty == "vector2" => rename(document, id, "rotate2d"),
        "rotate" => rename(document, id, "rotate3d"),
        "compare" => upgrade_compare(document, id),
        "transformpoint" | "transformvector" | "transformnormal"
            if input(document, id, "mat").is_some() =>
        {
            rename(document, id, "transformmatrix");
        }
        "combine" => {
            let count = (2..=4).rev().find(|it| input(document, id, &format!("in{it}")).is_some());
            rename(document, id, &format!("combine{}", count.unwrap_or(2)));
        }
        "separate" => {
            let of = input(document, id, "in");
            let ty = of.and_then(|it| document.get(it).attribute("type")).unwrap_or_default();
            let count = ty.chars().last().and_then(|last| last.to_digit(10)).unwrap_or(2);
            rename(document, id, &format!("separate{count}"));
        }
        "atan2" if input(document, id, "in1").is_some() || input(document, id, "in2").is_some() => {
            let names = if version(document, id) < 38 { ["inx", "iny"] } else { ["iny", "inx"] };
            for (old, new) in ["in1", "in2"].into_iter().zip(names) {
                if let Some(port) = input(document, id, old) {
                    document.get_mut(port).set("name", new);
                }
            }
        }
        _ => {}
    }
}

fn rename(document: &mut Document, id: ElementId, tag: &str) {
    document.get_mut(id).tag = tag.to_owned();
}

/// `compare` gave `in2` where the tested number is at least the cutoff.
fn upgrade_compare(document: &mut Document, id: ElementId) {
    rename(document, id, "ifgreatereq");
    let names = [("intest", "value1"), ("cutoff", "value2"), ("in1", "in2"), ("in2", "in1")];
    let ports = names.map(|(old, new)| (input(document, id, old), new));
    for (port, new) in ports {
        if let Some(port) = port {
            document.get_mut(port).set("name", new);
        }
    }
}

fn input(document: &Document, node: ElementId, name: &str) -> Option<ElementId> {
    document.input(node, name)
}

/// A material with references to shaders becomes a node with an input for each shader.
fn upgrade_material(document: &mut Document, material: ElementId) {
    let root = document.root();
    let references = references_of(document, material);
    rename(document, material, "surfacematerial");
    for reference in references {
        let element = document.get(reference);
        let (span, name) = (element.span, element.name().to_owned());
        let node = match (element.attribute("node"), element.attribute("nodedef")) {
            (Some(node), _) => node.to_owned(),
            (None, Some(definition)) => node_of(document, definition),
            (None, None) => name.clone(),
        };
        // Materials may have shaders of one name.
        let name = format!("{}_{name}", document.get(material).name());
        let shader = add_shader(document, root, &node, &name, span);
        let program = document.get(reference).name().to_owned();
        copy_program(document, &program, material, shader);
        for child in document.get(reference).children.clone() {
            document.copy(child, shader);
        }
        let port = document.add(material, "input", span);
        let input = if node == "displacement" { "displacementshader" } else { "surfaceshader" };
        document.get_mut(port).set("name", input);
        document.get_mut(port).set("type", input);
        document.get_mut(port).set("nodename", name);
    }
}

/// Copies the inputs of a `shader` of version 1.25 to a node, with the values that a material gives them by their
/// public names.
fn copy_program(document: &mut Document, name: &str, material: ElementId, node: ElementId) {
    let named = |it: &ElementId| document.get(*it).attribute("name") == Some(name);
    let Some(program) = document.children(document.root(), "shader").find(named) else { return };
    let overrides: Vec<ElementId> = document.children(material, "override").collect();
    for input in document.get(program).children.clone() {
        let public = document.get(input).attribute("publicname");
        let given = overrides.iter().find(|it| document.get(**it).attribute("name") == public);
        let value = given.and_then(|it| document.get(*it).attribute("value")).map(str::to_owned);
        let copy = document.copy(input, node);
        if let (Some(value), Some(_)) = (value, document.get(copy).attribute("publicname")) {
            document.get_mut(copy).set("value", value);
        }
    }
}

/// The references of a material, or of the nearest one that it inherits.
fn references_of(document: &Document, material: ElementId) -> Vec<ElementId> {
    let mut at = material;
    for _ in 0..limits::DEPTH {
        let own: Vec<ElementId> = document.children(at, "shaderref").collect();
        if !own.is_empty() {
            return own;
        }
        let element = document.children(at, "materialinherit").next();
        let named = element.and_then(|it| document.get(it).attribute("material"));
        let Some(name) = named.or(document.get(at).attribute("inherit")) else { break };
        let mut all = document.get(document.root()).children.iter().copied();
        let is_parent = |id: &ElementId| {
            let element = document.get(*id);
            matches!(element.tag.as_str(), "material" | "surfacematerial")
                && element.attribute("name") == Some(name)
        };
        let Some(parent) = all.find(is_parent) else { break };
        at = parent;
    }
    Vec::new()
}

fn add_shader(
    document: &mut Document,
    root: ElementId,
    node: &str,
    name: &str,
    span: Span,
) -> ElementId {
    let shader = document.add(root, node, span);
    document.get_mut(shader).set("name", name);
    document.get_mut(shader).set("type", "surfaceshader");
    shader
}

/// The node of a definition: by its element, or by its name.
fn node_of(document: &Document, definition: &str) -> String {
    let root = document.root();
    let found = document
        .children(root, "nodedef")
        .find(|it| document.get(*it).attribute("name") == Some(definition));
    let node = found.and_then(|it| document.get(it).attribute("node"));
    let named = definition.trim_start_matches("ND_").trim_end_matches("_surfaceshader");
    node.unwrap_or(named).to_owned()
}
