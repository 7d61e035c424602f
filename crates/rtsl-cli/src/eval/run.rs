//! Executes a request: creates the instance, sets its inputs, calls the method and reads the outputs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rtsl::host::PlainHost;
use rtsl::{
    CallArguments, CallMode, Class, Diagnostic, Engine, Instance, Instances, LaneBlock, LaneMask,
    LoopOwners, Messages, Method, ParameterType, Program, Scalar, StateVariable, Unit, Value,
    derived_components, diagnostic_codes as codes, new_state, place_words, set_defaults,
};
use rtsl_render::integrate::Evaluation as SceneEvaluation;
use rtsl_scene::reader::DiskFiles;
use rtsl_scene::{LoadOptions, load_scene};
use serde_json::Value as JsonValue;

use super::function::FunctionCall;
use super::request::{Evaluation, Request, Values};
use super::values::{self, Lanes, PlaceWords, ValueError};
use crate::json::Json;
use crate::names::{find_method, find_state};

/// The greatest number of rays of one request.
const MAX_LANES: usize = 1 << 20;

/// The reason for an answer without a result.
#[derive(Debug)]
pub enum Refusal {
    /// An error of the request itself.
    Request(String),
    /// An error of the shader, its parameters or this machine.
    Diagnostics(Vec<Diagnostic>),
}

impl From<Diagnostic> for Refusal {
    fn from(diagnostic: Diagnostic) -> Refusal {
        Refusal::Diagnostics(vec![diagnostic])
    }
}

impl From<ValueError> for Refusal {
    fn from(error: ValueError) -> Refusal {
        match error {
            ValueError::Malformed(message) => Refusal::Request(message),
            ValueError::Instance(diagnostics) => Refusal::Diagnostics(diagnostics),
        }
    }
}

/// Executes the request and completes the evaluation. Returns the program, for reuse.
pub fn run(
    request: &Request,
    unit: &Unit,
    engine: &Engine,
    scene_folders: Vec<PathBuf>,
    evaluation: &mut Evaluation,
) -> Result<Arc<Program>, Refusal> {
    let class = choose_class(unit, request.class.as_deref())?;
    let method =
        find_method(request.method.as_deref().unwrap_or_default()).map_err(Refusal::Request)?;
    let params = request.params.iter().chain(&request.buffers);
    let instance = values::make_instance(class, unit, params)?;
    evaluation.further.extend(values::range_warnings(&instance));
    let program = engine.program(&instance);
    let linked = program.method(method)?;
    evaluation.further.extend(linked.warnings.iter().cloned());
    let kernel = program.kernel(method, CallMode::Packet)?;

    let state_values = parse_lanes(&request.state);
    let scratch_values = parse_lanes(&request.scratch);
    let lanes = count_lanes(request, state_values.values().chain(scratch_values.values()))?;
    let mut state = new_state(lanes);
    if let Some(role) = class.role_of(method) {
        set_defaults(&mut state, role);
    }
    set_state(&mut state, &state_values)?;
    if let Some(role) = class.role_of(method) {
        let is_given = |it: &StateVariable| state_values.contains_key(it.name);
        for (component, derivation) in derived_components(role, method, is_given) {
            derivation.set(&mut state, component, lanes);
        }
    }
    let mut scratch = program.new_scratch(lanes);
    set_scratch(&mut scratch, &program, &scratch_values)?;
    let show = |state: &LaneBlock, scratch: &LaneBlock| {
        let written = linked.writes.iter().map(|variable| show_state(variable, state));
        (written.collect::<BTreeMap<_, _>>(), show_scratch(&program, scratch))
    };
    let before = request.only_changes.then(|| show(&state, &scratch));
    let mut accepted = LaneMask::new(lanes);
    let block = program.block(&instance);
    let trace = engine.options().trace.clone();
    // A scene is prepared before.
    let start = || {
        if let Some(trace) = &trace {
            trace.start();
        }
    };
    let status = match (&request.scene, method) {
        (Some(scene), Method::Radiance) => {
            let scene = scene_of(scene, scene_folders, &instance, engine)?;
            start();
            scene.radiance(&mut state, &mut scratch, lanes)
        }
        (Some(_), _) => {
            let message = format!("`{}` asks no scene, only `radiance` does", method.name());
            return Err(Refusal::Request(message));
        }
        (None, _) => {
            start();
            kernel.call(CallArguments {
                state: &mut state,
                scratch: &mut scratch,
                count: lanes,
                mask: None,
                accepted: Some(&mut accepted),
                instances: Instances::One(&block),
                host: &mut PlainHost::from(&request.host),
            })
        }
    };
    evaluation.recording = trace.map(|trace| trace.take());
    let answer = &mut evaluation.answer;
    if status.budget_exhausted {
        answer.ok = false;
        let problem = budget_exhausted(&program, method, request.budget());
        evaluation.further.push(problem);
    }
    let (mut written, mut members) = show(&state, &scratch);
    if let Some((state, scratch)) = before {
        written.retain(|name, value| state.get(name) != Some(value));
        members.retain(|name, value| FunctionCall::has(name) || scratch.get(name) != Some(value));
    }
    answer.state = Some(written);
    answer.scratch = Some(members);
    if method == Method::Intersect {
        let hits = (0..lanes).map(|lane| Json::Bool(accepted.get(lane)));
        answer.hit = Some(lanes_of(hits.collect()));
    }
    Ok(program)
}

/// Loads the scene that an integrator asks. `rtsl check` shows its warnings.
fn scene_of(
    path: &Path,
    search_path: Vec<PathBuf>,
    integrator: &Arc<Instance>,
    engine: &Engine,
) -> Result<SceneEvaluation, Refusal> {
    let refusal = |messages: Messages| Refusal::Request(messages.to_text(false));
    let traced = engine.options().trace.is_some();
    let options = LoadOptions { search_path, traced, ..LoadOptions::default() };
    let mut loaded = load_scene(path, &DiskFiles, &options).map_err(refusal)?;
    let warnings = &mut loaded.warnings;
    SceneEvaluation::new(&loaded.scene, integrator, engine, warnings).map_err(refusal)
}

fn choose_class<'a>(unit: &'a Unit, name: Option<&str>) -> Result<&'a Arc<Class>, Refusal> {
    match (name, unit.classes()) {
        (Some(name), _) => Ok(unit.class(name)?),
        (None, [class]) => Ok(class),
        (None, classes) => {
            let message = format!("choose a `class`: the text has {}", classes.len());
            Err(Refusal::Request(message))
        }
    }
}

fn parse_lanes(values: &Values) -> BTreeMap<&str, Lanes> {
    values.iter().map(|(name, value)| (name.as_str(), Lanes::parse(value))).collect()
}

fn count_lanes<'a>(
    request: &Request,
    values: impl Iterator<Item = &'a Lanes>,
) -> Result<usize, Refusal> {
    let given = values.filter_map(Lanes::count).max();
    let lanes = request.lanes.or(given).unwrap_or(1);
    if lanes > MAX_LANES {
        return Err(Refusal::Request(format!("{lanes} lanes, where {MAX_LANES} are the limit")));
    }
    Ok(lanes)
}

fn lane_value<'a>(name: &str, values: &'a Lanes, lane: usize) -> Result<&'a JsonValue, Refusal> {
    values
        .get(lane)
        .ok_or_else(|| Refusal::Request(format!("`{name}` has no value for lane {lane}")))
}

fn set_state(state: &mut LaneBlock, values: &BTreeMap<&str, Lanes>) -> Result<(), Refusal> {
    for (name, values) in values {
        let variable = find_state(name).map_err(Refusal::Request)?;
        for lane in 0..state.lanes() {
            let value = lane_value(name, values, lane)?;
            let floats = values::parse_state(variable, value).map_err(Refusal::Request)?;
            for (component, value) in floats.into_iter().enumerate() {
                state.floats_mut(variable.first_component as usize + component)[lane] = value;
            }
        }
    }
    Ok(())
}

fn set_scratch(
    scratch: &mut LaneBlock,
    program: &Program,
    values: &BTreeMap<&str, Lanes>,
) -> Result<(), Refusal> {
    for (name, values) in values {
        let ty = scratch_type(program.class(), name)?;
        for lane in 0..scratch.lanes() {
            let value = values::parse_value(lane_value(name, values, lane)?, &Unit::default())?;
            set_scratch_member(scratch, program, name, ty, &value, lane)?;
        }
    }
    Ok(())
}

fn scratch_type<'a>(class: &'a Class, name: &str) -> Result<&'a ParameterType, Refusal> {
    let found = class.scratch_types.iter().find(|(member, _)| member == name);
    found.map(|(_, ty)| ty).ok_or_else(|| {
        Refusal::Request(format!("class `{}` has no scratch member `{name}`", class.name))
    })
}

fn set_scratch_member(
    scratch: &mut LaneBlock,
    program: &Program,
    name: &str,
    ty: &ParameterType,
    value: &Value,
    lane: usize,
) -> Result<(), Refusal> {
    let places = place_words(name, ty, value)
        .map_err(|error| Refusal::Request(format!("scratch `{name}`: {error}")))?;
    for (place, words) in places {
        let Some(first) = program.layout().scratch.get(&place) else { continue };
        let is_bool = program
            .scratch()
            .iter()
            .any(|known| known.name == place && known.scalar == Scalar::Bool);
        for (index, word) in words.into_iter().enumerate() {
            // Kernels represent true by all ones.
            let word = if is_bool && word != 0 { u32::MAX } else { word };
            scratch.words_mut(*first as usize + index)[lane] = word;
        }
    }
    Ok(())
}

fn show_state(variable: &StateVariable, state: &LaneBlock) -> (String, Json) {
    let component = |index: u32, lane: usize| {
        Json::Float(state.floats((variable.first_component + index) as usize)[lane])
    };
    let lanes = (0..state.lanes()).map(|lane| match variable.ty.components() {
        1 => component(0, lane),
        count => Json::List((0..count).map(|index| component(index, lane)).collect()),
    });
    (variable.name.to_owned(), lanes_of(lanes.collect()))
}

fn show_scratch(program: &Program, scratch: &LaneBlock) -> BTreeMap<String, Json> {
    let members = program.class().scratch_types.iter().map(|(name, ty)| {
        let lanes = (0..scratch.lanes()).map(|lane| {
            let mut words = lane_words(program, scratch, lane);
            values::show(ty, name, &mut words)
        });
        (name.clone(), lanes_of(lanes.collect()))
    });
    members.collect()
}

/// The words of the scratch variables of one ray.
fn lane_words<'a>(program: &'a Program, scratch: &'a LaneBlock, lane: usize) -> PlaceWords<'a> {
    let places = program.scratch().iter().filter_map(|place| {
        let first = *program.layout().scratch.get(&place.name)?;
        let words = (first..first + place.len)
            .map(move |array| scratch.words(array as usize)[lane])
            .map(|word| if place.scalar == Scalar::Bool { u32::from(word != 0) } else { word });
        let words: Box<dyn Iterator<Item = u32>> = Box::new(words);
        Some((place.name.clone(), words))
    });
    places.collect()
}

fn lanes_of(lanes: Vec<Json>) -> Json {
    Json::Object(vec![("lanes".to_owned(), Json::List(lanes))])
}

fn budget_exhausted(program: &Program, method: Method, budget: u32) -> Diagnostic {
    let owners = LoopOwners::of(&program.class().name, method, [program]);
    Diagnostic::new(
        codes::BUDGET_EXHAUSTED,
        format!("{} used up its budget of {budget} loop iterations", owners.subject()),
    )
    .help("its loop may never end; `--budget` sets the limit")
}
