//! The pixel filter.

use rtsl::Diagnostics;
use rtsl_math::sampling::{FilterShape, PixelFilter};

use super::Settings;
use super::parameters::{ParameterReader, unknown_setting};
use crate::description::Entity;

/// The range of filter radii in pixels; a narrower filter is a point.
const NARROWEST_FILTER: f64 = 0.001;
const WIDEST_FILTER: f64 = 64.0;

/// The filter of scenes with one of pbrt's cameras that give none.
pub fn of_pbrt() -> PixelFilter {
    PixelFilter::new(FilterShape::Gaussian { sigma: 0.5 }, [1.5; 2])
}

/// The filter of pixels whose samples all lie at the centre.
pub fn point() -> PixelFilter {
    PixelFilter::new(FilterShape::Box, [NARROWEST_FILTER; 2])
}

impl Settings {
    pub(super) fn read_filter(&mut self, entity: &Entity, diagnostics: &mut Diagnostics) {
        let mut reader = ParameterReader::new(entity, diagnostics);
        let mut number = |name, least, greatest, otherwise| {
            reader.number_between(name, least, greatest).unwrap_or(otherwise)
        };
        let (shape, radius) = match entity.class.as_str() {
            "box" => (FilterShape::Box, 0.5),
            "triangle" => (FilterShape::Triangle, 2.0),
            "gaussian" => {
                (FilterShape::Gaussian { sigma: number("sigma", 0.01, WIDEST_FILTER, 0.5) }, 1.5)
            }
            "mitchell" => {
                let third = 1.0 / 3.0;
                let (b, c) = (number("B", 0.0, 1.0, third), number("C", 0.0, 1.0, third));
                (FilterShape::Mitchell { b, c }, 2.0)
            }
            "blackmanharris" => (FilterShape::BlackmanHarris, 1.5),
            "sinc" => (FilterShape::Sinc { tau: number("tau", 0.01, WIDEST_FILTER, 3.0) }, 4.0),
            _ => {
                let known = ["box", "triangle", "gaussian", "mitchell", "sinc", "blackmanharris"];
                diagnostics.push(unknown_setting(entity, &known));
                return;
            }
        };
        let radius = ["xradius", "yradius"]
            .map(|name| number(name, NARROWEST_FILTER, WIDEST_FILTER, radius));
        reader.finish();
        self.filter = PixelFilter::new(shape, radius);
    }
}
