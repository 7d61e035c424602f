//! The prelude's functions from uniform numbers to directions, against the densities that their
//! names promise.

use glam::Vec3;
use rtsl::Method;

use crate::sampling::call::{Shader, batches, thinning};
use crate::sampling::distribution::{Sample, compare};
use crate::sampling::grid::Grid;
use crate::sampling::host::random;

const SAMPLES: usize = 100_000;

/// `direction` is in terms of `vec2 u`, `density` in terms of `vec3 d`; both may call the
/// declarations.
fn check(declarations: &str, direction: &str, density: &str, least_cosine: f64) {
    let text = format!(
        "{declarations}
        class Probe : rt_Material;
        const float PI = 3.14159265;
        void sampleBSDF() {{ vec2 u = rt_BSDFSeed.xy; rt_LightDirection = {direction}; }}
        void evaluatePDF() {{ vec3 d = rt_LightDirection; rt_PDF = {density}; }}
        void BSDF() {{ rt_BSDFValue = color(1.0); }}"
    );
    let probe = Shader::text(&text, "Probe", vec![]);
    let mut samples = Vec::new();
    for numbers in batches(SAMPLES / thinning()) {
        let mut rays = probe.rays(numbers.clone());
        let seed = |ray: usize| Vec3::new(random(ray as u64, 0), random(ray as u64, 1), 0.0);
        rays.set_vectors("rt_BSDFSeed", &numbers.map(seed).collect::<Vec<_>>());
        probe.call(Method::SampleBsdf, &mut rays);
        let directions = rays.vectors("rt_LightDirection").into_iter();
        samples.extend(directions.map(|direction| Sample { direction, density: 1.0 }));
    }
    let density = |directions: &[Vec3]| {
        let mut rays = probe.rays(0..directions.len());
        rays.set_vectors("rt_LightDirection", directions);
        probe.call(Method::EvaluatePdf, &mut rays);
        rays.floats("rt_PDF").to_vec()
    };
    compare(&Grid::cap(Vec3::Z, least_cosine), &samples, density, 0.003)
        .unwrap_or_else(|problem| panic!("{direction}: {problem}"));
}

#[test]
fn spheres_and_their_parts_are_uniform() {
    check("", "sampleUniformSphere(u)", "0.25 / PI", -1.0);
    check("", "sampleUniformHemisphere(u)", "d.z > 0.0 ? 0.5 / PI : 0.0", -1.0);
    check("", "sampleUniformCone(u, 0.75)", "1.0 / (2.0 * PI * 0.25)", 0.75);
    check("", "sampleUniformCone(u, 0.9999)", "1.0 / (2.0 * PI * 0.0001)", 0.9999);
    check("", "sampleUniformCone(u, -0.5)", "1.0 / (2.0 * PI * 1.5)", -0.5);
}

#[test]
fn hemispheres_are_sampled_by_the_cosine() {
    check("", "sampleCosineHemisphere(u)", "max(d.z, 0.0) / PI", -1.0);
}

/// Of 75 and 0.5 degrees, of the sun's 0.267, and of 0.05 and 0.001.
#[test]
fn cones_are_uniform_however_small() {
    for height in [0.75, 3.8076853e-5, 1.0857979e-5, 3.8077179e-7, 1.5230871e-10_f64] {
        let sample = format!("sampleUniformConeByHeight(u, {height:e})");
        check("", &sample, &format!("uniformConePDF({height:e})"), 1.0 - height);
    }
    let cosine = 0.999_989_14_f32;
    let sample = format!("sampleUniformCone(u, {cosine:?})");
    let density = format!("uniformConePDF(1.0 - {cosine:?})");
    check("", &sample, &density, f64::from(cosine));
}

/// Lifted to the hemisphere above it, a uniform disk has the density of the cosine.
#[test]
fn disks_are_uniform() {
    let lift = "vec3 lift(vec2 p) { return vec3(p, sqrt(1.0 - min(dot(p, p), 1.0))); }";
    check(lift, "lift(sampleConcentricDisk(u))", "max(d.z, 0.0) / PI", -1.0);
}

/// With the sum of a point's coordinates as height, and the second's part of it as angle, a uniform
/// triangle has the density of the cosine.
#[test]
fn triangles_are_uniform() {
    let lift = "vec3 lift(vec2 p) {
        float z = max(p.x + p.y, 1.0e-20);
        float angle = 2.0 * 3.14159265 * p.y / z;
        return vec3(sqrt(1.0 - min(z * z, 1.0)) * vec2(cos(angle), sin(angle)), z);
    }";
    check(lift, "lift(sampleUniformTriangle(u))", "max(d.z, 0.0) / PI", -1.0);
}

#[test]
fn visible_normals_have_the_density_of_projected_ggx() {
    for view in ["vec3(0.0, 0.0, 1.0)", "vec3(0.6, -0.3, 0.4)", "vec3(-0.3, 0.9, 0.12)"] {
        for alpha in ["vec2(0.3, 0.6)", "vec2(1.0, 0.25)"] {
            let density = format!(
                "const vec2 alpha = {alpha};
                float density(vec3 h) {{
                    vec3 view = normalize({view});
                    vec3 scaled = vec3(h.xy / alpha, h.z);
                    float square = dot(scaled, scaled);
                    float normals = 1.0 / (3.14159265 * alpha.x * alpha.y * square * square);
                    float visible = 2.0 / (view.z + length(vec3(alpha * view.xy, view.z)));
                    return h.z > 0.0 ? visible * max(dot(view, h), 0.0) * normals : 0.0;
                }}"
            );
            let sample = format!("sampleVisibleNormal(normalize({view}), {alpha}, u)");
            check(&density, &sample, "density(d)", -1.0);
        }
    }
}
