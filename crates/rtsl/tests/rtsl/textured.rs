//! Parameters that are a value or a texture, on all backends: values, textures, ranges, constructors, what instances
//! share, and what hosts may set.

use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    CallArguments, CallMode, Engine, Instance, Instances, LaneMask, Method, Unit, Value,
    lookup_state, new_state, type_name,
};

use crate::common::{engines, new, unit};

/// Rays of a call: not a multiple of any width but 1.
const COUNT: usize = 37;

const TEXT: &str = "
class Ramp : rt_Texture;
public float scale = 1.0;
void lookup() {
    rt_FloatTextureValue = rt_TextureUV.x * scale;
    rt_TextureColor = color(vec3(rt_TextureUV, 0.5) * scale);
}

class Varnish : rt_Material;
[[min 0.1, max 0.9]] public texture float roughness = 0.3;
public texture color tint = color(0.25, 0.5, 0.75);
public texture vec3 axis = vec3(1.0, 2.0, 3.0);
private float fixedWidth;
float width(float rough) { return sqrt(rough) + 1.0; }
constructor() { if (!isTextured(roughness)) fixedWidth = width(roughness); }
float widthHere() { return isTextured(roughness) ? width(roughness) : fixedWidth; }
void shade() {
    color sum = color(widthHere(), roughness, axis.y);
    if (rt_TextureUV.y > 0.5) sum += tint * roughness;
    for (int i = 0; i < int(4.0 * rt_TextureUV.y); i++) sum += tint;
    rt_SampleColor = sum;
}

class Plain : rt_Material;
public float roughness = 0.3;
void shade() { rt_SampleColor = color(roughness * roughness); }

class Either : rt_Material;
public texture float roughness = 0.3;
void shade() { rt_SampleColor = color(roughness * roughness); }

class Computed : Varnish {
    public texture vec3 axis = vec3(7.0, 8.0, 9.0);
    float roughness() { return 2.0 * rt_TextureUV.x; }
    color tint() { return color(vec3(rt_TextureUV, 0.5)); }
};

class NotANumber : rt_Texture;
void lookup() { rt_FloatTextureValue = sqrt(rt_TextureUV.x - 10.0); }
";

fn ramp(unit: &Unit, scale: f32) -> Value {
    new(unit, "Ramp", vec![("scale", scale.into())]).into()
}

fn uv(ray: usize) -> [f32; 2] {
    [ray as f32 * 0.03125, (ray % 8) as f32 * 0.125]
}

/// The colours of rays with different texture coordinates; those outside of the mask are zero.
fn shade(engine: &Engine, instance: &Instance, mask: &LaneMask) -> Vec<[f32; 3]> {
    let program = engine.program(instance);
    let kernel = program.kernel(Method::Shade, CallMode::Packet).unwrap();
    let mut state = new_state(COUNT);
    let first = lookup_state("rt_TextureUV").unwrap().first_component as usize;
    let [us, vs] = state.vectors_mut::<2>(first);
    for ray in 0..COUNT {
        [us[ray], vs[ray]] = uv(ray);
    }
    let _ = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut program.new_scratch(COUNT),
        count: COUNT,
        mask: Some(mask),
        accepted: None,
        instances: Instances::One(&program.block(instance)),
        host: &mut NoHost,
    });
    let color = lookup_state("rt_SampleColor").unwrap().first_component as usize;
    (0..COUNT).map(|ray| [0, 1, 2].map(|it| state.floats(color + it)[ray])).collect()
}

/// The colour that `Varnish` computes for a ray.
fn varnish(ray: usize, textured: [bool; 3]) -> [f32; 3] {
    let [u, v] = uv(ray);
    let roughness = if textured[0] { (2.0 * u).clamp(0.1, 0.9) } else { 0.3 };
    let tint = if textured[1] { [u, v, 0.5] } else { [0.25, 0.5, 0.75] };
    let axis = if textured[2] { v } else { 2.0 };
    let mut sum = [f32::sqrt(roughness) + 1.0, roughness, axis];
    if v > 0.5 {
        sum = std::array::from_fn(|it| sum[it] + tint[it] * roughness);
    }
    for _ in 0..(4.0 * v) as i32 {
        sum = std::array::from_fn(|it| sum[it] + tint[it]);
    }
    sum
}

#[test]
fn each_parameter_is_a_value_or_a_texture() {
    let unit = unit(TEXT);
    for number in 0..8 {
        let textured = [1, 2, 4].map(|bit| number & bit != 0);
        let given = [("roughness", 2.0), ("tint", 1.0), ("axis", 1.0)];
        let given = given.into_iter().zip(textured).filter(|(_, is_textured)| *is_textured);
        let given = given.map(|((name, scale), _)| (name, ramp(&unit, scale))).collect();
        let instance = new(&unit, "Varnish", given);
        let mask = LaneMask::from_fn(COUNT, |ray| ray % 3 != number % 3);
        let expected: Vec<[f32; 3]> = (0..COUNT)
            .map(|ray| if mask.get(ray) { varnish(ray, textured) } else { [0.0; 3] })
            .collect();
        for engine in engines() {
            let found = shade(&engine, &instance, &mask);
            let same = found
                .iter()
                .zip(&expected)
                .all(|(a, b)| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-6 * b.abs()));
            assert!(same, "{textured:?} at width {}: {found:?}, not {expected:?}", engine.width());
            assert_eq!(found, shade(&engines()[0], &instance, &mask));
        }
    }
}

#[test]
fn functions_of_classes_below_compute_parameters() {
    let unit = unit(TEXT);
    let types = |class: &str| -> Vec<String> {
        unit.class(class).unwrap().parameters.iter().map(|it| it.name.clone()).collect()
    };
    assert_eq!(types("Computed"), ["axis"]);
    let given = vec![
        ("roughness", ramp(&unit, 2.0)),
        ("tint", ramp(&unit, 1.0)),
        ("axis", [7.0, 8.0, 9.0].into()),
    ];
    let textured = new(&unit, "Varnish", given);
    let computed = new(&unit, "Computed", vec![]);
    let other = new(&unit, "Computed", vec![("axis", [0.0, 1.0, 0.0].into())]);
    let mask = LaneMask::from_fn(COUNT, |ray| ray % 5 != 0);
    for engine in engines() {
        let expected = shade(&engine, &textured, &mask);
        assert_eq!(shade(&engine, &computed, &mask), expected, "width {}", engine.width());
        assert_ne!(shade(&engine, &other, &mask), expected);
        assert_eq!(expected, shade(&engines()[0], &computed, &mask));
    }
}

/// The code for a value is that of an ordinary member.
#[test]
fn a_value_costs_what_a_member_costs() {
    let unit = unit(TEXT);
    let code = |class: &str, arguments| {
        let instance = new(&unit, class, arguments);
        let method = engines()[0].program(&instance).method(Method::Shade).unwrap();
        let mut function = (*method.function).clone();
        function.renumber();
        function.to_string().replace(class, "Class")
    };
    let member = code("Plain", vec![]);
    assert_eq!(code("Either", vec![]), member);
    assert_eq!(code("Either", vec![("roughness", 0.5.into())]), member);
    let textured = code("Either", vec![("roughness", ramp(&unit, 1.0))]);
    // Two reads are one lookup.
    assert_eq!(textured.matches("rt_TextureUV@").count(), 1, "{textured}");
    assert!(!textured.contains("member:roughness@"), "{textured}");
}

#[test]
fn instances_with_other_textures_have_other_programs() {
    let unit = unit(TEXT);
    let engine = &engines()[0];
    let program = |value: Value| engine.program(&new(&unit, "Either", vec![("roughness", value)]));
    let values = [program(0.1.into()), program(0.2.into())];
    let textures = [program(ramp(&unit, 1.0)), program(ramp(&unit, 2.0))];
    assert!(Arc::ptr_eq(&values[0], &values[1]));
    assert!(Arc::ptr_eq(&textures[0], &textures[1]));
    assert!(!Arc::ptr_eq(&values[0], &textures[0]));
}

/// The range of a texture is the parameter's. NaN becomes the least value.
#[test]
fn textures_stay_in_the_range_of_the_parameter() {
    let unit = unit(TEXT);
    let mask = LaneMask::from_fn(COUNT, |_| true);
    for (texture, expected) in [
        (ramp(&unit, 1000.0), [0.1, 0.9]),
        (ramp(&unit, -1.0), [0.1, 0.1]),
        (new(&unit, "NotANumber", vec![]).into(), [0.1, 0.1]),
    ] {
        let instance = new(&unit, "Varnish", vec![("roughness", texture)]);
        for engine in engines() {
            let found = shade(&engine, &instance, &mask);
            assert_eq!([found[0][1], found[1][1]], expected);
        }
    }
}

#[test]
fn hosts_set_numbers_or_textures_and_the_last_counts() {
    let unit = unit(TEXT);
    let class = unit.class("Varnish").unwrap();
    let types: Vec<String> = class.parameters.iter().map(|it| type_name(&it.ty)).collect();
    assert_eq!(types, ["texture float", "texture color", "texture vec3"]);
    let (texture, mask) = (ramp(&unit, 1.0), LaneMask::from_fn(COUNT, |_| true));
    let first = new(&unit, "Either", vec![("roughness", texture.clone()), ("roughness", 2.into())]);
    let last = new(&unit, "Either", vec![("roughness", 2.into()), ("roughness", texture)]);
    assert_eq!(shade(&engines()[0], &first, &mask)[8], [4.0; 3]);
    assert_eq!(shade(&engines()[0], &last, &mask)[8], [0.0625; 3]);
    assert!(last.unset_reference_warnings(None).is_empty());
    let messages = |value: Value| -> Vec<String> {
        let problems = Instance::new(class, [("roughness", value)]).unwrap_err();
        problems.iter().map(|it| format!("{}: {}", it.code, it.message)).collect()
    };
    assert_eq!(
        messages([0.5, 0.5].into()),
        [
            "E0503: the parameter `roughness` of `Varnish` is a float or a texture, found a list of 2 values"
        ]
    );
    assert_eq!(
        messages(f32::NAN.into()),
        [
            "E0504: the parameter `roughness` of `Varnish` is out of range: NaN is not between 0.1 and 0.9"
        ]
    );
    let outside = new(&unit, "Varnish", vec![("roughness", 0.95.into())]);
    assert_eq!(
        outside.outside_range()[0].warning.message,
        "the parameter `roughness` of `Varnish` is outside of its range: 0.95 is not between 0.1 and 0.9"
    );
    assert_eq!(
        messages(new(&unit, "Plain", vec![]).into()),
        ["E0506: the parameter `roughness` of `Varnish` is a texture, and `Plain` is none"]
    );
}
