//! Vectors of three components, each of them lanes.

use std::ops::{Add, Mul, Sub};

use super::lanes::Floats;
use crate::packet::{Packet, RAYS};

/// A vector for each lane.
#[derive(Clone, Copy)]
pub struct Vec3<F> {
    /// First component.
    pub x: F,
    /// Second component.
    pub y: F,
    /// Third component.
    pub z: F,
}

impl<F: Floats> Vec3<F> {
    #[inline(always)]
    pub fn new(x: F, y: F, z: F) -> Vec3<F> {
        Vec3 { x, y, z }
    }

    #[inline(always)]
    pub fn splat(x: f32, y: f32, z: f32) -> Vec3<F> {
        Vec3 { x: F::splat(x), y: F::splat(y), z: F::splat(z) }
    }

    /// Three arrays that follow one another.
    ///
    /// # Safety
    /// They are there, as [`Floats::load`] wants them.
    #[inline(always)]
    pub unsafe fn load(from: *const f32) -> Vec3<F> {
        // Safety: as promised by the caller.
        unsafe {
            Vec3 { x: F::load(from), y: F::load(from.add(RAYS)), z: F::load(from.add(2 * RAYS)) }
        }
    }

    /// To three arrays that follow one another.
    ///
    /// # Safety
    /// As for `load`.
    #[inline(always)]
    pub unsafe fn store(self, to: *mut f32) {
        // Safety: as promised by the caller.
        unsafe {
            self.x.store(to);
            self.y.store(to.add(RAYS));
            self.z.store(to.add(2 * RAYS));
        }
    }

    /// Three parameters that follow one another.
    ///
    /// # Safety
    /// The race has them.
    #[inline(always)]
    pub unsafe fn parameter(packet: Packet, first: usize) -> Vec3<F> {
        // Safety: as promised by the caller.
        unsafe {
            Vec3::splat(
                packet.parameter(first),
                packet.parameter(first + 1),
                packet.parameter(first + 2),
            )
        }
    }

    #[inline(always)]
    pub fn dot(self, other: Vec3<F>) -> F {
        self.z.mul_add(other.z, self.y.mul_add(other.y, self.x * other.x))
    }

    #[inline(always)]
    pub fn cross(self, other: Vec3<F>) -> Vec3<F> {
        Vec3 {
            x: self.y.mul_sub(other.z, self.z * other.y),
            y: self.z.mul_sub(other.x, self.x * other.z),
            z: self.x.mul_sub(other.y, self.y * other.x),
        }
    }

    /// `self * scale + other`.
    #[inline(always)]
    pub fn scale_add(self, scale: F, other: Vec3<F>) -> Vec3<F> {
        Vec3 {
            x: self.x.mul_add(scale, other.x),
            y: self.y.mul_add(scale, other.y),
            z: self.z.mul_add(scale, other.z),
        }
    }

    #[inline(always)]
    pub fn select(mask: F::Mask, yes: Vec3<F>, no: Vec3<F>) -> Vec3<F> {
        Vec3 {
            x: F::select(mask, yes.x, no.x),
            y: F::select(mask, yes.y, no.y),
            z: F::select(mask, yes.z, no.z),
        }
    }
}

impl<F: Floats> Add for Vec3<F> {
    type Output = Vec3<F>;
    #[inline(always)]
    fn add(self, other: Vec3<F>) -> Vec3<F> {
        Vec3 { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl<F: Floats> Sub for Vec3<F> {
    type Output = Vec3<F>;
    #[inline(always)]
    fn sub(self, other: Vec3<F>) -> Vec3<F> {
        Vec3 { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl<F: Floats> Mul<F> for Vec3<F> {
    type Output = Vec3<F>;
    #[inline(always)]
    fn mul(self, scale: F) -> Vec3<F> {
        Vec3 { x: self.x * scale, y: self.y * scale, z: self.z * scale }
    }
}
