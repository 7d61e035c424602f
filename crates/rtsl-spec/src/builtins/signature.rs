//! Expands signatures in GLSL's notation with generic types to concrete overloads.
//!
//! Notation: `result name(parameter, ...)`, a parameter being `[out|inout] type name`. Types may be
//! concrete or generic. Within one signature all generic types have one size:
//!
//! | written | stands for |
//! |---|---|
//! | `genF genI genU genB` | a scalar or a vector of 2 to 4 |
//! | `vec ivec uvec bvec` | a vector of 2 to 4 |
//! | `mat` | any of the nine matrices, the same one throughout |
//! | `genC` | `color` or `float`, chosen for each parameter independently |

use super::table::RADIANCE;
use super::{Builtin, Lowering, Scalar, SpecType, Special, Usable};
use crate::Direction;

/// One concrete form of a built-in function.
#[derive(Clone, Debug)]
pub struct Overload {
    /// The registry entry of the function.
    pub builtin: &'static Builtin,
    /// The parameters in order.
    pub parameters: Vec<Parameter>,
    /// The type of the result, `Void` for none.
    pub result: SpecType,
}

impl Overload {
    /// The places where this form may be called: `nearestHit()` searches along the integrator's own ray.
    pub fn usable(&self) -> Usable {
        let is_search = self.builtin.lowering == Lowering::Special(Special::NearestHit);
        if is_search && self.parameters.is_empty() { RADIANCE } else { self.builtin.usable }
    }
}

/// A parameter of a built-in function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Its name, for documentation and messages.
    pub name: &'static str,
    /// Its type.
    pub ty: SpecType,
    /// The direction in which the value passes between caller and function.
    pub direction: Direction,
}

/// Returns all concrete forms of one signature, small sizes first.
///
/// `None` if the text is not a signature of this function in the notation above.
pub(super) fn expand(builtin: &'static Builtin, signature: &'static str) -> Option<Vec<Overload>> {
    let pattern = Pattern::parse(signature).filter(|pattern| pattern.name == builtin.name)?;
    let mut overloads = Vec::new();
    for instance in pattern.instances() {
        let parameters: Option<Vec<Parameter>> = pattern
            .parameters
            .iter()
            .enumerate()
            .map(|(index, parameter)| parameter.instantiate(instance, index))
            .collect();
        let result = pattern.result.instantiate(instance, RESULT)?;
        overloads.push(Overload { builtin, parameters: parameters?, result });
    }
    Some(overloads)
}

/// The index given for the result, which is never `genC`.
const RESULT: usize = usize::MAX;

struct Pattern {
    name: &'static str,
    result: TypePattern,
    parameters: Vec<ParameterPattern>,
}

struct ParameterPattern {
    name: &'static str,
    ty: TypePattern,
    direction: Direction,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum TypePattern {
    Concrete(SpecType),
    ScalarOrVector(Scalar),
    Vector(Scalar),
    Matrix,
    ColorOrFloat,
}

/// One choice of concrete types for the generic types of a signature.
#[derive(Clone, Copy)]
struct Instance {
    size: u8,
    matrix: (u8, u8),
    /// Bit i is set if parameter i, a `genC`, is a float.
    floats: u32,
}

impl Pattern {
    fn parse(signature: &'static str) -> Option<Pattern> {
        let (head, rest) = signature.split_once('(')?;
        let (result, name) = head.split_once(' ')?;
        let list = rest.strip_suffix(')')?;
        let parameters: Option<Vec<ParameterPattern>> = list
            .split(',')
            .map(str::trim)
            .filter(|text| !text.is_empty())
            .map(ParameterPattern::parse)
            .collect();
        Some(Pattern { name, result: TypePattern::parse(result)?, parameters: parameters? })
    }

    fn types(&self) -> impl Iterator<Item = TypePattern> {
        std::iter::once(self.result).chain(self.parameters.iter().map(|parameter| parameter.ty))
    }

    fn instances(&self) -> Vec<Instance> {
        let sizes = self.types().fold(1..=1, |sizes, ty| match ty {
            TypePattern::ScalarOrVector(_) => 1..=4,
            TypePattern::Vector(_) => 2..=4,
            TypePattern::Concrete(_) | TypePattern::Matrix | TypePattern::ColorOrFloat => sizes,
        });
        let dimensions =
            if self.types().any(|ty| ty == TypePattern::Matrix) { 2..=4 } else { 2..=2 };
        let color_mask = self.parameters.iter().enumerate().fold(0, |mask, (index, parameter)| {
            if parameter.ty == TypePattern::ColorOrFloat { mask | 1 << index } else { mask }
        });

        let mut instances = Vec::new();
        for size in sizes {
            for columns in dimensions.clone() {
                for rows in dimensions.clone() {
                    for floats in (0..=color_mask).filter(|floats| floats & !color_mask == 0) {
                        instances.push(Instance { size, matrix: (columns, rows), floats });
                    }
                }
            }
        }
        instances
    }
}

impl ParameterPattern {
    fn parse(text: &'static str) -> Option<ParameterPattern> {
        let (direction, text) = if let Some(rest) = text.strip_prefix("out ") {
            (Direction::Out, rest)
        } else if let Some(rest) = text.strip_prefix("inout ") {
            (Direction::InOut, rest)
        } else {
            (Direction::In, text)
        };
        let (ty, name) = text.split_once(' ')?;
        Some(ParameterPattern { name, ty: TypePattern::parse(ty)?, direction })
    }

    fn instantiate(&self, instance: Instance, index: usize) -> Option<Parameter> {
        let ty = self.ty.instantiate(instance, index)?;
        Some(Parameter { name: self.name, ty, direction: self.direction })
    }
}

impl TypePattern {
    fn parse(text: &str) -> Option<TypePattern> {
        Some(match text {
            "genF" => TypePattern::ScalarOrVector(Scalar::Float),
            "genI" => TypePattern::ScalarOrVector(Scalar::Int),
            "genU" => TypePattern::ScalarOrVector(Scalar::Uint),
            "genB" => TypePattern::ScalarOrVector(Scalar::Bool),
            "vec" => TypePattern::Vector(Scalar::Float),
            "ivec" => TypePattern::Vector(Scalar::Int),
            "uvec" => TypePattern::Vector(Scalar::Uint),
            "bvec" => TypePattern::Vector(Scalar::Bool),
            "mat" => TypePattern::Matrix,
            "genC" => TypePattern::ColorOrFloat,
            _ => TypePattern::Concrete(SpecType::from_name(text)?),
        })
    }

    fn instantiate(self, instance: Instance, index: usize) -> Option<SpecType> {
        Some(match self {
            TypePattern::Concrete(ty) => ty,
            TypePattern::ScalarOrVector(scalar) | TypePattern::Vector(scalar) => {
                SpecType::scalar_or_vector(scalar, instance.size)
            }
            TypePattern::Matrix => SpecType::Mat(instance.matrix.0, instance.matrix.1),
            TypePattern::ColorOrFloat if index == RESULT => return None,
            TypePattern::ColorOrFloat if instance.floats >> index & 1 == 1 => SpecType::Float,
            TypePattern::ColorOrFloat => SpecType::Color,
        })
    }
}

impl std::fmt::Display for Overload {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "{} {}(", self.result, self.builtin.name)?;
        for (index, parameter) in self.parameters.iter().enumerate() {
            let separator = if index == 0 { "" } else { ", " };
            let direction = match parameter.direction {
                Direction::In => "",
                Direction::Out => "out ",
                Direction::InOut => "inout ",
            };
            write!(out, "{separator}{direction}{} {}", parameter.ty, parameter.name)?;
        }
        out.write_str(")")
    }
}
