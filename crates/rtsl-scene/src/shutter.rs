//! The camera's shutter, and the motion while it is open.

use std::sync::Arc;

use rtsl::{Diagnostic, diagnostic_codes as codes};
use rtsl_math::{MovingTransform, Transform};

use super::description::{Description, Entity};
use crate::reader::Values;

/// The parameters of every camera for the times at which its shutter opens and closes.
pub const SHUTTER: [&str; 2] = ["shutteropen", "shutterclose"];

/// The times at which the shutter opens and closes, as fractions of the scene's motion: 0 at its start, 1 at its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shutter([f64; 2]);

impl Default for Shutter {
    /// Open during the whole motion.
    fn default() -> Self {
        Shutter([0.0, 1.0])
    }
}

impl Shutter {
    /// The shutter of `camera`: from 0 to 1 by default.
    pub fn read(description: &Description, camera: &Entity) -> Result<Shutter, Box<Diagnostic>> {
        let mut times = [0.0, 1.0];
        for (time, name) in times.iter_mut().zip(SHUTTER) {
            let Some(parameter) = camera.parameter(name) else {
                continue;
            };
            match &parameter.values {
                Values::Numbers(numbers) if numbers.len() == 1 => *time = numbers[0],
                Values::Numbers(_) | Values::Booleans(_) | Values::Texts(_) | Values::Buffer(_) => {
                    let message = format!("`{name}` takes one number");
                    let diagnostic = Diagnostic::new(codes::WRONG_VALUE, message);
                    return Err(Box::new(diagnostic.at(parameter.values_span, "")));
                }
            }
        }
        if times[1] < times[0] {
            let message =
                format!("the shutter closes at {}, before it opens at {}", times[1], times[0]);
            let diagnostic = Diagnostic::new(codes::WRONG_VALUE, message);
            return Err(Box::new(diagnostic.at(camera.class_span, "")));
        }
        let [start, end] = description.transform_times;
        Ok(Shutter(times.map(|time| (time - start) / (end - start))))
    }

    /// The placement of a thing with the transforms `start` and `end` of its motion, if it moves: its transform at
    /// shutter open, and its motion until the shutter closes.
    pub fn place(
        self,
        start: Transform,
        end: Option<Transform>,
    ) -> (Transform, Option<Arc<MovingTransform>>) {
        // The reader rejects transforms without a valid motion.
        let moving = end.and_then(|end| MovingTransform::new(start, end, self.0));
        match moving {
            None => (start, None),
            Some(moving) => (moving.keys()[0], moving.moves().then(|| Arc::new(moving))),
        }
    }
}
