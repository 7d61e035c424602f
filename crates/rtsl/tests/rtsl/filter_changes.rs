//! `dFdx`, `dFdy` and `fwidth` against the derivatives of the place, on all backends.

#![expect(clippy::disallowed_methods, reason = "the expected values allow for the last bit")]

use rtsl::{Engine, Instance, LaneBlock, Method, new_state};

use crate::common::{call_packet, component, engines, new, unit};

const COUNT: usize = 21;

/// The place of a ray and the filter there.
#[derive(Clone, Copy)]
struct Place {
    uv: [f32; 2],
    widths: [f32; 2],
    /// The derivatives of the coordinates by u, and by v.
    along: [[f32; 2]; 2],
    point: [f32; 3],
    /// The derivatives of the point by u, and by v.
    tangents: [[f32; 3]; 2],
}

fn place(ray: usize) -> Place {
    let at = ray as f32;
    Place {
        uv: [0.1337 + at * 0.0617, 1.4871 - at * 0.0293],
        widths: [0.01 + 0.003 * at, 0.02],
        along: [[1.5, 0.25], [-0.5, 2.0 - 0.05 * at]],
        point: [at * 0.1, 1.0 - at * 0.03, 0.5],
        tangents: [[1.0, 0.5, -0.25], [0.0, 2.0, 0.75]],
    }
}

/// The changes of the coordinates by a step along each side.
fn changes_of_uv(place: Place) -> [[f32; 2]; 2] {
    [0, 1].map(|side| place.along[side].map(|it| it * place.widths[side]))
}

fn changes_of_point(place: Place) -> [[f32; 3]; 2] {
    [0, 1].map(|side| place.tangents[side].map(|it| it * place.widths[side]))
}

fn set(state: &mut LaneBlock, name: &str, ray: usize, values: &[f32]) {
    for (index, value) in values.iter().enumerate() {
        state.floats_mut(component(name) + index)[ray] = *value;
    }
}

fn colors(engine: &Engine, instance: &Instance) -> Vec<[f32; 3]> {
    let mut state = new_state(COUNT);
    for ray in 0..COUNT {
        let place = place(ray);
        set(&mut state, "rt_TextureUV", ray, &place.uv);
        set(&mut state, "rt_du", ray, &[place.widths[0]]);
        set(&mut state, "rt_dv", ray, &[place.widths[1]]);
        set(&mut state, "rt_dsdu", ray, &[place.along[0][0]]);
        set(&mut state, "rt_dtdu", ray, &[place.along[0][1]]);
        set(&mut state, "rt_dsdv", ray, &[place.along[1][0]]);
        set(&mut state, "rt_dtdv", ray, &[place.along[1][1]]);
        set(&mut state, "rt_HitPoint", ray, &place.point);
        set(&mut state, "rt_dPdu", ray, &place.tangents[0]);
        set(&mut state, "rt_dPdv", ray, &place.tangents[1]);
    }
    call_packet(engine, instance, Method::Lookup, &mut state);
    let color = component("rt_TextureColor");
    (0..COUNT).map(|ray| [0, 1, 2].map(|it| state.floats(color + it)[ray])).collect()
}

/// Compares the colours of a class `A`, the same on all backends, with the changes along u and v and with their sum.
fn check(text: &str, expected: impl Fn(Place) -> [f32; 2]) {
    let unit = unit(text);
    let instance = new(&unit, "A", vec![]);
    let colors: Vec<_> = engines().iter().map(|engine| colors(engine, &instance)).collect();
    let bits = |colors: &[[f32; 3]]| -> Vec<u32> {
        colors.iter().flatten().map(|value| value.to_bits()).collect()
    };
    assert!(colors.iter().all(|other| bits(other) == bits(&colors[0])));
    for (ray, found) in colors[0].iter().enumerate() {
        let [u, v] = expected(place(ray));
        for (found, expected) in found.iter().zip([u, v, u.abs() + v.abs()]) {
            assert!(
                (found - expected).abs() < 1e-5 * expected.abs().max(1e-2),
                "{text}: {found} {expected} for ray {ray}"
            );
        }
    }
}

#[test]
fn values_change_with_the_coordinates() {
    check(
        "class A : rt_Texture;
         void lookup() {
             float f = rt_TextureUV.x * rt_TextureUV.y;
             rt_TextureColor = color(dFdx(f), dFdy(f), fwidth(f));
         }",
        |place| changes_of_uv(place).map(|[ds, dt]| ds * place.uv[1] + dt * place.uv[0]),
    );
}

#[test]
fn values_change_with_the_point() {
    check(
        "class A : rt_Texture;
         float f(vec3 p) { return sin(p.x) * p.y + p.z; }
         void lookup() {
             vec3 p = rt_HitPoint;
             float v = f(p);
             rt_TextureColor = color(dFdx(v), dFdy(f(rt_HitPoint)), fwidth(v));
         }",
        |place| {
            let [x, y, _] = place.point;
            changes_of_point(place).map(|[dx, dy, dz]| x.cos() * dx * y + x.sin() * dy + dz)
        },
    );
}

#[test]
fn changes_are_asked_for_in_functions_branches_and_loops() {
    check(
        "class A : rt_Texture;
         vec3 changes(float f) { return vec3(dFdx(f), dFdy(f), fwidth(f)); }
         void lookup() {
             float f = rt_TextureUV.x;
             vec3 sum = vec3(0.0);
             for (int i = 0; i < 4; i++) {
                 f *= rt_TextureUV.y;
                 if (i % 2 == 1) sum = changes(f);
             }
             rt_TextureColor = color(sum);
         }",
        |place| {
            let [s, t] = place.uv;
            changes_of_uv(place).map(|[ds, dt]| ds * t.powi(4) + 4.0 * s * t.powi(3) * dt)
        },
    );
}

#[test]
fn values_after_a_change_keep_their_derivatives() {
    check(
        "class A : rt_Texture;
         float f(float x, float y) { return x * x * y; }
         void lookup() {
             float x = rt_TextureUV.x, y = rt_TextureUV.y;
             float slope = gradient(f(x, y), x) + 0.0 * smoothstep(-fwidth(x), fwidth(x), y);
             rt_TextureColor = color(dFdx(slope), dFdy(slope), fwidth(slope));
         }",
        |place| {
            let [s, t] = place.uv;
            changes_of_uv(place).map(|[ds, dt]| 2.0 * (ds * t + s * dt))
        },
    );
}

#[test]
fn constants_do_not_change() {
    check(
        "class A : rt_Texture;
         public float k = 3.0;
         void lookup() { rt_TextureColor = color(dFdx(k), dFdy(floor(rt_TextureUV.x)), fwidth(2.0)); }",
        |_| [0.0; 2],
    );
}
