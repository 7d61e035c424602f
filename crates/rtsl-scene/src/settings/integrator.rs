//! The integrator.

use rtsl::{Diagnostic, Diagnostics};

use super::Settings;
use super::parameters::{ParameterReader, unknown_setting};
use crate::description::Entity;
use crate::reader::{Parameter, Values};
use crate::standard::{PATH_TRACER, WHITTED};

/// The name of the renderer that calls `shade` of materials.
pub const INTERACTIVE: &str = "interactive";

/// The name of the renderer that traces paths.
pub const BATCH: &str = "batch";

/// The names of renderers, which stand for integrators of the library.
pub const RENDERERS: [&str; 2] = [BATCH, INTERACTIVE];

/// A name of the format for an integrator.
struct NamedIntegrator {
    name: &'static str,
    /// The class of the library that makes the picture.
    class: &'static str,
    /// The rest of the warning, if the picture may differ from pbrt's.
    instead: Option<&'static str>,
}

/// The names of the format for integrators.
const INTEGRATORS: [NamedIntegrator; 17] = [
    NamedIntegrator::new("path", PATH_TRACER),
    NamedIntegrator::new("volpath", PATH_TRACER),
    NamedIntegrator::new("simplepath", PATH_TRACER),
    NamedIntegrator::new("simplevolpath", PATH_TRACER),
    NamedIntegrator::new(BATCH, PATH_TRACER),
    NamedIntegrator::new(INTERACTIVE, WHITTED),
    NamedIntegrator::new("whitted", WHITTED),
    NamedIntegrator::new("direct", WHITTED),
    NamedIntegrator::new("directlighting", WHITTED),
    NamedIntegrator::new("bdpt", PATH_TRACER).replaced_by(PATHS),
    NamedIntegrator::new("lightpath", PATH_TRACER).replaced_by(PATHS),
    NamedIntegrator::new("mlt", PATH_TRACER).replaced_by(PATHS),
    NamedIntegrator::new("sppm", PATH_TRACER).replaced_by(PATHS),
    NamedIntegrator::new("randomwalk", PATH_TRACER).replaced_by(PATHS),
    NamedIntegrator::new("function", PATH_TRACER).replaced_by(PATHS),
    NamedIntegrator::new("ambientocclusion", WHITTED).replaced_by(SHADING),
    NamedIntegrator::new("ao", WHITTED).replaced_by(SHADING),
];

const SHADING: &str = "the interactive renderer takes its place";
const PATHS: &str = "paths from the camera take its place";

/// Parameters of pbrt's integrators that change how the picture is found, and not the picture.
const WITHOUT_EFFECT: [&str; 16] = [
    "lightsampler",
    "samplelights",
    "samplebsdf",
    "bootstrapsamples",
    "chains",
    "mutationsperpixel",
    "largestepprobability",
    "sigma",
    "photonsperiteration",
    "radius",
    "seed",
    "cossample",
    "maxdistance",
    "function",
    "filename",
    "skipbad",
];

/// The greatest depth of paths; roulette ends them long before.
const MAX_DEPTH: u32 = 1 << 16;

/// The greatest depth in the interactive renderer: each level of `trace` takes a level of the host's stack.
pub const MAX_TRACE_DEPTH: u32 = 64;

impl Settings {
    pub(super) fn read_integrator(&mut self, entity: &Entity, diagnostics: &mut Diagnostics) {
        let known = NamedIntegrator::find(&entity.class);
        let class = class_of_integrator(entity);
        self.integrator = Some(class);
        let mut reader = ParameterReader::new(entity, diagnostics);
        if let Some(epsilon) = reader.number("epsilon") {
            self.epsilon = Some(epsilon as f32);
        }
        if let Some(budget) = reader.whole("budget", 1.0, f64::from(u32::MAX)) {
            self.loop_budget = budget as u32;
        }
        if known.is_none() {
            self.read_parameters_of_class(entity);
            return;
        }
        if let Some(NamedIntegrator { name, instead: Some(instead), .. }) = known {
            reader.warn(format!("integrator `{name}` is not supported: {instead}"));
        }
        // As in pbrt, negative numbers limit nothing.
        if let Some(depth) = reader.whole("maxdepth", f64::from(i32::MIN), f64::from(i32::MAX)) {
            self.max_depth = depth_of(depth);
            if class == WHITTED && self.max_depth > MAX_TRACE_DEPTH {
                let message = format!(
                    "the interactive renderer follows rays to a depth of {MAX_TRACE_DEPTH}"
                );
                reader.warn_of("maxdepth", message, None);
            }
        }
        if let Some(cutoff) = reader.number_between("cutoff", 0.0, 1.0) {
            self.cutoff = cutoff as f32;
        }
        // As in pbrt, paths that carry more than 1 never end at random.
        if let Some(threshold) = reader.number("rrthreshold") {
            self.roulette_threshold = threshold.clamp(0.0, 1.0) as f32;
        }
        let regularize = reader.boolean("regularize");
        self.regularize = regularize.unwrap_or(self.regularize);
        let no_effects = [
            ("regularize", regularize == Some(true) && class == WHITTED),
            ("visualizestrategies", reader.boolean("visualizestrategies") == Some(true)),
            ("visualizeweights", reader.boolean("visualizeweights") == Some(true)),
        ];
        for (name, is_set) in no_effects {
            if is_set {
                reader.warn_of(name, format!("`{name}` has no effect on this renderer"), None);
            }
        }
        reader.accept(&WITHOUT_EFFECT);
        reader.accept(&["imagefilename"]);
        reader.finish();
    }

    /// Reads the parameters of a class that are settings of the renderers that may take its place. Where the class is
    /// made they are checked.
    fn read_parameters_of_class(&mut self, entity: &Entity) {
        let number = |name: &str| entity.number(name);
        if let Some(depth) = number("maxDepth") {
            self.max_depth = depth_of(depth);
        }
        if let Some(threshold) = number("rouletteThreshold") {
            self.roulette_threshold = threshold.clamp(0.0, 1.0) as f32;
        }
        if let Some(Values::Booleans(values)) = entity.parameter("regularize").map(|it| &it.values)
            && let [regularize] = values[..]
        {
            self.regularize = regularize;
        }
    }
}

/// The depth that a scene gives. As in pbrt, negative numbers limit nothing.
fn depth_of(given: f64) -> u32 {
    if given < 0.0 { MAX_DEPTH } else { (given as u32).min(MAX_DEPTH) }
}

/// Parameters of named integrators, by the names that classes have for them.
const NAMES_IN_CLASSES: [(&str, &str); 2] =
    [("maxdepth", "maxDepth"), ("rrthreshold", "rouletteThreshold")];

/// Returns the parameters of the scene's own integrator by the names that a class in its place has for them.
pub fn taken_over(own: &Entity) -> impl Iterator<Item = Parameter> {
    let is_named = is_named_integrator(own);
    own.parameters.iter().cloned().map(move |mut parameter| {
        let in_class =
            NAMES_IN_CLASSES.iter().find(|(name, _)| is_named && *name == parameter.name);
        let Some((_, name)) = in_class else { return parameter };
        parameter.name = (*name).to_owned();
        if let (true, Values::Numbers(values)) = (*name == "maxDepth", &mut parameter.values) {
            values.iter_mut().for_each(|depth| *depth = f64::from(depth_of(*depth)));
        }
        parameter
    })
}

impl NamedIntegrator {
    const fn new(name: &'static str, class: &'static str) -> NamedIntegrator {
        NamedIntegrator { name, class, instead: None }
    }

    const fn replaced_by(self, instead: &'static str) -> NamedIntegrator {
        NamedIntegrator { instead: Some(instead), ..self }
    }

    fn find(name: &str) -> Option<&'static NamedIntegrator> {
        INTEGRATORS.iter().find(|named| named.name == name)
    }
}

/// Returns the class that a renderer's name stands for.
pub fn class_of_renderer(name: &str) -> Option<&'static str> {
    let named = NamedIntegrator::find(name).filter(|named| RENDERERS.contains(&named.name));
    named.map(|named| named.class)
}

/// Returns the class of the library that a scene with this integrator has if it makes no other one: classes, and
/// indirect light, need the path tracer.
pub fn class_of_integrator(entity: &Entity) -> &'static str {
    NamedIntegrator::find(&entity.class).map_or(PATH_TRACER, |named| named.class)
}

/// True if the entity is an integrator by a name of the format, and not a class written in RTSL.
pub fn is_named_integrator(entity: &Entity) -> bool {
    NamedIntegrator::find(&entity.class).is_some()
}

/// The error of an integrator that is neither a name of the format nor one of these classes.
pub fn unknown_integrator(entity: &Entity, classes: &[&str]) -> Diagnostic {
    let names = INTEGRATORS.iter().map(|named| &named.name).chain(classes);
    unknown_setting(entity, &names.copied().collect::<Vec<_>>())
}

/// The parameters of an integrator written in RTSL that are settings of the render.
pub const SETTINGS_OF_INTEGRATORS: [&str; 2] = ["epsilon", "budget"];
