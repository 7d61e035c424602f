//! Vectors of 16 lanes with AVX-512.
//!
//! # Safety
//! Two reasons hold for all unsafe blocks of this file. Intrinsics are called in functions that are inlined where the
//! instructions are enabled. Pointers are followed in unsafe functions, whose callers promise that they may be.
#![allow(clippy::undocumented_unsafe_blocks, reason = "the module gives the reason for all")]

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Sub};

use super::lanes::{Floats, Ints, Mask};

/// 16 floats.
#[derive(Clone, Copy)]
pub struct F16(__m512);

/// 16 integers.
#[derive(Clone, Copy)]
pub struct I16(__m512i);

/// 16 bools, one bit each.
#[derive(Clone, Copy)]
pub struct M16(__mmask16);

/// Implements an operator by an intrinsic.
macro_rules! operator {
    ($ty:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for $ty {
            type Output = $ty;
            #[inline(always)]
            fn $method(self, other: $ty) -> $ty {
                $ty(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}

operator!(F16, Add, add, _mm512_add_ps);
operator!(F16, Sub, sub, _mm512_sub_ps);
operator!(F16, Mul, mul, _mm512_mul_ps);
operator!(F16, Div, div, _mm512_div_ps);
operator!(I16, Add, add, _mm512_add_epi32);
operator!(I16, Sub, sub, _mm512_sub_epi32);
operator!(I16, Mul, mul, _mm512_mullo_epi32);
operator!(I16, BitAnd, bitand, _mm512_and_si512);
operator!(I16, BitXor, bitxor, _mm512_xor_si512);
operator!(M16, BitAnd, bitand, _kand_mask16);
operator!(M16, BitXor, bitxor, _kxor_mask16);
operator!(M16, BitOr, bitor, _kor_mask16);

impl Neg for F16 {
    type Output = F16;
    #[inline(always)]
    fn neg(self) -> F16 {
        (self.bits() ^ I16::splat(i32::MIN)).as_floats()
    }
}

impl Floats for F16 {
    type Ints = I16;
    type Mask = M16;
    const LANES: usize = 16;

    #[inline(always)]
    fn splat(value: f32) -> F16 {
        F16(unsafe { _mm512_set1_ps(value) })
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> F16 {
        F16(unsafe { _mm512_load_ps(from) })
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { _mm512_store_ps(to, self.0) }
    }

    #[inline(always)]
    unsafe fn store_where(self, mask: M16, to: *mut f32) {
        unsafe { _mm512_mask_store_ps(to, mask.0, self.0) }
    }

    #[inline(always)]
    unsafe fn blend_where(self, mask: M16, to: *mut f32) {
        unsafe { self.store_where(mask, to) }
    }

    #[inline(always)]
    fn mul_add(self, b: F16, c: F16) -> F16 {
        F16(unsafe { _mm512_fmadd_ps(self.0, b.0, c.0) })
    }

    #[inline(always)]
    fn mul_sub(self, b: F16, c: F16) -> F16 {
        F16(unsafe { _mm512_fmsub_ps(self.0, b.0, c.0) })
    }

    #[inline(always)]
    fn neg_mul_add(self, b: F16, c: F16) -> F16 {
        F16(unsafe { _mm512_fnmadd_ps(self.0, b.0, c.0) })
    }

    #[inline(always)]
    fn sqrt(self) -> F16 {
        F16(unsafe { _mm512_sqrt_ps(self.0) })
    }

    #[inline(always)]
    fn reciprocal_estimate(self) -> F16 {
        F16(unsafe { _mm512_rcp14_ps(self.0) })
    }

    #[inline(always)]
    fn inverse_sqrt_estimate(self) -> F16 {
        F16(unsafe { _mm512_rsqrt14_ps(self.0) })
    }

    #[inline(always)]
    fn abs(self) -> F16 {
        (self.bits() & I16::splat(i32::MAX)).as_floats()
    }

    #[inline(always)]
    fn max(self, other: F16) -> F16 {
        F16(unsafe { _mm512_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn min(self, other: F16) -> F16 {
        F16(unsafe { _mm512_min_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn round(self) -> F16 {
        F16(unsafe { _mm512_roundscale_ps::<8>(self.0) })
    }

    #[inline(always)]
    fn floor(self) -> F16 {
        F16(unsafe { _mm512_roundscale_ps::<9>(self.0) })
    }

    #[inline(always)]
    fn scale(self, exponent: F16) -> F16 {
        F16(unsafe { _mm512_scalef_ps(self.0, exponent.0) })
    }

    #[inline(always)]
    fn less(self, other: F16) -> M16 {
        M16(unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn less_equal(self, other: F16) -> M16 {
        M16(unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn equal(self, other: F16) -> M16 {
        M16(unsafe { _mm512_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn select(mask: M16, yes: F16, no: F16) -> F16 {
        F16(unsafe { _mm512_mask_blend_ps(mask.0, no.0, yes.0) })
    }

    #[inline(always)]
    fn to_ints(self) -> I16 {
        I16(unsafe { _mm512_cvtps_epi32(self.0) })
    }

    #[inline(always)]
    fn bits(self) -> I16 {
        I16(unsafe { _mm512_castps_si512(self.0) })
    }

    #[inline(always)]
    fn look_up(table: &[f32; 16], index: I16) -> Option<F16> {
        Some(F16(unsafe { _mm512_permutexvar_ps(index.0, _mm512_loadu_ps(table.as_ptr())) }))
    }
}

impl Ints for I16 {
    type Floats = F16;
    type Mask = M16;

    #[inline(always)]
    fn splat(value: i32) -> I16 {
        I16(unsafe { _mm512_set1_epi32(value) })
    }

    #[inline(always)]
    fn shift_left<const BITS: u32>(self) -> I16 {
        I16(unsafe { _mm512_slli_epi32::<BITS>(self.0) })
    }

    #[inline(always)]
    fn shift_right<const BITS: u32>(self) -> I16 {
        I16(unsafe { _mm512_srli_epi32::<BITS>(self.0) })
    }

    #[inline(always)]
    fn shift_right_signed<const BITS: u32>(self) -> I16 {
        I16(unsafe { _mm512_srai_epi32::<BITS>(self.0) })
    }

    #[inline(always)]
    fn less(self, other: I16) -> M16 {
        M16(unsafe { _mm512_cmplt_epi32_mask(self.0, other.0) })
    }

    #[inline(always)]
    fn equal(self, other: I16) -> M16 {
        M16(unsafe { _mm512_cmpeq_epi32_mask(self.0, other.0) })
    }

    #[inline(always)]
    fn has_bit(self, bit: I16) -> M16 {
        M16(unsafe { _mm512_test_epi32_mask(self.0, bit.0) })
    }

    #[inline(always)]
    fn to_floats(self) -> F16 {
        F16(unsafe { _mm512_cvtepi32_ps(self.0) })
    }

    #[inline(always)]
    fn as_floats(self) -> F16 {
        F16(unsafe { _mm512_castsi512_ps(self.0) })
    }

    #[inline(always)]
    unsafe fn gather(self, table: *const i32) -> I16 {
        I16(unsafe { _mm512_i32gather_epi32::<4>(self.0, table) })
    }
}

impl Mask for M16 {
    #[inline(always)]
    fn splat(on: bool) -> M16 {
        M16(if on { u16::MAX } else { 0 })
    }

    #[inline(always)]
    fn without(self, other: M16) -> M16 {
        M16(self.0 & !other.0)
    }

    #[inline(always)]
    fn any(self) -> bool {
        self.0 != 0
    }
}
