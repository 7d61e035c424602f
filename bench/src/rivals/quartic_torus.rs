//! A torus as the zeros of a quartic, which Newton's method finds between the zeros of its slope.

use super::Chunk;
use super::lanes::{Floats, Mask};
use super::precision::Precision;
use super::vector::Vec3;
use crate::kernels::QuarticTorus;
use crate::packet::Packet;

/// t^4 + p t^2 + q t + s.
#[derive(Clone, Copy)]
struct Quartic<F> {
    p: F,
    q: F,
    s: F,
    /// Twice `p`.
    p2: F,
}

/// A function and its derivative.
trait Curve<F>: Copy {
    fn at(self, t: F) -> (F, F);
}

#[derive(Clone, Copy)]
struct Value<F>(Quartic<F>);

#[derive(Clone, Copy)]
struct Slope<F>(Quartic<F>);

impl<F: Floats> Quartic<F> {
    #[inline(always)]
    fn value(self, t: F) -> F {
        t.mul_add(t, self.p).mul_add(t, self.q).mul_add(t, self.s)
    }

    #[inline(always)]
    fn slope(self, t: F) -> F {
        (F::splat(4.0) * t).mul_add(t, self.p2).mul_add(t, self.q)
    }

    #[inline(always)]
    fn curvature(self, t: F) -> F {
        (F::splat(12.0) * t).mul_add(t, self.p2)
    }

    /// The zero of the slope between `low` and `high`; `high` if there is none.
    #[inline(always)]
    fn extremum<P: Precision>(self, low: F, high: F, active: F::Mask) -> F {
        let (at_low, at_high) = (self.slope(low), self.slope(high));
        let none = (at_low * at_high).greater(F::splat(0.0));
        let rising = at_high.greater(at_low);
        let active = active.without(none);
        let found = newton::<F, P>(Slope(self), low, high, rising, active, 20, 1e-6);
        F::select(none, high, found)
    }
}

impl<F: Floats> Curve<F> for Value<F> {
    #[inline(always)]
    fn at(self, t: F) -> (F, F) {
        (self.0.value(t), self.0.slope(t))
    }
}

impl<F: Floats> Curve<F> for Slope<F> {
    #[inline(always)]
    fn at(self, t: F) -> (F, F) {
        (self.0.slope(t), self.0.curvature(t))
    }
}

/// Newton's method, kept between bounds, in the active lanes.
#[inline(always)]
fn newton<F: Floats, P: Precision>(
    curve: impl Curve<F>,
    mut low: F,
    mut high: F,
    rising: F::Mask,
    mut active: F::Mask,
    rounds: u32,
    tolerance: f32,
) -> F {
    let half = F::splat(0.5);
    let mut t = half * (low + high);
    for _ in 0..rounds {
        if !active.any() {
            break;
        }
        let (value, slope) = curve.at(t);
        let below = value.greater(F::splat(0.0)) ^ rising;
        low = F::select(below, t, low);
        high = F::select(below, high, t);
        let next = t - P::divide(value, slope);
        let within = next.greater(low) & next.less(high);
        let next = F::select(within, next, half * (low + high));
        let near = (next - t).abs().less_equal(F::splat(tolerance) * t.abs());
        active = active.without(near);
        t = F::select(active, next, t);
    }
    t
}

impl Chunk for QuarticTorus {
    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the race has these arrays and parameters.
        unsafe {
            let origin = Vec3::<F>::load(packet.state(0));
            let direction = Vec3::<F>::load(packet.state(3));
            let (major, minor) = (packet.parameter(0), packet.parameter(1));
            let square = direction.dot(direction);
            let inverse = P::inverse_sqrt(square);
            let d = direction * inverse;
            let shift = origin.dot(d);
            let o = d.scale_add(-shift, origin);
            let outer = 1.001 * (major + minor);
            let room = F::splat(outer * outer) - o.dot(o);
            let zero = F::splat(0.0);
            let mut active = room.greater_equal(zero);
            if !active.any() {
                return;
            }

            let major2 = major * major;
            let k = o.dot(o) + F::splat(major2 - minor * minor);
            let four = F::splat(4.0 * major2);
            let p = four.neg_mul_add(d.z.mul_add(d.z, d.x * d.x), k + k);
            let q = F::splat(-8.0 * major2) * o.z.mul_add(d.z, o.x * d.x);
            let s = four.neg_mul_add(o.z.mul_add(o.z, o.x * o.x), k * k);
            let quartic = Quartic { p, q, s, p2: p + p };

            let reach = P::sqrt(room);
            let curved = (p * F::splat(-1.0 / 6.0)).max(zero);
            let inflection = P::sqrt(curved).min(reach);
            let ends = [
                -reach,
                quartic.extremum::<P>(-reach, -inflection, active),
                quartic.extremum::<P>(-inflection, inflection, active),
                quartic.extremum::<P>(inflection, reach, active),
                reach,
            ];
            let (epsilon, limit) = (F::splat(packet.parameter(2)), F::load(packet.state(6)));
            let (mut hit, mut distance) = (F::Mask::splat(false), limit);
            let mut at_low = quartic.value(ends[0]);
            for index in 0..4 {
                let at_high = quartic.value(ends[index + 1]);
                let crosses = at_low.greater(zero) ^ at_high.greater(zero);
                let wanted = active & crosses;
                if wanted.any() {
                    let rising = at_high.greater(at_low);
                    let (low, high) = (ends[index], ends[index + 1]);
                    let root = newton::<F, P>(Value(quartic), low, high, rising, wanted, 32, 1e-7);
                    let t = (root - shift) * inverse;
                    let accepted = wanted & t.greater(epsilon) & t.less(limit);
                    distance = F::select(accepted, t, distance);
                    hit = hit | accepted;
                    active = active.without(accepted);
                }
                at_low = at_high;
            }
            P::store_where(distance, hit, packet.state(6));
        }
    }
}
