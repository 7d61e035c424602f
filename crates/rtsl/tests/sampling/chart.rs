//! Curved surfaces, unrolled onto the sphere of directions.
//!
//! Seen from a point, their density has no bound where the surface is seen from the side, and no sum
//! over a grid of directions comes near its integral. On the surface itself it is as smooth as the
//! sampling.
#![allow(clippy::disallowed_methods, reason = "these numbers only test; no result depends on them")]

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

/// A surface around the y axis: the angle around the axis becomes that of a direction, what is left
/// its height.
#[derive(Clone, Copy)]
pub enum Chart {
    Cylinder { radius: f32, low: f32, high: f32 },
    Torus { major: f32, minor: f32 },
}

/// A point on a surface.
pub struct Place {
    pub point: Vec3,
    pub normal: Vec3,
    /// Area for each unit of solid angle of the directions that stand for it.
    pub area: f32,
}

impl Chart {
    /// The direction that stands for a point.
    pub fn unroll(self, point: Vec3) -> Vec3 {
        let around = Vec2::new(point.x, point.z).normalize();
        let height = match self {
            Chart::Cylinder { low, high, .. } => (2.0 * point.y - low - high) / (high - low),
            Chart::Torus { major, .. } => {
                point.y.atan2(Vec2::new(point.x, point.z).length() - major) / PI
            }
        };
        let height = height.clamp(-1.0, 1.0);
        (around * (1.0 - height * height).sqrt()).extend(height)
    }

    /// The point that a direction stands for.
    pub fn roll(self, direction: Vec3) -> Place {
        let around = direction.truncate().normalize();
        let outward = Vec3::new(around.x, 0.0, around.y);
        match self {
            Chart::Cylinder { radius, low, high } => {
                let half = 0.5 * (high - low);
                let y = low + half * (1.0 + direction.z);
                Place {
                    point: radius * outward + y * Vec3::Y,
                    normal: outward,
                    area: radius * half,
                }
            }
            Chart::Torus { major, minor } => {
                let (sine, cosine) = (PI * direction.z).sin_cos();
                let normal = cosine * outward + sine * Vec3::Y;
                let area = (major + minor * cosine) * minor * PI;
                Place { point: major * outward + minor * normal, normal, area }
            }
        }
    }
}
