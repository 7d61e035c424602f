//! Directives of the current transform.

use rtsl::{Diagnostic, diagnostic_codes as codes};
use rtsl_math::Transform;

use super::{Executed, Interpreter, array, first_text, unknown_name};
use crate::reader::current_transform::ActiveTimes;
use crate::reader::parser::Command;

impl Interpreter<'_> {
    pub fn concatenate(&mut self, transform: Option<Transform>, command: &Command) -> Executed {
        let Some(transform) = transform else {
            let message = format!(
                "`{}` is given vectors without a direction, expected a frame",
                command.keyword.word()
            );
            return Err(Box::new(
                Diagnostic::new(codes::BAD_TRANSFORM, message).at(command.span, ""),
            ));
        };
        self.state.transform.concatenate(transform);
        Ok(())
    }

    pub fn rotate(&mut self, command: &Command) -> Executed {
        let [degrees, x, y, z] = array(command);
        self.concatenate(Transform::rotate(degrees, [x, y, z]), command)
    }

    pub fn look_at(&mut self, command: &Command) -> Executed {
        let n: [f64; 9] = array(command);
        let transform =
            Transform::look_at([n[0], n[1], n[2]], [n[3], n[4], n[5]], [n[6], n[7], n[8]]);
        self.concatenate(transform, command)
    }

    pub fn matrix(&self, command: &Command) -> Result<Transform, Box<Diagnostic>> {
        let matrix = Transform::from_columns(&array(command));
        if matrix.is_affine() {
            return Ok(matrix);
        }
        let message = "the matrix is not affine: every fourth number must be 0, the last 1";
        Err(Box::new(Diagnostic::new(codes::BAD_TRANSFORM, message).at(command.span, "")))
    }

    pub fn use_coordinate_system(&mut self, command: &Command) -> Executed {
        let name = first_text(command);
        match self.coordinate_systems.get(&name.text) {
            Some(transform) => {
                self.state.transform.set_all(*transform);
                Ok(())
            }
            None => {
                let names = self.coordinate_systems.keys().map(String::as_str);
                Err(unknown_name("coordinate system", name, names))
            }
        }
    }

    pub fn active_transform(&mut self, command: &Command) -> Executed {
        self.state.transform.active = match first_text(command).text.as_str() {
            "All" => ActiveTimes::All,
            "StartTime" => ActiveTimes::Start,
            "EndTime" => ActiveTimes::End,
            _ => {
                let message = "expected `StartTime`, `EndTime` or `All`";
                let diagnostic = Diagnostic::new(codes::SCENE_SYNTAX, message);
                return Err(Box::new(diagnostic.at(first_text(command).span, "")));
            }
        };
        Ok(())
    }

    pub fn transform_times(&mut self, command: &Command) -> Executed {
        let [start, end] = array(command);
        if start < end {
            self.description.transform_times = [start, end];
            return Ok(());
        }
        let message = format!("the motion starts at {start} and ends at {end}, not after it");
        Err(Box::new(Diagnostic::new(codes::WRONG_VALUE, message).at(command.span, "")))
    }
}
