//! The vector operations that hand-written kernels use.

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Sub};

/// A vector of floats.
///
/// Every function is inlined into an entry point that is compiled for the instructions it uses. Functions
/// that are not marked `unsafe` rely on that too: only
/// such entry points may instantiate them.
pub trait Floats:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// As many integers.
    type Ints: Ints<Floats = Self, Mask = Self::Mask>;
    /// As many bools.
    type Mask: Mask;
    /// The number of lanes.
    const LANES: usize;

    /// All the same.
    fn splat(value: f32) -> Self;
    /// From aligned memory.
    ///
    /// # Safety
    /// There are `LANES` floats, aligned to their size together.
    unsafe fn load(from: *const f32) -> Self;
    /// To aligned memory.
    ///
    /// # Safety
    /// As for `load`.
    unsafe fn store(self, to: *mut f32);
    /// To aligned memory, the lanes of the mask only.
    ///
    /// # Safety
    /// As for `load`.
    unsafe fn store_where(self, mask: Self::Mask, to: *mut f32);
    /// The same in the way that is fast on every processor: AVX2's masked store takes 18 operations on AMD's
    /// before Zen 4.
    ///
    /// # Safety
    /// As for `load`.
    unsafe fn blend_where(self, mask: Self::Mask, to: *mut f32);
    /// `self * b + c`, rounded once.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `self * b - c`, rounded once.
    fn mul_sub(self, b: Self, c: Self) -> Self;
    /// `c - self * b`, rounded once.
    fn neg_mul_add(self, b: Self, c: Self) -> Self;
    /// Correctly rounded.
    fn sqrt(self) -> Self;
    /// The processor's estimate of `1 / self`.
    fn reciprocal_estimate(self) -> Self;
    /// The processor's estimate of `1 / sqrt(self)`.
    fn inverse_sqrt_estimate(self) -> Self;
    /// Without the sign.
    fn abs(self) -> Self;
    /// The second where either is NaN.
    fn max(self, other: Self) -> Self;
    /// The second where either is NaN.
    fn min(self, other: Self) -> Self;
    /// To the nearest integer, ties to even.
    fn round(self) -> Self;
    /// To the next integer below.
    fn floor(self) -> Self;
    /// Times 2 to the power of an integral number; results below the smallest normal number need not be
    /// right.
    fn scale(self, exponent: Self) -> Self;
    /// `self < other`.
    fn less(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn less_equal(self, other: Self) -> Self::Mask;
    /// `self == other`.
    fn equal(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is on, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// To the nearest integer.
    fn to_ints(self) -> Self::Ints;
    /// The bits.
    fn bits(self) -> Self::Ints;
    /// `table[index & 15]`, from a table that stays in registers where there is such an
    /// instruction; `None` where there is not.
    fn look_up(table: &[f32; 16], index: Self::Ints) -> Option<Self>;

    /// `self > other`.
    #[inline(always)]
    fn greater(self, other: Self) -> Self::Mask {
        other.less(self)
    }

    /// `self >= other`.
    #[inline(always)]
    fn greater_equal(self, other: Self) -> Self::Mask {
        other.less_equal(self)
    }
}

/// A vector of 32-bit integers.
pub trait Ints:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + BitAnd<Output = Self>
    + BitXor<Output = Self>
{
    /// As many floats.
    type Floats;
    /// As many bools.
    type Mask;

    /// All the same.
    fn splat(value: i32) -> Self;
    /// To the left.
    fn shift_left<const BITS: u32>(self) -> Self;
    /// To the right, zeros from the left.
    fn shift_right<const BITS: u32>(self) -> Self;
    /// To the right, signs from the left.
    fn shift_right_signed<const BITS: u32>(self) -> Self;
    /// `self < other`, signed.
    fn less(self, other: Self) -> Self::Mask;
    /// `self == other`.
    fn equal(self, other: Self) -> Self::Mask;
    /// Tests a bit; `bit` has only that one.
    fn has_bit(self, bit: Self) -> Self::Mask;
    /// As floats of the same value.
    fn to_floats(self) -> Self::Floats;
    /// As floats of the same bits.
    fn as_floats(self) -> Self::Floats;
    /// `table[self]`.
    ///
    /// # Safety
    /// The table has an element for every lane.
    unsafe fn gather(self, table: *const i32) -> Self;
}

/// A vector of bools.
pub trait Mask:
    Copy + BitAnd<Output = Self> + BitOr<Output = Self> + BitXor<Output = Self>
{
    /// All on or all off.
    fn splat(on: bool) -> Self;
    /// `self` without `other`.
    fn without(self, other: Self) -> Self;
    /// True if any lane is on.
    fn any(self) -> bool;
}
