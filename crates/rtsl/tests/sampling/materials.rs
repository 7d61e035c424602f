//! `sampleBSDF` against `evaluatePDF` and `BSDF`.

use std::f32::consts::FRAC_PI_2;
use std::ops::Range;

use glam::Vec3;
use rtsl::{Method, Value};

use crate::call::{Rays, Shader, batches, constant, thinning};
use crate::distribution::{Sample, compare};
use crate::grid::Grid;
use crate::host::random;

const SAMPLES: usize = 60_000;

/// How a ray meets a surface.
struct Meeting {
    normal: Vec3,
    tangent: Vec3,
    ray: Vec3,
}

impl Meeting {
    /// `part` of the right angle from the normal, on its side or behind the surface.
    fn new(part: f32, behind: bool) -> Meeting {
        let normal = Vec3::new(0.3, 0.8, -0.5).normalize();
        let across = normal.any_orthonormal_vector();
        let turned = Vec3::normalize(across + 0.7 * normal.cross(across));
        // Rays may have any length.
        let ray = -1.7 * normal.rotate_towards(turned, part * FRAC_PI_2);
        // Neither unit length nor at right angles to the normal: nobody promised that.
        let tangent = 2.0 * across + 0.3 * normal;
        Meeting { normal: if behind { -normal } else { normal }, tangent, ray }
    }

    fn rays(&self, material: &Shader, numbers: Range<usize>) -> Rays {
        let mut rays = material.rays(numbers);
        rays.fill_vector("rt_RayDirection", self.ray);
        rays.fill_vector("rt_InverseRayDirection", self.ray.recip());
        rays.fill_vector("rt_ShadingNormal", self.normal);
        rays.fill_vector("rt_GeometricNormal", self.normal);
        rays.fill_vector("rt_dPdu", self.tangent);
        rays.fill_vector("rt_dPdv", self.normal.cross(self.tangent));
        rays
    }
}

/// What a material does with white light.
struct Scattered {
    samples: Vec<Sample>,
    /// The mean weight of a path: the part of light that it reflects.
    albedo: f32,
}

/// Checks each sample by itself too: value and density are those that the other methods give.
fn scatter(material: &Shader, meeting: &Meeting) -> Scattered {
    let count = SAMPLES / thinning();
    let mut samples = Vec::new();
    let mut sum = 0.0;
    for numbers in batches(count) {
        let mut rays = meeting.rays(material, numbers.clone());
        let seed = |ray: usize| Vec3::from_array([0, 1, 2].map(|it| random(ray as u64, it)));
        rays.set_vectors("rt_BSDFSeed", &numbers.clone().map(seed).collect::<Vec<_>>());
        material.call(Method::SampleBsdf, &mut rays);
        let directions = rays.vectors("rt_LightDirection");
        let values = rays.vectors("rt_BSDFValue");
        let densities = rays.floats("rt_PDF").to_vec();

        let mut rays = meeting.rays(material, numbers);
        rays.set_vectors("rt_LightDirection", &directions);
        material.call(Method::Bsdf, &mut rays);
        material.call(Method::EvaluatePdf, &mut rays);
        let (value_there, density_there) = (rays.vectors("rt_BSDFValue"), rays.floats("rt_PDF"));
        for (ray, direction) in directions.into_iter().enumerate() {
            let (value, density) = (values[ray], densities[ray]);
            samples.push(Sample { direction, density });
            assert!((direction.length() - 1.0).abs() < 1e-4, "{direction} is no unit vector");
            if density == 0.0 {
                sum += f64::from(value.x);
                continue;
            }
            assert_close(density, density_there[ray], "the density", direction);
            assert_close(value.x, value_there[ray].x, "the value", direction);
            sum += f64::from(value.x * direction.dot(meeting.normal).abs() / density);
        }
    }
    Scattered { samples, albedo: (sum / count as f64) as f32 }
}

fn assert_close(sampled: f32, evaluated: f32, what: &str, direction: Vec3) {
    let close = (sampled - evaluated).abs() <= 1e-3 * sampled.abs() + 1e-5;
    assert!(close, "{what} of sample {direction} is {sampled}, evaluated {evaluated}");
}

fn density(material: &Shader, meeting: &Meeting, directions: &[Vec3]) -> Vec<f32> {
    let mut rays = meeting.rays(material, 0..directions.len());
    rays.set_vectors("rt_LightDirection", directions);
    material.call(Method::EvaluatePdf, &mut rays);
    rays.floats("rt_PDF").to_vec()
}

/// From straight above, aslant, grazing and behind: parts of the right angle from the normal, and
/// whether the normal points away.
const MEETINGS: [(f32, bool); 5] =
    [(0.0, false), (0.45, false), (0.8, false), (0.94, false), (0.45, true)];

/// Tests a material, whose albedo must lie in the range.
fn check(name: &str, material: &Shader, albedo: Range<f32>) {
    check_meetings(name, material, albedo, &MEETINGS);
}

fn check_meetings(name: &str, material: &Shader, albedo: Range<f32>, meetings: &[(f32, bool)]) {
    for (part, behind) in meetings.iter().copied() {
        let meeting = Meeting::new(part, behind);
        let scattered = scatter(material, &meeting);
        let place = format!("{name}, {part} of a right angle, behind: {behind}");
        assert!(albedo.contains(&scattered.albedo), "{place}: albedo {}", scattered.albedo);
        compare(
            &Grid::sphere(meeting.normal),
            &scattered.samples,
            |directions| density(material, &meeting, directions),
            0.003,
        )
        .unwrap_or_else(|problem| panic!("{place}: {problem}"));
    }
}

fn lambertian() -> Shader {
    Shader::library("Lambertian", vec![("kd", constant(1.0))])
}

fn phong(kd: f32, ks: f32, exponent: f32) -> Shader {
    let reflectances = [("kd", constant(kd)), ("ks", constant(ks))];
    let all = reflectances.into_iter().chain([("exponent", exponent.into())]);
    Shader::library("Phong", all.collect())
}

fn ward(kd: f32, ks: f32) -> Shader {
    let reflectances = [("kd", constant(kd)), ("ks", constant(ks))];
    let roughness = [("alphaU", 0.15_f32.into()), ("alphaV", 0.4_f32.into())];
    Shader::library("Ward", reflectances.into_iter().chain(roughness).collect())
}

fn conductor(reflectance: f32, across: f32, along: f32) -> Shader {
    let parameters = vec![
        ("reflectance", constant(reflectance)),
        ("roughnessU", across.into()),
        ("roughnessV", along.into()),
        ("remapRoughness", false.into()),
    ];
    Shader::library("Conductor", parameters)
}

/// White, as far as it takes colours; `parameters` are numbers.
fn material(
    class: &str,
    references: &[(&'static str, f32)],
    parameters: &[(&'static str, f32)],
) -> Shader {
    let references = references.iter().map(|(name, value)| (*name, constant(*value)));
    let parameters = parameters.iter().map(|(name, value)| (*name, Value::from(*value)));
    Shader::library(class, references.chain(parameters).collect())
}

fn dielectric(roughness_u: f32, roughness_v: f32) -> Shader {
    let roughness = [("roughnessU", roughness_u), ("roughnessV", roughness_v)];
    material("Dielectric", &[], &roughness)
}

fn mix(first: &Shader, second: &Shader, amount: f32) -> Shader {
    let both = [("first", first.reference()), ("second", second.reference())];
    Shader::library("Mix", both.into_iter().chain([("amount", constant(amount))]).collect())
}

#[test]
fn lambertian_has_the_implied_cosine_density() {
    check("Lambertian", &lambertian(), 0.999..1.001);
}

#[test]
fn phong_samples_both_lobes() {
    check("Phong, white highlight", &phong(0.0, 1.0, 8.0), 0.0..1.02);
    check("Phong, white in sum", &phong(0.5, 0.5, 60.0), 0.4..1.02);
}

#[test]
fn ward_samples_both_lobes() {
    check("Ward, white highlight", &ward(0.0, 1.0), 0.0..1.02);
    check("Ward, white in sum", &ward(0.3, 0.7), 0.2..1.02);
}

/// What is missing from 1 is light that facets hide from one another.
#[test]
fn conductors_sample_their_visible_facets() {
    check("Conductor, brushed", &conductor(1.0, 0.1, 0.3), 0.8..1.001);
    check("Conductor, rough", &conductor(1.0, 0.5, 0.5), 0.6..1.001);
    check("Conductor, grey", &conductor(0.5, 0.2, 0.4), 0.4..0.8);
}

/// By the Fresnel equations: `((n - 1)^2 + k^2) / ((n + 1)^2 + k^2)` straight on, 1 at grazing.
#[test]
fn polished_conductors_reflect_as_their_constants_say() {
    let constants =
        vec![("eta", Value::from([0.2, 1.5, 2.0])), ("k", Value::from([3.9, 0.0, 0.0]))];
    let copper = Shader::library("Conductor", constants);
    for (part, expected) in [(0.0, 0.951), (0.9999, 1.0)] {
        let scattered = scatter(&copper, &Meeting::new(part, false));
        assert!(scattered.samples.iter().all(|sample| sample.density == 0.0));
        assert!((scattered.albedo - expected).abs() < 1e-3, "{part}: {}", scattered.albedo);
    }
}

/// Light takes the same way back: value and cosine aside, viewer and light may change places.
#[test]
fn reflection_is_reciprocal() {
    let rough = [("roughness", 0.3)];
    let materials = [
        lambertian(),
        ward(0.3, 0.7),
        conductor(0.9, 0.1, 0.4),
        conductor(0.5, 0.6, 0.6),
        material("OrenNayar", &[], &[("sigma", 40.0)]),
        material("AshikhminShirley", &[], &[("exponentU", 20.0)]),
        material("CoatedDiffuse", &[], &rough),
        material("CoatedConductor", &[], &[("roughness", 0.3), ("coatRoughness", 0.2)]),
        material("Principled", &[], &[("clearcoat", 1.0), ("sheen", 1.0), ("metallic", 0.3)]),
    ];
    let meeting = Meeting::new(0.45, false);
    let view = -meeting.ray.normalize();
    let random_direction = |ray: usize| {
        let [x, y, z] = [0, 1, 2].map(|it| 2.0 * random(ray as u64, it) - 1.0);
        let direction = Vec3::new(x, y, z);
        direction * direction.dot(meeting.normal).signum()
    };
    let lights: Vec<Vec3> = (0..500).map(|ray| random_direction(ray).normalize()).collect();
    for material in materials {
        let mut there = meeting.rays(&material, 0..lights.len());
        there.set_vectors("rt_LightDirection", &lights);
        material.call(Method::Bsdf, &mut there);
        let mut back = meeting.rays(&material, 0..lights.len());
        let rays: Vec<Vec3> = lights.iter().map(|light| -*light).collect();
        back.set_vectors("rt_RayDirection", &rays);
        back.fill_vector("rt_LightDirection", view);
        material.call(Method::Bsdf, &mut back);
        let pairs = there.vectors("rt_BSDFValue").into_iter().zip(back.vectors("rt_BSDFValue"));
        for (there, back) in pairs {
            assert!(there.x > 0.0 && (there.x - back.x).abs() < 1e-3 * there.x, "{there} {back}");
        }
    }
}

#[test]
fn oren_nayar_loses_no_light() {
    for sigma in [0.0, 20.0, 90.0] {
        let white = material("OrenNayar", &[("kd", 1.0)], &[("sigma", sigma)]);
        check("OrenNayar", &white, 0.99..1.01);
    }
}

/// Where rays do not graze: there the density of what is refracted rises too steeply for the grid.
const STEEP_MEETINGS: [(f32, bool); 3] = [(0.0, false), (0.45, false), (0.45, true)];

/// From the outside, refracted radiance is less by the square of the index; from the inside it is more. Refraction
/// makes lobes narrow, so these are rough.
#[test]
fn rough_dielectrics_sample_their_visible_facets() {
    for (u, v) in [(0.5, 0.9), (0.7, 0.7)] {
        check_meetings("Dielectric, rough", &dielectric(u, v), 0.3..2.3, &STEEP_MEETINGS);
    }
}

#[test]
fn diffuse_transmission_sends_light_through() {
    let half =
        material("DiffuseTransmission", &[("reflectance", 0.7), ("transmittance", 0.3)], &[]);
    check("DiffuseTransmission", &half, 0.99..1.01);
}

#[test]
fn ashikhmin_shirley_samples_both_lobes() {
    let exponents = [("exponentU", 10.0), ("exponentV", 100.0)];
    let white = material("AshikhminShirley", &[("kd", 1.0), ("ks", 0.2)], &exponents);
    check("AshikhminShirley", &white, 0.3..1.05);
}

/// Of white bases, what is missing from 1 is light that facets hide from one another.
#[test]
fn coated_diffuse_loses_no_light() {
    for (roughness, least) in [(0.0, 0.995), (0.1, 0.97), (0.5, 0.9)] {
        let white = material("CoatedDiffuse", &[("reflectance", 1.0)], &[("roughness", roughness)]);
        check("CoatedDiffuse", &white, least..1.01);
    }
}

#[test]
fn coated_conductors_sample_both_layers() {
    for (roughness, coat_roughness) in [(0.2, 0.0), (0.0, 0.2), (0.1, 0.3)] {
        let parameters = [("roughness", roughness), ("coatRoughness", coat_roughness)];
        let white = material("CoatedConductor", &[("reflectance", 1.0)], &parameters);
        check("CoatedConductor", &white, 0.6..1.01);
    }
}

#[test]
fn principled_samples_all_layers() {
    let roughness = ("roughness", 0.6);
    let all: [&[(&'static str, f32)]; 4] = [
        &[roughness],
        &[("metallic", 0.5), ("anisotropic", 0.8), ("roughness", 0.5)],
        &[("sheen", 1.0), roughness],
        &[("clearcoat", 1.0), ("clearcoatRoughness", 0.5), roughness],
    ];
    for parameters in all {
        let white = material("Principled", &[("baseColor", 1.0)], parameters);
        check(&format!("Principled, {}", parameters[0].0), &white, 0.6..1.01);
    }
    let parameters = [
        ("specularTransmission", 0.7),
        ("clearcoat", 0.5),
        ("clearcoatRoughness", 0.8),
        ("roughness", 0.9),
    ];
    let clear = material("Principled", &[("baseColor", 1.0)], &parameters);
    check_meetings("Principled, clear", &clear, 0.3..2.3, &STEEP_MEETINGS[1..]);
}

#[test]
fn mixtures_have_mixed_densities() {
    check("Mix of two", &mix(&lambertian(), &phong(0.5, 0.5, 20.0), 0.3), 0.6..1.02);
}

/// What is left to the delta is missing from the density.
#[test]
fn a_mixture_with_a_mirror_has_the_part_of_density_that_is_no_mirror() {
    let mirror = Shader::library("Mirror", vec![("kr", constant(1.0))]);
    check("Mix with a mirror", &mix(&lambertian(), &mirror, 0.3), 0.95..1.05);
}

#[test]
fn deltas_have_no_density_and_lose_no_light() {
    for (class, parameters) in [
        ("Mirror", vec![("kr", constant(1.0))]),
        ("SchlickDielectric", vec![]),
        ("ThinDielectric", vec![]),
    ] {
        let material = Shader::library(class, parameters);
        for (part, behind) in MEETINGS {
            let meeting = Meeting::new(part, behind);
            let scattered = scatter(&material, &meeting);
            assert!(scattered.samples.iter().all(|sample| sample.density == 0.0), "{class}");
            assert!((scattered.albedo - 1.0).abs() < 1e-4, "{class}: {}", scattered.albedo);
            let directions: Vec<Vec3> = scattered.samples.iter().map(|it| it.direction).collect();
            let densities = density(&material, &meeting, &directions);
            assert!(densities.iter().all(|density| *density == 0.0), "{class}");
        }
    }
}
