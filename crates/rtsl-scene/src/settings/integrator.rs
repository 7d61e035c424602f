//! The integrator.

use rtsl::{Diagnostic, Diagnostics};

use super::Settings;
use super::parameters::{ParameterReader, unknown_setting};
use crate::description::Entity;
use crate::reader::{Parameter, Values};
use crate::renderer::Renderer;

/// The integrators: the name, the renderer, and what takes its place if the picture may differ from pbrt's.
const INTEGRATORS: [(&str, Renderer, Option<&str>); 17] = [
    ("path", Renderer::Batch, None),
    ("volpath", Renderer::Batch, None),
    ("simplepath", Renderer::Batch, None),
    ("simplevolpath", Renderer::Batch, None),
    ("batch", Renderer::Batch, None),
    ("interactive", Renderer::Interactive, None),
    ("whitted", Renderer::Interactive, None),
    ("direct", Renderer::Interactive, None),
    ("directlighting", Renderer::Interactive, None),
    ("bdpt", Renderer::Batch, Some(PATHS)),
    ("lightpath", Renderer::Batch, Some(PATHS)),
    ("mlt", Renderer::Batch, Some(PATHS)),
    ("sppm", Renderer::Batch, Some(PATHS)),
    ("randomwalk", Renderer::Batch, Some(PATHS)),
    ("function", Renderer::Batch, Some(PATHS)),
    ("ambientocclusion", Renderer::Interactive, Some("the interactive renderer takes its place")),
    ("ao", Renderer::Interactive, Some("the interactive renderer takes its place")),
];

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
        let known = INTEGRATORS.iter().find(|(name, ..)| *name == entity.class);
        let renderer = Renderer::of_integrator(entity);
        self.renderer = Some(renderer);
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
        if let Some((name, _, Some(instead))) = known {
            reader.warn(format!("integrator `{name}` is not supported: {instead}"));
        }
        // As in pbrt, negative numbers limit nothing.
        if let Some(depth) = reader.whole("maxdepth", f64::from(i32::MIN), f64::from(i32::MAX)) {
            self.max_depth = depth_of(depth);
            if renderer == Renderer::Interactive && self.max_depth > MAX_TRACE_DEPTH {
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
            ("regularize", regularize == Some(true) && renderer == Renderer::Interactive),
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

impl Renderer {
    /// Returns the renderer of an integrator. Classes, and indirect light, require the batch renderer.
    pub(crate) fn of_integrator(entity: &Entity) -> Renderer {
        let known = INTEGRATORS.iter().find(|(name, ..)| *name == entity.class);
        known.map_or(Renderer::Batch, |(_, renderer, _)| *renderer)
    }
}

/// True if the entity is an integrator by a name of the format, and not a class written in RTSL.
pub fn is_named_integrator(entity: &Entity) -> bool {
    INTEGRATORS.iter().any(|(name, ..)| *name == entity.class)
}

/// The error of an integrator that is neither a name of the format nor one of these classes.
pub fn unknown_integrator(entity: &Entity, classes: &[&str]) -> Diagnostic {
    let names = INTEGRATORS.iter().map(|(name, ..)| name).chain(classes);
    unknown_setting(entity, &names.copied().collect::<Vec<_>>())
}

/// The parameters of an integrator written in RTSL that are settings of the render.
pub const SETTINGS_OF_INTEGRATORS: [&str; 2] = ["epsilon", "budget"];
