//! Pictures by an integrator under test, which have the same bits at every width and on the interpreter.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rtsl::{Backend, Engine, EngineOptions, Instance, Messages};
use rtsl_contract::{Contract, Failure, Finding, Outcome};
use rtsl_render::request::render_integrator;
use rtsl_render::{Execution, RenderRequest};
use rtsl_scene::reader::MemoryFiles;

/// Matte, mirroring and glowing balls and a mesh under a sky, beside a lamp.
const SCENE: &str = "LookAt 0 1 -6  0 0 0  0 1 0
Camera \"Pinhole\" \"float fov\" 40
WorldBegin
LightSource \"infinite\" \"rgb L\" [0.5 0.6 0.8]
LightSource \"point\" \"rgb I\" [10 9 8] \"point3 from\" [2 4 -3]
AttributeBegin
  AreaLightSource \"diffuse\" \"rgb L\" [4 4 4]
  Translate -1 3 0
  Shape \"sphere\" \"float radius\" 0.3
AttributeEnd
Material \"diffuse\" \"rgb reflectance\" [0.5 0.4 0.3]
Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [-5 -1 -5  5 -1 -5  5 -1 5  -5 -1 5]
Shape \"sphere\"
Material \"conductor\" \"float roughness\" 0.1
AttributeBegin Translate 2 0 0 Shape \"sphere\" AttributeEnd
Material \"dielectric\"
AttributeBegin Translate -2 0 0 Shape \"sphere\" AttributeEnd
";

/// Columns and rows: the last vectors are not full.
const SIZE: (usize, usize) = (11, 9);

/// Compares the pictures of an integrator. Without LLVM only the interpreter is available.
pub fn check(integrator: &Arc<Instance>, loop_budget: Option<u32>) -> Finding {
    let outcome = match compared(integrator, loop_budget) {
        Ok(outcome) => outcome,
        Err(messages) => broken(messages.to_text(false).trim_end().replace('\n', "\n          ")),
    };
    Finding { contract: Contract::Pictures, outcome }
}

fn compared(integrator: &Arc<Instance>, loop_budget: Option<u32>) -> Result<Outcome, Messages> {
    if Engine::new(EngineOptions { backend: Backend::Jit, ..EngineOptions::default() }).is_err() {
        let reason = "there is no LLVM to compare the interpreter with";
        return Ok(Outcome::NotApplicable(reason.to_owned()));
    }
    let picture = |backend: Backend, width: u32| {
        let engine =
            EngineOptions { backend, width: Some(width), loop_budget, ..EngineOptions::default() };
        bits(integrator, engine)
    };
    let expected = picture(Backend::Interpreter, 1)?;
    for width in Engine::WIDTHS {
        if picture(Backend::Jit, width)? != expected {
            let message =
                format!("a picture has other bits at width {width} than on the interpreter");
            return Ok(broken(message));
        }
    }
    Ok(Outcome::Held(None))
}

fn broken(message: String) -> Outcome {
    Outcome::Broken(Failure { message, inputs: None, broken: 1, tested: 1 })
}

/// Returns the bits of a picture.
fn bits(integrator: &Arc<Instance>, engine: EngineOptions) -> Result<Vec<u32>, Messages> {
    let scene = PathBuf::from("scene.pbrt");
    let files = MemoryFiles([(scene.clone(), SCENE.to_owned())].into());
    let request = RenderRequest {
        scene: Path::new(&scene).into(),
        size: Some(SIZE),
        samples: Some(4),
        execution: Execution::on_threads(1),
        engine,
        ..RenderRequest::default()
    };
    let rendered = render_integrator(&request, &files, integrator)?;
    Ok(rendered.image.pixels.iter().flatten().map(|value| value.to_bits()).collect())
}
