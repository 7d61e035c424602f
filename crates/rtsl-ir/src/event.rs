//! Events that a traced function reports to the observer of its run.

use crate::class::ParameterType;
use crate::{Constant, Place, Scalar};

/// A point of a function that reports values when it is reached.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The occasion.
    pub kind: EventKind,
    /// The method whose text this is, as `Class.method`.
    pub method: String,
    /// The place in the text, if it has one.
    pub place: Option<Place>,
    /// The values, whose scalars are the operands of the operation in this order.
    pub values: Vec<EventValue>,
}

/// The occasions of events.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// A `print`, with the parts of its text before, between and after the values.
    Print(Vec<String>),
    /// An assignment to a variable.
    Assignment,
    /// The start of a method that another method calls through this reference.
    Call(String),
    /// The end of a method that another method calls.
    Return,
}

/// A value that an event reports.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EventValue {
    /// The variable; empty in a `print`.
    pub name: String,
    /// The type: a scalar, a vector, a matrix or a colour.
    pub ty: ParameterType,
}

impl Event {
    /// Returns the words that stand for the event in the text form, which does not have its text.
    pub(crate) fn label(&self) -> &'static str {
        match self.kind {
            EventKind::Print(_) => "print",
            EventKind::Assignment => "assignment",
            EventKind::Call(_) => "call",
            EventKind::Return => "return",
        }
    }

    /// Returns an event with this label; `None` if there is no such occasion.
    pub(crate) fn without_text(
        label: &str,
        method: String,
        values: Vec<EventValue>,
    ) -> Option<Event> {
        let kinds = [
            EventKind::Print(vec![String::new(); values.len() + 1]),
            EventKind::Assignment,
            EventKind::Call(String::new()),
            EventKind::Return,
        ];
        let of_kind =
            |kind| Event { kind, method: method.clone(), place: None, values: values.clone() };
        kinds.into_iter().map(of_kind).find(|event| event.label() == label)
    }

    /// Returns the text of a `print`, or all values with their names.
    pub fn text(&self, words: &[u32]) -> String {
        let values = self.shown(words);
        if let EventKind::Print(pieces) = &self.kind {
            let (first, rest) = pieces.split_first().map_or(("", &[][..]), |it| (it.0, it.1));
            let rest = rest.iter().zip(values).map(|(piece, (_, value))| value + piece);
            return first.to_owned() + &rest.collect::<String>();
        }
        let named = values.map(|(name, value)| format!("{name} = {value}"));
        named.collect::<Vec<_>>().join(", ")
    }

    /// Returns the names and the values as text.
    pub fn shown(&self, mut words: &[u32]) -> impl Iterator<Item = (&str, String)> {
        self.values.iter().map(move |value| {
            let count = scalar_count(&value.ty).min(words.len());
            let (own, rest) = words.split_at(count);
            words = rest;
            (value.name.as_str(), shown(&value.ty, own))
        })
    }
}

/// Formats a value: `0.5`, `true`, `(1.0, 0.0, 0.5)`. Floats have the shortest text that reads back to the same bits.
pub fn shown(ty: &ParameterType, words: &[u32]) -> String {
    match *ty {
        ParameterType::Matrix(_, rows) => {
            let columns = words.chunks(usize::from(rows).max(1));
            listed(columns.map(|column| vector(Scalar::F32, column)))
        }
        ParameterType::Scalar(scalar) | ParameterType::Vector(scalar, _) => vector(scalar, words),
        _ => vector(Scalar::F32, words),
    }
}

/// Returns the number of scalars of a value that events report.
pub fn scalar_count(ty: &ParameterType) -> usize {
    match *ty {
        ParameterType::Scalar(_) => 1,
        ParameterType::Vector(_, count) => count.into(),
        ParameterType::Matrix(columns, rows) => usize::from(columns) * usize::from(rows),
        ParameterType::Color => rtsl_spec::COLOR_COMPONENTS as usize,
        _ => 0,
    }
}

fn vector(scalar: Scalar, words: &[u32]) -> String {
    let component = |word: &u32| match Constant::from_bits(scalar, *word) {
        Constant::F32(value) => format!("{value:?}"),
        other => other.to_string(),
    };
    match words {
        [word] => component(word),
        _ => listed(words.iter().map(component)),
    }
}

fn listed(values: impl Iterator<Item = String>) -> String {
    format!("({})", values.collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_as_text() {
        let words = |values: &[f32]| values.iter().map(|it| it.to_bits()).collect::<Vec<_>>();
        assert_eq!(shown(&ParameterType::Scalar(Scalar::F32), &words(&[1e-8])), "1e-8");
        assert_eq!(shown(&ParameterType::Color, &words(&[0.5, 1.0, f32::NAN])), "(0.5, 1.0, NaN)");
        let matrix = shown(&ParameterType::Matrix(2, 2), &words(&[1.0, 2.0, 3.0, -0.0]));
        assert_eq!(matrix, "((1.0, 2.0), (3.0, -0.0))");
        assert_eq!(shown(&ParameterType::Vector(Scalar::Bool, 2), &[1, 0]), "(true, false)");
        assert_eq!(shown(&ParameterType::Scalar(Scalar::I32), &[u32::MAX]), "-1");
    }
}
