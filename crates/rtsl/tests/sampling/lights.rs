//! Lights without extent: points and far away ones.

use glam::Vec3;
use rtsl::Method;

use crate::call::Shader;

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
