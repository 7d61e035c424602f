//! Values that events report: their parts, and their text.

use std::fmt;
use std::sync::Arc;

use crate::class::ParameterType;
use crate::{Constant, EventValue, Scalar};

/// The number of scalars of the largest variables whose values are reported.
pub const MAX_REPORTED_SCALARS: usize = 64;

/// A value that was reported. Its scalars are in the order of the leaves of its type: the elements of an array of
/// structs are apart, field by field.
#[derive(Clone, Debug, PartialEq)]
pub struct ReportedValue {
    /// The variable and the type.
    pub variable: Arc<EventValue>,
    /// The scalars.
    pub words: Box<[u32]>,
}

impl ReportedValue {
    /// Returns the name of the variable; empty for the value of an expression.
    pub fn name(&self) -> &str {
        &self.variable.name
    }

    /// Returns the type.
    pub fn ty(&self) -> &ParameterType {
        &self.variable.ty
    }

    /// Returns the components of a vector or a colour, the columns of a matrix, the fields of a struct or the elements
    /// of an array, with what selects each: `x`, `[2]`, `field`. A scalar has none.
    pub fn parts(&self) -> Vec<ReportedValue> {
        let parts = parts(self.ty(), &self.words);
        let EventValue { scope, extent, .. } = &*self.variable;
        let part = |(name, ty, words): (String, ParameterType, Vec<u32>)| {
            let (scope, extent) = (*scope, extent.clone());
            let variable = Arc::new(EventValue { name, ty, scope, extent });
            ReportedValue { variable, words: words.into() }
        };
        parts.into_iter().map(part).collect()
    }

    /// Returns the only scalar, if it is one.
    pub fn scalar(&self) -> Option<Constant> {
        match (self.ty(), &*self.words) {
            (ParameterType::Scalar(scalar), [word]) => Some(Constant::from_bits(*scalar, *word)),
            _ => None,
        }
    }

    /// Returns true if no float of it is NaN or an infinity.
    pub fn is_finite(&self) -> bool {
        match (self.ty(), self.scalar()) {
            (_, Some(Constant::F32(value))) => value.is_finite(),
            (ParameterType::Scalar(_), _) => true,
            _ => self.parts().iter().all(ReportedValue::is_finite),
        }
    }
}

/// Formats the value, without the name.
impl fmt::Display for ReportedValue {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&shown(self.ty(), &self.words))
    }
}

/// Formats a value: `0.5`, `true`, `(1.0, 0.0, 0.5)`, `{t = 0.5, n = (0.0, 1.0)}`. Floats have the shortest text that
/// reads back to the same bits.
pub fn shown(ty: &ParameterType, words: &[u32]) -> String {
    match (ty, words) {
        (ParameterType::Scalar(scalar), [word]) => match Constant::from_bits(*scalar, *word) {
            Constant::F32(value) => format!("{value:?}"),
            other => other.to_string(),
        },
        (ParameterType::Struct(..), _) => {
            let fields = parts(ty, words).into_iter();
            let fields = fields.map(|(name, ty, words)| format!("{name} = {}", shown(&ty, &words)));
            format!("{{{}}}", fields.collect::<Vec<_>>().join(", "))
        }
        _ => {
            let parts: Vec<String> =
                parts(ty, words).iter().map(|(_, ty, words)| shown(ty, words)).collect();
            match (ty, parts.as_slice()) {
                (ParameterType::Array(..), _) => format!("[{}]", parts.join(", ")),
                (_, [only]) => only.clone(),
                _ => format!("({})", parts.join(", ")),
            }
        }
    }
}

/// Returns the number of scalars of a value that events report; 0 for types without values of their own.
pub fn scalar_count(ty: &ParameterType) -> usize {
    match ty {
        ParameterType::Scalar(_) => 1,
        ParameterType::Vector(_, count) => usize::from(*count),
        ParameterType::Matrix(columns, rows) => usize::from(*columns) * usize::from(*rows),
        ParameterType::Color => rtsl_spec::COLOR_COMPONENTS as usize,
        ParameterType::Struct(_, fields) => fields.iter().map(|(_, ty)| scalar_count(ty)).sum(),
        ParameterType::Array(element, count) => scalar_count(element) * *count as usize,
        ParameterType::Buffer(_) | ParameterType::Reference(_) | ParameterType::Textured(_) => 0,
    }
}

/// The parts of a value, each with what selects it.
fn parts(ty: &ParameterType, words: &[u32]) -> Vec<(String, ParameterType, Vec<u32>)> {
    const AXES: [&str; 4] = ["x", "y", "z", "w"];
    let vector = |scalar: Scalar, names: &[&str]| {
        let component = |(index, word): (usize, &u32)| {
            let name = names.get(index).map_or(format!("[{index}]"), |name| (*name).to_owned());
            (name, ParameterType::Scalar(scalar), vec![*word])
        };
        words.iter().enumerate().map(component).collect::<Vec<_>>()
    };
    match ty {
        ParameterType::Vector(scalar, count) if usize::from(*count) <= AXES.len() => {
            vector(*scalar, &AXES)
        }
        ParameterType::Vector(scalar, _) => vector(*scalar, &[]),
        ParameterType::Color => vector(Scalar::F32, &["r", "g", "b"]),
        ParameterType::Matrix(_, rows) => {
            let columns = words.chunks(usize::from(*rows).max(1)).enumerate();
            let ty = ParameterType::Vector(Scalar::F32, *rows);
            columns.map(|(index, it)| (format!("[{index}]"), ty.clone(), it.to_vec())).collect()
        }
        ParameterType::Struct(_, fields) => {
            let mut rest = words;
            let fields = fields.iter().map(|(name, ty)| {
                let (own, after) = rest.split_at(scalar_count(ty).min(rest.len()));
                rest = after;
                (name.clone(), ty.clone(), own.to_vec())
            });
            fields.collect()
        }
        ParameterType::Array(element, count) => {
            let element_of = |index| element_of_array(element, *count, index, words);
            let elements = (0..*count).map(|index| (format!("[{index}]"), element_of(index)));
            elements.map(|(name, words)| (name, ParameterType::clone(element), words)).collect()
        }
        _ => Vec::new(),
    }
}

/// The scalars of an element of an array: those of each of its leaves.
fn element_of_array(element: &ParameterType, count: u32, index: u32, words: &[u32]) -> Vec<u32> {
    let (count, index) = (count as usize, index as usize);
    let (mut own, mut first) = (Vec::new(), 0);
    for len in leaves(element) {
        own.extend(words.iter().skip(first + index * len).take(len));
        first += len * count;
    }
    own
}

/// The numbers of scalars of the leaves of a type.
fn leaves(ty: &ParameterType) -> Vec<usize> {
    match ty {
        ParameterType::Struct(_, fields) => fields.iter().flat_map(|(_, ty)| leaves(ty)).collect(),
        ParameterType::Array(element, count) => {
            leaves(element).into_iter().map(|len| len * *count as usize).collect()
        }
        other => vec![scalar_count(other)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(values: &[f32]) -> Vec<u32> {
        values.iter().map(|it| it.to_bits()).collect()
    }

    #[test]
    fn values_as_text() {
        assert_eq!(shown(&ParameterType::Scalar(Scalar::F32), &words(&[1e-8])), "1e-8");
        assert_eq!(shown(&ParameterType::Color, &words(&[0.5, 1.0, f32::NAN])), "(0.5, 1.0, NaN)");
        let matrix = shown(&ParameterType::Matrix(2, 2), &words(&[1.0, 2.0, 3.0, -0.0]));
        assert_eq!(matrix, "((1.0, 2.0), (3.0, -0.0))");
        assert_eq!(shown(&ParameterType::Vector(Scalar::Bool, 2), &[1, 0]), "(true, false)");
        assert_eq!(shown(&ParameterType::Scalar(Scalar::I32), &[u32::MAX]), "-1");
    }

    #[test]
    fn elements_of_arrays_of_structs_are_apart() {
        let float = ParameterType::Scalar(Scalar::F32);
        let pair = ParameterType::Array(Box::new(float.clone()), 2);
        let fields = vec![
            ("t".to_owned(), float),
            ("n".to_owned(), ParameterType::Vector(Scalar::F32, 2)),
            ("w".to_owned(), pair),
        ];
        let ty = ParameterType::Array(Box::new(ParameterType::Struct("S".to_owned(), fields)), 2);
        // t of both, then n of both, then w of both.
        let words = words(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]);
        assert_eq!(scalar_count(&ty), words.len());
        assert_eq!(
            shown(&ty, &words),
            "[{t = 1.0, n = (3.0, 4.0), w = [7.0, 8.0]}, {t = 2.0, n = (5.0, 6.0), w = [9.0, 10.0]}]"
        );
    }
}
