//! Nodes that need more than an expression of their inputs.

use rtsl_source::{Diagnostic, diagnostic_codes as codes};

use crate::document::{ElementId, Fault};
use crate::graph::{Graph, ScopeId};
use crate::statements::Value;
use crate::types::Type;
use crate::{literal, pictures, places};

/// The nodes.
pub const NODES: &[&str] = &[
    "UsdPrimvarReader",
    "UsdUVTexture",
    "ambientocclusion",
    "artistic_ior",
    "bitangent",
    "blur",
    "bump",
    "chiang_hair_roughness",
    "constant",
    "convert",
    "creatematrix",
    "dot",
    "extract",
    "flake2d",
    "flake3d",
    "frame",
    "geomcolor",
    "geompropvalue",
    "geompropvalueuniform",
    "gltf_anisotropy_image",
    "gltf_colorimage",
    "gltf_image",
    "gltf_iridescence_thickness",
    "gltf_normalmap",
    "heighttonormal",
    "hextiledimage",
    "hextilednormalmap",
    "image",
    "latlongimage",
    "normal",
    "position",
    "ramp",
    "randomfloat",
    "separate2",
    "separate3",
    "separate4",
    "switch",
    "swizzle",
    "tangent",
    "texcoord",
    "tiledimage",
    "time",
    "transformmatrix",
    "transformnormal",
    "transformpoint",
    "transformvector",
    "triplanarprojection",
    "viewdirection",
];

/// Nodes that have no value here, and why.
const REASONS: [(&str, &str); 2] = [
    ("curveadjust", "its curve is no part of the standard library"),
    ("arrayappend", "arrays have no values here"),
];

/// True for nodes of this part.
pub fn is_known(node: &str) -> bool {
    NODES.contains(&node)
}

/// Returns the reason why a node of the standard is not supported.
pub fn reason(node: &str) -> Option<&'static str> {
    REASONS.iter().find(|(name, _)| *name == node).map(|(_, why)| *why)
}

/// Returns the value of a node of this part; `None` for others.
///
/// # Errors
/// If an input cannot be computed.
pub fn value(
    graph: &mut Graph<'_>,
    scope: ScopeId,
    node: ElementId,
    output: Option<&str>,
) -> Result<Option<Value>, Fault> {
    let mut at = At { graph, scope, node };
    let tag = at.graph.document.get(node).tag.clone();
    let value = match tag.as_str() {
        "constant" => at.passed("value")?,
        "dot" | "blur" => at.passed("in")?,
        "convert" => at.convert()?,
        "swizzle" => at.swizzle()?,
        "extract" => at.extract()?,
        "separate2" | "separate3" | "separate4" => at.separate(output)?,
        "switch" => at.switch()?,
        "creatematrix" => return at.matrix44(),
        "transformmatrix" => return at.transform_matrix(),
        "frame" => at.parameter("frame", "Number of the frame.", 1.0),
        "time" => at.parameter("time", "Seconds since the start.", 0.0),
        "ramp" => at.ramp()?,
        "randomfloat" => at.random()?,
        "flake2d" | "flake3d" => at.flake(&tag, output)?,
        "artistic_ior" => at.artistic_ior(output)?,
        "ambientocclusion" => {
            let message = "`ambientocclusion` is 1: a surface does not see its neighbourhood";
            at.graph.warn(message.to_owned(), node);
            Value::constant(Type::Float, vec![1.0])
        }
        "chiang_hair_roughness" => at.hair_roughness(output)?,
        _ => match places::value(&mut at, &tag)? {
            Some(value) => value,
            None => return pictures::value(&mut at, &tag, output),
        },
    };
    Ok(Some(value))
}

/// A node, and where it stands.
pub struct At<'g, 'd> {
    /// The graph.
    pub graph: &'g mut Graph<'d>,
    /// The scope of the node.
    pub scope: ScopeId,
    /// The node.
    pub node: ElementId,
}

impl At<'_, '_> {
    /// The type that the node has in the document.
    pub fn ty(&self) -> Type {
        let name = self.graph.document.get(self.node).attribute("type");
        name.and_then(Type::named).unwrap_or(Type::Float)
    }

    /// Returns the value of an input, of the type that it has in the document.
    pub fn given(&mut self, name: &str) -> Result<Option<Value>, Fault> {
        self.graph.input(self.scope, self.node, name)
    }

    /// Returns the value of an input, converted to a type.
    pub fn input(&mut self, name: &str, ty: Type, default: f64) -> Result<Value, Fault> {
        self.input_or(name, ty, &vec![default; ty.count()])
    }

    /// Returns the value of an input, converted to a type, or these numbers.
    pub fn input_or(&mut self, name: &str, ty: Type, default: &[f64]) -> Result<Value, Fault> {
        match self.given(name)? {
            Some(value) => converted(self.graph, &value, ty, self.node),
            None => Ok(Value::constant(ty, default.to_vec())),
        }
    }

    /// Returns the value of an input, or a property of the surface.
    pub fn input_or_property(
        &mut self,
        name: &str,
        ty: Type,
        property: &str,
    ) -> Result<Value, Fault> {
        match self.given(name)? {
            Some(value) => converted(self.graph, &value, ty, self.node),
            None => places::property(self.graph, property, self.node),
        }
    }

    /// Returns the text of an input that must be known.
    pub fn text(&mut self, name: &str) -> Result<Option<String>, Fault> {
        match self.given(name)? {
            Some(Value { ty: Type::Text, text, .. }) => Ok(Some(text)),
            Some(_) | None => {
                Ok(self.graph.document.get(self.node).attribute(name).map(str::to_owned))
            }
        }
    }

    /// Adds a statement of the node's type.
    pub fn add(&mut self, ty: Type, expression: String) -> Value {
        self.graph.add(ty, expression)
    }

    fn passed(&mut self, name: &str) -> Result<Value, Fault> {
        let ty = self.graph.document.get(self.node).attribute("type").and_then(Type::named);
        match self.given(name)? {
            Some(value) => match ty {
                Some(ty) if ty != Type::Text => converted(self.graph, &value, ty, self.node),
                _ => Ok(value),
            },
            None => match ty {
                Some(Type::Text) => Ok(Value::new(Type::Text, "")),
                Some(ty) => Ok(Value::constant(ty, vec![0.0; ty.count()])),
                None => Err(self
                    .graph
                    .unsupported("a node without a type of values".to_owned(), self.node)),
            },
        }
    }

    fn convert(&mut self) -> Result<Value, Fault> {
        let ty = self.ty();
        match self.given("in")? {
            Some(value) => converted(self.graph, &value, ty, self.node),
            None => Ok(Value::constant(ty, vec![0.0; ty.count()])),
        }
    }

    fn swizzle(&mut self) -> Result<Value, Fault> {
        let ty = self.ty();
        let channels = self.text("channels")?.unwrap_or_default();
        let value = self.given("in")?.unwrap_or_else(|| Value::constant(Type::Float, vec![0.0]));
        swizzled(self.graph, &value, &channels, ty, self.node)
    }

    fn extract(&mut self) -> Result<Value, Fault> {
        let index = self.input("index", Type::Integer, 0.0)?;
        let Some(value) = self.given("in")? else {
            return Ok(Value::constant(Type::Float, vec![0.0]));
        };
        let ty = self.ty();
        let count = match value.ty {
            Type::Matrix33 => 3,
            Type::Matrix44 => 4,
            ty => ty.count(),
        };
        if count == 1 {
            return Ok(value);
        }
        let expression = match index.constant {
            Some(index) => {
                let place = (index[0].max(0.0) as usize).min(count - 1);
                if let Some(numbers) = value.constant.filter(|_| value.ty.is_vector()) {
                    return Ok(Value::constant(Type::Float, vec![numbers[place]]));
                }
                format!("{}[{place}]", value.text)
            }
            None => format!("{}[{}]", value.text, index.text),
        };
        Ok(self.add(ty, expression))
    }

    fn separate(&mut self, output: Option<&str>) -> Result<Value, Fault> {
        let Some(value) = self.given("in")? else {
            return Ok(Value::constant(Type::Float, vec![0.0]));
        };
        let channel = output.and_then(|it| it.chars().last()).unwrap_or('x');
        let channel = channel_index(channel).unwrap_or(0).min(value.ty.count().saturating_sub(1));
        if let Some(numbers) = &value.constant {
            return Ok(Value::constant(Type::Float, vec![numbers[channel]]));
        }
        Ok(match value.ty.is_vector() {
            true => self.add(Type::Float, format!("{}.{}", value.text, &"xyzw"[channel..=channel])),
            false => value,
        })
    }

    fn switch(&mut self) -> Result<Value, Fault> {
        let ty = self.ty();
        let which = self.given("which")?.unwrap_or_else(|| Value::constant(Type::Float, vec![0.0]));
        if let Some(numbers) = &which.constant {
            let index = numbers[0].floor().clamp(-1.0, 10.0).max(0.0) as usize;
            if index > 9 {
                return Ok(Value::constant(ty, vec![0.0; ty.count()]));
            }
            return self.input(&format!("in{}", index + 1), ty, 0.0);
        }
        let last =
            (1..=10).rev().find(|it| self.graph.port(self.node, &format!("in{it}")).is_some());
        let mut expression = Value::constant(ty, vec![0.0; ty.count()]).text;
        for index in (1..=last.unwrap_or(1)).rev() {
            let value = self.input(&format!("in{index}"), ty, 0.0)?;
            let bound = literal::float(f64::from(index));
            expression = format!("{} < {bound} ? {} : {expression}", which.text, value.text);
        }
        Ok(self.add(ty, expression))
    }

    fn matrix44(&mut self) -> Result<Option<Value>, Fault> {
        if self.ty() != Type::Matrix44 {
            return Ok(None);
        }
        let is_full = self.given("in1")?.is_some_and(|it| it.ty.count() == 4);
        let ty = if is_full { Type::Vector4 } else { Type::Vector3 };
        let mut rows = Vec::new();
        for index in 0..4 {
            let mut default = vec![0.0; ty.count()];
            if let Some(one) = default.get_mut(index) {
                *one = 1.0;
            }
            let row = self.input_or(&format!("in{}", index + 1), ty, &default)?;
            let last = if index == 3 { "1.0" } else { "0.0" };
            rows.push(if is_full { row.text } else { format!("vec4({}, {last})", row.text) });
        }
        Ok(Some(self.add(Type::Matrix44, format!("mat4({})", rows.join(", ")))))
    }

    /// Vectors of three components, by matrices of three or four rows. Others are rows of the table.
    fn transform_matrix(&mut self) -> Result<Option<Value>, Fault> {
        if self.ty().count() != 3 {
            return Ok(None);
        }
        let value = self.input("in", Type::Vector3, 0.0)?;
        let expression = match self.given("mat")? {
            Some(Value { ty: Type::Matrix44, text, .. }) => {
                format!("({text} * vec4({}, 1.0)).xyz", value.text)
            }
            Some(matrix) => format!("{} * {}", matrix.text, value.text),
            None => return Ok(Some(value)),
        };
        Ok(Some(self.add(Type::Vector3, expression)))
    }

    /// A parameter of the class.
    fn parameter(&mut self, name: &str, doc: &str, default: f64) -> Value {
        let default = literal::float(default);
        let declaration = format!("[[doc \"{doc}\"]] public float {name} = {default};");
        self.graph.attributes.insert(name.to_owned(), declaration);
        Value::new(Type::Float, name)
    }

    fn ramp(&mut self) -> Result<Value, Fault> {
        let uv = self.input_or_property("texcoord", Type::Vector2, "UV0")?;
        let kind = self.input("type", Type::Integer, 0.0)?;
        let interpolation = self.input("interpolation", Type::Integer, 1.0)?;
        let count = self.input("num_intervals", Type::Integer, 2.0)?;
        let place = format!("mxColor.rampPlace({}, {})", uv.text, kind.text);
        let place = self.add(Type::Float, place);
        let mut stops = Vec::new();
        for index in 1..=10 {
            let is_first = index == 1;
            let at = if is_first { 0.0 } else { 1.0 };
            let place = self.input(&format!("interval{index}"), Type::Float, at)?;
            let color = [at, at, at, 1.0];
            let color = self.input_or(&format!("color{index}"), Type::Color4, &color)?;
            stops.push((place, color));
        }
        let first = &stops[0].1.text;
        let start = format!(
            "mxColor.rampStart({}, {}, {}, {first})",
            place.text, interpolation.text, count.text
        );
        let mut ramp = self.graph.statements.add("mxColor.Ramp", start);
        let known = count.constant.map_or(9, |it| (it[0] as usize).clamp(1, 10) - 1);
        for index in 0..known {
            let (from, first) = &stops[index];
            let (to, last) = &stops[index + 1];
            let next = format!(
                "mxColor.rampNext({ramp}, {}, {}, {}, {}, {})",
                index + 1,
                from.text,
                to.text,
                first.text,
                last.text
            );
            ramp = self.graph.statements.add("mxColor.Ramp", next);
        }
        Ok(self.add(Type::Color4, format!("{ramp}.color")))
    }

    fn random(&mut self) -> Result<Value, Fault> {
        let value = self.given("in")?;
        let is_integer = value.as_ref().is_some_and(|it| it.ty == Type::Integer);
        let value = self.input("in", Type::Float, 0.0)?;
        let low = self.input("min", Type::Float, 0.0)?;
        let high = self.input("max", Type::Float, 1.0)?;
        let seed = self.input("seed", Type::Integer, 0.0)?;
        let scale = if is_integer { "" } else { "4096.0 * " };
        let expression = format!(
            "mxNoise.random({scale}{}, {}, {}, {})",
            value.text, low.text, high.text, seed.text
        );
        Ok(self.add(Type::Float, expression))
    }

    fn flake(&mut self, tag: &str, output: Option<&str>) -> Result<Value, Fault> {
        let size = self.input("size", Type::Float, 0.01)?;
        let roughness = self.input("roughness", Type::Float, 0.1)?;
        let coverage = self.input("coverage", Type::Float, 0.5)?;
        let place = match tag {
            "flake2d" => {
                let uv = self.input_or_property("texcoord", Type::Vector2, "UV0")?;
                format!("vec3({}, 0.0)", uv.text)
            }
            _ => self.input_or_property("position", Type::Vector3, "Pobject")?.text,
        };
        let normal = self.input_or_property("normal", Type::Vector3, "Nworld")?;
        let tangent = self.input_or_property("tangent", Type::Vector3, "Tworld")?;
        let bitangent = self.input_or_property("bitangent", Type::Vector3, "Bworld")?;
        let call = format!(
            "mxNoise.flake({}, {}, {}, {place}, {}, {}, {})",
            size.text, roughness.text, coverage.text, normal.text, tangent.text, bitangent.text
        );
        let flake = self.graph.statements.add("mxNoise.Flake", call);
        let (member, ty) = match output {
            Some("id") => ("id", Type::Integer),
            Some("rand") => ("number", Type::Float),
            Some("presence") => ("presence", Type::Float),
            _ => ("normal", Type::Vector3),
        };
        Ok(self.add(ty, format!("{flake}.{member}")))
    }

    /// Gulbrandsen, "Artist Friendly Metallic Fresnel".
    fn artistic_ior(&mut self, output: Option<&str>) -> Result<Value, Fault> {
        let reflectivity = self.input_or("reflectivity", Type::Color3, &[0.944, 0.776, 0.373])?;
        let edge = self.input_or("edge_color", Type::Color3, &[0.998, 0.981, 0.751])?;
        let name = if output == Some("extinction") { "artisticExtinction" } else { "artisticIor" };
        let call = format!("mxColor.{name}({}, {})", reflectivity.text, edge.text);
        Ok(self.add(Type::Color3, call))
    }

    fn hair_roughness(&mut self, output: Option<&str>) -> Result<Value, Fault> {
        let along = self.input("longitudinal", Type::Float, 0.1)?;
        let around = self.input("azimuthal", Type::Float, 0.2)?;
        let scale = match output {
            Some("roughness_TT") => self.input("scale_TT", Type::Float, 0.5)?,
            Some("roughness_TRT") => self.input("scale_TRT", Type::Float, 2.0)?,
            _ => Value::constant(Type::Float, vec![1.0]),
        };
        let call = format!("mxHair.roughness({}, {}, {})", along.text, around.text, scale.text);
        Ok(self.add(Type::Vector2, call))
    }
}

fn channel_index(channel: char) -> Option<usize> {
    "xyzw".find(channel).or_else(|| "rgba".find(channel))
}

/// Returns the channels of a value, in their order, as a value of a type.
///
/// # Errors
/// If a channel does not exist.
pub fn swizzled(
    graph: &mut Graph<'_>,
    value: &Value,
    channels: &str,
    ty: Type,
    at: ElementId,
) -> Result<Value, Fault> {
    let mut parts = Vec::new();
    for channel in channels.chars().filter(|it| !it.is_whitespace()) {
        let known = channel_index(channel).filter(|index| *index < value.ty.count().max(1));
        parts.push(match (channel, known) {
            ('0', _) => "0.0".to_owned(),
            ('1', _) => "1.0".to_owned(),
            (_, Some(_)) if value.ty.count() == 1 => value.text.clone(),
            (_, Some(index)) => format!("{}.{}", value.text, &"xyzw"[index..=index]),
            // The second channel of the old type of two was its opacity.
            ('a', None) if value.ty == Type::Vector2 => format!("{}.y", value.text),
            ('a' | 'w', None) => "1.0".to_owned(),
            _ => {
                let message =
                    format!("a value of type `{}` has no channel `{channel}`", value.ty.name());
                let diagnostic = Diagnostic::new(codes::MATERIALX_SYNTAX, message);
                return Err(Box::new(diagnostic.at(graph.document.get(at).span, "")));
            }
        });
    }
    let count = ty.count();
    if !ty.is_vector() {
        let part = parts.first().cloned().unwrap_or_else(|| value.text.clone());
        return Ok(graph.add(ty, part));
    }
    let last = parts.last().cloned().unwrap_or_else(|| "0.0".to_owned());
    parts.resize(count, last);
    Ok(graph.add(ty, format!("{}({})", ty.rtsl(), parts.join(", "))))
}

/// Returns a value converted to a type.
///
/// # Errors
/// If there is no conversion.
pub fn converted(
    graph: &mut Graph<'_>,
    value: &Value,
    wanted: Type,
    at: ElementId,
) -> Result<Value, Fault> {
    if value.ty == wanted {
        return Ok(value.clone());
    }
    if value.ty.rtsl() == wanted.rtsl() && value.ty != Type::Text && wanted != Type::Text {
        return Ok(Value { ty: wanted, ..value.clone() });
    }
    if let (Some(numbers), true) = (&value.constant, value.ty.count() == 1 && wanted.is_vector()) {
        return Ok(Value::constant(wanted, vec![numbers[0]; wanted.count()]));
    }
    if let (Some(numbers), Type::Float, true) = (&value.constant, wanted, value.ty.count() == 1) {
        return Ok(Value::constant(wanted, numbers.clone()));
    }
    let text = &value.text;
    let to = wanted.rtsl();
    let expression = match (value.ty, wanted) {
        (Type::Boolean | Type::Integer, Type::Float) => format!("float({text})"),
        (Type::Boolean | Type::Float, Type::Integer) => format!("int({text})"),
        (Type::Integer, Type::Boolean) => format!("{text} != 0"),
        (Type::Float, Type::Boolean) => format!("{text} != 0.0"),
        (Type::Boolean | Type::Integer | Type::Float, _) if wanted.is_vector() => {
            format!("{to}(float({text}))")
        }
        (from, _) if from.is_vector() && wanted.is_vector() => {
            match (from.count(), wanted.count()) {
                (4, 3) => format!("{text}.xyz"),
                (3 | 4, 2) => format!("{text}.xy"),
                (3, 4) => format!("vec4({text}, 1.0)"),
                (2, 3) => format!("vec3({text}, 0.0)"),
                _ => format!("vec4({text}, 0.0, 1.0)"),
            }
        }
        (from, Type::Float) if from.is_vector() => format!("{text}.x"),
        (from, _) => {
            let message = format!(
                "a value of type `{}` is no value of type `{}`",
                from.name(),
                wanted.name()
            );
            let diagnostic = Diagnostic::new(codes::MATERIALX_SYNTAX, message);
            return Err(Box::new(
                diagnostic.at(graph.document.get(at).span, "an input of this node"),
            ));
        }
    };
    Ok(graph.add(wanted, expression).with_footprint(value.footprint.clone()))
}
