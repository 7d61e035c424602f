//! Comparison of the contenders' outputs.

use crate::arena::Arena;
use crate::contenders::Contender;
use crate::measure::Subject;

/// The outputs of a contender, array by array; `None` where it wrote nothing.
pub type Outputs = Vec<Vec<Option<f32>>>;

/// The difference between a contender's outputs and the expected ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Difference {
    /// The greatest relative error; values below a hundredth of the greatest are scaled by that.
    pub error: f64,
    /// The number of rays for which only one of both wrote a result.
    pub unmatched: usize,
}

/// Returns the outputs of one call of the contender.
pub fn outputs(contender: &Contender, arena: &mut Arena) -> Outputs {
    arena.clear();
    contender.run(arena, 1);
    arena.outputs()
}

/// Compares `outputs` with the expected ones.
pub fn difference(outputs: &Outputs, expected: &Outputs) -> Difference {
    let mut difference = Difference::default();
    for (own, other) in outputs.iter().zip(expected) {
        let greatest = other.iter().flatten().fold(0.0_f64, |it, x| it.max(f64::from(x.abs())));
        let mut unmatched = 0;
        for pair in own.iter().zip(other) {
            match pair {
                (Some(own), Some(other)) => {
                    let error = relative_error(f64::from(*own), f64::from(*other), greatest);
                    difference.error = difference.error.max(error);
                }
                (None, None) => {}
                (Some(_), None) | (None, Some(_)) => unmatched += 1,
            }
        }
        difference.unmatched = difference.unmatched.max(unmatched);
    }
    difference
}

fn relative_error(own: f64, other: f64, greatest: f64) -> f64 {
    let error = (own - other).abs() / other.abs().max(0.01 * greatest);
    if error.is_nan() && own.to_bits() != other.to_bits() { f64::INFINITY } else { error }
}
