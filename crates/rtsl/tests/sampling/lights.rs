//! `illumination` against `evaluatePDF` and `emission`.

use std::ops::Range;

use glam::Vec3;
use rtsl::{Method, Numbers, Value};

use crate::call::{Rays, Shader, batches, thinning};
use crate::distribution::{Sample, compare};
use crate::grid::Grid;

const SAMPLES: usize = 100_000;

fn rays_at(light: &Shader, normal: Vec3, numbers: Range<usize>) -> Rays {
    let mut rays = light.rays(numbers);
    rays.fill_vector("rt_HitPoint", Vec3::new(0.5, 1.5, -2.0));
    rays.fill_vector("rt_GeometricNormal", normal);
    rays.fill_vector("rt_ShadingNormal", normal);
    rays
}

fn density(light: &Shader, normal: Vec3, directions: &[Vec3]) -> Vec<f32> {
    let mut rays = rays_at(light, normal, 0..directions.len());
    rays.set_vectors("rt_LightDirection", directions);
    light.call(Method::EvaluatePdf, &mut rays);
    rays.floats("rt_PDF").to_vec()
}

fn emission(light: &Shader, normal: Vec3, directions: &[Vec3]) -> Vec<Vec3> {
    let mut rays = rays_at(light, normal, 0..directions.len());
    rays.set_vectors("rt_RayDirection", directions);
    light.call(Method::Emission, &mut rays);
    rays.vectors("rt_EmissionColor")
}

#[test]
fn skies_are_sampled_with_their_density_and_shine_as_they_look() {
    check_sky(&Shader::library("SkyLight", vec![]));
    check_sky(&Shader::library("ConstantSky", vec![("strength", 0.7_f32.into())]));
}

/// Two rows of four texels, or a square of four by four, brighter from column to column.
fn image_sky(latitudes: bool) -> Shader {
    let (columns, rows) = if latitudes { (4_usize, 2_usize) } else { (4, 4) };
    let brightness = |texel: usize| 1.0 + (texel % columns) as f32;
    let texels = (0..columns * rows).flat_map(|texel| [brightness(texel); 3]);
    let even: Vec<f32> = (0..=rows).map(|row| row as f32 / rows as f32).collect();
    let line = [0.0, 0.1, 0.3, 0.6, 1.0];
    let arguments = vec![
        ("texels", Value::Numbers(Numbers::floats(texels))),
        ("rows", Value::Numbers(Numbers::floats(even))),
        ("columns", Value::Numbers(Numbers::floats(line.repeat(rows)))),
        ("size", Value::from([columns as i32, rows as i32])),
        ("latitudes", Value::Bool(latitudes)),
    ];
    Shader::library("ImageSky", arguments)
}

#[test]
fn images_of_skies_are_sampled_by_their_sums() {
    check_sky(&image_sky(true));
    check_sky(&image_sky(false));
}

fn check_sky(light: &Shader) {
    for normal in [Vec3::Y, Vec3::NEG_Z, Vec3::new(-0.6, -0.3, 0.2).normalize()] {
        let mut samples = Vec::new();
        for numbers in batches(SAMPLES / thinning()) {
            let mut rays = rays_at(light, normal, numbers);
            light.call(Method::Illumination, &mut rays);
            let directions = rays.vectors("rt_LightDirection");
            let densities = density(light, normal, &directions);
            let emitted = emission(light, normal, &directions);
            for (ray, color) in rays.vectors("rt_LightColor").into_iter().enumerate() {
                let (direction, density) = (directions[ray], rays.floats("rt_PDF")[ray]);
                samples.push(Sample { direction, density });
                assert!((density - densities[ray]).abs() < 1e-5, "{density} towards {direction}");
                assert!(color.distance(emitted[ray]) < 1e-3, "{color}, not {}", emitted[ray]);
            }
        }
        let density = |directions: &[Vec3]| density(light, normal, directions);
        compare(&Grid::sphere(normal), &samples, density, 0.003)
            .unwrap_or_else(|problem| panic!("normal {normal}: {problem}"));
    }
}

#[test]
fn lights_without_extent_are_deltas() {
    for class in ["DirectionalLight", "PointLight", "SpotLight"] {
        let light = Shader::library(class, vec![]);
        let mut rays = rays_at(&light, Vec3::Y, 0..20);
        light.call(Method::Illumination, &mut rays);
        assert_eq!(rays.floats("rt_PDF"), [0.0; 20], "{class}");
        for direction in rays.vectors("rt_LightDirection") {
            assert!((direction.length() - 1.0).abs() < 1e-5, "{class}: {direction}");
        }
    }
}
