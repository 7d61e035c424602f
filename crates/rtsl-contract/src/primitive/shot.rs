//! Rays towards a primitive, and their hits.

use glam::{DVec3, Vec2, Vec3};
use rtsl::{Method, Role};

use crate::rays::Rays;
use crate::report::Inputs;
use crate::stop::Stop;
use crate::subject::Subject;

/// A ray with the limits of hits, in units of its direction's length.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: Vec3,
    pub direction: Vec3,
    pub epsilon: f32,
    pub limit: f32,
}

impl Ray {
    /// Creates a ray without a limit.
    pub fn new(origin: DVec3, direction: DVec3, epsilon: f64) -> Ray {
        let (origin, direction) = (origin.as_vec3(), direction.as_vec3());
        let epsilon = epsilon as f32 / direction.length().max(f32::MIN_POSITIVE);
        Ray { origin, direction, epsilon, limit: f32::INFINITY }
    }

    /// Returns the point at a parameter, rounded as in renderers.
    pub fn at(&self, t: f32) -> Vec3 {
        (self.origin.as_dvec3() + f64::from(t) * self.direction.as_dvec3()).as_vec3()
    }
}

/// Rays and their closest hits.
pub struct Shot {
    pub given: Vec<Ray>,
    /// The parameter of each ray's hit.
    pub hits: Vec<Option<f32>>,
    /// The points of hits; zero for rays that miss.
    pub points: Vec<Vec3>,
    rays: Rays,
}

impl Shot {
    /// Calls `intersect`.
    ///
    /// # Errors
    /// If it cannot be compiled or does not terminate.
    pub fn new(subject: &Subject<'_>, given: Vec<Ray>) -> Result<Shot, Stop> {
        let mut rays = set_up(subject, &given);
        subject.call(Method::Intersect, &mut rays)?;
        let distances = rays.floats("rt_HitDistance");
        let hits: Vec<Option<f32>> =
            (0..given.len()).map(|ray| rays.accepted.get(ray).then_some(distances[ray])).collect();
        let found = given.iter().zip(&hits);
        let points = found.map(|(ray, hit)| hit.map_or(Vec3::ZERO, |t| ray.at(t)));
        let points: Vec<Vec3> = points.collect();
        rays.set_vectors("rt_HitPoint", points.iter().copied());
        Ok(Shot { given, hits, points, rays })
    }

    /// Returns the inputs of `intersect` for a ray.
    ///
    /// # Errors
    /// If it cannot be compiled.
    pub fn inputs(&self, subject: &Subject<'_>, ray: usize) -> Result<Inputs, Stop> {
        let rays = set_up(subject, &self.given[ray..=ray]);
        subject.inputs(Method::Intersect, &rays, 0)
    }

    /// Calls a method after the hits were found; nothing happens if the class does not have it.
    ///
    /// # Errors
    /// If it cannot be compiled or does not terminate.
    pub fn then(&mut self, subject: &Subject<'_>, method: Method) -> Result<(), Stop> {
        if subject.has(method) {
            subject.call(method, &mut self.rays)?;
        }
        if method == Method::ComputeNormal {
            // It may have put hits back on the surface.
            let placed = self.rays.vectors("rt_HitPoint").into_iter().zip(&self.hits);
            self.points = placed.map(|(point, hit)| hit.map_or(Vec3::ZERO, |_| point)).collect();
            for variable in ["rt_GeometricNormal", "rt_ShadingNormal"] {
                let unit = self.rays.vectors(variable).into_iter().map(Vec3::normalize);
                self.rays.set_vectors(variable, unit);
            }
        }
        Ok(())
    }

    /// Returns a variable that a method set; normals are normalised.
    pub fn vectors(&self, variable: &str) -> Vec<Vec3> {
        self.rays.vectors(variable)
    }

    /// Returns a number that a method set.
    pub fn floats(&self, variable: &str) -> &[f32] {
        self.rays.floats(variable)
    }

    /// Returns the texture coordinates.
    pub fn coordinates(&self) -> Vec<Vec2> {
        self.rays.pairs("rt_TextureUV")
    }
}

fn set_up(subject: &Subject<'_>, given: &[Ray]) -> Rays {
    let stream = subject.stream(crate::Contract::Bounds);
    let mut rays = subject.rays(Role::Primitive, stream, 0..given.len() as u64);
    rays.set_vectors("rt_RayOrigin", given.iter().map(|ray| ray.origin));
    rays.set_ray_directions(given.iter().map(|ray| ray.direction));
    rays.set_floats("rt_Epsilon", given.iter().map(|ray| ray.epsilon));
    rays.set_floats("rt_HitDistance", given.iter().map(|ray| ray.limit));
    rays
}
