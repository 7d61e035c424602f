//! `gradient` against central differences, on all backends.

#![expect(clippy::disallowed_methods, reason = "the expected values allow for the last bit")]

use std::sync::Arc;

use rtsl::{Engine, Instance, Method, new_state};

use crate::common::{call_packet, component, engines, new, unit};

const COUNT: usize = 37;

/// The place of a ray.
fn uv(ray: usize) -> [f32; 2] {
    [0.1337 + ray as f32 * 0.0617, 1.4871 - ray as f32 * 0.0293]
}

/// The colours of `lookup` at the places of rays.
fn colors(engine: &Engine, instance: &Instance) -> Vec<[f32; 3]> {
    let mut state = new_state(COUNT);
    for ray in 0..COUNT {
        for (index, value) in uv(ray).into_iter().enumerate() {
            state.floats_mut(component("rt_TextureUV") + index)[ray] = value;
        }
    }
    call_packet(engine, instance, Method::Lookup, &mut state);
    let color = component("rt_TextureColor");
    (0..COUNT).map(|ray| [0, 1, 2].map(|it| state.floats(color + it)[ray])).collect()
}

/// The colours, which are the same on all backends.
fn all_colors(instance: &Arc<Instance>) -> Vec<[f32; 3]> {
    let colors: Vec<_> = engines().iter().map(|engine| colors(engine, instance)).collect();
    let bits = |colors: &[[f32; 3]]| -> Vec<u32> {
        colors.iter().flatten().map(|value| value.to_bits()).collect()
    };
    assert!(colors.iter().all(|other| bits(other) == bits(&colors[0])));
    colors.into_iter().next().unwrap()
}

/// Compares the gradient of a function of `p` with central differences of `expected`.
fn check(text: &str, expected: impl Fn(f64, f64) -> f64) {
    let text = format!(
        "class A : rt_Texture;
         {text}
         void lookup() {{ vec2 p = rt_TextureUV; rt_TextureColor = color(vec3(gradient(f(p), p), f(p))); }}"
    );
    let unit = unit(&text);
    for (ray, [du, dv, value]) in all_colors(&new(&unit, "A", vec![])).into_iter().enumerate() {
        let [u, v] = uv(ray).map(f64::from);
        let step = 1e-6;
        let central = [
            (expected(u + step, v) - expected(u - step, v)) / (2.0 * step),
            (expected(u, v + step) - expected(u, v - step)) / (2.0 * step),
        ];
        for (found, central) in [du, dv].into_iter().zip(central) {
            let difference = (f64::from(found) - central).abs();
            assert!(
                difference < 2e-5 * central.abs().max(1.0),
                "{text}: {found} {central} at {u} {v}"
            );
        }
        assert!((f64::from(value) - expected(u, v)).abs() < 1e-4, "{text}");
    }
}

#[test]
fn arithmetic_has_its_derivatives() {
    check("float f(vec2 p) { return 3.0 * p.x + p.x * p.y - p.y / p.x; }", |u, v| {
        3.0 * u + u * v - v / u
    });
    check(
        "float f(vec2 p) { return sqrt(p.x) + abs(p.y - 0.7) + max(p.x, p.y) * min(p.x, 2.0625 * p.y + 0.01); }",
        |u, v| u.sqrt() + (v - 0.7).abs() + u.max(v) * u.min(2.0625 * v + f64::from(0.01_f32)),
    );
    check(
        "float f(vec2 p) { return fma(p.x, p.y, fract(5.0 * p.x)) + floor(p.y) + mod(p.x, 0.3); }",
        |u, v| u * v + (5.0 * u).fract() + v.floor() + u.rem_euclid(f64::from(0.3_f32)),
    );
    check(
        "float f(vec2 p) { return length(p) + dot(normalize(vec3(p, 1.0)), vec3(1.0, 2.0, 3.0)); }",
        |u, v| u.hypot(v) + (u + 2.0 * v + 3.0) / (u * u + v * v + 1.0).sqrt(),
    );
    check(
        "float f(vec2 p) { return smoothstep(0.0, 3.0, p.x) + mix(p.x, p.y, p.x) + clamp(p.y, 0.6, 1.2); }",
        |u, v| {
            let t = (u / 3.0).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
                + u * (1.0 - u)
                + v * u
                + v.clamp(0.6_f32.into(), 1.2_f32.into())
        },
    );
}

#[test]
fn functions_of_bits_have_their_derivatives() {
    check("float f(vec2 p) { return sin(p.x) * cos(3.0 * p.y) + tan(0.3 * p.x); }", |u, v| {
        u.sin() * (3.0 * v).cos() + (f64::from(0.3_f32) * u).tan()
    });
    check("float f(vec2 p) { return exp(p.x) + exp2(p.y) + log(p.x) + log2(p.y); }", |u, v| {
        u.exp() + v.exp2() + u.ln() + v.log2()
    });
    check(
        "float f(vec2 p) { return pow(p.x, p.y) + pow(p.y, 2.5) + inversesqrt(p.x); }",
        |u, v| u.powf(v) + v.powf(2.5) + u.powf(-0.5),
    );
    check(
        "float f(vec2 p) { return asin(0.3 * p.x) + acos(0.3 * p.y) + atan(p.x) + atan(p.y, p.x); }",
        |u, v| {
            let third = f64::from(0.3_f32);
            (third * u).asin() + (third * v).acos() + u.atan() + v.atan2(u)
        },
    );
    check(
        "float f(vec2 p) { return sinh(p.x) + cosh(p.y) + tanh(p.x) + asinh(p.y) + acosh(1.5 + p.x) + atanh(0.3 * p.y); }",
        |u, v| {
            u.sinh()
                + v.cosh()
                + u.tanh()
                + v.asinh()
                + (1.5 + u).acosh()
                + (f64::from(0.3_f32) * v).atanh()
        },
    );
    check("float f(vec2 p) { vec2 s = sin(p * 2.0); return s.x * s.y + exp(s).y; }", |u, v| {
        (2.0 * u).sin() * (2.0 * v).sin() + (2.0 * v).sin().exp()
    });
}

#[test]
fn derivatives_follow_branches_loops_and_arrays() {
    check(
        "float f(vec2 p) {
            float sum = 0.0;
            for (int i = 1; i < 5; i++) { if (p.x > 0.3 * float(i)) sum += p.x * p.y / float(i); else sum += p.y; }
            return sum;
        }",
        |u, v| (1..5).map(|i| if u > f64::from(0.3_f32 * i as f32) { u * v / f64::from(i) } else { v }).sum(),
    );
    check(
        "float f(vec2 p) {
            float a[8];
            for (int i = 0; i < 8; i++) a[i] = p.x * float(i);
            for (int i = 1; i < 8; i++) a[(i * 3) % 8] += a[i - 1] * p.y;
            int at = int(p.x * 3.0) % 8;
            return a[at] + a[7 - at];
        }",
        |u, v| {
            let mut a: Vec<f64> = (0..8).map(|i| u * f64::from(i)).collect();
            for i in 1..8_usize {
                a[(i * 3) % 8] += a[i - 1] * v;
            }
            let at = (u * 3.0) as usize % 8;
            a[at] + a[7 - at]
        },
    );
    check(
        "float f(vec2 p) {
            float x = p.x;
            int steps = 0;
            while (x < 4.0 && steps < 20) { x = x * 1.5 + p.y * 0.1; ++steps; if (steps == 7) return x * x; }
            return x;
        }",
        |u, v| {
            let tenth = f64::from(0.1_f32);
            let (mut x, mut steps) = (u, 0);
            while x < 4.0 && steps < 20 {
                x = x * 1.5 + v * tenth;
                steps += 1;
                if steps == 7 {
                    return x * x;
                }
            }
            x
        },
    );
    check(
        "void g(inout float x, out float y, float z) { y = x * z; x = sin(x); }
         float f(vec2 p) { float y; float x = p.x; g(x, y, p.y); return x * y; }",
        |u, v| u.sin() * u * v,
    );
}

#[test]
fn derivatives_of_derivatives_are_exact() {
    check(
        "float d(vec2 p) { float x = p.x; return gradient(sin(x) * x * p.y + exp(2.0 * x), x); } float f(vec2 p) { return d(p); }",
        |u, v| (u.cos() * u + u.sin()) * v + 2.0 * (2.0 * u).exp(),
    );
}

#[test]
fn textures_are_differentiated_when_linked() {
    let text = "
        class Waves : rt_Texture;
        public float scale = 2.0;
        void lookup() { rt_FloatTextureValue = sin(scale * rt_TextureUV.x) * pow(rt_TextureUV.y, 3.0); }
        class Slope : rt_Texture;
        public rt_Texture height;
        void lookup() {
            vec2 uv = rt_TextureUV;
            rt_TextureColor = color(vec3(gradient(height.lookupFloat(uv), uv), height.lookupFloat(uv)));
        }";
    let unit = unit(text);
    let waves = new(&unit, "Waves", vec![("scale", 3.0.into())]);
    let slope = new(&unit, "Slope", vec![("height", waves.into())]);
    for (ray, [du, dv, _]) in all_colors(&slope).into_iter().enumerate() {
        let [u, v] = uv(ray);
        let expected = [3.0 * (3.0 * u).cos() * v * v * v, (3.0 * u).sin() * 3.0 * v * v];
        assert!((du - expected[0]).abs() < 1e-4 && (dv - expected[1]).abs() < 1e-4);
    }
}

#[test]
fn vectors_have_derivatives_by_numbers() {
    let text = "class A : rt_Texture;
        color f(float x) { return color(x * x, sin(x), 1.0 / x); }
        private float half2;
        constructor() { float x = 3.0; half2 = gradient(x * x * x, x); }
        void lookup() { float x = rt_TextureUV.x; rt_TextureColor = gradient(f(x), x) + color(half2 - 27.0); }";
    for (ray, found) in all_colors(&new(&unit(text), "A", vec![])).into_iter().enumerate() {
        let [u, _] = uv(ray);
        let expected = [2.0 * u, u.cos(), -1.0 / (u * u)];
        for channel in 0..3 {
            assert!(
                (found[channel] - expected[channel]).abs()
                    < 1e-4 * expected[channel].abs().max(1.0)
            );
        }
    }
}
