//! Sampling: directions of unit length, moments of their densities, frames.

use crate::prelude::evaluate::{evaluate, thinning, unit_pairs};

#[test]
fn directions_have_unit_length() {
    for direction in [
        "sampleCosineHemisphere(vec2(x, y))",
        "sampleUniformHemisphere(vec2(x, y))",
        "sampleUniformSphere(vec2(x, y))",
        "sampleUniformCone(vec2(x, y), 0.9)",
        "sampleUniformConeByHeight(vec2(x, y), 1.9)",
        "sampleUniformConeByHeight(vec2(x, y), 1.0e-5)",
        "sampleVisibleNormal(normalize(vec3(0.6, -0.3, 0.4)), vec2(0.1, 0.4), vec2(x, y))",
        "perpendicularTo(vec3(x - 0.5, y - 0.5, 0.1) * 1.0e30)",
        "perpendicularTo(vec3(0.0))",
        "makeFrame(normalize(vec3(x - 0.5, y - 0.5, -0.2)))[1]",
        "makeFrame(vec3(0.0, 0.0, 1.0), vec3(x, y, 1.0))[0]",
        "makeFrame(vec3(0.0, 0.0, 1.0), vec3(0.0, 0.0, x))[0]",
    ] {
        for length in samples(&format!("length({direction})")) {
            assert!((length - 1.0).abs() < 1e-5, "{direction} has length {length}");
        }
    }
}

#[test]
fn moments_are_those_of_the_densities() {
    for (expression, mean) in [
        ("sampleCosineHemisphere(vec2(x, y)).z", 2.0 / 3.0),
        ("sampleUniformHemisphere(vec2(x, y)).z", 0.5),
        ("sampleUniformSphere(vec2(x, y)).z", 0.0),
        ("sampleUniformCone(vec2(x, y), 0.5).z", 0.75),
        ("length(sampleConcentricDisk(vec2(x, y)))", 2.0 / 3.0),
        ("sampleConcentricDisk(vec2(x, y)).x", 0.0),
        ("sampleUniformTriangle(vec2(x, y)).x", 1.0 / 3.0),
        ("sampleUniformTriangle(vec2(x, y)).y", 1.0 / 3.0),
    ] {
        let values = samples(expression);
        let found = values.iter().sum::<f32>() / values.len() as f32;
        assert!((found - mean).abs() < 0.02, "{expression} is {found} in the mean, not {mean}");
    }
}

/// The angles of the cones are 0.5 degrees, the sun's 0.267, 0.05 and 0.001.
#[test]
fn directions_in_small_cones_differ() {
    let count = 20_000 / thinning();
    let inputs: Vec<[f32; 2]> =
        (1..=count).map(|index| [index as f32 / (count + 1) as f32, 0.0]).collect();
    for height in [3.8076853e-5_f32, 1.0857979e-5, 3.8077179e-7, 1.5230871e-10] {
        let by_height = format!("sampleUniformConeByHeight(vec2(x, y), {height:e}).x");
        // Just below the greatest cosine the steps between cosines are wide; these are what is left of the angle.
        let of_cosine = 1.0 - (1.0 - height);
        let by_cosine = format!("sampleUniformCone(vec2(x, y), 1.0 - {height:e}).x");
        for (expression, height) in [(by_height, height), (by_cosine, of_cosine)] {
            let sines = evaluate(&expression, &inputs);
            for ([part, _], sine) in inputs.iter().zip(&sines) {
                let below = f64::from(*part) * f64::from(height);
                let expected = (below * (2.0 - below)).sqrt();
                let error = (f64::from(*sine) - expected).abs();
                assert!(error <= 3e-7 * expected, "{expression} at {part}: {sine}, not {expected}");
            }
            let distinct: std::collections::BTreeSet<u32> =
                sines.iter().map(|sine| sine.to_bits()).collect();
            let most = if height > 0.0 { count } else { 1 };
            assert_eq!(distinct.len(), most, "{expression}");
        }
    }
}

#[test]
fn frames_turn_there_and_back() {
    let frame = "makeFrame(normalize(vec3(x - 0.5, y - 0.5, 0.3 - x)))";
    let there_and_back = format!(
        "distance(toWorld({frame}, toLocal({frame}, vec3(1.0, 2.0, 3.0))), vec3(1.0, 2.0, 3.0))"
    );
    assert!(samples(&there_and_back).iter().all(|error| *error < 1e-5));
    let handed = format!("determinant({frame})");
    assert!(samples(&handed).iter().all(|value| (*value - 1.0).abs() < 1e-5));
}

fn samples(expression: &str) -> Vec<f32> {
    evaluate(expression, &unit_pairs(20_000 / thinning()))
}
