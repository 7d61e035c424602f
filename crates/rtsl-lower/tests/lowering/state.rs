//! State variables: inputs, outputs and defaults.

use rtsl_spec::Method;

use crate::harness::{Machine, class, count, text_of};

fn run(text: &str, method: Method, state: &[(&str, &[f32])]) -> Machine {
    let class = class(text);
    let mut machine = Machine::instance(&class);
    for (name, values) in state {
        machine.set_state(name, values);
    }
    machine.run(&class.methods[&method]);
    machine
}

#[test]
fn outputs_left_unset_hold_their_defaults() {
    let machine = run(
        "class C : rt_Camera; void generateRay() {}",
        Method::GenerateRay,
        &[("rt_Epsilon", &[0.5]), ("rt_HitDistance", &[9.0])],
    );
    assert_eq!(machine.state("rt_RayDirection"), [0.0, 0.0, 1.0]);
    assert_eq!(machine.state("rt_SampleColor"), [1.0, 1.0, 1.0]);
    assert_eq!(machine.state("rt_Epsilon"), [0.5], "inout keeps the host's value");
    assert_eq!(machine.state("rt_HitDistance"), [9.0]);
}

#[test]
fn reading_an_output_reads_its_default() {
    let text = "class C : rt_Camera;
        void generateRay() { rt_RayOrigin = rt_RayDirection + 1.0; rt_RayDirection.x = 4.0; }";
    let machine = run(text, Method::GenerateRay, &[]);
    assert_eq!(machine.state("rt_RayOrigin"), [1.0, 1.0, 2.0]);
    assert_eq!(machine.state("rt_RayDirection"), [4.0, 0.0, 1.0]);
}

#[test]
fn texture_color_and_float_default_to_each_other() {
    let lookup = |body: &str| {
        let text = format!("class T : rt_Texture; void lookup() {{ {body} }}");
        let machine = run(&text, Method::Lookup, &[("rt_TextureUV", &[2.0, 0.0])]);
        (machine.state("rt_TextureColor"), machine.state("rt_FloatTextureValue")[0])
    };
    assert_eq!(lookup(""), (vec![0.0; 3], 0.0));
    assert_eq!(lookup("rt_FloatTextureValue = 3.0;"), (vec![3.0; 3], 3.0));
    let (color, value) = lookup("rt_TextureColor = color(1.0, 0.0, 0.0);");
    assert_eq!(color, [1.0, 0.0, 0.0]);
    assert!(value > 0.2 && value < 0.22, "{value}");
    let both = "rt_TextureColor = color(1.0); rt_FloatTextureValue = 7.0;";
    assert_eq!(lookup(both), (vec![1.0; 3], 7.0));
    let sometimes =
        "if (rt_TextureUV.x > 1.0) rt_FloatTextureValue = 5.0; else rt_TextureColor = color(2.0);";
    assert_eq!(lookup(sometimes), (vec![5.0; 3], 5.0));
    let read = "rt_FloatTextureValue = 4.0; color c = rt_TextureColor; rt_TextureColor = c * 2.0;";
    assert_eq!(lookup(read), (vec![8.0; 3], 4.0));
    let in_loop =
        "for (int i = 0; i < 3; i++) { rt_TextureColor *= 2.0; rt_TextureColor += color(1.0); }";
    assert_eq!(lookup(in_loop).0, [7.0; 3]);
    let late = "for (int i = 0; i < 3; i++) { if (i == 2) rt_FloatTextureValue = rgb(rt_TextureColor).x + 1.0; }";
    assert_eq!(lookup(late), (vec![1.0; 3], 1.0));
}

#[test]
fn the_shading_normal_follows_the_geometric_one() {
    let normals = |body: &str| {
        let text = format!("class P : rt_Primitive; void computeNormal() {{ {body} }}");
        let machine = run(&text, Method::ComputeNormal, &[("rt_HitPoint", &[1.0, 2.0, 3.0])]);
        (machine.state("rt_GeometricNormal"), machine.state("rt_ShadingNormal"))
    };
    assert_eq!(normals(""), (vec![0.0, 0.0, 1.0], vec![0.0, 0.0, 1.0]));
    let (geometric, shading) = normals("rt_GeometricNormal = rt_HitPoint;");
    assert_eq!(geometric, shading);
    let (_, shading) = normals("rt_GeometricNormal = rt_HitPoint; rt_ShadingNormal.y = 9.0;");
    assert_eq!(shading, [1.0, 9.0, 3.0], "a part written keeps the rest of the default");
    let (_, shading) = normals("rt_ShadingNormal.y = 9.0; rt_GeometricNormal = rt_HitPoint;");
    assert_eq!(shading, [0.0, 9.0, 1.0]);
}

#[test]
fn defaults_of_the_surface() {
    let text =
        "class P : rt_Primitive; void computeTextureCoordinates() {} void computeDerivatives() {}";
    let machine =
        run(text, Method::ComputeTextureCoordinates, &[("rt_HitPoint", &[1.0, 2.0, 3.0])]);
    assert_eq!(machine.state("rt_TextureUVW"), [1.0, 2.0, 3.0]);
    let normal = [0.6f32, 0.0, 0.8];
    let machine = run(text, Method::ComputeDerivatives, &[("rt_GeometricNormal", &normal)]);
    let (u, v) = (machine.state("rt_dPdu"), machine.state("rt_dPdv"));
    let dot = |a: &[f32], b: &[f32]| -> f32 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    assert!(
        dot(&u, &normal).abs() < 1e-6 && dot(&v, &normal).abs() < 1e-6 && dot(&u, &v).abs() < 1e-6
    );
    assert!((dot(&u, &u) - 1.0).abs() < 1e-5 && (dot(&v, &v) - 1.0).abs() < 1e-5);
    assert_eq!(machine.state("rt_dsdu"), [1.0]);
}

#[test]
fn variables_written_at_once_need_no_flag() {
    let text = "class T : rt_Texture;
        void lookup() { rt_TextureColor = color(rt_TextureUV.x); rt_FloatTextureValue = 1.0; }";
    let text = text_of(&class(text), Method::Lookup);
    assert_eq!(count(&text, "select") + count(&text, "if"), 0, "{text}");
}

#[test]
fn state_that_a_method_does_not_have_is_a_local() {
    let text = "class M : rt_Material;
        void shade() { rt_EmissionColor += color(2.0); emission(); rt_SampleColor = rt_EmissionColor; }
        void emission() { rt_EmissionColor *= 3.0; }
        void BSDF() {}";
    let class = class(text);
    let machine = run(text, Method::Shade, &[("rt_EmissionColor", &[50.0; 3])]);
    assert_eq!(machine.state("rt_SampleColor"), [6.0; 3]);
    let shade = text_of(&class, Method::Shade);
    assert!(!shade.contains("state rt_EmissionColor"), "{shade}");
    assert_eq!(class.methods.len(), 5, "the missing ones are implied");
}

#[test]
fn interface_methods_share_the_state_of_their_caller() {
    let text = "class M : rt_Material;
        void BSDF() { rt_BSDFValue = color(rt_LightDirection.x); }
        void sampleBSDF() { rt_LightDirection = vec3(0.5); rt_PDF = 2.0; BSDF(); rt_BSDFValue *= 2.0; }";
    let machine = run(text, Method::SampleBsdf, &[]);
    assert_eq!(machine.state("rt_BSDFValue"), [1.0; 3]);
    assert_eq!(machine.state("rt_LightDirection"), [0.5; 3]);
    assert_eq!(machine.state("rt_PDF"), [2.0]);
}

#[test]
fn inputs_may_be_indexed_dynamically() {
    let text = "class P : rt_Primitive;
        void computeBounds() { int a = dominantAxis(vec3(1.0, 3.0, 2.0)); rt_BoundMin[a] = 1.0; }
        void computeNormal() { rt_GeometricNormal = vec3(rt_HitPoint[dominantAxis(rt_HitPoint)]); }";
    let machine = run(text, Method::ComputeNormal, &[("rt_HitPoint", &[1.0, -7.0, 3.0])]);
    assert_eq!(machine.state("rt_GeometricNormal"), [-7.0; 3]);
    let machine = run(text, Method::ComputeBounds, &[]);
    assert_eq!(machine.state("rt_BoundMin"), [f32::NEG_INFINITY, 1.0, f32::NEG_INFINITY]);
}

#[test]
fn a_class_with_two_roles_has_both_tables() {
    let text = "class Bulb : rt_Primitive, rt_Material {
        scratch float seen;
        void intersect() { if (hit(1.0)) seen = 2.0; }
        void emission() { rt_EmissionColor = color(seen) * rt_HitPoint.x; }
    }";
    let class = class(text);
    let mut machine = Machine::instance(&class);
    machine.set(rtsl_ir::VariableKind::Scratch, "seen", &[3.0]);
    machine.set_state("rt_HitPoint", &[5.0, 0.0, 0.0]);
    machine.run(&class.methods[&Method::Emission]);
    assert_eq!(machine.state("rt_EmissionColor"), [15.0; 3]);
}
