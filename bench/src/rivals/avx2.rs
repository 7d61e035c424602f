//! Vectors of 8 lanes with AVX2 and FMA.
//!
//! # Safety
//! Two reasons hold for all unsafe blocks of this file. Intrinsics are called in functions that are inlined where the
//! instructions are enabled. Pointers are followed in unsafe functions, whose callers promise that they may be.
#![allow(clippy::undocumented_unsafe_blocks, reason = "the module gives the reason for all")]

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Sub};

use super::lanes::{Floats, Ints, Mask};

/// 8 floats.
#[derive(Clone, Copy)]
pub struct F8(__m256);

/// 8 integers.
#[derive(Clone, Copy)]
pub struct I8(__m256i);

/// 8 bools, all bits of a lane the same.
#[derive(Clone, Copy)]
pub struct M8(__m256);

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

operator!(F8, Add, add, _mm256_add_ps);
operator!(F8, Sub, sub, _mm256_sub_ps);
operator!(F8, Mul, mul, _mm256_mul_ps);
operator!(F8, Div, div, _mm256_div_ps);
operator!(I8, Add, add, _mm256_add_epi32);
operator!(I8, Sub, sub, _mm256_sub_epi32);
operator!(I8, Mul, mul, _mm256_mullo_epi32);
operator!(I8, BitAnd, bitand, _mm256_and_si256);
operator!(I8, BitXor, bitxor, _mm256_xor_si256);
operator!(M8, BitAnd, bitand, _mm256_and_ps);
operator!(M8, BitXor, bitxor, _mm256_xor_ps);
operator!(M8, BitOr, bitor, _mm256_or_ps);

impl Neg for F8 {
    type Output = F8;
    #[inline(always)]
    fn neg(self) -> F8 {
        (self.bits() ^ I8::splat(i32::MIN)).as_floats()
    }
}

impl Floats for F8 {
    type Ints = I8;
    type Mask = M8;
    const LANES: usize = 8;

    #[inline(always)]
    fn splat(value: f32) -> F8 {
        F8(unsafe { _mm256_set1_ps(value) })
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> F8 {
        F8(unsafe { _mm256_load_ps(from) })
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { _mm256_store_ps(to, self.0) }
    }

    #[inline(always)]
    unsafe fn store_where(self, mask: M8, to: *mut f32) {
        unsafe { _mm256_maskstore_ps(to, _mm256_castps_si256(mask.0), self.0) }
    }

    #[inline(always)]
    unsafe fn blend_where(self, mask: M8, to: *mut f32) {
        // Volatile, or LLVM makes a masked store of it again.
        let before = F8(unsafe { std::ptr::read_volatile(to.cast()) });
        unsafe { F8::select(mask, self, before).store(to) }
    }

    #[inline(always)]
    fn mul_add(self, b: F8, c: F8) -> F8 {
        F8(unsafe { _mm256_fmadd_ps(self.0, b.0, c.0) })
    }

    #[inline(always)]
    fn mul_sub(self, b: F8, c: F8) -> F8 {
        F8(unsafe { _mm256_fmsub_ps(self.0, b.0, c.0) })
    }

    #[inline(always)]
    fn neg_mul_add(self, b: F8, c: F8) -> F8 {
        F8(unsafe { _mm256_fnmadd_ps(self.0, b.0, c.0) })
    }

    #[inline(always)]
    fn sqrt(self) -> F8 {
        F8(unsafe { _mm256_sqrt_ps(self.0) })
    }

    #[inline(always)]
    fn reciprocal_estimate(self) -> F8 {
        F8(unsafe { _mm256_rcp_ps(self.0) })
    }

    #[inline(always)]
    fn inverse_sqrt_estimate(self) -> F8 {
        F8(unsafe { _mm256_rsqrt_ps(self.0) })
    }

    #[inline(always)]
    fn abs(self) -> F8 {
        (self.bits() & I8::splat(i32::MAX)).as_floats()
    }

    #[inline(always)]
    fn max(self, other: F8) -> F8 {
        F8(unsafe { _mm256_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn min(self, other: F8) -> F8 {
        F8(unsafe { _mm256_min_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn round(self) -> F8 {
        F8(unsafe { _mm256_round_ps::<8>(self.0) })
    }

    #[inline(always)]
    fn floor(self) -> F8 {
        F8(unsafe { _mm256_round_ps::<9>(self.0) })
    }

    #[inline(always)]
    fn scale(self, exponent: F8) -> F8 {
        let exponent = exponent.max(F8::splat(-126.0)).to_ints();
        self * (exponent + I8::splat(127)).shift_left::<23>().as_floats()
    }

    #[inline(always)]
    fn less(self, other: F8) -> M8 {
        M8(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn less_equal(self, other: F8) -> M8 {
        M8(unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn equal(self, other: F8) -> M8 {
        M8(unsafe { _mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn select(mask: M8, yes: F8, no: F8) -> F8 {
        F8(unsafe { _mm256_blendv_ps(no.0, yes.0, mask.0) })
    }

    #[inline(always)]
    fn to_ints(self) -> I8 {
        I8(unsafe { _mm256_cvtps_epi32(self.0) })
    }

    #[inline(always)]
    fn bits(self) -> I8 {
        I8(unsafe { _mm256_castps_si256(self.0) })
    }

    #[inline(always)]
    fn look_up(_: &[f32; 16], _: I8) -> Option<F8> {
        None
    }
}

impl Ints for I8 {
    type Floats = F8;
    type Mask = M8;

    #[inline(always)]
    fn splat(value: i32) -> I8 {
        I8(unsafe { _mm256_set1_epi32(value) })
    }

    #[inline(always)]
    fn shift_left<const BITS: u32>(self) -> I8 {
        I8(unsafe { _mm256_sll_epi32(self.0, _mm_cvtsi32_si128(BITS as i32)) })
    }

    #[inline(always)]
    fn shift_right<const BITS: u32>(self) -> I8 {
        I8(unsafe { _mm256_srl_epi32(self.0, _mm_cvtsi32_si128(BITS as i32)) })
    }

    #[inline(always)]
    fn shift_right_signed<const BITS: u32>(self) -> I8 {
        I8(unsafe { _mm256_sra_epi32(self.0, _mm_cvtsi32_si128(BITS as i32)) })
    }

    #[inline(always)]
    fn less(self, other: I8) -> M8 {
        M8(unsafe { _mm256_castsi256_ps(_mm256_cmpgt_epi32(other.0, self.0)) })
    }

    #[inline(always)]
    fn equal(self, other: I8) -> M8 {
        M8(unsafe { _mm256_castsi256_ps(_mm256_cmpeq_epi32(self.0, other.0)) })
    }

    #[inline(always)]
    fn has_bit(self, bit: I8) -> M8 {
        (self & bit).equal(bit)
    }

    #[inline(always)]
    fn to_floats(self) -> F8 {
        F8(unsafe { _mm256_cvtepi32_ps(self.0) })
    }

    #[inline(always)]
    fn as_floats(self) -> F8 {
        F8(unsafe { _mm256_castsi256_ps(self.0) })
    }

    #[inline(always)]
    unsafe fn gather(self, table: *const i32) -> I8 {
        I8(unsafe { _mm256_i32gather_epi32::<4>(table, self.0) })
    }
}

impl Mask for M8 {
    #[inline(always)]
    fn splat(on: bool) -> M8 {
        M8(I8::splat(if on { -1 } else { 0 }).as_floats().0)
    }

    #[inline(always)]
    fn without(self, other: M8) -> M8 {
        M8(unsafe { _mm256_andnot_ps(other.0, self.0) })
    }

    #[inline(always)]
    fn any(self) -> bool {
        (unsafe { _mm256_movemask_ps(self.0) }) != 0
    }
}
