//! A torus as the zeros of a quartic: the algorithm of the standard library's.

use super::{Ray, Real, Scalar};
use crate::kernels::QuarticTorus;

/// t^4 + p t^2 + q t + s.
#[derive(Clone, Copy)]
struct Quartic<R> {
    p: R,
    q: R,
    s: R,
}

impl<R: Real> Quartic<R> {
    #[inline(always)]
    fn value(self, t: R) -> R {
        ((t * t + self.p) * t + self.q) * t + self.s
    }

    #[inline(always)]
    fn slope(self, t: R) -> R {
        (R::of(4.0) * t * t + R::of(2.0) * self.p) * t + self.q
    }

    #[inline(always)]
    fn curvature(self, t: R) -> R {
        R::of(12.0) * t * t + R::of(2.0) * self.p
    }

    /// The zero of the slope between `low` and `high`; `high` where there is none.
    #[inline(always)]
    fn extremum(self, low: R, high: R) -> R {
        let (at_low, at_high) = (self.slope(low), self.slope(high));
        if at_low * at_high > R::of(0.0) {
            return high;
        }
        let rising = at_high > at_low;
        let step = |t| (self.slope(t), self.curvature(t));
        newton(step, low, high, rising, 20, 1e-6)
    }

    /// The zero between `low` and `high`.
    #[inline(always)]
    fn zero(self, low: R, high: R, rising: bool) -> R {
        newton(|t| (self.value(t), self.slope(t)), low, high, rising, 32, 1e-7)
    }
}

/// Newton's method, kept between bounds.
#[inline(always)]
fn newton<R: Real>(
    function: impl Fn(R) -> (R, R),
    mut low: R,
    mut high: R,
    rising: bool,
    rounds: u32,
    tolerance: f64,
) -> R {
    let mut t = R::of(0.5) * (low + high);
    for _ in 0..rounds {
        let (value, slope) = function(t);
        if (value > R::of(0.0)) == rising {
            high = t;
        } else {
            low = t;
        }
        let mut next = t - value / slope;
        if !(next > low && next < high) {
            next = R::of(0.5) * (low + high);
        }
        if (next - t).abs() <= R::of(tolerance) * t.abs() {
            break;
        }
        t = next;
    }
    t
}

impl Scalar for QuarticTorus {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        let (origin, direction) = (ray.vector::<R>(0), ray.vector::<R>(3));
        let (major, minor) = (ray.parameter::<R>(0), ray.parameter::<R>(1));
        let (zero, two, four) = (R::of(0.0), R::of(2.0), R::of(4.0));
        let unit = direction.dot(direction).sqrt();
        let d = direction * (R::of(1.0) / unit);
        let shift = origin.dot(d);
        let o = origin - d * shift;
        let outer = R::of(1.001) * (major + minor);
        let m = o.dot(o);
        if m > outer * outer {
            return;
        }
        let major2 = major * major;
        let k = m + major2 - minor * minor;
        let quartic = Quartic {
            p: two * k - four * major2 * (d.x * d.x + d.z * d.z),
            q: R::of(-8.0) * major2 * (o.x * d.x + o.z * d.z),
            s: k * k - four * major2 * (o.x * o.x + o.z * o.z),
        };
        let reach = (outer * outer - m).sqrt();
        let inflection = (-quartic.p / R::of(6.0)).max(zero).sqrt().min(reach);
        let ends = [
            -reach,
            quartic.extremum(-reach, -inflection),
            quartic.extremum(-inflection, inflection),
            quartic.extremum(inflection, reach),
            reach,
        ];
        for pair in ends.windows(2) {
            let (at_low, at_high) = (quartic.value(pair[0]), quartic.value(pair[1]));
            if (at_low > zero) == (at_high > zero) {
                continue;
            }
            let t = (quartic.zero(pair[0], pair[1], at_high > at_low) - shift) / unit;
            if t > ray.parameter(2) && t < ray.state(6) {
                ray.set_state(6, t);
                return;
            }
        }
    }
}
