//! Guarantees of `--math=fast`.

use rtsl::Math;

use crate::prelude::evaluate::evaluate_in;

fn fast(expression: &str, inputs: &[[f32; 2]]) -> Vec<f32> {
    evaluate_in(Math::Fast, expression, inputs)
}

/// Numbers of many sizes, none of them at the ends of the range.
fn ordinary() -> Vec<[f32; 2]> {
    (1..1000).map(|index| index as f32 * 0.37).map(|x| [x * x * x, 1.0 / (x + 0.1)]).collect()
}

type Reference = fn(f64, f64) -> f64;

#[test]
fn quotients_and_roots_are_close() {
    let inputs = ordinary();
    let wanted: [(&str, Reference); 4] = [
        ("x / y", |x, y| x / y),
        ("x / (y * sqrt(x))", |x, y| x / (y * x.sqrt())),
        ("sqrt(x)", |x, _| x.sqrt()),
        ("length(vec3(x, y, x))", |x, y| (2.0 * x * x + y * y).sqrt()),
    ];
    for (expression, reference) in wanted {
        for (&[x, y], found) in inputs.iter().zip(fast(expression, &inputs)) {
            let wanted = reference(f64::from(x), f64::from(y));
            let error = (f64::from(found) - wanted).abs() / wanted;
            assert!(error < 1e-6, "{expression} of {x:e}, {y:e} is {found:e}, not {wanted:e}");
        }
    }
}

#[test]
fn zeros_and_infinities_do_no_harm() {
    let zero = [[0.0, -0.0]];
    assert_eq!(fast("1.0 / x", &zero), [f32::INFINITY]);
    assert_eq!(fast("1.0 / y", &zero), [f32::NEG_INFINITY]);
    assert_eq!(fast("1.0 / (1.0 / x)", &zero), [0.0]);
    assert_eq!(fast("sqrt(x)", &zero), [0.0]);
    assert_eq!(fast("sqrt(y)", &zero), [0.0]);
    assert_eq!(fast("length(vec2(x, y))", &zero), [0.0]);
    assert_eq!(fast("inversesqrt(x)", &zero), [f32::INFINITY]);
    assert!(fast("sqrt(x)", &[[-1.0, 0.0]])[0].is_nan());
}

#[test]
fn normalised_vectors_have_unit_length() {
    let inputs = ordinary();
    for found in fast("length(normalize(vec3(x, -y, 0.0)))", &inputs) {
        assert!((found - 1.0).abs() < 1e-6, "{found:e}");
    }
}

#[test]
fn whole_quotients_stay_whole() {
    let inputs: Vec<[f32; 2]> =
        (1..100).flat_map(|x| (1..50).map(move |y| [(x * y) as f32, y as f32])).collect();
    assert!(fast("mod(x, y)", &inputs).iter().all(|found| *found == 0.0));
    assert_eq!(fast("unpackUnorm4x8(0xffffffffu).w + x", &[[0.0; 2]]), [1.0]);
}

#[test]
fn precise_variables_are_exact() {
    let inputs = ordinary();
    let found = crate::prelude::evaluate::evaluate_in_with(
        Math::Fast,
        "float exact(float x, float y) { precise float quotient = sqrt(x) / y; return quotient; }",
        "exact(x, y)",
        &inputs,
    );
    for (&[x, y], found) in inputs.iter().zip(found) {
        assert_eq!(found.to_bits(), (x.sqrt() / y).to_bits());
    }
}
