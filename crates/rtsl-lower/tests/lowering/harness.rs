//! Compiles texts and runs their methods for one ray.

use std::collections::BTreeMap;

use rtsl_ir::class::Class;
use rtsl_ir::host::{Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, RayLanes};
use rtsl_ir::verify::verify;
use rtsl_ir::{Function, Interpreter, Outcome, Storage, VariableId, VariableKind};
use rtsl_lower::lower_class;
use rtsl_sema::hir::{ClassId, Module};
use rtsl_source::{Diagnostic, Severity, render};
use rtsl_spec::{COLOR_COMPONENTS, Method};
use rtsl_testing::checked::check;

/// The last class of a text, or the errors of its lowering; `None` where the text has errors.
pub fn try_parsed(text: &str) -> Option<Result<Class, Vec<Diagnostic>>> {
    parsed(text).ok().map(|module| lower_module(text, &module))
}

/// The last class of a text, or the errors of its lowering.
pub fn lower(text: &str) -> Result<Class, Vec<Diagnostic>> {
    let module = parsed(text).unwrap_or_else(|messages| panic!("{text}\n{messages}"));
    lower_module(text, &module)
}

fn parsed(text: &str) -> Result<Module, String> {
    let (module, sources, found) = check(text);
    let has_errors = found.iter().any(|diagnostic| diagnostic.severity == Severity::Error);
    if has_errors { Err(render::all_to_text(&sources, &found, false)) } else { Ok(module) }
}

fn lower_module(text: &str, module: &Module) -> Result<Class, Vec<Diagnostic>> {
    let last = module.classes.len() as u32 - 1;
    let class = lower_class(module, ClassId(last), None)?;
    let functions = class.methods.values().chain(&class.constructor).chain([&class.initializer]);
    for function in functions {
        if let Err(error) = verify(function) {
            panic!("{error}\n{function}\n{text}");
        }
    }
    Ok(class)
}

/// The only class of a text that lowers.
pub fn class(text: &str) -> Class {
    lower(text).unwrap_or_else(|errors| panic!("{text}\n{errors:?}"))
}

/// The variables by kind and name, with the bits of their scalars.
pub type Values = BTreeMap<(VariableKind, String), Vec<u32>>;

/// An object, a ray and a scene.
#[derive(Clone, Debug, Default)]
pub struct Machine {
    pub values: Values,
    /// Direction and color of each light; all have distance 2 and density 0.5.
    pub lights: Vec<([f32; 3], [f32; 3])>,
    /// The light queries so far: point, axis and cosine. A light sample reaches the point if it is
    /// within the cone.
    pub queries: Vec<([f32; 3], [f32; 3], f32)>,
    rands: u32,
}

impl Machine {
    /// The data of an object whose constructor has run.
    pub fn instance(class: &Class) -> Self {
        let mut machine = Machine::default();
        machine.run(&class.initializer);
        if let Some(constructor) = &class.constructor {
            machine.run(constructor);
        }
        machine
    }

    /// Sets a variable of floats.
    pub fn set(&mut self, kind: VariableKind, name: &str, values: &[f32]) -> &mut Self {
        let bits = values.iter().map(|value| value.to_bits()).collect();
        self.values.insert((kind, name.to_owned()), bits);
        self
    }

    pub fn set_state(&mut self, name: &str, values: &[f32]) -> &mut Self {
        self.set(VariableKind::State, name, values)
    }

    /// The floats of a variable.
    pub fn get(&self, kind: VariableKind, name: &str) -> Vec<f32> {
        let bits = self.values.get(&(kind, name.to_owned()));
        let bits = bits.unwrap_or_else(|| panic!("nothing was stored to {name}"));
        bits.iter().map(|bits| f32::from_bits(*bits)).collect()
    }

    pub fn state(&self, name: &str) -> Vec<f32> {
        self.get(VariableKind::State, name)
    }

    pub fn run(&mut self, function: &Function) -> Outcome {
        let mut interpreter = Interpreter::prepare(function).unwrap();
        let mut stores = Stores { function, values: self.values.clone() };
        let outcome = interpreter.run(0, &mut stores, self);
        self.values = stores.values;
        outcome
    }
}

struct Stores<'a> {
    function: &'a Function,
    values: Values,
}

impl Storage for Stores<'_> {
    fn load(&self, place: VariableId, index: u32) -> u32 {
        let place = self.function.variable(place);
        let values = self.values.get(&(place.kind, place.name.clone()));
        values.and_then(|values| values.get(index as usize)).copied().unwrap_or(0)
    }

    fn elements(&self, buffer: VariableId) -> u32 {
        let place = self.function.variable(buffer);
        let values = self.values.get(&(place.kind, place.name.clone()));
        values.map_or(0, |values| values.len() as u32 / place.len)
    }

    fn store(&mut self, place: VariableId, component: u32, bits: u32) {
        let place = self.function.variable(place);
        let values = self.values.entry((place.kind, place.name.clone())).or_default();
        values.resize(place.len as usize, 0);
        values[component as usize] = bits;
    }
}

impl Host for Machine {
    fn trace(&mut self, _: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        for (component, lanes) in radiance.iter_mut().enumerate() {
            lanes[0] = rays.origin[component % 3][0] + rays.direction[component % 3][0];
        }
    }

    fn occluded(&mut self, _: LaneSet, rays: &RayLanes) -> u32 {
        u32::from(rays.limit[0] > 1.0)
    }

    fn light_count(&mut self) -> u32 {
        self.lights.len() as u32
    }

    fn light_sample(
        &mut self,
        _: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        let vector = |lanes: &[LaneFloats; 3]| [lanes[0][0], lanes[1][0], lanes[2][0]];
        let normal = vector(&query.normal);
        self.queries.push((vector(&query.point), normal, query.cosine[0]));
        let (direction, color) = self.lights[index as usize];
        for component in 0..3 {
            light.direction[component][0] = direction[component];
            light.color[component][0] = color[component];
        }
        light.distance[0] = 2.0;
        light.pdf[0] = 0.5;
        let cosine: f32 = direction.iter().zip(normal).map(|(a, b)| a * b).sum();
        u32::from(cosine >= query.cosine[0])
    }

    fn ambient(&mut self) -> [f32; COLOR_COMPONENTS as usize] {
        [0.25; COLOR_COMPONENTS as usize]
    }

    fn rand(&mut self, _: LaneSet, values: &mut LaneFloats) {
        self.rands += 1;
        values[0] = self.rands as f32 / 16.0;
    }
}

/// Runs `body` as a texture's `lookup` with rt_TextureUV = (u, 0); `helpers` precede it in the
/// class. Returns the value of `result`, a float.
pub fn eval_with(helpers: &str, body: &str, u: f32) -> f32 {
    let text = format!(
        "class Test : rt_Texture;\n{helpers}\nvoid lookup() {{\n    float u = rt_TextureUV.x;\n    \
         float result = 0.0;\n{body}\n    rt_FloatTextureValue = result;\n}}\n"
    );
    let class = class(&text);
    let mut machine = Machine::instance(&class);
    machine.set_state("rt_TextureUV", &[u, 0.0]);
    machine.run(&class.methods[&Method::Lookup]);
    machine.state("rt_FloatTextureValue")[0]
}

/// [`eval_with`] without helpers.
pub fn eval(body: &str, u: f32) -> f32 {
    eval_with("", body, u)
}

/// The text form of the only method of a class.
pub fn text_of(class: &Class, method: Method) -> String {
    class.methods[&method].to_string()
}

/// The number of operations of a kind in the text form of a method.
pub fn count(text: &str, operation: &str) -> usize {
    text.split_whitespace().filter(|word| *word == operation).count()
}
