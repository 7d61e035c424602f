//! Values of every class of the standard library stay finite with parameters outside of the ranges that their
//! annotations declare: hosts take such values with a warning.

use std::sync::Arc;

use rtsl::host::PlainHost;
use rtsl::{
    AnnotationValue, CallArguments, CallMode, Class, Constant, Engine, Instance, Instances,
    LaneBlock, LaneMask, Method, Parameter, ParameterType, Role, Scalar, Value, lookup_state,
    new_state, set_defaults,
};
use rtsl_contract::settings;

use crate::common::seeds::seeds;
use crate::library::table;

/// Rays at a time: one interpretation of a method serves all of them.
const RAYS: usize = 16;

/// The methods of a role, in the order in which renderers call them for a ray.
fn methods(role: Role) -> &'static [Method] {
    match role {
        Role::Camera => &[Method::GenerateRay],
        Role::Primitive => &[
            Method::ComputeBounds,
            Method::Intersect,
            Method::ComputeNormal,
            Method::ComputeTextureCoordinates,
            Method::ComputeDerivatives,
            Method::GenerateSample,
            Method::SamplePdf,
        ],
        Role::Texture => &[Method::Lookup],
        Role::Material => &[
            Method::Bsdf,
            Method::EvaluatePdf,
            Method::Emission,
            Method::Presence,
            Method::SampleBsdf,
        ],
        Role::Light => &[Method::Illumination, Method::EvaluatePdf, Method::Emission],
        // Integrators ask a scene.
        Role::Integrator => &[],
    }
}

/// A number from 0 to 1 of a ray.
fn number(ray: usize, dimension: usize) -> f32 {
    ((ray * 7 + dimension * 5 + ray * dimension) % 17) as f32 / 17.0
}

/// A unit vector of a ray with this height over the surface.
fn direction(ray: usize, dimension: usize, height: f32) -> [f32; 3] {
    let (x, y) = (number(ray, dimension) - 0.5, number(ray, dimension + 1) - 0.45);
    let length = (x * x + y * y).sqrt();
    let width = (1.0 - height * height).sqrt();
    [x / length * width, y / length * width, height]
}

/// The inputs of methods: rays towards the origin, whose surface faces along z.
fn inputs(role: Role) -> LaneBlock {
    let mut state = new_state(RAYS);
    set_defaults(&mut state, role);
    let mut set = |name: &str, ray: usize, values: &[f32]| {
        let first = lookup_state(name).expect("a state variable").first_component as usize;
        for (component, value) in values.iter().enumerate() {
            state.floats_mut(first + component)[ray] = *value;
        }
    };
    for ray in 0..RAYS {
        let view = direction(ray, 1, 0.1 + 0.85 * number(ray, 3)).map(|it| -it);
        let light = direction(ray, 4, 0.1 + 0.85 * number(ray, 6));
        let side = if ray % 4 == 3 { -1.0 } else { 1.0 };
        let (u, v) = (number(ray, 7), number(ray, 8));
        set("rt_du", ray, &[0.02]);
        set("rt_dv", ray, &[0.03]);
        if role == Role::Light {
            set("rt_HitPoint", ray, &[u - 0.3, v + 1.5, 0.7 - u]);
        }
        if role == Role::Primitive {
            let target = [0.4 * u, 0.4 * v, 0.1];
            set("rt_RayOrigin", ray, &[0, 1, 2].map(|axis| target[axis] - 4.0 * view[axis]));
        }
        if role != Role::Camera {
            set("rt_RayDirection", ray, &view);
            set("rt_InverseRayDirection", ray, &view.map(f32::recip));
        }
        set("rt_LightDirection", ray, &light.map(|it| side * it));
        set("rt_BSDFSeed", ray, &[u, v, number(ray, 9)]);
        set("rt_TextureUV", ray, &[3.0 * u - 1.0, 2.0 * v]);
        set("rt_TextureUVW", ray, &[u, v, 0.3]);
        set("rt_ScreenCoord", ray, &[u, v]);
        set("rt_LensCoord", ray, &[v, u]);
        set("rt_dPdu", ray, &[1.0, 0.0, 0.0]);
        set("rt_dPdv", ray, &[0.0, 1.0, 0.0]);
        set("rt_ShadingNormal", ray, &[0.0, 0.0, 1.0]);
        set("rt_GeometricNormal", ray, &[0.0, 0.0, 1.0]);
    }
    state
}

/// Calls all methods of an instance; returns those that give numbers which are not finite.
fn not_finite(engine: &Engine, instance: &Arc<Instance>) -> Vec<String> {
    let program = engine.program(instance);
    let block = program.block(instance);
    let mut found = Vec::new();
    for role in &instance.class().roles {
        let (mut state, mut scratch) = (inputs(*role), program.new_scratch(RAYS));
        let mut hits = LaneMask::from_fn(RAYS, |_| true);
        for method in methods(*role).iter().filter(|method| program.has(**method)) {
            let kernel = program.kernel(*method, CallMode::Packet).expect("it is compiled");
            let mut accepted = LaneMask::new(RAYS);
            let status = kernel.call(CallArguments {
                state: &mut state,
                scratch: &mut scratch,
                count: RAYS,
                mask: None,
                accepted: (*method == Method::Intersect).then_some(&mut accepted),
                instances: Instances::One(&block),
                host: &mut PlainHost { rand: 0.3, ..PlainHost::default() },
            });
            if status.budget_exhausted {
                found.push(format!("{} does not end", method.name()));
            }
            if *method == Method::Intersect {
                hits = accepted;
                set_hit_points(&mut state);
            }
            let linked = program.method(*method).expect("it is linked");
            for variable in &linked.writes {
                let first = variable.first_component as usize;
                for component in first..first + variable.ty.components() as usize {
                    let values = state.floats(component);
                    // Distances and bounds may be infinite.
                    let is_bad = |ray: &usize| {
                        hits.get(*ray)
                            && (values[*ray].is_nan()
                                || is_color(variable.name) && values[*ray].is_infinite())
                    };
                    if let Some(ray) = (0..RAYS).find(is_bad) {
                        let value = values[ray];
                        found.push(format!("{}: {} is {value}", method.name(), variable.name));
                        break;
                    }
                }
            }
        }
    }
    found
}

fn is_color(name: &str) -> bool {
    name.contains("Color") || name.contains("Value") || name == "rt_PDF"
}

/// The points of the hits that `intersect` found.
fn set_hit_points(state: &mut LaneBlock) {
    let first = |name: &str| lookup_state(name).expect("a state variable").first_component as usize;
    let [origin, direction, point] = ["rt_RayOrigin", "rt_RayDirection", "rt_HitPoint"].map(first);
    for ray in 0..RAYS {
        let distance = state.floats(first("rt_HitDistance"))[ray];
        for axis in 0..3 {
            let start = state.floats(origin + axis)[ray];
            let way = state.floats(direction + axis)[ray];
            state.floats_mut(point + axis)[ray] = start + distance * way;
        }
    }
}

/// Values outside of the range of a parameter: a little and far below, a little and far above.
fn outside(parameter: &Parameter) -> [Option<(String, Value)>; 4] {
    let bound = |key| match parameter.annotation(key)? {
        AnnotationValue::Constant(Constant::F32(value)) => Some(*value),
        AnnotationValue::Constant(Constant::I32(value)) => Some(*value as f32),
        _ => None,
    };
    let (least, greatest) = (bound("min"), bound("max"));
    let whole = matches!(parameter.ty.value_type(), ParameterType::Scalar(Scalar::I32));
    let step = if whole { 1.0 } else { 0.01 };
    let numbers = [
        least.map(|least| least - step),
        least.map(|least| least - 1.0 - least.abs()),
        greatest.map(|greatest| greatest + step),
        greatest.map(|greatest| 1.5 * greatest.abs() + 1.0),
    ];
    numbers.map(|number| {
        let number = number?;
        let value = match parameter.ty.value_type() {
            ParameterType::Scalar(Scalar::F32) => Value::Float(number),
            ParameterType::Scalar(Scalar::I32) => Value::Int(number as i32),
            ParameterType::Color => Value::from([number; 3]),
            _ => return None,
        };
        Some((parameter.name.clone(), value))
    })
}

/// Sets of parameters outside of their ranges: all parameters together, in long runs each one alone.
fn cases(class: &Class) -> Vec<Vec<(String, Value)>> {
    let all: Vec<[Option<(String, Value)>; 4]> = class.parameters.iter().map(outside).collect();
    let together = (0..4).map(|way| all.iter().filter_map(|it| it[way].clone()).collect());
    let together: Vec<Vec<(String, Value)>> = together.collect();
    let alone = all.iter().flatten().flatten().map(|it| vec![it.clone()]);
    let alone = alone.filter(|_| seeds().end > 1);
    together.into_iter().filter(|it| !it.is_empty()).chain(alone).collect()
}

/// Returns the results that are not finite of a class with parameters outside of their ranges. Kernels are those of
/// other checks, if somebody has the program.
pub fn problems(engine: &Engine, class: &Arc<Class>) -> String {
    let given = table(&class.name).into_iter().next().unwrap_or_default();
    let defaults = settings(class, &[]).into_iter().next().expect("the defaults");
    let Ok(usual) = defaults.instance(class, &given) else { return String::new() };
    let _program = engine.program(&usual);
    let mut all = String::new();
    for case in cases(class) {
        let is_other = |(name, _): &&(String, Value)| case.iter().all(|(own, _)| own != name);
        let others = given.iter().filter(is_other).cloned();
        let arguments: Vec<(String, Value)> = others.chain(case.iter().cloned()).collect();
        let instance = defaults.instance(class, &arguments);
        let instance = instance.unwrap_or_else(|it| panic!("{} with {case:?}: {it:?}", class.name));
        assert_eq!(instance.outside_range().len(), case.len(), "{} with {case:?}", class.name);
        for problem in not_finite(engine, &instance) {
            all += &format!("{} with {case:?}: {problem}\n", class.name);
        }
    }
    all
}
