//! Calls of other shaders with arguments for state variables, on all backends.

use rtsl::host::NoHost;
use rtsl::{
    CallArguments, CallMode, Engine, Instance, Instances, LaneMask, Method, Unit, Value,
    lookup_state, new_state,
};

use crate::common::{component, engines, new, unit};

/// Rays of a call: not a multiple of any width but 1.
const COUNT: usize = 37;

const TEXT: &str = "
class Coordinates : rt_Texture;
void lookup() { rt_TextureColor = color(vec3(rt_TextureUV, rt_HitPoint.x + rt_TextureUVW.y)); }

class Seen : rt_Material;
public rt_Texture kd;
void BSDF() {
    rt_BSDFValue = color(dot(rt_ShadingNormal, rt_LightDirection), rt_RayDirection.x, rt_InverseRayDirection.x)
        + kd.lookup();
}
void evaluatePDF() { rt_PDF = rt_LightDirection.z + 10.0 * rt_dPdu.y; }
void sampleBSDF() {
    rt_LightDirection = rt_BSDFSeed + rt_ShadingNormal;
    rt_PDF = 0.5;
    rt_BSDFValue = color(rt_BSDFSeed.z);
}
void shade() { rt_SampleColor = color(rt_ShadingNormal); }
void emission() { rt_EmissionColor = color(rt_RayDirection.z); }

// Asks its base for another place: what it passes reaches the base's texture, and through `Between`.
class Wrapper : rt_Material;
public rt_Material base;
vec3 turned() { return rt_ShadingNormal.yzx + vec3(rt_TextureUV.x); }
void BSDF() {
    rt_BSDFValue = base.BSDF(
        rt_ShadingNormal = turned(),
        rt_LightDirection = vec3(1.0, 2.0, rt_TextureUV.y),
        rt_RayDirection = vec3(4.0),
        rt_TextureUV = rt_TextureUV * 2.0,
        rt_TextureUVW = vec3(0.0, rt_TextureUV.x, 0.0),
        rt_HitPoint = vec3(8));
}
void evaluatePDF() { rt_PDF = base.evaluatePDF(rt_dPdu = vec3(rt_TextureUV, 1.0)) + base.evaluatePDF(); }
void sampleBSDF() {
    rt_BSDFValue = base.sampleBSDF(rt_BSDFSeed = vec3(rt_TextureUV, 0.25), rt_ShadingNormal = vec3(1.0));
}
void shade() { rt_SampleColor = base.shade(rt_ShadingNormal = turned()) + base.shade(); }
void emission() { rt_EmissionColor = base.emission(rt_RayDirection = vec3(0.0, 0.0, rt_TextureUV.x)); }

class Between : rt_Material;
public rt_Material base;
void BSDF() { rt_BSDFValue = base.BSDF() + base.BSDF(rt_TextureUV = vec2(100.0)); }

class Shifted : rt_Material;
public rt_Texture height;
void BSDF() {
    vec2 uv = rt_TextureUV + vec2(0.5, 0.0);
    rt_BSDFValue = height.lookup(uv, rt_HitPoint = vec3(2.0)) - height.lookup(rt_TextureUV = uv);
}

// Textures see the surface and the ray, and their filter.
class Facing : rt_Texture;
void lookup() { rt_TextureColor = color(rt_ShadingNormal.y * rt_RayDirection + rt_GeometricNormal); }
class Filtered : rt_Texture;
void lookup() {
    vec2 along = rt_du * vec2(rt_dsdu, rt_dtdu);
    vec2 across = rt_dv * vec2(rt_dsdv, rt_dtdv);
    rt_TextureColor = color(rt_TextureUV.x + along.x, along.y + across.x, across.y);
    rt_FloatTextureValue = rt_du + 10.0 * rt_dv;
}
class Looking : rt_Material;
public rt_Texture kd;
void BSDF() { rt_BSDFValue = kd.lookup() + kd.lookup(rt_ShadingNormal = vec3(0.0, 4.0, 0.0)); }
class Wide : rt_Material;
public rt_Texture kd;
public texture color tint = color(0.0);
void BSDF() { rt_BSDFValue = kd.lookup(rt_TextureUV, 0.5, rt_TextureUV.x) + kd.lookup() + tint; }
void evaluatePDF() { rt_PDF = kd.lookupFloat(vec2(0.0), 2, 3) + kd.lookupFloat(vec2(1.0), rt_du = 1.0); }
";

fn seen(unit: &Unit) -> Value {
    let kd = new(unit, "Coordinates", vec![]).into();
    new(unit, "Seen", vec![("kd", kd)]).into()
}

fn uv(ray: usize) -> [f32; 2] {
    [ray as f32 * 0.25, (ray % 4) as f32 * 0.5]
}

/// The components of an output, for rays with texture coordinates; zero for the first of each five, which is masked.
fn call(engine: &Engine, instance: &Instance, method: Method, output: &str) -> Vec<[f32; 3]> {
    let program = engine.program(instance);
    let kernel = program.kernel(method, CallMode::Packet).unwrap();
    let mut state = new_state(COUNT);
    let mut set = |name: &str, values: &dyn Fn(usize) -> Vec<f32>| {
        for ray in 0..COUNT {
            for (index, value) in values(ray).into_iter().enumerate() {
                state.floats_mut(component(name) + index)[ray] = value;
            }
        }
    };
    set("rt_TextureUV", &|ray| uv(ray).to_vec());
    set("rt_ShadingNormal", &|ray| vec![1.0, 2.0, ray as f32]);
    set("rt_RayDirection", &|_| vec![0.5, 0.25, 1.0]);
    set("rt_InverseRayDirection", &|_| vec![2.0, 4.0, 1.0]);
    set("rt_GeometricNormal", &|ray| vec![0.0, ray as f32, 0.0]);
    set("rt_du", &|_| vec![0.125]);
    set("rt_dv", &|_| vec![0.25]);
    if method != Method::SampleBsdf {
        set("rt_LightDirection", &|_| vec![3.0, 5.0, 7.0]);
    }
    let mask = LaneMask::from_fn(COUNT, |ray| !ray.is_multiple_of(5));
    let _ = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut program.new_scratch(COUNT),
        count: COUNT,
        mask: Some(&mask),
        accepted: None,
        instances: Instances::One(&program.block(instance)),
        host: &mut NoHost,
    });
    let components = lookup_state(output).unwrap().ty.components() as usize;
    let of = |ray: usize| -> [f32; 3] {
        std::array::from_fn(|it| match it < components && !ray.is_multiple_of(5) {
            true => state.floats(component(output) + it)[ray],
            false => 0.0,
        })
    };
    (0..COUNT).map(of).collect()
}

fn check(
    instance: &Instance,
    method: Method,
    output: &str,
    expected: impl Fn([f32; 2], f32) -> [f32; 3],
) {
    let expected: Vec<[f32; 3]> = (0..COUNT)
        .map(|ray| if !ray.is_multiple_of(5) { expected(uv(ray), ray as f32) } else { [0.0; 3] })
        .collect();
    for engine in engines() {
        let found = call(&engine, instance, method, output);
        assert_eq!(found, expected, "{} at width {}", method.name(), engine.width());
    }
}

#[test]
fn the_callee_sees_the_arguments_and_else_the_state_of_the_caller() {
    let unit = unit(TEXT);
    let wrapper = new(&unit, "Wrapper", vec![("base", seen(&unit))]);
    check(&wrapper, Method::Bsdf, "rt_BSDFValue", |[u, v], number| {
        // The normal (1, 2, n) turned is (2, n, 1).
        let cosine = (2.0 + u) + (number + u) * 2.0 + (1.0 + u) * v;
        [cosine + 2.0 * u, 4.0 + 2.0 * v, 0.25 + (8.0 + u)]
    });
    check(&wrapper, Method::EvaluatePdf, "rt_PDF", |[_, v], _| [7.0 + 10.0 * v + 7.0, 0.0, 0.0]);
    check(&wrapper, Method::SampleBsdf, "rt_BSDFValue", |_, _| [0.25; 3]);
    check(&wrapper, Method::SampleBsdf, "rt_LightDirection", |[u, v], _| [u + 1.0, v + 1.0, 1.25]);
    check(&wrapper, Method::SampleBsdf, "rt_PDF", |_, _| [0.5, 0.0, 0.0]);
    check(&wrapper, Method::Shade, "rt_SampleColor", |[u, _], number| {
        [2.0 + u + 1.0, number + u + 2.0, 1.0 + u + number]
    });
    check(&wrapper, Method::Emission, "rt_EmissionColor", |[u, _], _| [u; 3]);
}

#[test]
fn arguments_reach_what_the_callee_calls() {
    let unit = unit(TEXT);
    let between = new(&unit, "Between", vec![("base", seen(&unit))]);
    let wrapper = new(&unit, "Wrapper", vec![("base", between.into())]);
    check(&wrapper, Method::Bsdf, "rt_BSDFValue", |[u, v], number| {
        let cosine = (2.0 + u) + (number + u) * 2.0 + (1.0 + u) * v;
        let last = 0.25 + (8.0 + u);
        [(cosine + 2.0 * u) + (cosine + 100.0), (4.0 + 2.0 * v) + 104.0, last + last]
    });
}

#[test]
fn textures_are_looked_up_elsewhere() {
    let unit = unit(TEXT);
    let height = new(&unit, "Coordinates", vec![]).into();
    let shifted = new(&unit, "Shifted", vec![("height", height)]);
    check(&shifted, Method::Bsdf, "rt_BSDFValue", |_, _| [0.0, 0.0, 2.0]);
}

#[test]
fn textures_see_the_surface_and_the_ray() {
    let unit = unit(TEXT);
    let kd = new(&unit, "Facing", vec![]).into();
    let looking = new(&unit, "Looking", vec![("kd", kd)]);
    // The normals are (1, 2, n) and (0, n, 0), and the ray's direction (0.5, 0.25, 1).
    check(&looking, Method::Bsdf, "rt_BSDFValue", |_, number| [3.0, 1.5 + 2.0 * number, 6.0]);
}

#[test]
fn lookups_may_give_the_widths_of_the_filter() {
    let unit = unit(TEXT);
    let filtered = || new(&unit, "Filtered", vec![]).into();
    let wide = new(&unit, "Wide", vec![("kd", filtered()), ("tint", filtered())]);
    // Widths that a call does not give are those of the caller.
    check(&wide, Method::Bsdf, "rt_BSDFValue", |[u, _], _| [3.0 * u + 0.75, 0.0, u + 0.5]);
    check(&wide, Method::EvaluatePdf, "rt_PDF", |_, _| [32.0 + (1.0 + 2.5), 0.0, 0.0]);
}
