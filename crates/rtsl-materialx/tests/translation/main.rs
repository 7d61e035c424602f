//! Translations of documents: texts of classes, and errors.

mod closures;
mod errors;
mod hair;
mod lama;
mod mixtures;
mod nodes;
mod robust;
mod texts;

use rtsl_materialx::{Document, Loaded, Translation, translate, translate_outputs};
use rtsl_source::{Diagnostic, SourceMap, render};

/// Reads a document without others.
pub fn document(text: &str) -> Result<(Document, SourceMap), String> {
    let mut sources = SourceMap::new();
    let mut load = |path: &str, _: &str| match path {
        "nodes.mtlx" => Ok(Loaded { name: path.to_owned(), text: NODES.to_owned() }),
        "circle.mtlx" => Ok(Loaded {
            name: path.to_owned(),
            text: "<materialx xmlns:xi=\"x\"><xi:include href=\"circle.mtlx\"/></materialx>"
                .to_owned(),
        }),
        _ => Err("there is no such file".to_owned()),
    };
    match Document::read("test.mtlx", text, &mut load, &mut sources) {
        Ok(document) => Ok((document, sources)),
        Err(diagnostic) => Err(shown(&sources, &[*diagnostic])),
    }
}

/// A document that others include.
const NODES: &str = r#"<materialx version="1.39">
  <nodedef name="ND_twice" node="twice">
    <input name="in" type="float" value="1"/>
    <output name="out" type="float"/>
  </nodedef>
  <nodegraph name="NG_twice" nodedef="ND_twice">
    <multiply name="product" type="float">
      <input name="in1" type="float" interfacename="in"/>
      <input name="in2" type="float" value="2"/>
    </multiply>
    <output name="out" type="float" nodename="product"/>
  </nodegraph>
</materialx>"#;

/// An element that is a node, around its inputs.
pub fn node(tag: &str, name: &str, ty: &str, inputs: &str) -> String {
    format!("<{tag} name=\"{name}\" type=\"{ty}\">{inputs}</{tag}>\n")
}

/// An input with a value.
pub fn input(name: &str, ty: &str, value: &str) -> String {
    format!("<input name=\"{name}\" type=\"{ty}\" value=\"{value}\"/>")
}

/// An input that is connected to a node.
pub fn link(name: &str, ty: &str, node: &str) -> String {
    format!("<input name=\"{name}\" type=\"{ty}\" nodename=\"{node}\"/>")
}

/// A material of a surface whose scattered light is that of a closure.
pub fn with_closure(elements: &str, closure: &str) -> String {
    let surface = node("surface", "surface", "surfaceshader", &link("bsdf", "BSDF", closure));
    with_material(&format!("{elements}\n{surface}"))
}

/// Surrounds elements by a document with a material whose surface is called `surface`.
pub fn with_material(elements: &str) -> String {
    format!(
        "<materialx version=\"1.39\" xmlns:xi=\"http://www.w3.org/2001/XInclude\">\n{elements}\n\
         <surfacematerial name=\"m\" type=\"material\">\n\
         <input name=\"surfaceshader\" type=\"surfaceshader\" nodename=\"surface\"/>\n\
         </surfacematerial>\n</materialx>"
    )
}

/// The text of a document's classes, or its errors.
pub fn text_of(text: &str) -> String {
    of(text, |document| translate(document, "test.mtlx", None))
}

/// The text of the classes of a document's outputs, or its errors.
pub fn outputs_of(text: &str) -> String {
    of(text, |document| translate_outputs(document, "test.mtlx"))
}

fn of(text: &str, translate: impl Fn(&Document) -> Translation) -> String {
    let (document, sources) = match document(text) {
        Ok(read) => read,
        Err(error) => return error,
    };
    let translation = translate(&document);
    let problems: Vec<Diagnostic> =
        translation.warnings.iter().chain(&translation.errors).cloned().collect();
    let shown = shown(&sources, &problems);
    format!("{shown}{}", translation.text())
}

fn shown(sources: &SourceMap, diagnostics: &[Diagnostic]) -> String {
    render::all_to_text(sources, diagnostics, false)
}
