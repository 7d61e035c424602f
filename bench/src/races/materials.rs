//! Materials.

use rtsl::{CallMode, Method};

use crate::kernels::{Dielectric, Ggx, Ward};
use crate::race::{Parameter, Race, Shader, WrittenForms, independent};
use crate::random::{Random, cross, dot, negate, normalize};

pub fn races() -> Vec<Race> {
    vec![ward(), ggx(), dielectric()]
}

fn ward() -> Race {
    Race {
        name: "ward",
        shader: Shader {
            file: "ward.rtsl",
            class: "Ward",
            method: Method::Bsdf,
            mode: CallMode::Packet,
        },
        state: &[
            "rt_RayDirection",
            "rt_LightDirection",
            "rt_ShadingNormal",
            "rt_dPdu",
            "rt_dPdv",
            "rt_BSDFValue",
        ],
        others: &[],
        inputs: 15,
        in_place: false,
        rays: |random| independent(random, ward_directions),
        parameters: vec![
            Parameter::new("alphaU", &[0.15]),
            Parameter::new("alphaV", &[0.4]),
            Parameter::new("diffuse", &[0.3, 0.2, 0.1]),
            Parameter::new("specular", &[0.5, 0.6, 0.7]),
        ],
        written: WrittenForms::of::<Ward>(),
    }
}

/// Mostly above the surface; every other one near the mirror direction.
fn ward_directions(random: &mut Random) -> Vec<f32> {
    let (normal, other) = (random.direction(), random.direction());
    let tangent = normalize(cross(other, normal));
    let across = cross(normal, tangent);
    let light = mostly_above(random, normal);
    let mut view = mostly_above(random, normal);
    if random.once_in(2) {
        let cosine = dot(light, normal);
        let mirrored = std::array::from_fn(|axis| {
            2.0 * cosine * normal[axis] - light[axis] + random.between(-0.2, 0.2)
        });
        view = normalize(mirrored);
    }
    [negate(view), light, normal, tangent, across].concat()
}

fn mostly_above(random: &mut Random, normal: [f32; 3]) -> [f32; 3] {
    let direction = random.direction();
    let below = dot(direction, normal) < 0.0;
    if below && !random.once_in(8) { negate(direction) } else { direction }
}

fn ggx() -> Race {
    Race {
        name: "ggx",
        shader: Shader {
            file: "ggx.rtsl",
            class: "Ggx",
            method: Method::SampleBsdf,
            mode: CallMode::Packet,
        },
        state: &[
            "rt_RayDirection",
            "rt_ShadingNormal",
            "rt_dPdu",
            "rt_dPdv",
            "rt_BSDFSeed",
            "rt_LightDirection",
            "rt_BSDFValue",
            "rt_PDF",
        ],
        others: &[],
        inputs: 15,
        in_place: false,
        rays: |random| {
            independent(random, |random| {
                let normal = random.direction();
                let tangent = normalize(cross(random.direction(), normal));
                let view = mostly_above(random, normal);
                let seed: [f32; 3] = std::array::from_fn(|_| random.between(0.0, 1.0));
                [negate(view), normal, tangent, cross(normal, tangent), seed].concat()
            })
        },
        parameters: vec![
            Parameter::new("alpha", &[0.3, 0.15]),
            Parameter::new("reflectance", &[0.9, 0.7, 0.4]),
        ],
        written: WrittenForms::of::<Ggx>(),
    }
}

fn dielectric() -> Race {
    Race {
        name: "dielectric",
        shader: Shader {
            file: "dielectric.rtsl",
            class: "Dielectric",
            method: Method::SampleBsdf,
            mode: CallMode::Packet,
        },
        state: &[
            "rt_RayDirection",
            "rt_ShadingNormal",
            "rt_HitDistance",
            "rt_LightDirection",
            "rt_BSDFValue",
            "rt_PDF",
        ],
        others: &[],
        inputs: 7,
        in_place: false,
        rays: |random| {
            independent(random, |random| {
                let (direction, normal) = (random.direction(), random.direction());
                [direction.as_slice(), &normal, &[random.between(0.1, 5.0)]].concat()
            })
        },
        parameters: vec![
            Parameter::new("eta", &[1.5]),
            Parameter::new("absorption", &[0.8, 0.9, 0.6]),
        ],
        written: WrittenForms::of::<Dielectric>(),
    }
}
