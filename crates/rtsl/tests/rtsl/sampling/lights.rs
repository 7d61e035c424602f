//! Lights without extent: points and far away ones.

use glam::Vec3;
use rtsl::Method;

use crate::sampling::call::Shader;

#[test]
fn lights_without_extent_are_deltas() {
    for class in ["DirectionalLight", "PointLight", "SpotLight"] {
        let light = Shader::library(class, vec![]);
        let mut rays = light.rays(0..20);
        rays.fill_vector("rt_HitPoint", Vec3::new(0.5, 1.5, -2.0));
        rays.fill_vector("rt_GeometricNormal", Vec3::Y);
        rays.fill_vector("rt_ShadingNormal", Vec3::Y);
        light.call(Method::Illumination, &mut rays);
        assert_eq!(rays.floats("rt_PDF"), [0.0; 20], "{class}");
        for direction in rays.vectors("rt_LightDirection") {
            assert!((direction.length() - 1.0).abs() < 1e-5, "{class}: {direction}");
        }
    }
}

/// A twentieth of a degree, soft from the axis on: each point's light is its own.
#[test]
fn narrow_spot_lights_are_smooth() {
    const COUNT: usize = 200;
    let arguments = vec![("coneAngle", 0.05.into()), ("softness", 0.05.into())];
    let light = Shader::library("SpotLight", arguments);
    let mut rays = light.rays(0..COUNT);
    // The tangent of 0.05 degrees.
    let edge = 8.726_648e-4;
    let part = |ray: usize| ray as f32 / COUNT as f32;
    let points: Vec<Vec3> = (0..COUNT).map(|ray| Vec3::new(edge * part(ray), -1.0, 0.0)).collect();
    rays.set_vectors("rt_HitPoint", &points);
    light.call(Method::Illumination, &mut rays);
    let found = rays.floats("rt_LightColor");
    assert!(found.windows(2).skip(10).all(|pair| pair[0] > pair[1]), "{found:?}");
    for (ray, found) in found.iter().enumerate() {
        let part = part(ray) * part(ray);
        let expected = 1.0 - part * part * (3.0 - 2.0 * part);
        assert!((found - expected).abs() < 2e-3, "{ray}: {found}, not {expected}");
    }
}
