//! Settings of the image: film, sampler and integrator.

use rtsl::{Diagnostic, Diagnostics, diagnostic_codes as codes, most_similar};
use rtsl_math::sampling::{FilterShape, PixelFilter, Sampler, SamplerKind};

use crate::description::{Description, Entity, EntityId};
use crate::reader::{Parameter, ParameterType, Values};
use crate::renderer::Renderer;

/// All settings of an image that are not shaders.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Columns of the image.
    pub width: usize,
    /// Rows of the image.
    pub height: usize,
    /// The name of the image file, if the scene gives one.
    pub filename: Option<String>,
    /// The brightness of 8-bit images, in stops.
    pub exposure: f32,
    /// The pixel filter.
    pub filter: PixelFilter,
    /// The sampler.
    pub sampler: Sampler,
    /// The renderer, if the scene selects one.
    pub renderer: Option<Renderer>,
    /// The greatest depth of rays spawned by rays; 0 traces camera rays only.
    pub max_depth: u32,
    /// The least contribution to the pixel for which spawned rays are traced; 0 traces all.
    pub cutoff: f32,
    /// The contribution to the pixel below which paths are terminated at random (Russian roulette); 0 terminates none.
    pub roulette_threshold: f32,
    /// The least distance of a hit from its ray's origin, if the scene sets it.
    pub epsilon: Option<f32>,
    /// The greatest number of loop iterations of one ray in one call of a method.
    pub loop_budget: u32,
}

/// The greatest number of pixels: 2^28 pixels take 3 GiB.
const MAX_PIXELS: u64 = 1 << 28;
const MAX_SIDE: f64 = 65_536.0;
const MAX_SAMPLES: f64 = 65_536.0;
/// The range of filter radii in pixels; a narrower filter is a point.
const NARROWEST_FILTER: f64 = 0.001;
const WIDEST_FILTER: f64 = 64.0;
/// The greatest depth: each level of `trace` takes a level of the host's stack.
const MAX_DEPTH: f64 = 64.0;

impl Default for Settings {
    fn default() -> Self {
        Settings {
            width: 1280,
            height: 720,
            filename: None,
            exposure: 0.0,
            filter: PixelFilter::default(),
            sampler: stratified(16, 0),
            renderer: None,
            max_depth: 5,
            cutoff: 0.0,
            roulette_threshold: 1.0,
            epsilon: None,
            loop_budget: 1 << 20,
        }
    }
}

impl Settings {
    /// Reads the settings of a scene; errors go to `diagnostics`.
    pub fn read(description: &Description, diagnostics: &mut Diagnostics) -> Self {
        let mut settings = Settings::default();
        let entity = |id: Option<EntityId>| id.map(|EntityId(index)| &description.entities[index]);
        if let Some(film) = entity(description.film) {
            settings.read_film(film, diagnostics);
        }
        if let Some(filter) = entity(description.filter) {
            settings.read_filter(filter, diagnostics);
        }
        if let Some(sampler) = entity(description.sampler) {
            settings.read_sampler(sampler, diagnostics);
        }
        if let Some(integrator) = entity(description.integrator) {
            settings.read_integrator(integrator, diagnostics);
        }
        settings
    }

    /// Sets the number of samples per pixel and keeps the kind of sampler.
    pub fn set_samples_per_pixel(&mut self, count: u32) {
        let (columns, rows) = grid(count);
        self.sampler = Sampler { columns, rows, ..self.sampler };
    }

    /// Returns an error message if the image is too large.
    pub fn size_problem(&self) -> Option<String> {
        let pixels = (self.width as u64).saturating_mul(self.height as u64);
        (pixels > MAX_PIXELS).then(|| format!("the image has more than {MAX_PIXELS} pixels"))
    }

    fn read_film(&mut self, film: &Entity, diagnostics: &mut Diagnostics) {
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

    fn read_filter(&mut self, entity: &Entity, diagnostics: &mut Diagnostics) {
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
            _ => {
                let known = ["box", "triangle", "gaussian", "mitchell", "blackmanharris"];
                diagnostics.push(unknown_setting(entity, &known));
                return;
            }
        };
        let radius = ["xradius", "yradius"]
            .map(|name| number(name, NARROWEST_FILTER, WIDEST_FILTER, radius));
        reader.finish();
        self.filter = PixelFilter::new(shape, radius);
    }

    fn read_sampler(&mut self, entity: &Entity, diagnostics: &mut Diagnostics) {
        let mut reader = ParameterReader::new(entity, diagnostics);
        let seed = reader.whole("seed", 0.0, 9.0e15).map_or(0, |seed| seed as u64);
        let count = reader.whole("pixelsamples", 1.0, MAX_SAMPLES);
        let columns = reader.whole("xsamples", 1.0, 256.0);
        let rows = reader.whole("ysamples", 1.0, 256.0);
        let jitter = reader.boolean("jitter").unwrap_or(true);
        // Scrambling is always Owen's, whatever the scene selects.
        reader.text("randomization");
        reader.finish();
        let (columns, rows) = match (columns, rows) {
            (None, None) => grid(count.map_or(16, |count| count as u32)),
            (columns, rows) => (columns.map_or(4, |n| n as u32), rows.map_or(4, |n| n as u32)),
        };
        let kind = match entity.class.as_str() {
            "independent" => SamplerKind::Independent,
            "stratified" => SamplerKind::Stratified { jitter },
            // One sampler implements all low-discrepancy samplers of the format.
            "sobol" | "halton" | "paddedsobol" | "zsobol" | "pmj02bn" => SamplerKind::Sobol,
            _ => {
                diagnostics.push(unknown_setting(entity, &["independent", "stratified", "sobol"]));
                SamplerKind::Independent
            }
        };
        self.sampler = Sampler { kind, columns, rows, seed };
    }

    fn read_integrator(&mut self, entity: &Entity, diagnostics: &mut Diagnostics) {
        const KNOWN: [&str; 15] = [
            "interactive",
            "whitted",
            "batch",
            "path",
            "volpath",
            "simplepath",
            "direct",
            "directlighting",
            "randomwalk",
            "bdpt",
            "ambientocclusion",
            "lightpath",
            "mlt",
            "sppm",
            "function",
        ];
        // Indirect light requires the path renderer.
        self.renderer = Some(match entity.class.as_str() {
            "interactive" | "whitted" | "direct" | "directlighting" | "ambientocclusion" => {
                Renderer::Interactive
            }
            _ => Renderer::Batch,
        });
        let mut reader = ParameterReader::new(entity, diagnostics);
        if let Some(depth) = reader.whole("maxdepth", 0.0, MAX_DEPTH) {
            self.max_depth = depth as u32;
        }
        if let Some(cutoff) = reader.number_between("cutoff", 0.0, 1.0) {
            self.cutoff = cutoff as f32;
        }
        if let Some(threshold) = reader.number_between("rrthreshold", 0.0, 1.0) {
            self.roulette_threshold = threshold as f32;
        }
        if let Some(epsilon) = reader.number("epsilon") {
            self.epsilon = Some(epsilon as f32);
        }
        if let Some(budget) = reader.whole("budget", 1.0, f64::from(u32::MAX)) {
            self.loop_budget = budget as u32;
        }
        reader.ignore(&["regularize", "lightsampler", "samplelights", "samplebsdf"]);
        reader.finish();
        if !KNOWN.contains(&entity.class.as_str()) {
            diagnostics.push(unknown_setting(entity, &KNOWN));
        }
    }
}

fn stratified(count: u32, seed: u64) -> Sampler {
    let (columns, rows) = grid(count);
    Sampler { kind: SamplerKind::Stratified { jitter: true }, columns, rows, seed }
}

/// The columns and rows of a grid of `count` cells, as near to square as divisors permit.
fn grid(count: u32) -> (u32, u32) {
    let count = count.max(1);
    let divides = |rows: &u32| count.is_multiple_of(*rows);
    let rows = (1..=count.isqrt()).rev().find(divides).unwrap_or(1);
    (count / rows, rows)
}

fn unknown_setting(entity: &Entity, known: &[&str]) -> Diagnostic {
    let message = format!("unknown {} `{}`", entity.kind.word(), entity.class);
    let diagnostic = Diagnostic::new(codes::UNKNOWN_CLASS, message).at(entity.class_span, "");
    match most_similar(&entity.class, known.iter().copied()) {
        Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
        None => diagnostic.help(format!("known are {}", known.join(", "))),
    }
}

/// Takes parameters one by one; the remaining ones are unknown.
struct ParameterReader<'a> {
    entity: &'a Entity,
    taken: Vec<&'static str>,
    diagnostics: &'a mut Diagnostics,
}

impl<'a> ParameterReader<'a> {
    fn new(entity: &'a Entity, diagnostics: &'a mut Diagnostics) -> Self {
        ParameterReader { entity, taken: Vec::new(), diagnostics }
    }

    fn take(&mut self, name: &'static str) -> Option<&'a Parameter> {
        self.taken.push(name);
        self.entity.parameters.iter().find(|parameter| parameter.name == name)
    }

    fn number(&mut self, name: &'static str) -> Option<f64> {
        let parameter = self.take(name)?;
        match (&parameter.kind, &parameter.values) {
            (
                ParameterType::Numeric { count: 1, .. } | ParameterType::Given,
                Values::Numbers(values),
            ) if values.len() == 1 && (values[0] as f32).is_finite() => Some(values[0]),
            _ => self.wrong(parameter, "one number"),
        }
    }

    fn whole(&mut self, name: &'static str, least: f64, greatest: f64) -> Option<f64> {
        let parameter = self.take(name)?;
        match &parameter.values {
            Values::Numbers(values) if values.len() == 1 && values[0] == values[0].trunc() => {
                self.between(parameter, values[0], least, greatest)
            }
            _ => self.wrong(parameter, "one whole number"),
        }
    }

    fn number_between(&mut self, name: &'static str, least: f64, greatest: f64) -> Option<f64> {
        let value = self.number(name)?;
        let parameter = self.take(name)?;
        self.between(parameter, value, least, greatest)
    }

    fn between(
        &mut self,
        parameter: &Parameter,
        value: f64,
        least: f64,
        greatest: f64,
    ) -> Option<f64> {
        if (least..=greatest).contains(&value) {
            return Some(value);
        }
        let name = &parameter.name;
        let message = format!("`{name}` must lie between {least} and {greatest}, found {value}");
        self.diagnostics
            .push(Diagnostic::new(codes::SCENE_LIMIT, message).at(parameter.values_span, ""));
        None
    }

    fn boolean(&mut self, name: &'static str) -> Option<bool> {
        let parameter = self.take(name)?;
        match &parameter.values {
            Values::Booleans(values) if values.len() == 1 => Some(values[0]),
            Values::Texts(values) if values.len() == 1 => Some(values[0] == "true"),
            _ => self.wrong(parameter, "`true` or `false`"),
        }
    }

    fn text(&mut self, name: &'static str) -> Option<String> {
        let parameter = self.take(name)?;
        match &parameter.values {
            Values::Texts(values) if values.len() == 1 => Some(values[0].clone()),
            _ => self.wrong(parameter, "one quoted string"),
        }
    }

    /// Ignores parameters of the format that have no effect.
    fn ignore(&mut self, names: &[&'static str]) {
        for name in names {
            if let Some(parameter) = self.take(name) {
                let message = format!("`{name}` has no effect on this renderer");
                self.diagnostics.push(
                    Diagnostic::new(codes::IGNORED_SETTING, message).at(parameter.declaration, ""),
                );
            }
        }
    }

    fn finish(self) {
        let unknown =
            self.entity.parameters.iter().filter(|it| !self.taken.contains(&it.name.as_str()));
        for parameter in unknown {
            let (kind, name) = (self.entity.kind.word(), &parameter.name);
            let message = format!("{kind} `{}` has no parameter `{name}`", self.entity.class);
            let diagnostic =
                Diagnostic::new(codes::UNKNOWN_PARAMETER, message).at(parameter.declaration, "");
            self.diagnostics.push(match most_similar(name, self.taken.iter().copied()) {
                Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
                None => diagnostic.help(format!("it has {}", self.taken.join(", "))),
            });
        }
    }

    fn wrong<T>(&mut self, parameter: &Parameter, expected: &str) -> Option<T> {
        let found = match parameter.values.len() {
            1 => format!("one of {}", parameter.values.description()),
            count => format!("{count} {}", parameter.values.description()),
        };
        let message = format!("`{}` takes {expected}, found {found}", parameter.name);
        self.diagnostics
            .push(Diagnostic::new(codes::WRONG_VALUE, message).at(parameter.values_span, ""));
        None
    }
}

#[cfg(test)]
mod tests {
    use crate::reader::{MemoryFiles, read_scene};

    use super::*;

    #[test]
    fn grids_are_as_square_as_they_can_be() {
        assert_eq!([1, 2, 12, 16, 7].map(grid), [(1, 1), (2, 1), (4, 3), (4, 4), (7, 1)]);
    }

    fn read(text: &str) -> (Settings, String) {
        let path = std::path::Path::new("scene.pbrt");
        let files = MemoryFiles([(path.to_owned(), text.to_owned())].into());
        let (mut map, mut diagnostics) = (rtsl::SourceMap::new(), Diagnostics::new());
        let description = read_scene(path, &files, &mut map, &mut diagnostics);
        let settings = Settings::read(&description, &mut diagnostics);
        (settings, rtsl::render::all_to_text(&map, diagnostics.iter(), false))
    }

    #[test]
    fn the_formats_samplers_of_low_discrepancy_are_sobols() {
        for name in ["sobol", "halton", "paddedsobol", "zsobol", "pmj02bn"] {
            let (settings, messages) = read(&format!(
                "Sampler \"{name}\" \"integer pixelsamples\" 77 \"string randomization\" \"owen\""
            ));
            assert_eq!(messages, "");
            assert_eq!(settings.sampler.kind, SamplerKind::Sobol);
            assert_eq!(settings.sampler.samples_per_pixel(), 77);
        }
    }

    #[test]
    fn filters_have_the_formats_parameters() {
        let filter = |text: &str| {
            let (settings, messages) = read(text);
            assert_eq!(messages, "", "{text}");
            (settings.filter.shape(), settings.filter.radius())
        };
        assert_eq!(filter(""), (FilterShape::Box, [0.5; 2]));
        assert_eq!(
            filter("PixelFilter \"gaussian\" \"float sigma\" 0.4 \"float yradius\" 1"),
            (FilterShape::Gaussian { sigma: 0.4 }, [1.5, 1.0])
        );
        assert_eq!(
            filter("PixelFilter \"mitchell\" \"float B\" 0 \"float C\" 0.5"),
            (FilterShape::Mitchell { b: 0.0, c: 0.5 }, [2.0; 2])
        );
        assert_eq!(filter("PixelFilter \"triangle\""), (FilterShape::Triangle, [2.0; 2]));
        let black = filter("PixelFilter \"blackmanharris\" \"float xradius\" 2");
        assert_eq!(black, (FilterShape::BlackmanHarris, [2.0, 1.5]));
    }

    #[test]
    fn what_is_no_filter_is_said() {
        for (text, part) in [
            ("PixelFilter \"gausian\"", "did you mean `gaussian`?"),
            ("PixelFilter \"box\" \"float sigma\" 1", "has no parameter `sigma`"),
            ("PixelFilter \"box\" \"float xradius\" 0", "`xradius` must lie between 0.001 and 64"),
        ] {
            let (settings, messages) = read(text);
            assert!(messages.contains(part), "{messages}");
            assert_eq!(settings.filter, PixelFilter::default());
        }
    }
}
