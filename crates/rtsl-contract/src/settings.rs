//! The parameter settings with which a class is checked: its defaults, and values from annotated ranges.

use std::sync::{Arc, LazyLock};

use rtsl::{
    AnnotationValue, Class, Compiler, Constant, Diagnostics, Instance, Parameter, ParameterType,
    ReferenceCount, Role, Scalar, Value, library,
};

use crate::random::Stream;

/// The number of elements of an array of references that has no size.
const OPEN_REFERENCES: usize = 2;
/// The number of random settings.
const RANDOM_SETTINGS: u64 = 3;

/// The text for a texture in [`Setting::shown`].
pub const TEXTURE: &str = "texture";

/// Values for some parameters of a class.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Names and values in the syntax of the command line; textures are shown as [`TEXTURE`].
    pub shown: Vec<(String, String)>,
    /// The same as arguments of instances, with references.
    pub arguments: Vec<(String, Value)>,
}

impl Setting {
    /// Creates an instance of the class with this setting and other arguments, which take precedence.
    ///
    /// # Errors
    /// As for [`Instance::new`].
    pub fn instance(
        &self,
        class: &Arc<Class>,
        given: &[(String, Value)],
    ) -> Result<Arc<Instance>, Diagnostics> {
        let is_given = |name: &String| given.iter().any(|(other, _)| other == name);
        let own = self.arguments.iter().filter(|(name, _)| !is_given(name));
        Instance::new(class, given.iter().chain(own).map(|(name, it)| (name.as_str(), it.clone())))
    }
}

/// Writes the setting's values, such as `roughness=0.5 twoSided=true`, or that there are none.
impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.shown.is_empty() {
            return f.write_str("defaults");
        }
        let shown: Vec<String> =
            self.shown.iter().map(|(name, value)| format!("{name}={value}")).collect();
        f.write_str(&shown.join(" "))
    }
}

/// Returns settings: the defaults; then all numbers with a range at its least, middle and greatest value; then random
/// numbers and bools; then a texture for all parameters that may be one. Parameters that are `given` are not set.
/// References that the class requires are set to simple shaders.
pub fn settings(class: &Class, given: &[&str]) -> Vec<Setting> {
    let references = references(class);
    let of = |shown: Vec<(String, String)>, values: Vec<(String, Value)>| {
        let arguments = values.into_iter().chain(references.iter().cloned()).collect();
        Setting { shown, arguments }
    };
    let mut all = vec![of(Vec::new(), Vec::new())];
    all.extend(of_numbers(class, given).into_iter().map(|(shown, values)| of(shown, values)));
    let textured = class.parameters.iter().filter(|it| {
        matches!(it.ty, ParameterType::Textured(_)) && !given.contains(&it.name.as_str())
    });
    let textured = textured.map(|it| {
        let texture = Value::Instance(varying_texture());
        ((it.name.clone(), TEXTURE.to_owned()), (it.name.clone(), texture))
    });
    let (shown, values): (Vec<_>, Vec<_>) = textured.unzip();
    if !shown.is_empty() {
        all.push(of(shown, values));
    }
    all
}

/// Parameters as text and as arguments.
type Values = (Vec<(String, String)>, Vec<(String, Value)>);

/// Returns values of the parameters with a range.
fn of_numbers(class: &Class, given: &[&str]) -> Vec<Values> {
    let free = class.parameters.iter().filter(|it| !given.contains(&it.name.as_str()));
    let ranged: Vec<_> = free.filter_map(|it| Some((it, Range::of(it)?))).collect();
    if ranged.is_empty() {
        return Vec::new();
    }
    let setting = |part: &dyn Fn(usize, &Range) -> f64| {
        let values = ranged.iter().enumerate().map(|(index, (parameter, range))| {
            let (shown, value) = range.at(part(index, range));
            ((parameter.name.clone(), shown), (parameter.name.clone(), value))
        });
        values.unzip()
    };
    let mut all = Vec::new();
    let has_numbers = ranged.iter().any(|(_, range)| range.scalar != Scalar::Bool);
    for part in [0.0, 0.5, 1.0].into_iter().filter(|part| has_numbers || *part != 0.5) {
        all.push(setting(&|_, _| part));
    }
    if ranged.len() > 1 {
        for item in 0..RANDOM_SETTINGS {
            let random = Stream::new(item);
            all.push(setting(&|index, _| f64::from(random.number(index as u64, 0))));
        }
    }
    all
}

/// Returns a simple shader of a role: a grey texture, a diffuse material, a ball, a light, a camera.
pub fn stand_in(role: Role) -> Arc<Instance> {
    static STAND_INS: LazyLock<Vec<Arc<Instance>>> =
        LazyLock::new(|| Role::ALL.map(make_stand_in).into());
    let index = Role::ALL.iter().position(|it| *it == role).expect("all roles are there");
    STAND_INS[index].clone()
}

/// Returns so many simple shaders of a role, by turns two that differ: shapes that overlap, textures and materials of
/// two colours. What combines shaders would hide its mistakes where all are equal.
fn stand_ins(role: Role, count: usize) -> Vec<Value> {
    static OTHERS: LazyLock<[Arc<Instance>; 3]> = LazyLock::new(|| {
        let corner = |at: f32| Value::List(vec![Value::Float(at); 3]);
        let corners = vec![("corner", corner(-0.6)), ("opposite", corner(0.9))];
        let dark = |name| vec![(name, Value::Float(0.2))];
        [
            of_library("shaders/primitives/box.rtsl", "Box", corners),
            of_library("shaders/textures/constant.rtsl", "Constant", dark("value")),
            of_library("shaders/materials/lambertian.rtsl", "Lambertian", dark("kd")),
        ]
    });
    let other = match role {
        Role::Primitive => OTHERS[0].clone(),
        Role::Texture => OTHERS[1].clone(),
        Role::Material => OTHERS[2].clone(),
        Role::Camera | Role::Light | Role::Integrator => stand_in(role),
    };
    [stand_in(role), other].into_iter().cycle().take(count).map(Value::Instance).collect()
}

fn make_stand_in(role: Role) -> Arc<Instance> {
    match role {
        Role::Camera => of_library("shaders/cameras/pinhole.rtsl", "Pinhole", vec![]),
        Role::Primitive => of_library("shaders/primitives/sphere.rtsl", "Sphere", vec![]),
        Role::Texture => {
            let grey = vec![("value", Value::Float(0.5))];
            of_library("shaders/textures/constant.rtsl", "Constant", grey)
        }
        Role::Light => of_library("shaders/lights/point_light.rtsl", "PointLight", vec![]),
        Role::Material => of_library("shaders/materials/lambertian.rtsl", "Lambertian", vec![]),
        Role::Integrator => of_library("shaders/integrators/depth.rtsl", "Depth", vec![]),
    }
}

fn of_library(path: &str, class: &str, arguments: Vec<(&str, Value)>) -> Arc<Instance> {
    let file = library::files().iter().find(|file| file.path == path);
    let text = file.expect("the library has it").text;
    let compilation = Compiler::default().compile(path, text);
    let unit = compilation.unit.expect("the library compiles");
    Instance::new(unit.class(class).expect("the file has it"), arguments)
        .expect("its parameters are right")
}

/// Returns a texture whose values vary over a surface.
fn varying_texture() -> Arc<Instance> {
    static TEXTURE: LazyLock<Arc<Instance>> = LazyLock::new(|| {
        let values = vec![("even", Value::Float(0.4)), ("odd", Value::Float(0.1))];
        of_library("shaders/textures/checker.rtsl", "Checker", values)
    });
    TEXTURE.clone()
}

/// The references that the class uses without testing if they are set.
fn references(class: &Class) -> Vec<(String, Value)> {
    let untested = class.references.iter().filter(|it| !it.tested);
    let mut used = [0; Role::ALL.len()];
    let each = untested.map(|reference| {
        let count = match reference.count {
            ReferenceCount::Single => 1,
            ReferenceCount::Array(count) => count as usize,
            ReferenceCount::Open => OPEN_REFERENCES,
        };
        let first = &mut used[reference.role as usize];
        let mut values = stand_ins(reference.role, *first + count).split_off(*first);
        *first += count;
        let value = match (reference.count, values.pop()) {
            (ReferenceCount::Single, Some(only)) => only,
            (_, last) => Value::List(values.into_iter().chain(last).collect()),
        };
        (reference.name.clone(), value)
    });
    each.collect()
}

/// The range of a parameter.
#[derive(Clone, Copy, Debug)]
struct Range {
    scalar: Scalar,
    least: f64,
    greatest: f64,
}

impl Range {
    /// The range of a bool, or of a number with both ends annotated.
    fn of(parameter: &Parameter) -> Option<Range> {
        let ParameterType::Scalar(scalar) = *parameter.ty.value_type() else { return None };
        if scalar == Scalar::Bool {
            return Some(Range { scalar, least: 0.0, greatest: 1.0 });
        }
        let bound = |key| match parameter.annotation(key)? {
            AnnotationValue::Constant(value) => Some(number(*value)),
            AnnotationValue::None | AnnotationValue::Text(_) => None,
        };
        Some(Range { scalar, least: bound("min")?, greatest: bound("max")? })
    }

    /// The value at a fraction of the range, as text and as a value.
    fn at(&self, part: f64) -> (String, Value) {
        let number = self.least + part * (self.greatest - self.least);
        match self.scalar {
            Scalar::F32 => {
                // Few digits, so that the value can be typed.
                let value = ((number * 1e4).round() / 1e4) as f32;
                (value.to_string(), Value::Float(value))
            }
            Scalar::I32 => (format!("{number:.0}"), Value::Int(number.round() as i32)),
            Scalar::U32 => (format!("{number:.0}"), Value::Uint(number.round() as u32)),
            Scalar::Bool => {
                let value = part >= 0.5;
                (value.to_string(), Value::Bool(value))
            }
        }
    }
}

fn number(value: Constant) -> f64 {
    match value {
        // By its shortest text: the annotation 0.1 means 0.1.
        Constant::F32(value) => value.to_string().parse().unwrap_or(f64::from(value)),
        Constant::I32(value) => f64::from(value),
        Constant::U32(value) => f64::from(value),
        Constant::Bool(value) => f64::from(u8::from(value)),
    }
}
