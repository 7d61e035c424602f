//! Observers of the interpreter's runs.

use crate::{Event, Place};

/// A value that is not finite, though a method has made it of finite numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Spoilt {
    /// The value.
    pub value: f32,
    /// The number of the value among those that the run has made, from 1.
    pub number: u32,
    /// The place of the operation that made it, or a value that it comes from, not finite; if it is known.
    pub place: Option<Place>,
}

/// Receives what happens while a function runs. The methods do nothing by default.
pub trait Observer {
    /// Receives an event with the scalars of its values.
    fn event(&mut self, event: &Event, words: &[u32]) {
        let _ = (event, words);
    }

    /// Receives a value that is not finite and is made of finite ones, whether or not it leaves the method.
    fn made(&mut self, made: Spoilt) {
        let _ = made;
    }

    /// Receives a value that is not finite and leaves the method. Each operation is told once for each time that it is
    /// executed.
    fn spoilt(&mut self, spoilt: Spoilt) {
        let _ = spoilt;
    }
}
