//! The film.

use rtsl::{Diagnostic, Diagnostics, diagnostic_codes as codes};

use super::parameters::ParameterReader;
use super::{MAX_SIDE, Settings};
use crate::description::Entity;

impl Settings {
    pub(super) fn read_film(&mut self, film: &Entity, diagnostics: &mut Diagnostics) {
        let mut reader = ParameterReader::new(film, diagnostics);
        if let Some(width) = reader.whole("xresolution", 1.0, MAX_SIDE) {
            self.width = width as usize;
        }
        if let Some(height) = reader.whole("yresolution", 1.0, MAX_SIDE) {
            self.height = height as usize;
        }
        self.filename = reader.text("filename").or(self.filename.take());
        self.exposure = reader.number("exposure").map_or(self.exposure, |value| value as f32);
        reader.ignore(&[
            "diagonal",
            "sensor",
            "iso",
            "maxcomponentvalue",
            "savefp16",
            "cropwindow",
            "pixelbounds",
            "whitebalance",
            "exposuretime",
        ]);
        reader.finish();
        if let Some(problem) = self.size_problem() {
            diagnostics.push(Diagnostic::new(codes::SCENE_LIMIT, problem).at(film.class_span, ""));
        }
    }
}
