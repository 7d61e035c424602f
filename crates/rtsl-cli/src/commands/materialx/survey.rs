//! `rtsl materialx --check`: how many documents of a folder are translated, compiled and evaluated.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rtsl::{
    Backend, CallArguments, CallMode, Class, Compiler, Engine, EngineOptions, Instance, Instances,
    LaneBlock, Method, Role, SourceMap, lookup_state,
};
use rtsl_materialx::{Material, Translation, has_materials, translate, translate_outputs};
use serde::Serialize;

use super::{read, title};
use crate::commands::bench::{BenchHost, Random, random_state};
use crate::files::write_result;
use crate::outcome::{CommandResult, Failure, Outcome};

/// The points at which each class is evaluated.
const POINTS: usize = 64;

/// The seed of the points.
const SEED: u64 = 1;

/// The result for one document.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
struct DocumentResult {
    document: String,
    /// The stage that the document reached.
    stage: Stage,
    /// Materials, and outputs of graphs, that have a class.
    materials: usize,
    outputs: usize,
    /// The greatest number of values of a method.
    values: usize,
    errors: Vec<String>,
}

/// The stages, each of which includes those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "camelCase")]
enum Stage {
    /// The document is not read.
    Unread,
    /// It is read, and some material or output has no translation.
    Read,
    /// It has neither materials nor outputs.
    Empty,
    /// All are translated, and some class does not compile.
    Translated,
    /// All compile, and some value is infinite or not a number.
    Compiled,
    /// All values are finite.
    Finite,
}

/// The counts of a folder.
#[derive(Debug, Default, Serialize)]
#[serde(rename_all = "camelCase")]
struct Counts {
    documents: usize,
    empty: usize,
    translated: usize,
    compiled: usize,
    finite: usize,
    /// The greatest number of values of a method.
    values: usize,
    /// Messages of documents without a translation, with the number of documents.
    errors: BTreeMap<String, usize>,
}

#[derive(Debug, Serialize)]
struct Survey {
    counts: Counts,
    documents: Vec<DocumentResult>,
}

/// Checks the documents of a folder, or one document.
pub fn run(path: &Path, json: bool) -> CommandResult {
    let files = documents(path)?;
    let options =
        EngineOptions { backend: Backend::Interpreter, ..rtsl_contract::engine_options() };
    let (engine, _) = Engine::new(options)?;
    let documents: Vec<DocumentResult> =
        files.iter().map(|file| check(file, path, &engine)).collect();
    let survey = Survey { counts: count(&documents), documents };
    let text = match json {
        true => serde_json::to_string_pretty(&survey)
            .map_err(|error| Failure::Output(std::io::Error::other(error)))?,
        false => show(&survey),
    };
    write_result(None, format!("{text}\n").as_bytes())?;
    Ok(Outcome::Done)
}

/// The documents in a folder and the folders in it, by name.
fn documents(path: &Path) -> Result<Vec<PathBuf>, Failure> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let mut found = Vec::new();
    let mut open = vec![path.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).map_err(Failure::Output)? {
            let entry = entry.map_err(Failure::Output)?;
            // Links are not followed, since they may form circles.
            match entry.file_type() {
                Ok(kind) if kind.is_dir() => open.push(entry.path()),
                Ok(_) if entry.path().extension().is_some_and(|it| it == "mtlx") => {
                    found.push(entry.path());
                }
                Ok(_) | Err(_) => {}
            }
        }
    }
    found.sort();
    Ok(found)
}

fn check(file: &Path, root: &Path, engine: &Engine) -> DocumentResult {
    let shown = file.strip_prefix(root).ok().filter(|it| !it.as_os_str().is_empty());
    let mut result = DocumentResult {
        document: shown.unwrap_or(file).display().to_string(),
        stage: Stage::Unread,
        materials: 0,
        outputs: 0,
        values: 0,
        errors: Vec::new(),
    };
    let mut sources = SourceMap::new();
    let document = match read(file, &mut sources) {
        Ok(document) => document,
        Err(diagnostic) => {
            result.errors.push(diagnostic.message);
            return result;
        }
    };
    let title = title(file);
    let outputs = translate_outputs(&document, &title);
    let materials = match has_materials(&document) {
        true => translate(&document, &title, None),
        false => Translation::default(),
    };
    let errors = materials.errors.iter().chain(&outputs.errors);
    result.errors.extend(errors.map(|error| format!("{}: {}", error.code, error.message)));
    result.materials = materials.materials.len();
    result.outputs = outputs.materials.len();
    result.stage = match (result.errors.is_empty(), result.materials + result.outputs) {
        (false, _) => Stage::Read,
        (true, 0) => Stage::Empty,
        (true, _) => compiled(&[materials, outputs], engine, &mut result),
    };
    result
}

/// Compiles and evaluates the classes of a document.
fn compiled(translations: &[Translation], engine: &Engine, result: &mut DocumentResult) -> Stage {
    let mut stage = Stage::Finite;
    let all = translations.iter().flat_map(|it| &it.materials);
    for material in all.flat_map(Material::with_parts) {
        let compilation = Compiler::default().compile(&material.class, &material.file_text());
        let Some(unit) = compilation.unit else {
            let errors = compilation.diagnostics.iter().filter(|it| it.is_error());
            let messages = errors.map(|it| format!("{}: {}", material.name, it.message));
            result.errors.extend(messages.take(3));
            return Stage::Translated;
        };
        let Ok(class) = unit.class(&material.class) else { return Stage::Translated };
        let sizes = class.methods.values().map(|method| method.values.len());
        result.values = result.values.max(sizes.max().unwrap_or(0));
        match evaluate(class, engine) {
            Ok(true) => {}
            Ok(false) => {
                result.errors.push(format!("{}: a value is not finite", material.name));
                stage = stage.min(Stage::Compiled);
            }
            Err(message) => {
                result.errors.push(format!("{}: {message}", material.name));
                return Stage::Translated;
            }
        }
    }
    stage
}

/// True if a class gives finite values at random points.
fn evaluate(class: &Arc<Class>, engine: &Engine) -> Result<bool, String> {
    let instance = Instance::new(class, []).map_err(|errors| {
        errors.into_vec().first().map_or(String::new(), |it| it.message.clone())
    })?;
    let program = engine.program(&instance);
    let (methods, role): (&[Method], Role) = match class.roles.contains(&Role::Texture) {
        true => (&[Method::Lookup], Role::Texture),
        false => (&[Method::Bsdf, Method::Emission], Role::Material),
    };
    for method in methods {
        let kernel = program.kernel(*method, CallMode::Packet).map_err(|it| it.message)?;
        let mut state = random_state(&mut Random::new(SEED), role, None, POINTS);
        let block = program.block(&instance);
        let status = kernel.call(CallArguments {
            state: &mut state,
            scratch: &mut program.new_scratch(POINTS),
            count: POINTS,
            mask: None,
            accepted: None,
            instances: Instances::One(&block),
            host: &mut BenchHost,
        });
        if status.budget_exhausted {
            return Err(format!("`{}` runs past its budget of loops", method.name()));
        }
        if !is_finite(&state, *method) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The results of a method, which are finite.
fn is_finite(state: &LaneBlock, method: Method) -> bool {
    let names: &[&str] = match method {
        Method::Lookup => &["rt_TextureColor", "rt_FloatTextureValue"],
        Method::Emission => &["rt_EmissionColor"],
        _ => &["rt_BSDFValue"],
    };
    names.iter().filter_map(|name| lookup_state(name)).all(|variable| {
        let first = variable.first_component as usize;
        let components = first..first + variable.ty.components() as usize;
        let mut components = components;
        components.all(|it| state.floats(it).iter().all(|value| value.is_finite()))
    })
}

fn count(documents: &[DocumentResult]) -> Counts {
    let mut counts = Counts { documents: documents.len(), ..Counts::default() };
    for document in documents {
        counts.empty += usize::from(document.stage == Stage::Empty);
        counts.translated += usize::from(document.stage >= Stage::Translated);
        counts.compiled += usize::from(document.stage >= Stage::Compiled);
        counts.finite += usize::from(document.stage == Stage::Finite);
        counts.values = counts.values.max(document.values);
        let mut messages = document.errors.clone();
        messages.dedup();
        for message in messages {
            *counts.errors.entry(message).or_default() += 1;
        }
    }
    counts
}

fn show(survey: &Survey) -> String {
    let Counts { documents, empty, translated, compiled, finite, values, .. } = &survey.counts;
    let mut lines = Vec::new();
    for document in &survey.documents {
        let stage = format!("{:?}", document.stage).to_lowercase();
        lines.push(format!("{stage:10} {}", document.document));
        lines.extend(document.errors.iter().map(|error| format!("           {error}")));
    }
    lines.push(format!(
        "{documents} documents, of which {empty} have neither materials nor outputs\n\
         {translated} translated, {compiled} compiled, {finite} with finite values\n\
         at most {values} values in a method"
    ));
    lines.join("\n")
}
