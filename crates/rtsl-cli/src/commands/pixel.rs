//! `rtsl render --pixel`: one pixel, with what shaders print, and a trace of the methods that it calls.

use clap::Args;
use rtsl::{Recording, Trace, TraceDetail, TraceKind};
use rtsl_render::{PixelRequest, RenderRequest, TracedPixel, TracedSample, render_pixel};
use serde::Serialize;

use super::render::report;
use crate::files::write_result;
use crate::json::Json;
use crate::outcome::{CommandResult, Outcome};
use crate::report::Reporter;
use crate::trace::{JsonRecording, TraceName};

/// The arguments of one pixel.
#[derive(Debug, Args)]
pub struct PixelArguments {
    /// Render this pixel only, and print its value, and what shaders print for it. Columns and rows count from 0, from
    /// the top left.
    #[arg(
        long,
        value_name = "X,Y",
        value_parser = parse_pixel,
        conflicts_with_all = ["output", "aov", "checkpoint", "resume", "noise", "time", "denoise", "stats"]
    )]
    pixel: Option<[usize; 2]>,
    /// The sample of the pixel, from 0; all of them if not given.
    #[arg(long, value_name = "N")]
    sample: Option<u32>,
    /// Print the calls of methods with their state, or with `lines` the values of variables too; and the first operation
    /// whose result is NaN or an infinity.
    #[arg(
        long,
        value_name = "DETAIL",
        value_enum,
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "calls"
    )]
    trace: Option<TraceName>,
    /// Print the pixel as JSON.
    #[arg(long)]
    json: bool,
}

impl PixelArguments {
    /// The problem of options that are for one pixel, without a pixel.
    pub fn misplaced(&self) -> Option<String> {
        let given = [
            ("sample", self.sample.is_some()),
            ("trace", self.trace.is_some()),
            ("json", self.json),
        ];
        let (name, _) = given.iter().find(|(_, is_given)| *is_given && self.pixel.is_none())?;
        let advice = match *name {
            "json" => ", or write the statistics of a picture as JSON by `--stats FILE`",
            _ => "",
        };
        Some(format!(
            "`--{name}` is for one pixel: give `--pixel X,Y` in place of `--output`{advice}"
        ))
    }
}

/// Renders the pixel and prints what happens.
pub fn render_one(
    request: &RenderRequest<'_>,
    arguments: &PixelArguments,
    reporter: &Reporter,
) -> CommandResult {
    let pixel = arguments.pixel.unwrap_or_default();
    let chosen = PixelRequest {
        pixel,
        first: arguments.sample.unwrap_or(0),
        count: arguments.sample.map(|_| 1),
    };
    let trace = Trace::new(arguments.trace.map_or(TraceDetail::Prints, TraceDetail::from));
    let traced = match render_pixel(request, chosen, &trace) {
        Ok(traced) => traced,
        Err(messages) => {
            report(&messages, reporter);
            return Ok(Outcome::InputAtFault);
        }
    };
    report(&traced.warnings, reporter);
    if arguments.json {
        let json = JsonPixel::new(pixel, &traced);
        let text = serde_json::to_string(&json).unwrap_or_default() + "\n";
        write_result(None, text.as_bytes())?;
        return Ok(Outcome::Done);
    }
    write_result(None, text_of(pixel, &traced).as_bytes())?;
    let mut all = traced.samples.iter();
    if let Some((sources, warning)) = all.find_map(|sample| sample.recording.not_finite()) {
        reporter.diagnostics(&sources, [&warning]);
    }
    Ok(Outcome::Done)
}

/// Formats the samples, where something happened, and the value of the pixel.
fn text_of([x, y]: [usize; 2], traced: &TracedPixel) -> String {
    let mut text = String::new();
    for TracedSample { index, radiance, recording, .. } in &traced.samples {
        let is_odd = radiance.iter().any(|channel| !channel.is_finite());
        if recording.entries.is_empty() && !is_odd {
            continue;
        }
        text += &format!("sample {index}: {}\n", color_text(*radiance));
        text += &indented(recording);
    }
    let samples = match traced.samples.as_slice() {
        [only] => format!("sample {}", only.index),
        all => format!("the mean of {} samples", all.len()),
    };
    text + &format!("pixel {x},{y}: {}, {samples}\n", color_text(traced.color))
}

fn indented(recording: &Recording) -> String {
    recording.to_text().lines().map(|line| format!("  {line}\n")).collect()
}

pub fn color_text([red, green, blue]: [f32; 3]) -> String {
    format!("({red:?}, {green:?}, {blue:?})")
}

/// Parses a column and a row.
pub fn parse_pixel(text: &str) -> Result<[usize; 2], String> {
    let pixel = text
        .split_once(',')
        .and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
    pixel.ok_or_else(|| "expected a column and a row, such as 320,240".to_owned())
}

/// A pixel as JSON.
#[derive(Serialize)]
struct JsonPixel {
    pixel: [usize; 2],
    color: Json,
    samples: Vec<JsonSample>,
}

/// A sample as JSON.
#[derive(Serialize)]
struct JsonSample {
    sample: u32,
    color: Json,
    prints: Vec<String>,
    #[serde(flatten)]
    recording: JsonRecording,
}

impl JsonPixel {
    fn new(pixel: [usize; 2], traced: &TracedPixel) -> JsonPixel {
        let color = |color: [f32; 3]| Json::List(color.map(Json::Float).to_vec());
        let samples = traced.samples.iter().map(|sample| JsonSample {
            sample: sample.index,
            color: color(sample.radiance),
            prints: prints(&sample.recording),
            recording: JsonRecording::new(&sample.recording),
        });
        JsonPixel { pixel, color: color(traced.color), samples: samples.collect() }
    }
}

/// The texts that shaders have printed.
fn prints(recording: &Recording) -> Vec<String> {
    let texts = recording.entries.iter().filter_map(|entry| match &entry.kind {
        TraceKind::Print(text, _) => Some(text.clone()),
        _ => None,
    });
    texts.collect()
}
