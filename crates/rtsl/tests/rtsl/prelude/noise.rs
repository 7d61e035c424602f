//! Noise and patterns.

use crate::prelude::evaluate::{evaluate, thinning, unit_pairs};

/// Points of one to four dimensions on a plane through them.
const POINTS: [&str; 4] = [
    "x * 97.0 + y",
    "vec2(x * 97.0, y * 89.0 - 40.0)",
    "vec3(x * 97.0, y * 89.0 - 40.0, x * 13.7 + y * 31.1)",
    "vec4(x * 97.0, y * 89.0 - 40.0, x * 13.7 + y * 31.1, x * 7.3 - y * 5.1)",
];

#[test]
fn noise_fills_its_range() {
    for point in POINTS {
        let values = samples(&format!("noise({point})"));
        let greatest = values.iter().fold(0.0f32, |most, value| most.max(value.abs()));
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        assert!(greatest <= 1.0 && greatest > 0.5, "noise({point}) reaches {greatest}");
        assert!(mean.abs() < 0.05, "noise({point}) is {mean} in the mean");
    }
}

#[test]
fn noise_is_zero_at_the_corners() {
    for point in POINTS {
        for value in samples(&format!("noise(floor({point}))")) {
            assert_eq!(value, 0.0, "{point}");
        }
    }
}

#[test]
fn noise_is_continuous() {
    for point in POINTS {
        for value in samples(&format!("noise({point} + 0.001) - noise({point})")) {
            assert!(value.abs() < 0.02, "{point} jumps by {value}");
        }
    }
}

#[test]
fn patterns_repeat_after_their_period() {
    for (point, ones) in POINTS.iter().zip(["1.0", "vec2(1.0)", "vec3(1.0)", "vec4(1.0)"]) {
        for name in ["noise", "cellnoise"] {
            // Whole points and a dyadic part, so that the shift by a period is exact.
            let place = format!("floor({point}) + 0.25");
            let period = format!("5.0 * {ones}");
            let same =
                format!("float({name}({place} + 10.0, {period}) == {name}({place}, {period}))");
            assert!(samples(&same).iter().all(|same| *same == 1.0), "{same}");
        }
    }
}

#[test]
fn cells_differ() {
    for point in POINTS {
        let values = samples(&format!("cellnoise({point})"));
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        assert!(values.iter().all(|value| (0.0..1.0).contains(value)), "{point}");
        assert!((mean - 0.5).abs() < 0.1, "cellnoise({point}) is {mean} in the mean");
    }
}

#[test]
fn voronoi_orders_its_distances() {
    for point in &POINTS[1..] {
        for value in samples(&format!("voronoi({point}).y - voronoi({point}).x")) {
            assert!((0.0..4.0).contains(&value), "{point}: {value}");
        }
    }
}

#[test]
fn octaves_add_up() {
    let first = samples("float(fbm(vec2(x, y) * 9.0, 1) == noise(vec2(x, y) * 9.0))");
    assert!(first.iter().all(|same| *same == 1.0));
    let turbulent = samples("turbulence(vec3(x, y, 0.5) * 9.0, 4)");
    assert!(turbulent.iter().all(|value| (0.0..2.0).contains(value)));
}

fn samples(expression: &str) -> Vec<f32> {
    evaluate(expression, &unit_pairs(20_000 / thinning()))
}
