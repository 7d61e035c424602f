//! Events that a traced function reports to the observer of its run.

use std::ops::Range;
use std::sync::Arc;

use crate::Place;
use crate::class::ParameterType;
use crate::reported_value::{ReportedValue, scalar_count, shown};

/// A point of a function that reports values when it is reached.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The occasion.
    pub kind: EventKind,
    /// The method whose text this is, as `Class.method`.
    pub method: Arc<str>,
    /// The place in the text, if it has one.
    pub place: Option<Place>,
    /// The values, whose scalars are the operands of the operation in this order.
    pub values: Vec<Arc<EventValue>>,
}

/// The occasions of events.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// A `print`, with the parts of its text before, between and after the values.
    Print(Vec<String>),
    /// An assignment to a variable or a part of one: its value, then that of the whole variable if it is not too large.
    Assignment,
    /// The start of a method that another method calls through this reference.
    Call(String),
    /// The end of a method that another method calls.
    Return,
    /// The statement, the condition or the step of a loop at the place, which runs next; or the closing brace of a
    /// function, where all values are what they are at its end.
    Statement,
    /// The value of the condition at the place.
    Condition,
    /// The values of variables that nothing has assigned, such as members.
    Known,
    /// The start of a function of this name, which is no method, with its parameters.
    Enter(String),
    /// The end of such a function, with its result if it has one.
    Leave,
}

/// A value that an event reports.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EventValue {
    /// The variable or the part of one, as written; empty for other values.
    pub name: String,
    /// The type, without buffers and references.
    pub ty: ParameterType,
    /// The kind of the variable.
    pub scope: ValueScope,
    /// The bytes of its text in which the variable is visible, which distinguish it from others of its name; all of
    /// them if it is no variable of a function.
    pub extent: Range<u32>,
}

impl EventValue {
    /// The bytes of all texts.
    pub const EVERYWHERE: Range<u32> = 0..u32::MAX;

    /// Creates a value that is visible everywhere.
    pub fn new(name: impl Into<String>, ty: ParameterType, scope: ValueScope) -> EventValue {
        EventValue { name: name.into(), ty, scope, extent: EventValue::EVERYWHERE }
    }
}

/// The kinds of variables whose values events report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum ValueScope {
    /// None: the value of an expression.
    #[default]
    Expression,
    /// A parameter or a variable of a function.
    Local,
    /// A member of a class.
    Member,
    /// A state variable.
    State,
}

impl Event {
    /// Returns the words that stand for the event in the text form, which does not have its text.
    pub(crate) fn label(&self) -> &'static str {
        match self.kind {
            EventKind::Print(_) => "print",
            EventKind::Assignment => "assignment",
            EventKind::Call(_) => "call",
            EventKind::Return => "return",
            EventKind::Statement => "statement",
            EventKind::Condition => "condition",
            EventKind::Known => "known",
            EventKind::Enter(_) => "enter",
            EventKind::Leave => "leave",
        }
    }

    /// Returns an event with this label; `None` if there is no such occasion.
    pub(crate) fn without_text(
        label: &str,
        method: &str,
        values: Vec<Arc<EventValue>>,
    ) -> Option<Event> {
        let kinds = [
            EventKind::Print(vec![String::new(); values.len() + 1]),
            EventKind::Assignment,
            EventKind::Call(String::new()),
            EventKind::Return,
            EventKind::Statement,
            EventKind::Condition,
            EventKind::Known,
            EventKind::Enter(String::new()),
            EventKind::Leave,
        ];
        let of_kind =
            |kind| Event { kind, method: method.into(), place: None, values: values.clone() };
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
    pub fn shown(&self, words: &[u32]) -> impl Iterator<Item = (&str, String)> {
        self.split(words).map(|(value, words)| (value.name.as_str(), shown(&value.ty, words)))
    }

    /// Returns the values with their scalars.
    pub fn reported(&self, words: &[u32]) -> impl Iterator<Item = ReportedValue> {
        let values = self.split(words);
        values.map(|(value, words)| ReportedValue { variable: value.clone(), words: words.into() })
    }

    /// Returns each value with its scalars.
    fn split<'w>(
        &self,
        mut words: &'w [u32],
    ) -> impl Iterator<Item = (&Arc<EventValue>, &'w [u32])> {
        self.values.iter().map(move |value| {
            let count = scalar_count(&value.ty).min(words.len());
            let (own, rest) = words.split_at(count);
            words = rest;
            (value, own)
        })
    }
}
