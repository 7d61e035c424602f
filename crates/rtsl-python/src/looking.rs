//! Looks inside shaders: recordings of calls and of pixels, and the costs of lines.

use pyo3::prelude::*;
use rtsl::{Recording, TextCosts, TraceEntry, TraceKind, render};
use rtsl_render::measure::{SceneLines, measure_lines_of};
use rtsl_render::{PixelRequest, TracedPixel, TracedSample, render_pixel_of};
use rtsl_scene::Scene;

use crate::detached::detached;
use crate::diagnostic::dictionary;
use crate::engine::PyEngine;
use crate::error::Exception;

/// The lines of a recording, those that `print` wrote, the number of entries that are not kept, and the diagnostic
/// about the first value that is not finite, with its text.
pub type RecordingParts = (Vec<String>, Vec<String>, u64, Option<(Py<PyAny>, String)>);

/// The index of a sample, its radiance, the named outputs of the integrator, and its recording.
type SampleParts = (u32, [f32; 3], Vec<(String, Vec<f32>)>, RecordingParts);

/// The work of a line: its number, the estimated cycles of a path, and the shares of active lanes and of conditions at
/// which rays diverge, if it has any.
type LineParts = (u32, f64, Option<f64>, Option<f64>);

/// The name of a text, the text, and its lines.
type TextParts = (String, Option<String>, Vec<LineParts>);

/// The colour of a pixel, its samples, and warnings.
pub type Inspected = ([f32; 3], Vec<SampleParts>, String);

/// The texts with their lines, the number of paths, rays at a time, and warnings.
pub type Costs = (Vec<TextParts>, u64, u32, String);

/// Returns the parts of a recording.
pub fn recording_parts(py: Python<'_>, recording: &Recording) -> PyResult<RecordingParts> {
    let is_print = |entry: &&TraceEntry| matches!(entry.kind, TraceKind::Print(..));
    let lines = recording.to_text().lines().map(str::to_owned).collect();
    let prints = recording.entries.iter().filter(is_print).map(ToString::to_string).collect();
    let report = |(sources, diagnostic)| {
        let text = render::all_to_text(&sources, [&diagnostic], false);
        Ok::<_, PyErr>((dictionary(py, &sources, &diagnostic)?, text))
    };
    let not_finite = recording.not_finite().map(report).transpose()?;
    Ok((lines, prints, recording.dropped, not_finite))
}

/// Renders samples of a pixel on an engine with a trace. Returns the colour, the samples and warnings.
pub fn inspect(
    py: Python<'_>,
    engine: &PyEngine,
    scene: Scene,
    request: PixelRequest,
) -> PyResult<Inspected> {
    let Some(trace) = engine.engine.options().trace.clone() else {
        return Err(Exception::Error.with_text("the engine has no trace"));
    };
    let traced = detached(py, || render_pixel_of(scene, &engine.engine, request, &trace))?;
    let traced = traced.map_err(|messages| Exception::Scene.of_messages(&messages))?;
    let TracedPixel { color, samples, warnings } = traced;
    let parts = |TracedSample { index, radiance, outputs, recording }: TracedSample| {
        Ok((index, radiance, outputs, recording_parts(py, &recording)?))
    };
    let samples = samples.into_iter().map(parts).collect::<PyResult<_>>()?;
    Ok((color, samples, warnings.to_text(false)))
}

/// Measures the costs of lines on an engine that records them. Returns the texts, the number of paths, rays at a time,
/// and warnings.
pub fn costs(
    py: Python<'_>,
    engine: &PyEngine,
    scene: &Scene,
    threads: Option<usize>,
) -> PyResult<Costs> {
    let Some(record) = engine.engine.options().costs.clone() else {
        return Err(Exception::Error.with_text("the engine records no costs"));
    };
    let measured = detached(py, || measure_lines_of(scene, &engine.engine, &record, threads))?;
    let measured = measured.map_err(|messages| Exception::Scene.of_messages(&messages))?;
    let SceneLines { texts, paths, width, warnings } = measured;
    let texts = texts.iter().map(|text| text_parts(text, paths)).collect();
    Ok((texts, paths, width, warnings.to_text(false)))
}

fn text_parts(text: &TextCosts, paths: u64) -> TextParts {
    let lines = text.lines.iter().map(|line| {
        (
            line.line,
            line.millicycles as f64 / 1000.0 / paths.max(1) as f64,
            line.active_share(),
            line.diverged_share(),
        )
    });
    let source = text.source.as_ref().map(|source| source.text.to_string());
    (text.name.to_string(), source, lines.collect())
}
