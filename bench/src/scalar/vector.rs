//! Vectors of three components for one ray.

use std::ops::{Add, Mul, Neg, Sub};

use super::real::Real;

#[derive(Clone, Copy, Debug)]
pub struct Vec3<R> {
    pub x: R,
    pub y: R,
    pub z: R,
}

impl<R: Real> Vec3<R> {
    #[inline(always)]
    pub fn new(x: R, y: R, z: R) -> Vec3<R> {
        Vec3 { x, y, z }
    }

    #[inline(always)]
    pub fn splat(value: f64) -> Vec3<R> {
        Vec3 { x: R::of(value), y: R::of(value), z: R::of(value) }
    }

    #[inline(always)]
    pub fn dot(self, other: Vec3<R>) -> R {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub fn cross(self, other: Vec3<R>) -> Vec3<R> {
        Vec3 {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    #[inline(always)]
    pub fn normalize(self) -> Vec3<R> {
        self * (R::of(1.0) / self.dot(self).sqrt())
    }
}

impl<R: Real> Add for Vec3<R> {
    type Output = Vec3<R>;
    #[inline(always)]
    fn add(self, other: Vec3<R>) -> Vec3<R> {
        Vec3 { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl<R: Real> Sub for Vec3<R> {
    type Output = Vec3<R>;
    #[inline(always)]
    fn sub(self, other: Vec3<R>) -> Vec3<R> {
        Vec3 { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl<R: Real> Mul<R> for Vec3<R> {
    type Output = Vec3<R>;
    #[inline(always)]
    fn mul(self, scale: R) -> Vec3<R> {
        Vec3 { x: self.x * scale, y: self.y * scale, z: self.z * scale }
    }
}

impl<R: Real> Neg for Vec3<R> {
    type Output = Vec3<R>;
    #[inline(always)]
    fn neg(self) -> Vec3<R> {
        Vec3 { x: -self.x, y: -self.y, z: -self.z }
    }
}
