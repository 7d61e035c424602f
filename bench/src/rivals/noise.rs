//! Six octaves of gradient noise, its lattice hashed or in a table.

use super::Chunk;
use super::lanes::{Floats, Ints};
use super::precision::Precision;
use super::vector::Vec3;
use crate::kernels::{HashedFbm, TableFbm};
use crate::packet::Packet;

impl Chunk for HashedFbm {
    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the race has these arrays, as the caller promises.
        unsafe {
            let mut p = Vec3::<F>::load(packet.state(0));
            let (mut sum, mut amplitude) = (F::splat(0.0), F::splat(1.0));
            for _ in 0..6 {
                let cell = Vec3::new(p.x.floor(), p.y.floor(), p.z.floor());
                sum = amplitude.mul_add(blend::<F, P>(hashed_corners(cell), p - cell), sum);
                p = p * F::splat(2.0);
                amplitude = amplitude * F::splat(0.5);
            }
            sum.store(packet.state(3));
        }
    }
}

impl Chunk for TableFbm {
    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the caller's promise.
        unsafe {
            let table = packet.parameters.cast::<i32>();
            let mut p = Vec3::<F>::load(packet.state(0));
            let (mut sum, mut amplitude) = (F::splat(0.0), F::splat(1.0));
            for _ in 0..6 {
                let cell = Vec3::new(p.x.floor(), p.y.floor(), p.z.floor());
                sum = amplitude.mul_add(blend::<F, P>(table_corners(cell, table), p - cell), sum);
                p = p * F::splat(2.0);
                amplitude = amplitude * F::splat(0.5);
            }
            sum.store(packet.state(3));
        }
    }
}

#[inline(always)]
fn hashed_corners<F: Floats>(cell: Vec3<F>) -> [F::Ints; 8] {
    let constant = |bits: u32| <F::Ints as Ints>::splat(bits.cast_signed());
    let (a, b, c) = (constant(0x8da6_b343), constant(0xd816_3841), constant(0xcb1a_b31f));
    let s = cell.x.to_ints() * a + cell.y.to_ints() * b + cell.z.to_ints() * c;
    [
        mix_bits::<F>(s),
        mix_bits::<F>(s + a),
        mix_bits::<F>(s + b),
        mix_bits::<F>(s + (a + b)),
        mix_bits::<F>(s + c),
        mix_bits::<F>(s + (a + c)),
        mix_bits::<F>(s + (b + c)),
        mix_bits::<F>(s + (a + b + c)),
    ]
}

#[inline(always)]
fn mix_bits<F: Floats>(h: F::Ints) -> F::Ints {
    let h = h ^ h.shift_right::<13>();
    let h = h * <F::Ints as Ints>::splat(0x5bd1_e995);
    h ^ h.shift_right::<15>()
}

/// # Safety
/// The table is a permutation of 0 to 255, twice.
#[inline(always)]
unsafe fn table_corners<F: Floats>(cell: Vec3<F>, table: *const i32) -> [F::Ints; 8] {
    // Safety: every index is below 512: a value of the table and a byte.
    unsafe {
        let (byte, one) = (<F::Ints as Ints>::splat(255), <F::Ints as Ints>::splat(1));
        let i = cell.x.to_ints() & byte;
        let j = cell.y.to_ints() & byte;
        let k = cell.z.to_ints() & byte;
        let a = i.gather(table) + j;
        let b = (i + one).gather(table) + j;
        let aa = a.gather(table) + k;
        let ab = (a + one).gather(table) + k;
        let ba = b.gather(table) + k;
        let bb = (b + one).gather(table) + k;
        [
            aa.gather(table),
            ba.gather(table),
            ab.gather(table),
            bb.gather(table),
            (aa + one).gather(table),
            (ba + one).gather(table),
            (ab + one).gather(table),
            (bb + one).gather(table),
        ]
    }
}

#[inline(always)]
fn blend<F: Floats, P: Precision>(h: [F::Ints; 8], p: Vec3<F>) -> F {
    let one = F::splat(1.0);
    let Vec3 { x, y, z } = p;
    let (x1, y1, z1) = (x - one, y - one, z - one);
    let (u, v, w) = (fade(x), fade(y), fade(z));
    between(
        w,
        between(
            v,
            between(u, gradient::<F, P>(h[0], x, y, z), gradient::<F, P>(h[1], x1, y, z)),
            between(u, gradient::<F, P>(h[2], x, y1, z), gradient::<F, P>(h[3], x1, y1, z)),
        ),
        between(
            v,
            between(u, gradient::<F, P>(h[4], x, y, z1), gradient::<F, P>(h[5], x1, y, z1)),
            between(u, gradient::<F, P>(h[6], x, y1, z1), gradient::<F, P>(h[7], x1, y1, z1)),
        ),
    )
}

#[inline(always)]
fn fade<F: Floats>(t: F) -> F {
    t * t * t * t.mul_add(t.mul_sub(F::splat(6.0), F::splat(15.0)), F::splat(10.0))
}

#[inline(always)]
fn between<F: Floats>(t: F, a: F, b: F) -> F {
    t.mul_add(b - a, a)
}

#[rustfmt::skip]
const GRADIENTS: [[f32; 16]; 3] = [
    [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0],
    [1.0, 1.0, -1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0],
    [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 0.0, 1.0, 0.0, -1.0],
];

#[inline(always)]
fn gradient<F: Floats, P: Precision>(h: F::Ints, x: F, y: F, z: F) -> F {
    if P::TUNED
        && let [Some(gx), Some(gy), Some(gz)] = [
            F::look_up(&GRADIENTS[0], h),
            F::look_up(&GRADIENTS[1], h),
            F::look_up(&GRADIENTS[2], h),
        ]
    {
        return gz.mul_add(z, gy.mul_add(y, gx * x));
    }
    let splat = <F::Ints as Ints>::splat;
    let h = h & splat(15);
    let u = F::select(h.less(splat(8)), x, y);
    let v = F::select((h & splat(13)).equal(splat(12)), x, z);
    let v = F::select(h.less(splat(4)), y, v);
    let (first, second) = (h.shift_left::<31>(), (h & splat(2)).shift_left::<30>());
    (u.bits() ^ first).as_floats() + (v.bits() ^ second).as_floats()
}
