//! `illuminance` and rays.

use rtsl_spec::Method;

use crate::harness::{Machine, class};

fn shade(body: &str, lights: &[([f32; 3], [f32; 3])]) -> Machine {
    let text = format!("class M : rt_Material; void shade() {{ {body} }} void BSDF() {{}}");
    let class = class(&text);
    let mut machine = Machine::instance(&class);
    machine.lights = lights.to_vec();
    machine.set_state("rt_HitPoint", &[1.0, 2.0, 3.0]);
    machine.run(&class.methods[&Method::Shade]);
    machine
}

fn sampled(body: &str, lights: &[([f32; 3], [f32; 3])]) -> f32 {
    shade(body, lights).state("rt_SampleColor")[0]
}

const LIGHTS: &[([f32; 3], [f32; 3])] = &[
    ([0.0, 0.0, 1.0], [1.0; 3]),
    ([1.0, 0.0, 0.0], [10.0; 3]),
    ([0.0, 0.0, -1.0], [100.0; 3]),
    ([0.0, 0.6, 0.8], [1000.0; 3]),
];

#[test]
fn the_body_runs_for_each_light() {
    let body = "illuminance { rt_SampleColor += rt_LightColor * rt_LightDistance * rt_PDF; }";
    assert_eq!(sampled(body, LIGHTS), 1111.0);
    assert_eq!(sampled(body, &[]), 0.0);
    let machine = shade(body, LIGHTS);
    assert_eq!(machine.queries.len(), 4);
    assert_eq!(machine.queries[0].0, [1.0, 2.0, 3.0], "the hit point by default");
    assert_eq!(machine.queries[0].2, f32::NEG_INFINITY, "no cone by default");
}

#[test]
fn only_lights_in_the_cone() {
    let body =
        "illuminance(vec3(4.0), vec3(0.0, 0.0, 1.0), 0.7) { rt_SampleColor += rt_LightColor; }";
    assert_eq!(sampled(body, LIGHTS), 1001.0);
    let machine = shade(body, LIGHTS);
    assert_eq!(machine.queries[0].0, [4.0; 3]);
    let cosine = machine.queries[0].2;
    assert!((cosine - 0.764_842_2).abs() < 1e-6, "{cosine}");
}

#[test]
fn jumps_in_illuminance() {
    let body = "illuminance { if (rt_LightDirection.x > 0.5) continue; \
                if (rt_LightDirection.z < 0.0) break; rt_SampleColor += rt_LightColor; }";
    assert_eq!(sampled(body, LIGHTS), 1.0);
    let body =
        "illuminance() { rt_SampleColor += rt_LightColor; if (rt_LightDirection.x > 0.5) return; }
        rt_SampleColor = color(-1.0);";
    assert_eq!(sampled(body, LIGHTS), 11.0);
    assert_eq!(sampled(body, &[]), -1.0);
}

#[test]
fn the_light_is_gone_afterwards() {
    let body = "illuminance { rt_SampleColor += rt_LightColor; }
        rt_SampleColor += color(rt_LightDirection.z) + rt_LightColor;";
    assert_eq!(sampled(body, LIGHTS), 1112.0, "the default direction is (0, 0, 1)");
}

#[test]
fn helpers_see_the_light_and_its_loop() {
    let text = "class M : rt_Material;
        private float count;
        void add() { count += 1.0; if (rt_LightDirection.z > 0.0) rt_SampleColor += rt_LightColor; }
        void shade() {
            for (int i = 0; i < 2; i++) illuminance { add(); if (count > 5.5) break; }
            rt_SampleColor += color(count / 16.0);
        }";
    let class = class(text);
    let mut machine = Machine::instance(&class);
    machine.lights = LIGHTS.to_vec();
    machine.run(&class.methods[&Method::Shade]);
    assert_eq!(machine.state("rt_SampleColor")[0], 1001.0 + 1.0 + 6.0 / 16.0);
}

#[test]
fn implied_shade_sums_emission_and_lights() {
    let text = "class M : rt_Material;
        void BSDF() { rt_BSDFValue = color(0.25); }
        void emission() { rt_EmissionColor = color(3.0); }";
    let class = class(text);
    let mut machine = Machine::instance(&class);
    machine.lights = vec![([0.0, 0.0, 1.0], [1.0; 3]), ([0.0, 0.6, -0.8], [10.0; 3])];
    machine.set_state("rt_ShadingNormal", &[0.0, 0.0, 1.0]);
    machine.run(&class.methods[&Method::Shade]);
    let sum = machine.state("rt_SampleColor")[0];
    assert!((sum - (3.0 + 0.25 / 0.5 + 2.5 * 0.8 / 0.5)).abs() < 1e-5, "{sum}");
}

#[test]
fn rays_and_random_numbers() {
    let body =
        "rt_SampleColor = trace(vec3(1.0), vec3(2.0)) + ambient() + color(rand()) + color(rand());
        if (occluded(vec3(0.0), vec3(1.0), 2.0)) rt_SampleColor += color(100.0);
        if (occluded(vec3(0.0), vec3(1.0), 0.5)) rt_SampleColor += color(1000.0);";
    assert_eq!(sampled(body, &[]), 3.0 + 0.25 + 1.0 / 16.0 + 2.0 / 16.0 + 100.0);
}

#[test]
fn inside_looks_at_the_normal() {
    let text = "class M : rt_Material; void shade() { if (inside()) rt_SampleColor = color(1.0); }";
    let class = class(text);
    for (z, expected) in [(1.0, 1.0), (-1.0, 0.0)] {
        let mut machine = Machine::instance(&class);
        machine.set_state("rt_RayDirection", &[0.0, 0.0, z]);
        machine.set_state("rt_GeometricNormal", &[0.0, 0.0, 1.0]);
        machine.run(&class.methods[&Method::Shade]);
        assert_eq!(machine.state("rt_SampleColor")[0], expected);
    }
}
