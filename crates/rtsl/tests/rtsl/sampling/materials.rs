//! The albedo of materials. `rtsl-contract` tests for the whole library that samples have their densities, that values
//! agree, that no more light leaves than arrives, and that BSDFs are reciprocal.

use std::f32::consts::FRAC_PI_2;
use std::ops::Range;

use glam::{DVec3, Vec3};
use rtsl::{Method, Value};

use crate::sampling::call::{Rays, Shader, batches, constant, thinning};
use crate::sampling::host::random;

const SAMPLES: usize = 60_000;

/// The directions of a ray and of the surface that it meets.
pub struct Meeting {
    normal: Vec3,
    tangent: Vec3,
    ray: Vec3,
}

impl Meeting {
    /// `part` of the right angle from the normal, on its side or behind the surface.
    pub fn new(part: f32, behind: bool) -> Meeting {
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

/// The mean weight of a path: the part of red light that is sent on.
fn albedo(material: &Shader, meeting: &Meeting) -> f32 {
    albedos(material, meeting).x
}

/// The same for red, green and blue light.
pub fn albedos(material: &Shader, meeting: &Meeting) -> Vec3 {
    let count = SAMPLES / thinning();
    let mut sum = DVec3::ZERO;
    for numbers in batches(count) {
        let mut rays = meeting.rays(material, numbers.clone());
        let seed = |ray: usize| Vec3::from_array([0, 1, 2].map(|it| random(ray as u64, it)));
        rays.set_vectors("rt_BSDFSeed", &numbers.map(seed).collect::<Vec<_>>());
        material.call(Method::SampleBsdf, &mut rays);
        let (values, directions) =
            (rays.vectors("rt_BSDFValue"), rays.vectors("rt_LightDirection"));
        for (ray, density) in rays.floats("rt_PDF").iter().enumerate() {
            let weight = match density {
                0.0 => 1.0,
                density => directions[ray].dot(meeting.normal).abs() / density,
            };
            sum += (values[ray] * weight).as_dvec3();
        }
    }
    (sum / count as f64).as_vec3()
}

/// From straight above, aslant, grazing and behind: parts of the right angle from the normal, and
/// whether the normal points away.
const MEETINGS: [(f32, bool); 5] =
    [(0.0, false), (0.45, false), (0.8, false), (0.94, false), (0.45, true)];

/// Tests a material, whose albedo must lie in the range.
fn check(name: &str, material: &Shader, range: Range<f32>) {
    for (part, behind) in MEETINGS {
        let found = albedo(material, &Meeting::new(part, behind));
        assert!(
            range.contains(&found),
            "{name}, {part} of a right angle, behind: {behind}: {found}"
        );
    }
}

fn lambertian() -> Shader {
    Shader::library("Lambertian", vec![("kd", constant(1.0))])
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

#[test]
fn lambertian_loses_no_light() {
    check("Lambertian", &lambertian(), 0.999..1.001);
}

/// The difference of the albedo from 1 is the light that facets hide from one another.
#[test]
fn conductors_lose_what_facets_hide() {
    check("Conductor, brushed", &conductor(1.0, 0.1, 0.3), 0.8..1.001);
    check("Conductor, rough", &conductor(1.0, 0.5, 0.5), 0.6..1.001);
    check("Conductor, grey", &conductor(0.5, 0.2, 0.4), 0.4..0.8);
}

/// By the Fresnel equations: `((n - 1)^2 + k^2) / ((n + 1)^2 + k^2)` straight on, 1 at grazing.
#[test]
fn polished_conductors_reflect_as_their_constants_say() {
    let constants =
        vec![("eta", Value::from([0.2, 1.5, 2.0])), ("k", Value::from([3.9, 0.0, 0.0]))];
    let metal = Shader::library("Conductor", constants);
    for (part, expected) in [(0.0, 0.951), (0.9999, 1.0)] {
        let found = albedo(&metal, &Meeting::new(part, false));
        assert!((found - expected).abs() < 1e-3, "{part}: {found}");
    }
}

#[test]
fn oren_nayar_loses_no_light() {
    for sigma in [0.0, 20.0, 90.0] {
        check("OrenNayar", &material("OrenNayar", &[("kd", 1.0)], &[("sigma", sigma)]), 0.99..1.01);
    }
}

#[test]
fn diffuse_transmission_sends_light_through() {
    let half =
        material("DiffuseTransmission", &[("reflectance", 0.7), ("transmittance", 0.3)], &[]);
    check("DiffuseTransmission", &half, 0.99..1.01);
}

/// Of white bases, what is missing from 1 is light that facets hide from one another.
#[test]
fn white_under_a_polished_coat_stays_white() {
    let white = material("CoatedDiffuse", &[("reflectance", 1.0)], &[]);
    check("CoatedDiffuse", &white, 0.995..1.01);
    let layers = [("sheen", 1.0), ("clearcoat", 1.0), ("metallic", 0.3), ("roughness", 0.5)];
    let white = material("Principled", &[("baseColor", 1.0)], &layers);
    check("Principled", &white, 0.6..1.01);
}

/// Facets of a coat lose what they send to other facets, each time that light meets them.
#[test]
fn white_under_a_rough_coat_loses_light() {
    for (roughness, range) in [(0.01, 0.83..0.95), (0.1, 0.6..0.75), (0.5, 0.36..0.5)] {
        let white = material("CoatedDiffuse", &[("reflectance", 1.0)], &[("roughness", roughness)]);
        check("CoatedDiffuse", &white, range);
    }
    for (roughness, coat_roughness) in [(0.2, 0.0), (0.0, 0.2), (0.1, 0.3)] {
        let parameters = [("roughness", roughness), ("coatRoughness", coat_roughness)];
        let white = material("CoatedConductor", &[("reflectance", 1.0)], &parameters);
        check("CoatedConductor", &white, 0.3..0.98);
    }
}

/// A texture of a black medium has the class compute by random walks what it computes exactly for the number 0.
#[test]
fn random_walks_in_a_coat_agree_with_its_tables() {
    for roughness in [0.0, 0.02, 0.1, 0.4] {
        for (thickness, events, reflectance) in [(0.0, 1000, 1.0), (0.2, 10, 0.9), (0.05, 3, 0.5)] {
            let mut parameters: Vec<(&'static str, Value)> = vec![
                ("roughness", roughness.into()),
                ("thickness", thickness.into()),
                ("maxDepth", events.into()),
                ("reflectance", reflectance.into()),
            ];
            let exact = Shader::library("CoatedDiffuse", parameters.clone());
            parameters.push(("albedo", constant(0.0)));
            let walked = Shader::library("CoatedDiffuse", parameters);
            for (part, behind) in MEETINGS {
                let meeting = Meeting::new(part, behind);
                let (exact, walked) = (albedo(&exact, &meeting), albedo(&walked, &meeting));
                assert!(
                    (walked - exact).abs() < 0.015 * exact,
                    "roughness {roughness}, thickness {thickness}, {part}: {walked}, exactly {exact}"
                );
            }
        }
    }
}

/// Light is lost in a medium only by absorption, and in proportion to it if there is little of it.
#[test]
fn a_medium_in_a_coat_loses_what_it_absorbs() {
    let coat = |class: &'static str, albedo: f32| {
        let numbers = [("thickness", 0.5), ("albedo", albedo), ("g", 0.4)];
        material(class, &[("reflectance", 1.0)], &numbers)
    };
    check("CoatedDiffuse", &coat("CoatedDiffuse", 1.0), 0.98..1.02);
    check("CoatedConductor", &coat("CoatedConductor", 1.0), 0.97..1.02);
    check("CoatedDiffuse", &coat("CoatedDiffuse", 0.9), 0.6..0.95);
    check("CoatedConductor", &coat("CoatedConductor", 0.9), 0.7..0.98);
}

/// Without facets that hide one another, what is reflected to and fro between mirrors is a geometric series.
#[test]
fn polished_metal_under_a_polished_coat_is_a_series() {
    let coated = |events: i32, thickness: f32| {
        let parameters = vec![
            ("reflectance", constant(0.8)),
            ("maxDepth", events.into()),
            ("thickness", thickness.into()),
        ];
        albedo(&Shader::library("CoatedConductor", parameters), &Meeting::new(0.0, false))
    };
    // With an index of 1 and an extinction that reflects 0.8, both divided by that of the layer.
    let (n, k2) = (1.0 / 1.5_f32, 4.0 * 0.8 / 0.2 / 2.25);
    let [less, more] = [n - 1.0, n + 1.0];
    let metal = (less * less + k2) / (more * more + k2);
    // What is left after two ways through the layer: exp(-2 thickness).
    const LEFT: f32 = 0.818_731;
    for (events, thickness, left) in
        [(1, 0.0, 1.0), (3, 0.1, LEFT), (1000, 0.1, LEFT), (1000, 0.0, 1.0)]
    {
        let once = metal * left;
        let terms = ((events + 1) / 2).min(50);
        let series = (0..terms).fold(0.0, |rest, _| 1.0 + 0.04 * once * rest);
        let expected = 0.04 + 0.96 * 0.96 * once * series;
        let found = coated(events, thickness);
        assert!((found - expected).abs() < 2e-3, "{events} events: {found}, not {expected}");
    }
}

/// Of white surfaces of glTF, what is missing from 1 is light that facets hide from one another.
#[test]
fn white_surfaces_of_gltf_stay_white() {
    for (roughness, metallic, least) in [(0.0, 0.0, 0.98), (0.5, 0.0, 0.85), (0.3, 1.0, 0.85)] {
        let parameters = [("roughness", roughness), ("metallic", metallic)];
        let white = material("GltfPbr", &[("baseColor", 1.0)], &parameters);
        check("GltfPbr", &white, least..1.01);
    }
    let clear = [("roughness", 0.3), ("metallic", 0.0), ("transmission", 1.0)];
    check("a thin sheet", &material("GltfPbr", &[("baseColor", 1.0)], &clear), 0.85..1.01);
    let films = [("roughness", 0.2), ("metallic", 0.0), ("iridescence", 1.0)];
    check("a film", &material("GltfPbr", &[("baseColor", 1.0)], &films), 0.7..1.01);
}

#[test]
fn a_mixture_with_a_mirror_loses_no_light() {
    let mirror = Shader::library("Mirror", vec![("kr", constant(1.0))]);
    let both = [("first", lambertian().reference()), ("second", mirror.reference())];
    let mixed = both.into_iter().chain([("amount", constant(0.3))]);
    check("Mix with a mirror", &Shader::library("Mix", mixed.collect()), 0.95..1.05);
}

#[test]
fn mirrors_and_clear_glass_lose_no_light() {
    for (class, parameters) in [
        ("Mirror", vec![("kr", constant(1.0))]),
        ("SchlickDielectric", vec![]),
        ("ThinDielectric", vec![]),
    ] {
        check(class, &Shader::library(class, parameters), 0.9999..1.0001);
    }
}
