//! Elementary functions after Cephes (Moshier), to about 2 units in the last place.

use std::f32::consts::{FRAC_2_PI, FRAC_PI_2, LN_2, LOG2_E};

use super::lanes::{Floats, Ints};

/// `coefficients` from the highest power down, at `x`.
#[inline(always)]
fn polynomial<F: Floats, const N: usize>(x: F, coefficients: [f32; N]) -> F {
    let mut sum = F::splat(coefficients[0]);
    let mut index = 1;
    while index < N {
        sum = sum.mul_add(x, F::splat(coefficients[index]));
        index += 1;
    }
    sum
}

#[inline(always)]
pub fn exp<F: Floats>(x: F) -> F {
    let n = (x * F::splat(LOG2_E)).round();
    let f = n.mul_add(F::splat(-0.693_359_4), x);
    let f = n.mul_add(F::splat(2.121_944_4e-4), f);
    let q = polynomial(
        f,
        [1.987_569_1e-4, 1.398_199_9e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5],
    );
    q.mul_add(f * f, f + F::splat(1.0)).scale(n)
}

#[inline(always)]
pub fn exp2<F: Floats>(x: F) -> F {
    let n = x.round();
    let f = x - n;
    let q = polynomial(
        f,
        [
            1.535_336_2e-4,
            1.339_887_4e-3,
            9.618_437e-3,
            5.550_332_5e-2,
            2.402_264_7e-1,
            6.931_472e-1,
        ],
    );
    q.mul_add(f, F::splat(1.0)).scale(n)
}

#[inline(always)]
pub fn log2<F: Floats>(x: F) -> F {
    // The bits of sqrt(1/2), so that the significand lies around 1.
    let half_root = <F::Ints as Ints>::splat(0x3f35_04f3);
    let b = x.bits() - half_root;
    let e = b.shift_right_signed::<23>().to_floats();
    let significand = (b & <F::Ints as Ints>::splat(0x7f_ffff)) + half_root;
    let f = significand.as_floats() - F::splat(1.0);
    let z = f * f;
    let q = polynomial(
        f,
        [
            7.037_683_6e-2,
            -1.151_461e-1,
            1.167_699_87e-1,
            -1.242_014_1e-1,
            1.424_932_3e-1,
            -1.666_805_8e-1,
            2.000_071_4e-1,
            -2.499_999_4e-1,
            3.333_333e-1,
        ],
    );
    let l = (z * f).mul_add(q, F::splat(-0.5).mul_add(z, f));
    l.mul_add(F::splat(LOG2_E), e)
}

#[inline(always)]
pub fn log<F: Floats>(x: F) -> F {
    log2(x) * F::splat(LN_2)
}

#[inline(always)]
pub fn pow<F: Floats>(a: F, b: F) -> F {
    exp2(b * log2(a))
}

/// Sine and cosine for `|r| <= pi / 4`.
#[inline(always)]
pub fn sin_cos_reduced<F: Floats>(r: F) -> (F, F) {
    let z = r * r;
    let s = polynomial(z, [-1.951_529_6e-4, 8.332_161e-3, -1.666_665_5e-1]).mul_add(z * r, r);
    let c = polynomial(z, [2.443_315_7e-5, -1.388_731_6e-3, 4.166_664_6e-2])
        .mul_add(z * z, F::splat(-0.5).mul_add(z, F::splat(1.0)));
    (s, c)
}

/// Sine and cosine; the reduction is Cody and Waite's.
#[inline(always)]
pub fn sin_cos<F: Floats>(x: F) -> (F, F) {
    let n = (x * F::splat(FRAC_2_PI)).round();
    let r = n.mul_add(F::splat(-1.570_312_5), x);
    let r = n.mul_add(F::splat(-4.837_513e-4), r);
    let r = n.mul_add(F::splat(-7.549_79e-8), r);
    let (s, c) = sin_cos_reduced(r);
    place_in_quadrant(n.to_ints(), s, c)
}

#[inline(always)]
fn place_in_quadrant<F: Floats>(quadrant: F::Ints, s: F, c: F) -> (F, F) {
    let (one, two) = (<F::Ints as Ints>::splat(1), <F::Ints as Ints>::splat(2));
    let swapped = quadrant.has_bit(one);
    let sine = F::select(swapped, c, s).bits() ^ (quadrant & two).shift_left::<30>();
    let cosine = F::select(swapped, s, c).bits() ^ ((quadrant + one) & two).shift_left::<30>();
    (sine.as_floats(), cosine.as_floats())
}

/// Sine and cosine of a turn in `0..=1`, where 1 is the whole circle: its reduction is exact.
#[inline(always)]
pub fn sin_cos_of_turn<F: Floats>(turn: F) -> (F, F) {
    let quarters = turn * F::splat(4.0);
    let n = quarters.round();
    let (s, c) = sin_cos_reduced((quarters - n) * F::splat(FRAC_PI_2));
    place_in_quadrant(n.to_ints(), s, c)
}
