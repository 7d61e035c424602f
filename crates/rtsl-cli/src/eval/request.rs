//! What is asked and answered, a JSON object each.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use serde_json::Value as JsonValue;

use crate::arguments::DEFAULT_LOOP_BUDGET;
use crate::json::Json;
use crate::report::JsonDiagnostic;

/// Names with their values, in the order of the text.
pub type Values = serde_json::Map<String, JsonValue>;

/// A request.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Given back in the answer.
    #[serde(default)]
    pub id: Option<JsonValue>,
    /// The shader's text.
    pub source: Option<String>,
    /// The shader's file, in place of its text.
    pub file: Option<PathBuf>,
    /// The class; may be left out where there is one.
    pub class: Option<String>,
    /// The method; without one the text is only compiled.
    pub method: Option<String>,
    /// The parameters of the instance.
    #[serde(default)]
    pub params: Values,
    /// State variables before the call.
    #[serde(default)]
    pub state: Values,
    /// Scratch members before the call.
    #[serde(default)]
    pub scratch: Values,
    /// Buffers, which are parameters too: they may stand here or in `params`.
    #[serde(default)]
    pub buffers: Values,
    /// How many rays; as many as the longest `lanes` list has, else 1.
    pub lanes: Option<usize>,
    /// `auto`, `jit` or `interp`.
    pub backend: Option<String>,
    /// Rays at a time.
    pub width: Option<u32>,
    /// `contract`, `strict` or `fast`.
    pub math: Option<String>,
    /// The greatest number of loop iterations of one ray; [`DEFAULT_LOOP_BUDGET`] if not given.
    pub budget: Option<u32>,
    /// What the renderer answers.
    #[serde(default)]
    pub host: HostRequest,
}

impl Request {
    /// The greatest number of loop iterations of one ray.
    pub fn budget(&self) -> u32 {
        self.budget.unwrap_or(DEFAULT_LOOP_BUDGET)
    }
}

/// What the renderer answers to a shader's questions.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HostRequest {
    /// The radiance along every ray; black if not given.
    pub trace: [f32; 3],
    /// Whether every ray is blocked.
    pub occluded: bool,
    /// Ambient light; black if not given.
    pub ambient: [f32; 3],
    /// The value of `rand()`.
    pub rand: f32,
    /// What `illuminance` runs over.
    pub lights: Vec<Light>,
}

/// A light, the same at every point.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// The unit vector towards it.
    pub direction: [f32; 3],
    /// How far it is; infinitely if not given.
    #[serde(default = "infinity")]
    pub distance: f32,
    /// Its radiance, or the whole contribution where the density is 0.
    pub color: [f32; 3],
    /// The density per solid angle; 0, a delta, if not given.
    #[serde(default)]
    pub pdf: f32,
}

fn infinity() -> f32 {
    f32::INFINITY
}

/// An answer.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Answer {
    /// The request's.
    pub id: Option<JsonValue>,
    /// Whether there are no errors.
    pub ok: bool,
    /// What is wrong with the request itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// What is wrong with the shader.
    pub diagnostics: Vec<JsonDiagnostic>,
    /// The classes of the text, where no method is asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub classes: Option<Vec<String>>,
    /// The state variables that the method may set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state: Option<BTreeMap<String, Json>>,
    /// The scratch members.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scratch: Option<BTreeMap<String, Json>>,
    /// Whether each ray's call accepted a hit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hit: Option<Json>,
}

impl Answer {
    /// The answer to a request that makes no sense.
    pub fn refusal(id: Option<JsonValue>, error: impl Into<String>) -> Answer {
        Answer { id, error: Some(error.into()), ..Answer::default() }
    }

    /// As a line of JSON, its end included.
    pub fn to_line(&self) -> String {
        serde_json::to_string(self).unwrap_or_default() + "\n"
    }
}
