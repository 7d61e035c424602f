//! The division and square root of the rivals.

use super::lanes::Floats;

/// Division and square root, exact or good to about 22 bits.
pub trait Precision {
    /// True for the tuned variant.
    const TUNED: bool;
    /// `1 / a`.
    fn reciprocal<F: Floats>(a: F) -> F;
    /// `a / b`.
    fn divide<F: Floats>(a: F, b: F) -> F;
    /// The square root.
    fn sqrt<F: Floats>(a: F) -> F;
    /// `1 / sqrt(a)`.
    fn inverse_sqrt<F: Floats>(a: F) -> F;
    /// Stores the lanes of a mask.
    ///
    /// # Safety
    /// As for [`Floats::store`].
    unsafe fn store_where<F: Floats>(value: F, mask: F::Mask, to: *mut f32);
}

/// The processor's division and square root, correctly rounded.
pub struct Exact;

/// The processor's estimates and one step of Newton's method; blends instead of masked stores, which are slow on some
/// processors.
pub struct Tuned;

impl Precision for Exact {
    const TUNED: bool = false;

    #[inline(always)]
    fn reciprocal<F: Floats>(a: F) -> F {
        F::splat(1.0) / a
    }

    #[inline(always)]
    fn divide<F: Floats>(a: F, b: F) -> F {
        a / b
    }

    #[inline(always)]
    fn sqrt<F: Floats>(a: F) -> F {
        a.sqrt()
    }

    #[inline(always)]
    fn inverse_sqrt<F: Floats>(a: F) -> F {
        F::splat(1.0) / a.sqrt()
    }

    #[inline(always)]
    unsafe fn store_where<F: Floats>(value: F, mask: F::Mask, to: *mut f32) {
        // Safety: as promised by the caller.
        unsafe { value.store_where(mask, to) }
    }
}

impl Precision for Tuned {
    const TUNED: bool = true;

    #[inline(always)]
    fn reciprocal<F: Floats>(a: F) -> F {
        let r = a.reciprocal_estimate();
        r * a.neg_mul_add(r, F::splat(2.0))
    }

    #[inline(always)]
    fn divide<F: Floats>(a: F, b: F) -> F {
        a * Self::reciprocal(b)
    }

    #[inline(always)]
    fn sqrt<F: Floats>(a: F) -> F {
        let a = a.max(F::splat(1e-30));
        a * Self::inverse_sqrt(a)
    }

    #[inline(always)]
    fn inverse_sqrt<F: Floats>(a: F) -> F {
        let r = a.inverse_sqrt_estimate();
        r * (F::splat(0.5) * a * r).neg_mul_add(r, F::splat(1.5))
    }

    #[inline(always)]
    unsafe fn store_where<F: Floats>(value: F, mask: F::Mask, to: *mut f32) {
        // Safety: as promised by the caller.
        unsafe { value.blend_where(mask, to) }
    }
}
