//! Arithmetic in single and double precision.
#![allow(clippy::disallowed_methods, reason = "compared within a tolerance only")]

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub};

/// f32 or f64.
pub trait Real:
    Copy
    + Debug
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + MulAssign
{
    fn of(value: f64) -> Self;
    fn from_f32(value: f32) -> Self;
    fn to_f32(self) -> f32;
    fn to_i32(self) -> i32;
    fn abs(self) -> Self;
    fn floor(self) -> Self;
    fn sqrt(self) -> Self;
    fn exp(self) -> Self;
    fn log(self) -> Self;
    fn pow(self, exponent: Self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn max(self, other: Self) -> Self;
    fn min(self, other: Self) -> Self;
}

macro_rules! real {
    ($ty:ident) => {
        impl Real for $ty {
            #[inline(always)]
            fn of(value: f64) -> $ty {
                value as $ty
            }
            #[inline(always)]
            fn from_f32(value: f32) -> $ty {
                value as $ty
            }
            #[inline(always)]
            fn to_f32(self) -> f32 {
                self as f32
            }
            #[inline(always)]
            fn to_i32(self) -> i32 {
                self as i32
            }
            #[inline(always)]
            fn abs(self) -> $ty {
                $ty::abs(self)
            }
            #[inline(always)]
            fn floor(self) -> $ty {
                $ty::floor(self)
            }
            #[inline(always)]
            fn sqrt(self) -> $ty {
                $ty::sqrt(self)
            }
            #[inline(always)]
            fn exp(self) -> $ty {
                $ty::exp(self)
            }
            #[inline(always)]
            fn log(self) -> $ty {
                $ty::ln(self)
            }
            #[inline(always)]
            fn pow(self, exponent: $ty) -> $ty {
                $ty::powf(self, exponent)
            }
            #[inline(always)]
            fn sin(self) -> $ty {
                $ty::sin(self)
            }
            #[inline(always)]
            fn cos(self) -> $ty {
                $ty::cos(self)
            }
            #[inline(always)]
            fn max(self, other: $ty) -> $ty {
                $ty::max(self, other)
            }
            #[inline(always)]
            fn min(self, other: $ty) -> $ty {
                $ty::min(self, other)
            }
        }
    };
}

real!(f32);
real!(f64);
