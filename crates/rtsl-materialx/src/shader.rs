//! Shaders of surfaces: the node that an input of the type `surfaceshader` is connected to, through graphs, and the
//! nodes that it mixes.

use crate::document::{ElementId, Fault};
use crate::graph::{Graph, ScopeId, Source};
use crate::surface::Surface;
use crate::{closure, hair, limits, surface};

/// A shader, with the place of its node.
#[derive(Clone, Debug)]
pub struct Shader {
    /// The scope of the node.
    pub scope: ScopeId,
    /// The node.
    pub node: ElementId,
    /// The kind of class that takes its place.
    pub kind: Kind,
}

/// The kind of class that takes the place of a shader.
#[derive(Clone, Debug)]
pub enum Kind {
    /// A material of the library.
    Model(&'static Surface),
    /// The library's hair, for the closure at this place.
    Hair(ScopeId, ElementId),
    /// A class of closures: of the node `surface`, or of a mixture of these.
    Closures,
    /// A mixture of two others; without one, of nothing.
    Mix(Option<Box<Shader>>, Option<Box<Shader>>),
}

/// The greatest number of surfaces in a mixture.
const MAX_PARTS: usize = 32;

/// Returns the shader of a material: of a `surfacematerial`, of the output of a graph, or of a node that is a surface;
/// `None` if it has no surface.
///
/// # Errors
/// If the surface is not supported.
pub fn of_material(graph: &mut Graph<'_>, material: ElementId) -> Result<Option<Shader>, Fault> {
    let scope = graph.scope_of_output(material);
    let mut finder = Finder { graph, parts: 0, depth: 0 };
    match finder.follow(scope, material, None)? {
        Some((scope, node)) => finder.shader(scope, node).map(Some),
        None => Ok(None),
    }
}

struct Finder<'g, 'd> {
    graph: &'g mut Graph<'d>,
    parts: usize,
    depth: usize,
}

impl Finder<'_, '_> {
    /// Follows nodes that pass a shader on; `None` if an input on the way is not connected.
    fn follow(
        &mut self,
        mut scope: ScopeId,
        mut node: ElementId,
        mut output: Option<String>,
    ) -> Result<Option<(ScopeId, ElementId)>, Fault> {
        let document = self.graph.document;
        for _ in 0..limits::DEPTH {
            let tag = &document.get(node).tag;
            if surface::named(tag).is_some() || closure::is_surface(tag) {
                return Ok(Some((scope, node)));
            }
            let port = match tag.as_str() {
                "surfacematerial" => self.graph.port(node, "surfaceshader"),
                "dot" => self.graph.port(node, "in"),
                "output" => Some(node),
                _ => match self.graph.implementation(scope, node, output.as_deref())? {
                    Some((inner, port)) => {
                        scope = inner;
                        Some(port)
                    }
                    None => return Ok(Some((scope, node))),
                },
            };
            let Some(port) = port else { return Ok(None) };
            let Some(Source::Node(outer, next, name)) = self.graph.source(scope, port)? else {
                return Ok(None);
            };
            (scope, node, output) = (outer, next, name);
        }
        Err(self.graph.unsupported("a surface through too many graphs".to_owned(), node))
    }

    fn shader(&mut self, scope: ScopeId, node: ElementId) -> Result<Shader, Fault> {
        self.parts += 1;
        if self.parts > MAX_PARTS || self.depth > limits::DEPTH {
            let message = format!("a material may mix {MAX_PARTS} surfaces");
            return Err(self.graph.unsupported(message, node));
        }
        let tag = &self.graph.document.get(node).tag;
        let kind = match (tag.as_str(), surface::named(tag)) {
            (_, Some(surface)) => Kind::Model(surface),
            ("surface", None) => match hair::closure_of(self.graph, scope, node)? {
                Some((scope, node)) => Kind::Hair(scope, node),
                None => Kind::Closures,
            },
            ("mix", None) => self.mixture(scope, node)?,
            ("add" | "multiply", None) => self.sum(scope, node)?,
            _ => {
                let message = format!("the surface `{tag}` is not supported");
                return Err(self.graph.unsupported(message, node));
            }
        };
        Ok(Shader { scope, node, kind })
    }

    /// A mixture of closures is a class of closures.
    fn mixture(&mut self, scope: ScopeId, node: ElementId) -> Result<Kind, Fault> {
        let mut parts = self.parts(scope, node, &["fg", "bg"])?;
        if parts.iter().all(is_of_closures) {
            return Ok(Kind::Closures);
        }
        let back = parts.pop().flatten().map(Box::new);
        Ok(Kind::Mix(parts.pop().flatten().map(Box::new), back))
    }

    /// A sum of closures, or a product, is a class of closures. Materials of the library have nothing of the kind.
    fn sum(&mut self, scope: ScopeId, node: ElementId) -> Result<Kind, Fault> {
        let is_sum = self.graph.document.get(node).tag == "add";
        // The other input of a product is a number.
        let names: &[&str] = if is_sum { &["in1", "in2"] } else { &["in1"] };
        let parts = self.parts(scope, node, names)?;
        if parts.iter().all(is_of_closures) {
            return Ok(Kind::Closures);
        }
        let tag = &self.graph.document.get(node).tag;
        let message = format!("`{tag}` is not supported for surfaces other than `surface`");
        let fault = self.graph.unsupported(message, node);
        Err(Box::new(fault.help(format!("mix them, or use `{tag}` on closures of one `surface`"))))
    }

    /// The shaders of these inputs; `None` for those that are not connected.
    fn parts(
        &mut self,
        scope: ScopeId,
        node: ElementId,
        names: &[&str],
    ) -> Result<Vec<Option<Shader>>, Fault> {
        self.depth += 1;
        let parts = names.iter().map(|name| self.part(scope, node, name)).collect();
        self.depth -= 1;
        parts
    }

    fn part(
        &mut self,
        scope: ScopeId,
        node: ElementId,
        name: &str,
    ) -> Result<Option<Shader>, Fault> {
        let Some(port) = self.graph.port(node, name) else { return Ok(None) };
        let Some(Source::Node(scope, node, output)) = self.graph.source(scope, port)? else {
            return Ok(None);
        };
        match self.follow(scope, node, output)? {
            Some((scope, node)) => self.shader(scope, node).map(Some),
            None => Ok(None),
        }
    }
}

fn is_of_closures(part: &Option<Shader>) -> bool {
    part.as_ref().is_none_or(|it| matches!(it.kind, Kind::Closures))
}
