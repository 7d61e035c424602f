//! Targets of the debugger: a sample of a pixel, or one call of a method, which are recorded.

use rtsl::{Trace, TraceDetail, TraceLimits, render};
use rtsl_debug::Replay;
use rtsl_render::{PixelRequest, RenderRequest, render_pixel};

use crate::arguments::SearchPath;
use crate::commands::eval::plain_text;
use crate::commands::pixel::color_text;
use crate::eval::{Evaluation, Request, Session};

/// The number of entries that are recorded if no other is given, about 150 MB.
pub const DEFAULT_KEPT: usize = 1 << 20;
/// The greatest number of entries that can be recorded, about 2.5 GB.
pub const MAX_KEPT: usize = 1 << 24;

/// A run that is debugged.
pub enum Target {
    /// A sample of a pixel.
    Pixel(Box<PixelTarget>),
    /// A call of a method or a function.
    Method(Box<Request>),
}

/// A sample of a pixel of a scene.
pub struct PixelTarget {
    /// The scene with its settings.
    pub request: RenderRequest<'static>,
    /// The column and the row.
    pub pixel: [usize; 2],
    /// The sample.
    pub sample: u32,
}

/// A recorded target.
pub struct Recorded {
    /// The recording.
    pub replay: Replay,
    /// A few words for the recorded call or pixel.
    pub title: String,
    /// Its results, as lines.
    pub result: String,
    /// Warnings, as text.
    pub warnings: String,
}

/// Records a target.
///
/// # Errors
/// If it can't run, or no statement of it can be recorded, as text.
pub fn record(
    target: &Target,
    limits: TraceLimits,
    search_path: &SearchPath,
) -> Result<Recorded, String> {
    let trace = Trace::with_limits(TraceDetail::Steps, limits);
    let mut recorded = match target {
        Target::Pixel(target) => record_pixel(target, &trace)?,
        Target::Method(request) => record_method(request, &trace, search_path)?,
    };
    let replay = &recorded.replay;
    if replay.skipped() > 0 {
        recorded.warnings += &format!(
            "note: the recording begins after {} entries; earlier statements are not in it\n",
            replay.skipped()
        );
    }
    if replay.dropped() > 0 {
        recorded.warnings += &format!(
            "note: the recording is cut: its last {} entries are not kept; keep more of them, or skip {} to record \
             the end\n",
            replay.dropped(),
            limits.skip + replay.dropped(),
        );
    }
    Ok(recorded)
}

fn record_pixel(target: &PixelTarget, trace: &Trace) -> Result<Recorded, String> {
    let PixelTarget { request, pixel, sample } = target;
    let chosen = PixelRequest { pixel: *pixel, first: *sample, count: Some(1) };
    let traced = render_pixel(request, chosen, trace).map_err(|errors| errors.to_text(false))?;
    let title = format!("pixel {},{}, sample {sample}", pixel[0], pixel[1]);
    let sample = traced.samples.into_iter().next();
    let sample = sample.ok_or_else(|| format!("{title} was not rendered"))?;
    let result = format!("{title}: {}\n", color_text(sample.radiance));
    let replay = Replay::new(sample.recording, trace.stepped_lines());
    let replay = replay.map_err(|error| format!("{title}: {error}"))?;
    Ok(Recorded { replay, title, result, warnings: traced.warnings.to_text(false) })
}

fn record_method(
    request: &Request,
    trace: &Trace,
    search_path: &SearchPath,
) -> Result<Recorded, String> {
    let request = Request { recorder: Some(trace.clone()), ..request.clone() };
    let title = request.method.clone().unwrap_or_default();
    let mut session = Session::new(search_path.clone());
    let Evaluation { answer, compilation, further, recording } = session.evaluate(&request);
    let mut warnings = compilation.map_or_else(String::new, |it| it.report(false));
    warnings += &render::all_to_text(&rtsl::SourceMap::new(), &further, false);
    let Some(recording) = recording else {
        return Err(answer.error.map_or(warnings, |error| format!("error: {error}\n")));
    };
    let mut lines = trace.stepped_lines();
    if let (true, Some(file)) = (request.calls_function(), &request.file) {
        let length = std::fs::metadata(file).map_or(0, |file| file.len());
        lines.cut(&file.display().to_string(), length as usize);
    }
    let replay = Replay::new(recording, lines).map_err(|error| format!("`{title}`: {error}"))?;
    Ok(Recorded { replay, title, result: plain_text(&answer), warnings })
}
