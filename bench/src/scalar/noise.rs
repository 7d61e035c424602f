//! Six octaves of noise.

use super::{Ray, Real, Scalar, Vec3};
use crate::kernels::{HashedFbm, TableFbm};

impl Scalar for HashedFbm {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        octaves::<R>(ray, hashed_corners);
    }
}

impl Scalar for TableFbm {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        octaves::<R>(ray, table_corners);
    }
}

#[inline(always)]
fn octaves<R: Real>(ray: Ray, corners: impl Fn(Ray, [u32; 3]) -> [u32; 8]) {
    let mut p = ray.vector::<R>(0);
    let (mut sum, mut amplitude) = (R::of(0.0), R::of(1.0));
    for _ in 0..6 {
        let cell = Vec3::new(p.x.floor(), p.y.floor(), p.z.floor());
        let lattice = [cell.x, cell.y, cell.z].map(|it| it.to_i32().cast_unsigned());
        sum += amplitude * blend(corners(ray, lattice), p - cell);
        p = p * R::of(2.0);
        amplitude *= R::of(0.5);
    }
    ray.set_state(3, sum);
}

#[inline(always)]
fn hashed_corners(_: Ray, [i, j, k]: [u32; 3]) -> [u32; 8] {
    let (a, b, c) = (0x8da6_b343_u32, 0xd816_3841_u32, 0xcb1a_b31f_u32);
    let s = i.wrapping_mul(a).wrapping_add(j.wrapping_mul(b)).wrapping_add(k.wrapping_mul(c));
    let corner = |number: u32| {
        let along = |axis: u32, step: u32| if number >> axis & 1 != 0 { step } else { 0 };
        let steps = along(0, a).wrapping_add(along(1, b)).wrapping_add(along(2, c));
        let h = s.wrapping_add(steps);
        let h = (h ^ h >> 13).wrapping_mul(0x5bd1_e995);
        h ^ h >> 15
    };
    [corner(0), corner(1), corner(2), corner(3), corner(4), corner(5), corner(6), corner(7)]
}

#[inline(always)]
fn table_corners(ray: Ray, lattice: [u32; 3]) -> [u32; 8] {
    let [i, j, k] = lattice.map(|it| it & 255);
    let table = |index| ray.table(index);
    let (a, b) = (table(i) + j, table(i + 1) + j);
    let (aa, ab, ba, bb) = (table(a) + k, table(a + 1) + k, table(b) + k, table(b + 1) + k);
    [
        table(aa),
        table(ba),
        table(ab),
        table(bb),
        table(aa + 1),
        table(ba + 1),
        table(ab + 1),
        table(bb + 1),
    ]
}

#[inline(always)]
fn blend<R: Real>(h: [u32; 8], Vec3 { x, y, z }: Vec3<R>) -> R {
    let one = R::of(1.0);
    let (x1, y1, z1) = (x - one, y - one, z - one);
    let (u, v, w) = (fade(x), fade(y), fade(z));
    let low = between(
        v,
        between(u, gradient(h[0], x, y, z), gradient(h[1], x1, y, z)),
        between(u, gradient(h[2], x, y1, z), gradient(h[3], x1, y1, z)),
    );
    let high = between(
        v,
        between(u, gradient(h[4], x, y, z1), gradient(h[5], x1, y, z1)),
        between(u, gradient(h[6], x, y1, z1), gradient(h[7], x1, y1, z1)),
    );
    between(w, low, high)
}

#[inline(always)]
fn fade<R: Real>(t: R) -> R {
    t * t * t * (t * (t * R::of(6.0) - R::of(15.0)) + R::of(10.0))
}

#[inline(always)]
fn between<R: Real>(t: R, a: R, b: R) -> R {
    a + t * (b - a)
}

#[inline(always)]
fn gradient<R: Real>(h: u32, x: R, y: R, z: R) -> R {
    let h = h & 15;
    let u = if h < 8 { x } else { y };
    let v = match h {
        0..4 => y,
        12 | 14 => x,
        _ => z,
    };
    (if h & 1 != 0 { -u } else { u }) + (if h & 2 != 0 { -v } else { v })
}
