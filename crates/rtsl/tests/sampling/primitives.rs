//! `generateSample` against `samplePDF` and `intersect`.

use std::ops::Range;

use glam::{Vec2, Vec3};
use rtsl::{Method, Numbers, Value};

use crate::call::{Rays, Shader, batches, thinning};
use crate::chart::{Chart, Place};
use crate::distribution::{Sample, compare};
use crate::grid::Grid;

const SAMPLES: usize = 30_000;

/// A primitive, seen from a point.
struct Seen {
    primitive: Shader,
    origin: Vec3,
    /// The part of the samples that a ray may miss: those at edges and silhouettes, by rounding.
    missed: f64,
}

impl Seen {
    fn rays(&self, numbers: Range<usize>) -> Rays {
        let mut rays = self.primitive.rays(numbers);
        rays.fill_vector("rt_RayOrigin", self.origin);
        rays
    }

    /// The parameters of the nearest hits.
    fn intersect(&self, rays: &mut Rays, directions: &[Vec3]) -> Vec<f32> {
        let inverse: Vec<Vec3> = directions.iter().map(|it| it.recip()).collect();
        rays.set_vectors("rt_RayDirection", directions);
        rays.set_vectors("rt_InverseRayDirection", &inverse);
        rays.fill("rt_Epsilon", 1e-4);
        rays.fill("rt_HitDistance", f32::INFINITY);
        self.primitive.call(Method::Intersect, rays);
        rays.floats("rt_HitDistance").to_vec()
    }

    /// Checks each sample by itself too: `samplePDF` gives its density, and a ray finds it.
    fn sample(&self) -> Vec<Sample> {
        let count = SAMPLES / thinning();
        let (mut samples, mut missed) = (Vec::new(), 0);
        for numbers in batches(count) {
            let mut rays = self.rays(numbers);
            self.primitive.call(Method::GenerateSample, &mut rays);
            let points = rays.vectors("rt_HitPoint");
            let densities = rays.floats("rt_PDF").to_vec();
            let normals = rays.vectors("rt_GeometricNormal");
            let there = self.density_at(&points, &normals);
            for ((point, density), there) in points.iter().zip(&densities).zip(&there) {
                // At silhouettes the cosine that divides has few digits.
                let close = (density - there).abs() <= 0.01 * density;
                assert!(close || *density > 1e3, "{density} at {point}, but {there}");
                samples.push(Sample { direction: point - self.origin, density: *density });
            }
            let directions: Vec<Vec3> = points.iter().map(|point| point - self.origin).collect();
            let found = self.intersect(&mut rays, &directions);
            missed += found.iter().filter(|distance| **distance > 1.01).count();
        }
        let allowed = (count as f64 * self.missed).ceil() as usize;
        assert!(missed <= allowed, "rays miss {missed} of {count} samples");
        samples
    }

    /// The density of directions: that of the points that lie there, of which only the nearest may
    /// be samples.
    fn density(&self, directions: &[Vec3]) -> Vec<f32> {
        let mut rays = self.rays(0..directions.len());
        let found = self.intersect(&mut rays, directions);
        let points = directions.iter().zip(&found);
        let points: Vec<Vec3> = points.map(|(it, t)| self.origin + *t * *it).collect();
        rays.set_vectors("rt_HitPoint", &points);
        self.primitive.call(Method::ComputeNormal, &mut rays);
        let normals = rays.vectors("rt_GeometricNormal");
        let densities = self.density_at(&points, &normals);
        let hits = densities.iter().zip(&found);
        hits.map(|(density, t)| if t.is_finite() { *density } else { 0.0 }).collect()
    }

    /// What `samplePDF` says of points.
    fn density_at(&self, points: &[Vec3], normals: &[Vec3]) -> Vec<f32> {
        let mut rays = self.rays(0..points.len());
        let normals: Vec<Vec3> = normals.iter().map(|it| it.normalize()).collect();
        rays.set_vectors("rt_HitPoint", points);
        rays.set_vectors("rt_GeometricNormal", &normals);
        self.primitive.call(Method::SamplePdf, &mut rays);
        rays.floats("rt_PDF").to_vec()
    }

    /// Compares by directions.
    fn check(&self, grid: &Grid, tolerance: f64) {
        compare(grid, &self.sample(), |directions| self.density(directions), tolerance)
            .unwrap_or_else(|problem| panic!("from {}: {problem}", self.origin));
    }

    /// Compares on the surface.
    fn check_on(&self, chart: Chart) {
        let samples = self.sample().into_iter().map(|Sample { direction, density }| Sample {
            direction: chart.unroll(self.origin + direction),
            density,
        });
        let density = |directions: &[Vec3]| {
            let places: Vec<Place> = directions.iter().map(|it| chart.roll(*it)).collect();
            let points: Vec<Vec3> = places.iter().map(|it| it.point).collect();
            let normals: Vec<Vec3> = places.iter().map(|it| it.normal).collect();
            let densities = self.density_at(&points, &normals).into_iter().zip(places);
            let on_the_sphere = densities.map(|(density, place)| {
                let way = place.point - self.origin;
                let cosine = place.normal.dot(way.normalize()).abs();
                density * cosine / way.length_squared() * place.area
            });
            on_the_sphere.collect()
        };
        compare(&Grid::sphere(Vec3::Z), &samples.collect::<Vec<_>>(), density, 0.003)
            .unwrap_or_else(|problem| panic!("from {}: {problem}", self.origin));
    }
}

fn sphere(origin: Vec3, missed: f64) -> Seen {
    let parameters = vec![("center", [0.5, -1.0, 2.0].into()), ("radius", 1.5_f32.into())];
    Seen { primitive: Shader::library("Sphere", parameters), origin, missed }
}

fn seen(class: &str, parameters: Vec<(&str, Value)>, origin: Vec3) -> Seen {
    Seen { primitive: Shader::library(class, parameters), origin, missed: 1e-3 }
}

#[test]
fn spheres_from_outside_fill_their_cone() {
    let center = Vec3::new(0.5, -1.0, 2.0);
    for offset in [Vec3::new(2.0, 1.0, -1.0), Vec3::new(0.0, 1.6, 0.0), Vec3::new(-30.0, 0.0, 5.0)]
    {
        let sine = 1.5 / f64::from(offset.length());
        let cone = Grid::cap(-offset, (1.0 - sine * sine).sqrt());
        sphere(center + offset, 1e-3).check(&cone, 0.01);
    }
}

#[test]
fn spheres_from_inside_are_sampled_by_area() {
    for origin in [Vec3::new(0.5, -1.0, 2.0), Vec3::new(1.0, -0.5, 1.5)] {
        sphere(origin, 0.0).check(&Grid::sphere(Vec3::new(0.3, 0.4, 0.5)), 0.01);
    }
}

#[test]
fn disks_with_and_without_a_hole() {
    for hole in [0.0_f32, 0.6] {
        for origin in [Vec3::new(0.3, 0.8, -0.2), Vec3::new(1.5, -0.4, 1.0)] {
            let parameters = vec![("radius", 1.3_f32.into()), ("innerRadius", hole.into())];
            let disk = seen("Disk", parameters, origin);
            disk.check(&Grid::cap(Vec3::new(0.0, -origin.y, 0.0), 0.0), 0.02);
        }
    }
}

#[test]
fn triangles() {
    for origin in [Vec3::new(0.4, 0.3, 1.2), Vec3::new(-0.5, 1.5, -0.5)] {
        let corners = [("a", [-0.5, 0.0, 0.2]), ("b", [1.5, 0.2, -0.1]), ("c", [0.1, 1.1, 0.4])];
        let corners = corners.map(|(name, corner)| (name, corner.into()));
        let triangle = seen("Triangle", corners.into(), origin);
        let middle = Vec3::new(1.1, 1.3, 0.5) / 3.0;
        triangle.check(&Grid::cap(middle - origin, 0.0), 0.02);
    }
}

#[test]
fn faces_of_meshes() {
    let list = |numbers: &[f32]| Value::Numbers(Numbers::floats(numbers.iter().copied()));
    let normals = [[0.0, 0.0, 1.0]; 4].concat();
    for normals in [&[][..], &normals] {
        let positions = [0.1, 1.1, 0.4, 9.0, 9.0, 9.0, -0.5, 0.0, 0.2, 1.5, 0.2, -0.1];
        let parameters = vec![
            ("positions", list(&positions)),
            ("normals", list(normals)),
            ("uvs", list(&[])),
            ("indices", Value::Numbers(Numbers::ints([0, 1, 2, 0, 3, 2]))),
            ("face", 1.into()),
        ];
        let origin = Vec3::new(0.4, 0.3, 1.2);
        let face = seen("TriangleMesh", parameters, origin);
        let middle = Vec3::new(1.1, 1.3, 0.5) / 3.0;
        face.check(&Grid::cap(middle - origin, 0.0), 0.02);
    }
}

#[test]
fn patches_of_meshes() {
    // A parallelogram, and one whose last corner lies elsewhere.
    for last in [[1.4, 1.3, 0.2], [1.9, 1.4, 0.9]] {
        let list = |numbers: &[f32]| Value::Numbers(Numbers::floats(numbers.iter().copied()));
        let corners = [[-0.5, 0.0, 0.2], [1.3, 0.2, -0.1], [-0.4, 1.1, 0.5], last];
        let parameters = vec![
            ("positions", list(&corners.concat())),
            ("normals", list(&[])),
            ("uvs", list(&[])),
            ("indices", Value::Numbers(Numbers::ints([0, 1, 2, 3]))),
        ];
        let patch = seen("BilinearMesh", parameters, Vec3::new(0.3, 0.2, 1.9));
        let middle = Vec3::new(0.45, 0.65, 0.3);
        patch.check(&Grid::cap(middle - patch.origin, 0.0), 0.02);
    }
}

#[test]
fn cylinders_from_inside_and_outside() {
    let (radius, low, high) = (0.8, -0.7, 1.1);
    for origin in [Vec3::new(0.2, 0.1, -0.3), Vec3::new(1.8, 0.6, 0.9)] {
        let parameters = [("radius", radius), ("yMin", low), ("yMax", high)];
        let parameters = parameters.map(|(name, value)| (name, value.into()));
        let cylinder = seen("Cylinder", parameters.into(), origin);
        cylinder.check_on(Chart::Cylinder { radius, low, high });
        if origin.x < radius {
            cylinder.check(&Grid::sphere(Vec3::Y), 0.02);
        }
    }
}

#[test]
fn tori_from_inside_and_outside() {
    let (major, minor) = (1.1, 0.4);
    for origin in [Vec3::new(0.1, 0.0, -0.1), Vec3::new(0.9, 1.5, 0.7), Vec3::new(1.0, 0.1, 0.2)] {
        let parameters = vec![("majorRadius", major.into()), ("minorRadius", minor.into())];
        let torus = seen("Torus", parameters, origin);
        // Out of the tube no ray leads without a hit.
        let inside =
            Vec2::new(Vec2::new(origin.x, origin.z).length() - major, origin.y).length() < minor;
        let torus = if inside { Seen { missed: 0.0, ..torus } } else { torus };
        torus.check_on(Chart::Torus { major, minor });
    }
}
