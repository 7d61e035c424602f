//! The drawings of `shader_runner`: rectangles of one colour each.

use crate::case::{Case, Stage, Step};
use crate::judge::{Compiled, run_stages, set_uniform};
use crate::rules::RASTERISATION;
use crate::run::{Runner, Words};

/// A rectangle that was drawn, in parts of the window.
struct Rectangle {
    low: [f32; 2],
    high: [f32; 2],
    color: [f32; 4],
}

/// The roundings of an 8-bit picture and of its comparison.
const TOLERANCE: f32 = 0.0125;

/// Runs the steps of a case.
///
/// # Errors
/// The first pixel that differs, or why the drawing has no value here.
pub fn draw(case: &Case, stages: &[Compiled], runner: &Runner) -> Result<(), String> {
    let mut words = Words::new();
    let mut drawn: Vec<Rectangle> = Vec::new();
    let mut clear_color = [0.0; 4];
    for step in &case.steps {
        match step {
            Step::Uniform { .. } => set_uniform(&mut words, step),
            Step::ClearColor(color) => clear_color = *color,
            Step::Clear => {
                drawn.clear();
                drawn.push(Rectangle { low: [0.0; 2], high: [1.0; 2], color: clear_color });
            }
            Step::Draw(rectangle) => drawn.push(rectangle_of(*rectangle, stages, &words, runner)?),
            Step::Probe { place, color } => probe(&drawn, *place, color)?,
            Step::Unknown(line) => return Err(format!("step `{line}`")),
        }
    }
    Ok(())
}

/// Runs the vertex shader at the corners and the fragment shader once.
fn rectangle_of(
    [left, bottom, width, height]: [f32; 4],
    stages: &[Compiled],
    given: &Words,
    runner: &Runner,
) -> Result<Rectangle, String> {
    let fragment: Vec<&Compiled> = stages.iter().filter(|it| it.stage == Stage::Fragment).collect();
    let [fragment] = fragment[..] else { return Err(RASTERISATION.to_owned()) };
    let vertex: Vec<Compiled> = stages
        .iter()
        .filter(|it| it.stage == Stage::Vertex)
        .map(|it| Compiled { translation: it.translation.clone(), class: it.class.clone(), ..*it })
        .collect();
    let corners = [(left, bottom), (left + width, bottom + height)];
    let mut passed = Vec::new();
    for (x, y) in corners {
        let mut words = given.clone();
        for name in ["builtin_Vertex", "piglit_vertex", "vertex"] {
            words.insert(name.to_owned(), [x, y, 0.0, 1.0].map(f32::to_bits).to_vec());
        }
        for name in [
            "builtin_ModelViewMatrix",
            "builtin_ProjectionMatrix",
            "builtin_ModelViewProjectionMatrix",
        ] {
            words.insert(name.to_owned(), identity(4));
        }
        words.insert("builtin_NormalMatrix".to_owned(), identity(3));
        // The corners of a rectangle of negative width or height turn the other way.
        words.insert("builtin_FrontFacing".to_owned(), vec![u32::from(width * height > 0.0)]);
        let mut results = run_stages(&vertex, &words, runner)?;
        if vertex.is_empty() {
            let position = words["builtin_Vertex"].clone();
            results.insert("builtin_Position".to_owned(), position);
        }
        for (from, to) in [("FrontColor", "Color"), ("FrontSecondaryColor", "SecondaryColor")] {
            if let Some(color) = results.remove(&format!("builtin_{from}")) {
                results.insert(format!("builtin_{to}"), color);
            }
        }
        passed.push(results);
    }
    let corner = |words: &Words| -> Result<[f32; 2], String> {
        let position = words.get("builtin_Position").map(|it| floats(it));
        match position.as_deref() {
            Some([x, y, _, w]) if *w > 0.0 => Ok([x / w, y / w].map(|it| 0.5 + 0.5 * it)),
            _ => Err(RASTERISATION.to_owned()),
        }
    };
    let (low, high) = (corner(&passed[0])?, corner(&passed[1])?);
    let reads = fragment.translation.variables.iter().filter(|it| !it.is_uniform);
    let reads = reads.filter(|it| it.storage == crate::items::Storage::In).map(|it| &it.name);
    for name in reads {
        if passed[0].get(name) != passed[1].get(name) || !passed[0].contains_key(name) {
            return Err(RASTERISATION.to_owned());
        }
    }
    let class = fragment.class.as_ref().ok_or("no class")?;
    let results = runner.call(class, &passed[0])?;
    let color = color_of(fragment, &results).ok_or(RASTERISATION)?;
    Ok(Rectangle { low, high, color })
}

/// The colour that a fragment shader gives: `gl_FragColor`, the first of `gl_FragData`, or the one output.
fn color_of(fragment: &Compiled, results: &Words) -> Option<[f32; 4]> {
    let variables = fragment.translation.variables.iter();
    let outs = variables.filter(|it| it.storage == crate::items::Storage::Out).map(|it| &it.name);
    let mut outs = outs.filter(|it| *it != "builtin_FragDepth");
    let (name, None) = (outs.next()?, outs.next()) else { return None };
    let words = floats(results.get(name)?);
    words.get(..4)?.try_into().ok()
}

fn floats(words: &[u32]) -> Vec<f32> {
    words.iter().map(|it| f32::from_bits(*it)).collect()
}

fn identity(size: usize) -> Vec<u32> {
    let entry = |at| if at % (size + 1) == 0 { 1.0_f32 } else { 0.0 };
    (0..size * size).map(|at| entry(at).to_bits()).collect()
}

fn probe(drawn: &[Rectangle], place: Option<[f32; 2]>, expected: &[f32]) -> Result<(), String> {
    let places = match place {
        Some(place) => vec![place],
        // No drawing of the suites has parts between these.
        None => {
            (0..16).map(|at| [(at % 4) as f32 / 4.0 + 0.1, (at / 4) as f32 / 4.0 + 0.1]).collect()
        }
    };
    for place in places {
        let covers = |it: &&Rectangle| {
            (0..2).all(|axis| {
                let (low, high) =
                    (it.low[axis].min(it.high[axis]), it.low[axis].max(it.high[axis]));
                low <= place[axis] && place[axis] <= high
            })
        };
        let Some(found) = drawn.iter().rev().find(covers) else {
            return Err(format!("nothing is drawn at {place:?}"));
        };
        let clamped = found.color.map(|it| if it.is_nan() { it } else { it.clamp(0.0, 1.0) });
        // Nothing is close to NaN.
        let is_close = |(found, expected): (&f32, &f32)| (found - expected).abs() <= TOLERANCE;
        if !clamped.iter().zip(expected).all(is_close) {
            return Err(format!("the colour at {place:?} is {:?}, not {expected:?}", found.color));
        }
    }
    Ok(())
}
