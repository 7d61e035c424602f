//! The current transform, which may move: its value at the start of the motion and at its end.

use rtsl_math::Transform;

/// The operand of `ActiveTransform`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ActiveTimes {
    /// `StartTime`
    Start,
    /// `EndTime`
    End,
    /// `All`
    All,
}

/// From the current space to the world's; before `WorldBegin` from the world's to the camera's.
#[derive(Clone, Copy, Debug)]
pub struct CurrentTransform {
    start: Transform,
    end: Transform,
    /// Selects the values that directives change.
    pub active: ActiveTimes,
}

impl CurrentTransform {
    /// The identity at all times.
    pub const IDENTITY: CurrentTransform = CurrentTransform {
        start: Transform::IDENTITY,
        end: Transform::IDENTITY,
        active: ActiveTimes::All,
    };

    /// Returns the value at the start of the motion.
    pub fn start(&self) -> Transform {
        self.start
    }

    /// Returns the value at the end, if it moves.
    pub fn end(&self) -> Option<Transform> {
        (self.end != self.start).then_some(self.end)
    }

    /// Replaces the active values by `transform`.
    pub fn set(&mut self, transform: Transform) {
        self.change(|_| transform);
    }

    /// Concatenates `first` with the active values, to be applied before them.
    pub fn concatenate(&mut self, first: Transform) {
        self.change(|value| value.after(first));
    }

    /// Takes the values of `other`; the selection of active values is kept.
    pub fn set_all(&mut self, other: CurrentTransform) {
        (self.start, self.end) = (other.start, other.end);
    }

    /// Returns the inverse; `None` if there is none at some time of the motion.
    pub fn inverse(&self) -> Option<Self> {
        let (start, end) = (self.start.inverse()?, self.end.inverse()?);
        let keeps_sides = self.start.swaps_handedness() == self.end.swaps_handedness();
        keeps_sides.then_some(CurrentTransform { start, end, ..*self })
    }

    fn change(&mut self, change: impl Fn(Transform) -> Transform) {
        if self.active != ActiveTimes::End {
            self.start = change(self.start);
        }
        if self.active != ActiveTimes::Start {
            self.end = change(self.end);
        }
    }
}
