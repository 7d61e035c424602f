//! Closures: the node `surface`, whose inputs are lobes of scattered and emitted light that other nodes combine.
//!
//! The class has a structure with a lobe for each closure, by the module `closures` of the library. Its methods sum the
//! values and the densities of all lobes, and choose one for a sample.

mod lobes;
mod text;

use crate::document::{ElementId, Fault};
use crate::graph::{Graph, ScopeId};
use crate::special::{At, converted};
use crate::statements::Value;
use crate::types::Type;
use crate::{hair, limits};

pub use text::class;

/// A closure of scattered light.
#[derive(Clone, Debug)]
pub enum Closure {
    /// No light.
    Nothing,
    /// A lobe, by its index.
    Lobe(usize),
    /// The first over the second.
    Layer(Box<Closure>, Box<Closure>),
    /// From the second to the first, by the amount with this index.
    Mix(Box<Closure>, Box<Closure>, usize),
    /// Both.
    Sum(Box<Closure>, Box<Closure>),
    /// A closure by a factor.
    Scaled(Box<Closure>, String),
}

/// A lobe of scattered light.
#[derive(Clone, Debug)]
pub struct Lobe {
    /// The expression that makes it.
    pub expression: String,
    /// True if it has a normal of its own.
    pub is_turned: bool,
}

/// A surface of closures.
#[derive(Clone, Debug)]
pub struct Closures {
    /// The lobes.
    pub lobes: Vec<Lobe>,
    /// The amounts of mixtures, expressions of type `vec3`.
    pub amounts: Vec<String>,
    /// The combination of the lobes.
    pub root: Closure,
    /// The emission, an expression of type `vec3`; `None` without any.
    pub emission: Option<String>,
    /// The opacity, an expression; `None` if it is 1.
    pub opacity: Option<String>,
    /// True if the surface is a sheet.
    pub is_sheet: bool,
}

/// The greatest number of lobes of a surface.
const MAX_LOBES: usize = 32;

/// Visits of nodes, which may be connected several times.
const MAX_VISITS: usize = 1000;

/// True for nodes that [`closures`] reads.
pub fn is_surface(tag: &str) -> bool {
    matches!(tag, "surface" | "mix" | "add" | "multiply")
}

/// Reads a surface of closures, or a mixture of such surfaces.
///
/// # Errors
/// If a closure is not supported.
pub fn closures(graph: &mut Graph<'_>, scope: ScopeId, node: ElementId) -> Result<Closures, Fault> {
    let closures = Closures {
        lobes: Vec::new(),
        amounts: Vec::new(),
        root: Closure::Nothing,
        emission: None,
        opacity: None,
        is_sheet: false,
    };
    let mut reader = Reader { graph, closures, depth: 0, visits: 0 };
    let surface = reader.surface(scope, node)?;
    let Reader { mut closures, .. } = reader;
    let bends = closures.lobes.iter().any(|lobe| lobe.expression.contains("mxClosures.bending("));
    let is_clear = (bends && !closures.is_sheet).to_string();
    for lobe in &mut closures.lobes {
        lobe.expression = lobe.expression.replace(lobes::IS_CLEAR, &is_clear);
    }
    closures.root = surface.scattered;
    closures.emission = surface.emission;
    closures.opacity = surface.opacity;
    Ok(closures)
}

/// Returns the opacity of a surface, an expression; `None` if it is 1.
///
/// # Errors
/// If the input cannot be computed.
pub fn opacity(
    graph: &mut Graph<'_>,
    scope: ScopeId,
    node: ElementId,
) -> Result<Option<String>, Fault> {
    let Some(value) = graph.input(scope, node, "opacity")? else { return Ok(None) };
    let value = converted(graph, &value, Type::Float, node)?;
    Ok((value.constant.as_deref() != Some(&[1.0])).then_some(value.text))
}

/// A surface within a mixture.
struct Surface {
    scattered: Closure,
    emission: Option<String>,
    opacity: Option<String>,
}

struct Reader<'g, 'd> {
    graph: &'g mut Graph<'d>,
    closures: Closures,
    depth: usize,
    visits: usize,
}

impl Reader<'_, '_> {
    /// Goes one node further from the surface.
    fn deeper<T>(
        &mut self,
        node: ElementId,
        work: impl FnOnce(&mut Self) -> Result<T, Fault>,
    ) -> Result<T, Fault> {
        self.depth += 1;
        self.visits += 1;
        if self.depth > limits::DEPTH || self.visits > MAX_VISITS {
            return Err(self.graph.unsupported("closures through too many nodes".to_owned(), node));
        }
        let result = work(self);
        self.depth -= 1;
        result
    }

    fn surface(&mut self, scope: ScopeId, node: ElementId) -> Result<Surface, Fault> {
        let tag = self.graph.document.get(node).tag.clone();
        match tag.as_str() {
            "surface" => self.simple_surface(scope, node),
            "mix" => self.deeper(node, |reader| reader.mixed_surface(scope, node)),
            "add" => self.deeper(node, |reader| reader.added_surface(scope, node)),
            "multiply" => self.deeper(node, |reader| reader.scaled_surface(scope, node)),
            "dot" => match self.graph.connected(scope, node, "in")? {
                Some((scope, node, _)) => self.deeper(node, |it| it.surface(scope, node)),
                None => Err(self.unsupported_surface(&tag, node)),
            },
            _ => Err(self.unsupported_surface(&tag, node)),
        }
    }

    fn unsupported_surface(&self, tag: &str, node: ElementId) -> Fault {
        let message = format!("the surface `{tag}` is not supported within a mixture");
        self.graph.unsupported(message, node)
    }

    fn simple_surface(&mut self, scope: ScopeId, node: ElementId) -> Result<Surface, Fault> {
        let sheet = self.value(scope, node, "thin_walled", Type::Boolean)?;
        if let Some(sheet) = sheet {
            self.closures.is_sheet |= sheet.constant.is_some_and(|it| it[0] != 0.0);
        }
        let scattered = self.input(scope, node, "bsdf")?;
        let emission = self.emitted_by(scope, node, "edf")?;
        let opacity = opacity(self.graph, scope, node)?;
        Ok(Surface { scattered, emission, opacity })
    }

    fn mixed_surface(&mut self, scope: ScopeId, node: ElementId) -> Result<Surface, Fault> {
        let front = self.part(scope, node, "fg")?;
        let back = self.part(scope, node, "bg")?;
        let amount = self.amount(scope, node)?;
        let index = self.add_amount(&amount);
        let mixed = |front: Option<String>, back: Option<String>, other: &str| {
            if front.is_none() && back.is_none() {
                return None;
            }
            let [front, back] = [front, back].map(|it| it.unwrap_or_else(|| other.to_owned()));
            Some(format!("mix({back}, {front}, {})", amount.text))
        };
        Ok(Surface {
            emission: mixed(front.emission, back.emission, "vec3(0.0)"),
            opacity: mixed(front.opacity, back.opacity, "1.0"),
            scattered: Closure::Mix(Box::new(front.scattered), Box::new(back.scattered), index),
        })
    }

    /// The surface of an input.
    fn part(&mut self, scope: ScopeId, node: ElementId, name: &str) -> Result<Surface, Fault> {
        match self.graph.connected(scope, node, name)? {
            Some((scope, node, _)) => self.surface(scope, node),
            None => Ok(Surface { scattered: Closure::Nothing, emission: None, opacity: None }),
        }
    }

    /// A surface of a sum or a product. What the holes of two surfaces have in common is in no document.
    fn whole_part(
        &mut self,
        scope: ScopeId,
        node: ElementId,
        name: &str,
    ) -> Result<Surface, Fault> {
        let part = self.part(scope, node, name)?;
        if part.opacity.is_some() {
            let tag = &self.graph.document.get(node).tag;
            let message = format!("`{tag}` of surfaces with an opacity is not supported");
            let fault = self.graph.unsupported(message, node);
            return Err(Box::new(fault.help("give the opacity to the surface of their closures")));
        }
        Ok(part)
    }

    fn added_surface(&mut self, scope: ScopeId, node: ElementId) -> Result<Surface, Fault> {
        let first = self.whole_part(scope, node, "in1")?;
        let second = self.whole_part(scope, node, "in2")?;
        let emission = match (first.emission, second.emission) {
            (Some(first), Some(second)) => Some(format!("({first} + {second})")),
            (first, second) => first.or(second),
        };
        let scattered = Closure::Sum(Box::new(first.scattered), Box::new(second.scattered));
        Ok(Surface { scattered, emission, opacity: None })
    }

    fn scaled_surface(&mut self, scope: ScopeId, node: ElementId) -> Result<Surface, Fault> {
        let factor = self.value(scope, node, "in2", Type::Color3)?;
        let of = self.whole_part(scope, node, "in1")?;
        let factor = factor.map_or("vec3(1.0)".to_owned(), |it| it.text);
        Ok(Surface {
            emission: of.emission.map(|emission| format!("({emission} * {factor})")),
            scattered: Closure::Scaled(Box::new(of.scattered), factor),
            opacity: None,
        })
    }

    fn amount(&mut self, scope: ScopeId, node: ElementId) -> Result<Value, Fault> {
        let amount = self.value(scope, node, "mix", Type::Float)?;
        let amount = amount.unwrap_or_else(|| Value::constant(Type::Float, vec![0.0]));
        Ok(self.graph.add(Type::Float, format!("clamp({}, 0.0, 1.0)", amount.text)))
    }

    fn add_amount(&mut self, amount: &Value) -> usize {
        self.closures.amounts.push(format!("vec3({})", amount.text));
        self.closures.amounts.len() - 1
    }

    fn value(
        &mut self,
        scope: ScopeId,
        node: ElementId,
        name: &str,
        ty: Type,
    ) -> Result<Option<Value>, Fault> {
        match self.graph.input(scope, node, name)? {
            Some(value) => converted(self.graph, &value, ty, node).map(Some),
            None => Ok(None),
        }
    }

    /// The closure of an input.
    fn input(&mut self, scope: ScopeId, node: ElementId, name: &str) -> Result<Closure, Fault> {
        match self.graph.connected(scope, node, name)? {
            Some((scope, node, _)) => self.deeper(node, |reader| reader.closure(scope, node)),
            None => Ok(Closure::Nothing),
        }
    }

    fn closure(&mut self, scope: ScopeId, node: ElementId) -> Result<Closure, Fault> {
        let tag = self.graph.document.get(node).tag.clone();
        let boxed = |closure: Closure| Box::new(closure);
        match tag.as_str() {
            "dot" => self.input(scope, node, "in"),
            "thin_film_bsdf" => {
                self.graph.warn(format!("`{tag}` has no effect"), node);
                Ok(Closure::Nothing)
            }
            "layer" => {
                let top = self.input(scope, node, "top")?;
                if self.is_volume(scope, node)? {
                    return Ok(top);
                }
                let base = self.input(scope, node, "base")?;
                Ok(match top {
                    Closure::Nothing => base,
                    top => Closure::Layer(boxed(top), boxed(base)),
                })
            }
            "mix" => {
                let front = self.input(scope, node, "fg")?;
                let back = self.input(scope, node, "bg")?;
                let amount = self.amount(scope, node)?;
                let index = self.add_amount(&amount);
                Ok(Closure::Mix(boxed(front), boxed(back), index))
            }
            "add" => {
                let first = self.input(scope, node, "in1")?;
                Ok(Closure::Sum(boxed(first), boxed(self.input(scope, node, "in2")?)))
            }
            "multiply" => {
                let factor = self.value(scope, node, "in2", Type::Color3)?;
                let factor = factor.map_or("vec3(1.0)".to_owned(), |it| it.text);
                Ok(Closure::Scaled(boxed(self.input(scope, node, "in1")?), factor))
            }
            _ => self.lobe(scope, node, &tag),
        }
    }

    /// True if the base of a layer is a volume, which has no effect.
    fn is_volume(&mut self, scope: ScopeId, node: ElementId) -> Result<bool, Fault> {
        let Some((_, base, _)) = self.graph.connected(scope, node, "base")? else {
            return Ok(false);
        };
        let tag = self.graph.document.get(base).tag.clone();
        let is_volume = tag.ends_with("_vdf");
        if is_volume {
            self.graph.warn(format!("`{tag}` below a surface has no effect"), base);
        }
        Ok(is_volume)
    }

    fn lobe(&mut self, scope: ScopeId, node: ElementId, tag: &str) -> Result<Closure, Fault> {
        if hair::is_closure(tag) {
            let message = format!("`{tag}` is not the only closure of its surface");
            let fault = self.graph.unsupported(message, node);
            return Err(Box::new(fault.help("mix surfaces instead of closures")));
        }
        let is_sheet = self.closures.is_sheet;
        let mut at = At { graph: self.graph, scope, node };
        let Some(lobes) = lobes::lobes(&mut at, tag, is_sheet)? else {
            let message = format!("the closure `{tag}` is not supported");
            return Err(self.graph.unsupported(message, node));
        };
        let mut closure = None;
        for lobe in lobes {
            if self.closures.lobes.len() >= MAX_LOBES {
                let message = format!("a surface may have {MAX_LOBES} closures");
                return Err(self.graph.unsupported(message, node));
            }
            self.closures.lobes.push(lobe);
            let own = Closure::Lobe(self.closures.lobes.len() - 1);
            closure = Some(match closure {
                None => own,
                Some(above) => Closure::Layer(Box::new(above), Box::new(own)),
            });
        }
        Ok(closure.unwrap_or(Closure::Nothing))
    }

    /// The emission of an input, an expression of type `vec3`.
    fn emitted_by(
        &mut self,
        scope: ScopeId,
        node: ElementId,
        name: &str,
    ) -> Result<Option<String>, Fault> {
        match self.graph.connected(scope, node, name)? {
            Some((scope, node, _)) => self.deeper(node, |reader| reader.emission(scope, node)),
            None => Ok(None),
        }
    }

    fn emission(&mut self, scope: ScopeId, node: ElementId) -> Result<Option<String>, Fault> {
        let tag = self.graph.document.get(node).tag.clone();
        let dark = || "vec3(0.0)".to_owned();
        let expression = match tag.as_str() {
            "conical_edf" | "measured_edf" | "uniform_edf" => {
                if tag != "uniform_edf" {
                    self.graph.warn(format!("`{tag}` emits the same to all sides"), node);
                }
                let color = self.value(scope, node, "color", Type::Color3)?;
                color.map_or("vec3(1.0)".to_owned(), |it| it.text)
            }
            "dot" => return self.emitted_by(scope, node, "in"),
            "add" => {
                let first = self.emitted_by(scope, node, "in1")?.unwrap_or_else(dark);
                let second = self.emitted_by(scope, node, "in2")?.unwrap_or_else(dark);
                format!("({first} + {second})")
            }
            "multiply" => {
                let of = self.emitted_by(scope, node, "in1")?.unwrap_or_else(dark);
                let factor = self.value(scope, node, "in2", Type::Color3)?;
                format!("({of} * {})", factor.map_or("vec3(1.0)".to_owned(), |it| it.text))
            }
            "mix" => {
                let front = self.emitted_by(scope, node, "fg")?.unwrap_or_else(dark);
                let back = self.emitted_by(scope, node, "bg")?.unwrap_or_else(dark);
                let amount = self.amount(scope, node)?;
                format!("mix({back}, {front}, {})", amount.text)
            }
            "generalized_schlick_edf" => {
                let base = self.emitted_by(scope, node, "base")?.unwrap_or_else(dark);
                let mut at = At { graph: self.graph, scope, node };
                let straight = at.input("color0", Type::Color3, 1.0)?;
                let edge = at.input("color90", Type::Color3, 1.0)?;
                let exponent = at.input("exponent", Type::Float, 5.0)?;
                format!(
                    "({base} * mxClosures.emittedTowards(normalize(rt_RayDirection), rt_ShadingNormal, {}, {}, {}))",
                    straight.text, edge.text, exponent.text
                )
            }
            _ => {
                let message = format!("the closure `{tag}` is not supported");
                return Err(self.graph.unsupported(message, node));
            }
        };
        Ok(Some(expression))
    }
}
