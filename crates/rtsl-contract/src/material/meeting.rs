//! The geometry of a ray that meets a surface.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;
use rtsl::Role;

use crate::random::Stream;
use crate::rays::Rays;
use crate::subject::Subject;

/// A ray and the surface that it meets.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// The geometric and shading normal, of unit length.
    pub normal: DVec3,
    pub tangent: DVec3,
    /// The ray's direction towards the surface, of any length.
    pub ray: DVec3,
    degrees: f64,
    behind: bool,
}

impl Meeting {
    /// Returns meetings from perpendicular to grazing, on both sides.
    pub fn all() -> Vec<Meeting> {
        const PARTS: [(f64, bool); 7] = [
            (0.0, false),
            (0.2, false),
            (0.45, false),
            (0.8, false),
            (0.94, false),
            (0.3, true),
            (0.85, true),
        ];
        let number = |(index, (part, behind)): (usize, &(f64, bool))| {
            Meeting::new(*part, 0.13 + 0.29 * index as f64, *behind)
        };
        PARTS.iter().enumerate().map(number).collect()
    }

    /// A ray at an angle from the normal, as a fraction of the right angle, turned around it by a fraction of a turn.
    pub fn new(part: f64, turn: f64, behind: bool) -> Meeting {
        let normal = DVec3::new(0.3, 0.8, -0.5).normalize();
        let (across, along) = normal.any_orthonormal_pair();
        let (sine, cosine) = libm::sincos(4.0 * FRAC_PI_2 * turn);
        let aside = cosine * across + sine * along;
        let (sine, cosine) = libm::sincos(part * FRAC_PI_2);
        let up = if behind { -normal } else { normal };
        Meeting {
            normal,
            // Neither of unit length nor perpendicular to the normal: renderers do not guarantee that.
            tangent: 2.0 * across + 0.3 * normal,
            // Rays may have any length.
            ray: -1.7 * (cosine * up + sine * aside),
            degrees: part * 90.0,
            behind,
        }
    }

    /// Returns the direction to the viewer, of unit length.
    pub fn view(&self) -> DVec3 {
        -self.ray.normalize()
    }

    /// True if the ray comes from behind the surface.
    pub fn is_behind(&self) -> bool {
        self.behind
    }

    /// Returns rays that all have this geometry.
    pub fn rays(&self, subject: &Subject<'_>, stream: Stream, count: usize) -> Rays {
        let mut rays = subject.rays(Role::Material, stream, 0..count as u64);
        let point = DVec3::new(0.4, 0.7, -1.1);
        rays.set_ray_directions(std::iter::repeat_n(self.ray.as_vec3(), count));
        rays.fill_vector("rt_RayOrigin", (point - 2.0 * self.ray).as_vec3());
        rays.fill_vector("rt_HitPoint", point.as_vec3());
        rays.fill_vector("rt_TextureUVW", point.as_vec3());
        rays.fill("rt_HitDistance", 2.0);
        rays.fill_vector("rt_ShadingNormal", self.normal.as_vec3());
        rays.fill_vector("rt_GeometricNormal", self.normal.as_vec3());
        rays.fill_vector("rt_dPdu", self.tangent.as_vec3());
        rays.fill_vector("rt_dPdv", self.normal.cross(self.tangent).as_vec3());
        rays
    }
}

/// `seen 40 degrees from the normal, from behind`
impl std::fmt::Display for Meeting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let side = if self.behind { ", from behind" } else { "" };
        write!(f, "seen {:.0} degrees from the normal{side}", self.degrees)
    }
}
