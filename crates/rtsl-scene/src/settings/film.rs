//! The film.

use rtsl::{Diagnostic, Diagnostics, diagnostic_codes as codes, most_similar};

use super::parameters::ParameterReader;
use super::{MAX_SIDE, Settings};
use crate::description::Entity;
use crate::reader::Values;

/// The sensor of the human eye's standard observer.
const OBSERVER: &str = "cie1931";

/// The cameras whose sensors pbrt knows.
const SENSORS: [&str; 17] = [
    "canon_eos_100d",
    "canon_eos_1dx_mkii",
    "canon_eos_200d",
    "canon_eos_200d_mkii",
    "canon_eos_5d",
    "canon_eos_5d_mkii",
    "canon_eos_5d_mkiii",
    "canon_eos_5d_mkiv",
    "canon_eos_5ds",
    "canon_eos_m",
    "hasselblad_l1d_20c",
    "nikon_d810",
    "nikon_d850",
    "sony_ilce_6400",
    "sony_ilce_7m3",
    "sony_ilce_7rm3",
    "sony_ilce_9",
];

/// The temperature that the sensors of cameras show as white by default, in kelvin: that of sRGB.
const WHITE_OF_CAMERAS: f64 = 6500.0;

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
        self.read_part(&mut reader);
        self.read_response(&mut reader);
        // The size of the film matters to lens systems alone, and files have 32 bits a number anyway.
        reader.number("diagonal");
        reader.boolean("savefp16");
        match film.class.as_str() {
            "gbuffer" => {
                reader.text("coordinatesystem");
                reader
                    .warn("film `gbuffer` has only the colours of `rgb`: give `--aov` for others");
            }
            "spectral" => {
                reader.accept(&["nbuckets", "lambdamin", "lambdamax"]);
                reader.warn("film `spectral` has only the colours of `rgb`");
            }
            _ => {}
        }
        reader.finish();
        if let Some(problem) = self.size_problem() {
            diagnostics.push(Diagnostic::new(codes::SCENE_LIMIT, problem).at(film.class_span, ""));
        }
    }

    /// Reads the part of the film that the picture shows; a crop window counts before bounds of pixels.
    fn read_part(&mut self, reader: &mut ParameterReader<'_>) {
        let bounds = reader.numbers("pixelbounds", 4);
        let window = reader.numbers("cropwindow", 4);
        let whole = [self.width, self.height];
        let part = match (window, bounds) {
            (Some(window), _) => [0, 1].map(|axis| {
                let ends = [window[2 * axis], window[2 * axis + 1]].map(|end| end.clamp(0.0, 1.0));
                let pixel = |end: f64| (end as f32 * whole[axis] as f32).ceil() as usize;
                [pixel(ends[0].min(ends[1])), pixel(ends[0].max(ends[1]))]
            }),
            (None, Some(bounds)) => [0, 1].map(|axis| {
                let pixel = |end: f64| end.clamp(0.0, whole[axis] as f64) as usize;
                [pixel(bounds[2 * axis]), pixel(bounds[2 * axis + 1])]
            }),
            (None, None) => return,
        };
        let [[left, right], [top, bottom]] = part;
        if left < right && top < bottom {
            self.set_part([left, top], [right, bottom]);
        } else {
            reader.error(codes::WRONG_VALUE, "the part of the film to render contains no pixels");
        }
    }

    /// Reads sensitivity, white balance and the limit of samples.
    fn read_response(&mut self, reader: &mut ParameterReader<'_>) {
        const ANY: f64 = f32::MAX as f64;
        let mut scale = f64::from(self.imaging.scale);
        // A time of the film, which earlier versions of pbrt-v4 have, counts instead of the shutter's.
        scale = reader.number_between("exposuretime", 0.0, ANY).unwrap_or(scale);
        scale *= reader.number_between("iso", 0.0, ANY).map_or(1.0, |iso| iso / 100.0);
        scale *= reader.number_between("imagingratio", 0.0, ANY).unwrap_or(1.0);
        self.imaging.scale = scale as f32;
        self.imaging.max_component =
            reader.number_between("maxcomponentvalue", 0.0, ANY).map(|value| value as f32);
        let white = reader.number_between("whitebalance", 0.0, 1e6).unwrap_or(0.0);
        let is_camera = match reader.text("sensor") {
            Some(name) if name != OBSERVER => {
                let message =
                    format!("sensor `{name}` is not supported: `{OBSERVER}` takes its place");
                let near = SENSORS.contains(&name.as_str()).then_some(None);
                let near = near.unwrap_or_else(|| most_similar(&name, SENSORS));
                reader.warn_of("sensor", message, near);
                true
            }
            Some(_) | None => false,
        };
        if white > 0.0 && !(is_camera && white == WHITE_OF_CAMERAS) {
            self.imaging.set_white(white);
        }
    }

    /// Reads the time that the shutter of one of pbrt's cameras is open. Other cameras do not expose longer if it is.
    pub(super) fn read_exposure_time(&mut self, camera: &Entity) {
        let time = |name: &str, otherwise: f64| {
            let parameter = camera.parameter(name);
            match parameter.map(|parameter| &parameter.values) {
                Some(Values::Numbers(numbers)) if numbers.len() == 1 => numbers[0],
                _ => otherwise,
            }
        };
        let open = time("shutterclose", 1.0) - time("shutteropen", 0.0);
        // A shutter that never opens would make every picture black.
        if open > 0.0 {
            self.imaging.scale = open as f32;
        }
    }
}
