//! The library's materials on top of others, against formulas: normal maps, bumps, sides and holes over a matte base.

use std::f32::consts::PI;
use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    CallArguments, CallMode, Compiler, Engine, EngineOptions, Instance, Instances, LaneBlock,
    Method, Value, library, lookup_state, new_state,
};

/// A light to either side of the surface, neither along the normal.
const LIGHT: [f32; 3] = [0.48, -0.6, 0.64];
pub const VIEW: [f32; 3] = [0.0, 0.6, 0.8];

pub fn of_library(class: &str, arguments: Vec<(&str, Value)>) -> Arc<Instance> {
    let unit = library::unit_of_class(&Compiler::default(), class).unwrap();
    Instance::new(unit.class(class).unwrap(), arguments).unwrap()
}

fn of_text(text: &str) -> Value {
    let unit = Compiler::default().compile("texture.rtsl", text).unit.unwrap();
    Instance::new(&unit.classes()[0], []).unwrap().into()
}

fn white() -> Value {
    of_library("Lambertian", vec![("kd", 1.0.into())]).into()
}

pub fn component(name: &str) -> usize {
    lookup_state(name).unwrap().first_component as usize
}

/// A call at a surface with the normal z, derivatives of lengths 2 and 3, seen from `view`.
pub fn call(
    instance: &Instance,
    method: Method,
    view: [f32; 3],
    more: &[(&str, &[f32])],
) -> LaneBlock {
    let (engine, _) = Engine::new(EngineOptions::default()).unwrap();
    let program = engine.program(instance);
    let mut state = new_state(1);
    let mut set = |name: &str, values: &[f32]| {
        for (index, value) in values.iter().enumerate() {
            state.floats_mut(component(name) + index)[0] = *value;
        }
    };
    set("rt_RayDirection", &view.map(|it| -it));
    set("rt_GeometricNormal", &[0.0, 0.0, 1.0]);
    set("rt_ShadingNormal", &[0.0, 0.0, 1.0]);
    set("rt_dPdu", &[2.0, 0.0, 0.0]);
    set("rt_dPdv", &[0.0, 3.0, 0.0]);
    set("rt_LightDirection", &LIGHT);
    more.iter().for_each(|(name, values)| set(name, values));
    let _ = program.kernel(method, CallMode::Packet).unwrap().call(CallArguments {
        state: &mut state,
        scratch: &mut program.new_scratch(1),
        count: 1,
        mask: None,
        accepted: None,
        instances: Instances::One(&program.block(instance)),
        host: &mut NoHost,
    });
    state
}

fn bsdf(instance: &Instance, view: [f32; 3], more: &[(&str, &[f32])]) -> f32 {
    call(instance, Method::Bsdf, view, more).floats(component("rt_BSDFValue"))[0]
}

fn close(found: f32, expected: f32) {
    assert!((found - expected).abs() <= 1e-5 * expected.abs().max(1e-3), "{found}, not {expected}");
}

/// The value of a white matte surface with this normal, which the renderer's cosine turns into that with this normal.
fn turned(normal: [f32; 3]) -> f32 {
    let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let length = dot(normal, normal).sqrt();
    (dot(LIGHT, normal) / length).abs() / LIGHT[2] / PI
}

#[test]
fn a_mapped_normal_is_that_of_the_base() {
    let map = |normal: [f32; 3], more: Vec<(&'static str, Value)>| {
        let stored: [f32; 3] = normal.map(|it| 0.5 * it + 0.5);
        let given = vec![("base", white()), ("normals", stored.into())];
        of_library("NormalMap", given.into_iter().chain(more).collect())
    };
    close(bsdf(&map([0.0, 0.0, 1.0], vec![]), VIEW, &[]), 1.0 / PI);
    close(bsdf(&map([0.5, 0.25, 0.75], vec![]), VIEW, &[]), turned([0.5, 0.25, 0.75]));
    let flatter = map([0.5, 0.25, 0.75], vec![("scale", 0.5.into())]);
    close(bsdf(&flatter, VIEW, &[]), turned([0.25, 0.125, 0.75]));
    // Mirrored coordinates: green follows v for glTF only.
    let mirrored: &[(&str, &[f32])] = &[("rt_dPdv", &[0.0, -3.0, 0.0])];
    close(bsdf(&map([0.5, 0.25, 0.75], vec![]), VIEW, mirrored), turned([0.5, 0.25, 0.75]));
    let along = map([0.5, 0.25, 0.75], vec![("alongV", true.into())]);
    close(bsdf(&along, VIEW, mirrored), turned([0.5, -0.25, 0.75]));
    close(bsdf(&along, VIEW, &[]), turned([0.5, 0.25, 0.75]));
    // No direction, and one below the surface, which is turned to its front.
    close(bsdf(&map([0.0, 0.0, 0.0], vec![]), VIEW, &[]), 1.0 / PI);
    close(bsdf(&map([0.5, 0.25, -0.75], vec![]), VIEW, &[]), turned([-0.5, -0.25, 0.75]));
    // A texture, looked up at the hit.
    let texture = of_text(
        "class Map : rt_Texture; void lookup() { rt_TextureColor = color(vec3(rt_TextureUV, 0.875)); }",
    );
    let textured = of_library("NormalMap", vec![("base", white()), ("normals", texture)]);
    let found = bsdf(&textured, VIEW, &[("rt_TextureUV", &[0.75, 0.625])]);
    close(found, turned([0.5, 0.25, 0.75]));
}

#[test]
fn bumps_have_the_slopes_of_their_height() {
    for text in [
        "rt_FloatTextureValue = 0.5 * rt_TextureUV.x - 0.25 * rt_TextureUV.y;",
        "rt_FloatTextureValue = 0.25 * rt_TextureUVW.x - 0.25 / 3.0 * rt_TextureUVW.y;",
        "rt_FloatTextureValue = 0.25 * rt_HitPoint.x - 0.25 / 3.0 * rt_HitPoint.y;",
    ] {
        let height = of_text(&format!("class Slope : rt_Texture; void lookup() {{ {text} }}"));
        let bump = |scale: f32| {
            let scale = ("scale", scale.into());
            of_library("Bump", vec![("base", white()), ("displacement", height.clone()), scale])
        };
        let wide: &[(&str, &[f32])] = &[("rt_du", &[0.25]), ("rt_dv", &[0.5])];
        // Along (2, 0, 0.5) and (0, 3, -0.25).
        close(bsdf(&bump(1.0), VIEW, wide), turned([-1.5, 0.5, 6.0]));
        close(bsdf(&bump(-2.0), VIEW, wide), turned([3.0, -1.0, 6.0]));
        let found = bsdf(&bump(1.0), VIEW, &[]);
        assert!((found - turned([-1.5, 0.5, 6.0])).abs() < 1e-3, "{found}");
        // With a tangent that leans to the normal, slopes are those along the surface.
        let leaning: &[(&str, &[f32])] = &[("rt_dPdu", &[2.0, 0.0, 1.0])];
        if text.contains("UV.x") {
            let both = [wide, leaning].concat();
            close(bsdf(&bump(1.0), VIEW, &both), turned([-1.5, 0.5, 6.0]));
        }
    }
    let flat = of_library("Bump", vec![("base", white())]);
    close(bsdf(&flat, VIEW, &[]), 1.0 / PI);
    let none: &[(&str, &[f32])] = &[("rt_dPdu", &[0.0; 3]), ("rt_dPdv", &[0.0; 3])];
    let slope =
        of_text("class S : rt_Texture; void lookup() { rt_FloatTextureValue = rt_TextureUV.x; }");
    let bump = of_library("Bump", vec![("base", white()), ("displacement", slope)]);
    close(bsdf(&bump, VIEW, none), 1.0 / PI);
}

#[test]
fn sides_have_materials_of_their_own() {
    let grey = |value: f32| of_library("Lambertian", vec![("kd", value.into())]).into();
    let both = of_library("TwoSided", vec![("front", grey(0.75)), ("back", grey(0.25))]);
    let behind = VIEW.map(|it| -it);
    let below: &[(&str, &[f32])] = &[("rt_LightDirection", &[0.48, -0.6, -0.64])];
    close(bsdf(&both, VIEW, &[]), 0.75 / PI);
    close(bsdf(&both, behind, below), 0.25 / PI);
    // A lamp that shines outward only shines on both sides.
    let lamp: Value = of_library("Emissive", vec![]).into();
    let emission = |instance: &Instance, view| {
        call(instance, Method::Emission, view, &[]).floats(component("rt_EmissionColor"))[0]
    };
    let lamps = of_library("TwoSided", vec![("front", lamp.clone())]);
    assert_eq!([emission(&lamps, VIEW), emission(&lamps, behind)], [1.0, 1.0]);
    let front = of_library("TwoSided", vec![("front", lamp), ("back", grey(0.5))]);
    assert_eq!([emission(&front, VIEW), emission(&front, behind)], [1.0, 0.0]);
}

#[test]
fn holes_are_where_the_material_is_absent() {
    let masked = of_library("Masked", vec![("base", white()), ("opacity", 0.25.into())]);
    let presence =
        |of: &Instance| call(of, Method::Presence, VIEW, &[]).floats(component("rt_Presence"))[0];
    close(presence(&masked), 0.25);
    // What there is looks as the base does.
    close(bsdf(&masked, VIEW, &[]), 1.0 / PI);
    let twice =
        of_library("Masked", vec![("base", masked.clone().into()), ("opacity", 0.5.into())]);
    close(presence(&twice), 0.125);
    let mixed = [("first", masked.into()), ("second", white()), ("amount", 0.5.into())];
    let mixed = of_library("Mix", mixed.into());
    close(presence(&mixed), 0.625);
    close(bsdf(&mixed, VIEW, &[]), 1.0 / PI);
}
