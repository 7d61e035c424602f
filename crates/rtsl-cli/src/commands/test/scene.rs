//! `rtsl test SCENE`: checks the instances of a scene, with all that they refer to.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl::{Engine, Instance};
use rtsl_contract::{Inputs, Options, Report, check};
use rtsl_scene::reader::DiskFiles;
use rtsl_scene::{LoadOptions, Scene, load_scene};

use super::{TestArguments, json_finding};
use crate::commands::render::report;
use crate::files::write_result;
use crate::json::Json;
use crate::outcome::Failure;
use crate::project_file::ProjectFile;
use crate::report::Reporter;

/// Checks the camera, the materials, the lights and the shapes of a scene; returns the number of broken contracts.
pub fn check_scene(
    arguments: &TestArguments,
    engine: &Engine,
    reporter: &Reporter,
) -> Result<usize, Failure> {
    if !arguments.params.is_empty() {
        let problem = "`--param` is for shaders: the instances of a scene have their parameters";
        return Err(Failure::Usage(problem.to_owned()));
    }
    let scene = load(arguments, reporter)?;
    let TestArguments { samples, seed, json, .. } = *arguments;
    let options = Options { samples, seed, compare_bits: true };
    let mut broken = 0;
    for (name, instance) in subjects(&scene) {
        let class = &instance.class().name;
        if arguments.class.as_ref().is_some_and(|wanted| wanted != class) {
            continue;
        }
        let report = check(engine, &instance, &options)?;
        broken += report.broken().count();
        let text = match json {
            true => json_line(&name, class, &report),
            false => text(&name, class, &report),
        };
        write_result(None, text.as_bytes())?;
    }
    Ok(broken)
}

fn load(arguments: &TestArguments, reporter: &Reporter) -> Result<Scene, Failure> {
    let project = ProjectFile::beside(&arguments.file, &arguments.search_path.folders());
    reporter.diagnostics(&project.sources, project.diagnostics.iter());
    let search_path = arguments.search_path.with(project).folders();
    let options = LoadOptions { search_path, ..LoadOptions::default() };
    match load_scene(&arguments.file, &DiskFiles, &options) {
        Ok(loaded) => {
            report(&loaded.warnings, reporter);
            Ok(loaded.scene)
        }
        Err(messages) => {
            report(&messages, reporter);
            Err(Failure::Reported)
        }
    }
}

/// Returns each instance once, with its name. Shapes with elements, such as meshes, are left out: contracts are about
/// single shapes.
fn subjects(scene: &Scene) -> Vec<(String, Arc<Instance>)> {
    let numbered = |kind: &str, instances: Vec<Arc<Instance>>| {
        let numbered = instances.into_iter().enumerate();
        numbered.map(|(index, it)| (format!("{kind} {index}"), it)).collect::<Vec<_>>()
    };
    let lights = scene.lights.iter().map(|placed| placed.light.clone()).collect();
    let shapes = scene.objects.iter().filter(|object| object.elements.is_none());
    let shapes = shapes.map(|object| object.primitive.clone()).collect();
    let mut subjects = vec![("camera".to_owned(), scene.camera.clone())];
    subjects.extend(numbered("material", scene.materials.clone()));
    subjects.extend(numbered("light", lights));
    subjects.extend(numbered("shape", shapes));
    let mut seen = BTreeSet::new();
    subjects.retain(|(_, instance)| seen.insert(Arc::as_ptr(instance)));
    subjects
}

fn text(name: &str, class: &str, report: &Report) -> String {
    let call = |inputs: &Inputs| format!("in `{}` with {inputs}", inputs.method.name());
    let findings = report.findings.iter().map(|finding| finding.to_text(&call));
    format!("{name} ({class})\n{}\n", findings.collect::<String>())
}

fn json_line(name: &str, class: &str, report: &Report) -> String {
    let text = |it: &str| Json::Text(it.to_owned());
    let fields = vec![
        ("instance".to_owned(), text(name)),
        ("class".to_owned(), text(class)),
        ("holds".to_owned(), Json::Bool(report.holds())),
        ("contracts".to_owned(), Json::List(report.findings.iter().map(json_finding).collect())),
    ];
    serde_json::to_string(&Json::Object(fields)).unwrap_or_default() + "\n"
}
