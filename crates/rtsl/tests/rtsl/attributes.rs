//! Attributes that shapes give and shaders read, and maps between the world and objects, on all backends.

use std::sync::Arc;

use rtsl::{
    ATTRIBUTES, Compiler, Engine, Instance, LaneBlock, Method, TO_OBJECT, TO_WORLD, Unit,
    new_state, set_defaults,
};

use crate::common::{call_packet, component, engines, new, unit};

const COUNT: usize = 19;

const TEXT: &str = "
class Dust : rt_Texture;
attribute color tint = color(0.5, 0.25, 1.0);
attribute float height = 0.125;
attribute float missing = 7.0;
void lookup() {
    rt_TextureColor = tint * height;
    rt_FloatTextureValue = missing + height;
}

class Dusty : rt_Material;
public rt_Texture dust;
attribute float height = 0.125;
attribute float level = 2.0;
void emission() { rt_EmissionColor = dust.lookup() + color(height, level, dust.lookupFloat()); }

// Gives one attribute by its method, one as a parameter, and one of another type, which is none.
class Hill : rt_Primitive;
public float height = 0.75;
public vec2 level = vec2(1.0);
attribute color tint;
void intersect() { hit(-rt_RayOrigin.z / rt_RayDirection.z); }
void computeNormal() { rt_GeometricNormal = vec3(0.0, 0.0, 1.0); }
void computeTextureCoordinates() { if (rt_HitPoint.x > 4.0) tint = color(rt_HitPoint); }

class Plain : rt_Primitive;
void intersect() { hit(-rt_RayOrigin.z / rt_RayDirection.z); }
void computeNormal() { rt_GeometricNormal = vec3(0.0, 0.0, 1.0); }

class Maps : rt_Texture;
void lookup() {
    vec3 all = pointToObject(rt_HitPoint) + 2.0 * vectorToObject(rt_HitPoint) + 4.0 * normalToObject(rt_HitPoint)
        + pointToWorld(rt_HitPoint) + 2.0 * vectorToWorld(rt_HitPoint) + 4.0 * normalToWorld(rt_HitPoint);
    rt_TextureColor = color(all);
}

// Shapes have no hit object: their textures read defaults, and maps are the identity.
class Bent : rt_Primitive;
public rt_Texture by;
void intersect() { hit(by.lookupFloat()); }
void computeNormal() { rt_GeometricNormal = rgb(by.lookup(rt_HitPoint = vec3(1.0, 2.0, 4.0))); }
";

fn dusty(unit: &Unit) -> Arc<Instance> {
    new(unit, "Dusty", vec![("dust", new(unit, "Dust", vec![]).into())])
}

/// Calls a method for rays whose hit points and hidden state differ.
fn call(engine: &Engine, instance: &Instance, method: Method) -> LaneBlock {
    let mut state = new_state(COUNT);
    set_defaults(&mut state, instance.class().roles[0]);
    for ray in 0..COUNT {
        let number = ray as f32;
        let mut set = |name: &str, values: &[f32]| {
            for (index, value) in values.iter().enumerate() {
                state.floats_mut(component(name) + index)[ray] = *value;
            }
        };
        set("rt_HitPoint", &[number, 2.0, 4.0]);
        if method == Method::Emission {
            set(ATTRIBUTES, &[number, 0.5, 2.0, 3.0 + number]);
        } else if method == Method::Lookup {
            set(TO_OBJECT, &[2.0, 0.0, 1.0, 0.0, 4.0, 0.0, 0.0, 0.0, 8.0, 1.0, 2.0, number]);
            set(TO_WORLD, &[1.0, 1.0, 0.0, 0.0, 2.0, 0.0, 3.0, 0.0, 1.0, number, 5.0, 6.0]);
        }
    }
    call_packet(engine, instance, method, &mut state);
    state
}

fn numbers(state: &LaneBlock, name: &str, count: usize, ray: usize) -> Vec<f32> {
    (0..count).map(|index| state.floats(component(name) + index)[ray]).collect()
}

#[test]
fn shaders_read_what_shapes_give() {
    let unit = unit(TEXT);
    let (dusty, hill, plain) =
        (dusty(&unit), new(&unit, "Hill", vec![]), new(&unit, "Plain", vec![]));
    let table = Instance::attributes([&*dusty], [&*hill, &*plain]).unwrap();
    assert_eq!(table.names().collect::<Vec<_>>(), ["height", "tint"]);
    let with = |instance: &Arc<Instance>| instance.with_attributes(&table);
    for engine in engines() {
        let (read, hills, planes) = (
            call(&engine, &with(&dusty), Method::Emission),
            call(&engine, &with(&hill), Method::ComputeTextureCoordinates),
            call(&engine, &with(&plain), Method::ComputeTextureCoordinates),
        );
        for ray in 0..COUNT {
            let n = ray as f32;
            let expected = [0.5 * n + n, 2.0 * n + 2.0, (3.0 + n) * n + (7.0 + n)];
            assert_eq!(numbers(&read, "rt_EmissionColor", 3, ray), expected);
            let tint = if n > 4.0 { [n, 2.0, 4.0] } else { [0.5, 0.25, 1.0] };
            // The primitive has a default of its own, black, where it sets nothing.
            let tint = if n > 4.0 { tint } else { [0.0; 3] };
            assert_eq!(numbers(&hills, ATTRIBUTES, 4, ray), [&[0.75][..], &tint].concat());
            assert_eq!(numbers(&planes, ATTRIBUTES, 4, ray), [0.125, 0.5, 0.25, 1.0]);
        }
    }
}

#[test]
fn attributes_that_nothing_gives_are_their_defaults() {
    let unit = unit(TEXT);
    let (dusty, hill) = (dusty(&unit), new(&unit, "Hill", vec![]));
    assert!(Instance::attributes([&*hill], [&*hill]).unwrap().is_empty());
    for engine in engines() {
        let read = call(&engine, &dusty, Method::Emission);
        let given = call(&engine, &hill, Method::ComputeTextureCoordinates);
        for ray in 0..COUNT {
            let color = numbers(&read, "rt_EmissionColor", 3, ray);
            assert_eq!(color, [0.0625 + 0.125, 0.03125 + 2.0, 0.125 + 7.125]);
            assert_eq!(numbers(&given, ATTRIBUTES, 4, ray), [0.0; 4]);
        }
    }
}

#[test]
fn programs_are_shared_by_instances_with_equal_lists() {
    let unit = unit(TEXT);
    let (dusty, hill) = (dusty(&unit), new(&unit, "Hill", vec![]));
    let table = || Instance::attributes([&*dusty], [&*hill]).unwrap();
    let engine = &engines()[0];
    let program = engine.program(&hill.with_attributes(&table()));
    assert!(Arc::ptr_eq(&program, &engine.program(&hill.with_attributes(&table()))));
    assert!(!Arc::ptr_eq(&program, &engine.program(&hill)));
}

#[test]
fn too_many_attributes_are_an_error() {
    let declared: String = (0..33).map(|it| format!("attribute float a{it};\n")).collect();
    let read: Vec<String> = (0..33).map(|it| format!("a{it}")).collect();
    let given: String = (0..33).map(|it| format!("public float a{it} = 1.0;\n")).collect();
    let text = format!(
        "class Reader : rt_Texture {{ {declared} void lookup() {{ rt_FloatTextureValue = {}; }} }};
         class Giver : rt_Primitive {{ {given} void intersect() {{ hit(1.0); }}
             void computeNormal() {{ rt_GeometricNormal = vec3(1.0); }} }};",
        read.join(" + ")
    );
    let unit = Compiler::default().compile("test.rtsl", &text).unit.unwrap();
    let (reader, giver) = (new(&unit, "Reader", vec![]), new(&unit, "Giver", vec![]));
    let error = Instance::attributes([&*reader], [&*giver]).unwrap_err();
    assert_eq!(error.code.to_string(), "E0512");
}

#[test]
fn points_vectors_and_normals_are_mapped() {
    let unit = unit(TEXT);
    let maps = new(&unit, "Maps", vec![]);
    for engine in engines() {
        let state = call(&engine, &maps, Method::Lookup);
        for ray in 0..COUNT {
            let n = ray as f32;
            // The rows of both linear parts, applied to (n, 2, 4), with the origins and the transposed parts.
            let (to_object, to_world) = ([2.0 * n, 8.0, n + 32.0], [n + 12.0, n + 4.0, 4.0]);
            let (by_world, by_object) = ([n + 2.0, 4.0, 3.0 * n + 4.0], [2.0 * n + 4.0, 8.0, 32.0]);
            let origins = [[1.0, 2.0, n], [n, 5.0, 6.0]];
            let expected: Vec<f32> = (0..3)
                .map(|axis| {
                    3.0 * to_object[axis]
                        + origins[0][axis]
                        + 4.0 * by_world[axis]
                        + 3.0 * to_world[axis]
                        + origins[1][axis]
                        + 4.0 * by_object[axis]
                })
                .collect();
            assert_eq!(numbers(&state, "rt_TextureColor", 3, ray), expected);
        }
    }
}

#[test]
fn textures_of_shapes_have_no_hit_object() {
    let unit = unit(TEXT);
    let maps = new(&unit, "Bent", vec![("by", new(&unit, "Maps", vec![]).into())]);
    let dust = new(&unit, "Bent", vec![("by", new(&unit, "Dust", vec![]).into())]);
    let hill = new(&unit, "Hill", vec![]);
    let table = Instance::attributes([&*dusty(&unit)], [&*hill]).unwrap();
    for engine in engines() {
        let state = call(&engine, &maps, Method::ComputeNormal);
        assert_eq!(numbers(&state, "rt_GeometricNormal", 3, 3), [14.0, 28.0, 56.0]);
        let state = call(&engine, &dust.with_attributes(&table), Method::ComputeNormal);
        assert_eq!(numbers(&state, "rt_GeometricNormal", 3, 3), [0.0625, 0.03125, 0.125]);
    }
}
