//! Requests and answers, a JSON object each.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use rtsl::host::{PlainHost, PlainLight};
use rtsl::{Compilation, DEFAULT_LOOP_BUDGET, Diagnostic, Method, Recording, Trace};
use serde::{Deserialize, Serialize};
use serde_json::Value as JsonValue;

use crate::json::Json;
use crate::report::JsonDiagnostic;
use crate::trace::{JsonRecording, TraceName};

/// Names with their values, in the order of the text.
pub type Values = serde_json::Map<String, JsonValue>;

/// A request.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Repeated in the answer.
    #[serde(default)]
    pub id: Option<JsonValue>,
    /// The shader's text.
    pub source: Option<String>,
    /// The shader's file, in place of its text.
    pub file: Option<PathBuf>,
    /// The class; optional if there is only one.
    pub class: Option<String>,
    /// The method, or another function; without one the text is only compiled.
    pub method: Option<String>,
    /// The parameters of the instance.
    #[serde(default)]
    pub params: Values,
    /// The arguments of a function that is no method.
    #[serde(default)]
    pub args: Values,
    /// True if the answer has only what the call changed: of a function it is not known what it may set.
    #[serde(skip)]
    pub only_changes: bool,
    /// State variables before the call.
    #[serde(default)]
    pub state: Values,
    /// Scratch members before the call.
    #[serde(default)]
    pub scratch: Values,
    /// Buffers, which are also parameters: they may be given here or in `params`.
    #[serde(default)]
    pub buffers: Values,
    /// The number of rays; the length of the longest `lanes` list, or 1, if not given.
    pub lanes: Option<usize>,
    /// `auto`, `jit` or `interp`.
    pub backend: Option<String>,
    /// The SIMD width in rays.
    pub width: Option<u32>,
    /// `contract`, `strict` or `fast`.
    pub math: Option<String>,
    /// The greatest number of loop iterations of one ray; [`DEFAULT_LOOP_BUDGET`] if not given.
    pub budget: Option<u32>,
    /// The scene that an integrator asks; without one, nothing is there.
    pub scene: Option<PathBuf>,
    /// The answers of the host.
    #[serde(default)]
    pub host: HostRequest,
    /// The detail of the trace, if there is to be one.
    pub trace: Option<TraceName>,
    /// The trace to which the call is recorded, in place of one of that detail.
    #[serde(skip)]
    pub recorder: Option<Trace>,
}

impl Request {
    /// True if the request calls a function that is no method.
    pub fn calls_function(&self) -> bool {
        self.method.as_deref().is_some_and(|name| Method::from_name(name).is_none())
    }

    /// Returns the greatest number of loop iterations of one ray.
    pub fn budget(&self) -> u32 {
        self.budget.unwrap_or(DEFAULT_LOOP_BUDGET)
    }
}

/// The answers of the host to a shader's requests.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HostRequest {
    /// The radiance along every ray; black if not given.
    pub trace: [f32; 3],
    /// True if every ray is occluded.
    pub occluded: bool,
    /// Ambient light; black if not given.
    pub ambient: [f32; 3],
    /// The value of `rand()`.
    pub rand: f32,
    /// The lights of `illuminance`.
    pub lights: Vec<Light>,
}

/// A light, the same at every point.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// The unit vector towards it.
    pub direction: [f32; 3],
    /// The distance; infinite if not given.
    #[serde(default = "infinity")]
    pub distance: f32,
    /// Its radiance, or the whole contribution if the density is 0.
    pub color: [f32; 3],
    /// The density per solid angle; 0, a delta, if not given.
    #[serde(default)]
    pub pdf: f32,
}

impl From<&HostRequest> for PlainHost {
    fn from(request: &HostRequest) -> PlainHost {
        let HostRequest { trace, occluded, ambient, rand, .. } = *request;
        let light = |light: &Light| PlainLight {
            direction: light.direction,
            distance: light.distance,
            color: light.color,
            pdf: light.pdf,
        };
        let lights = request.lights.iter().map(light).collect();
        PlainHost { trace, occluded, ambient, rand, lights }
    }
}

fn infinity() -> f32 {
    f32::INFINITY
}

/// An answer.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Answer {
    /// The id of the request.
    pub id: Option<JsonValue>,
    /// True if there are no errors.
    pub ok: bool,
    /// The error of the request itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// The diagnostics of the shader.
    pub diagnostics: Vec<JsonDiagnostic>,
    /// The classes of the text, if the request has no method.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub classes: Option<Vec<String>>,
    /// The result of a function that is no method.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub result: Option<Json>,
    /// Its out parameters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out: Option<BTreeMap<String, Json>>,
    /// The state variables that the method may set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state: Option<BTreeMap<String, Json>>,
    /// The scratch members.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scratch: Option<BTreeMap<String, Json>>,
    /// For each ray, true if the call accepted a hit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hit: Option<Json>,
    /// The prints of the call, and its trace if the request asks for one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trace: Option<JsonRecording>,
}

/// The result of a request.
pub struct Evaluation {
    /// The answer without its diagnostics.
    pub answer: Answer,
    /// The compiled text with its diagnostics.
    pub compilation: Option<Arc<Compilation>>,
    /// Further diagnostics, of parameters, linking and running, without a position.
    pub further: Vec<Diagnostic>,
    /// The prints and the calls of methods, if the call is traced.
    pub recording: Option<Recording>,
}

impl Evaluation {
    /// Creates an evaluation that has nothing but an answer.
    pub fn of_answer(answer: Answer) -> Evaluation {
        Evaluation { answer, compilation: None, further: Vec::new(), recording: None }
    }
}

impl Answer {
    /// The answer to an invalid request.
    pub fn refusal(id: Option<JsonValue>, error: impl Into<String>) -> Answer {
        Answer { id, error: Some(error.into()), ..Answer::default() }
    }

    /// Returns a line of JSON with its end.
    pub fn to_line(&self) -> String {
        serde_json::to_string(self).unwrap_or_default() + "\n"
    }
}
