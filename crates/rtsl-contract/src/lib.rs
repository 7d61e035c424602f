//! What classes promise to renderers, checked.
//!
//! A renderer relies on more than types: that `evaluatePDF` is the density of `sampleBSDF`, that no
//! surface reflects more light than it receives, that hits lie within bounds. Each such promise is a
//! [`Contract`]; [`check`] calls the methods of an instance for many rays and gives a [`Report`] that
//! says of each whether it held, with the inputs that broke it.
//!
//! ```
//! use rtsl::{Compiler, Engine, Instance};
//! use rtsl_contract::{Options, check, engine_options};
//!
//! let text = "class Grey : rt_Material; void BSDF() { rt_BSDFValue = color(0.5); }";
//! let unit = Compiler::default().compile("grey.rtsl", text).unit.expect("it compiles");
//! let grey = Instance::new(&unit.classes()[0], []).expect("it has no parameters");
//! let (engine, _warnings) = Engine::new(engine_options()).expect("the interpreter, if nothing else");
//! let report = check(&engine, &grey, &Options::default()).expect("its methods have code");
//! // A division by pi is missing.
//! assert!(!report.holds() && report.to_string().contains("more light is scattered than arrives"));
//! ```
//!
//! Random numbers are counted and all arithmetic is this crate's own or the shader's, so a report is
//! the same on every machine, whatever runs the code.
//!
//! This crate knows no scenes and no renderers, and no stage of the compiler: only `rtsl`.

mod agreement;
mod camera;
mod contract;
mod distribution;
mod light;
mod light_meeting;
mod material;
mod neighbours;
mod options;
mod partition;
mod primitive;
mod proposal;
mod random;
mod rays;
mod report;
mod settings;
mod statistics;
mod stop;
mod subject;
mod tally;
mod texture;
mod values;

use std::sync::Arc;

use rtsl::{Diagnostic, Engine, Instance, Role};

pub use contract::Contract;
pub use options::{Options, engine_options};
pub use report::{Failure, Finding, Inputs, Outcome, Report};
pub use settings::{Setting, settings, stand_in};

use crate::stop::Stop;
use crate::subject::Subject;

/// Checks what the class of an instance promises in each of its roles.
///
/// The engine should have a loop budget, as that of [`engine_options`] has. It keeps the code of a class as
/// long as somebody has its [program](Engine::program): hold on to that to check many instances of a class.
///
/// # Errors
/// If a method has no code, which is not the class's doing.
pub fn check(
    engine: &Engine,
    instance: &Arc<Instance>,
    options: &Options,
) -> Result<Report, Diagnostic> {
    let subject = Subject::new(engine, instance, options);
    let mut findings = Vec::new();
    for role in &instance.class().roles {
        let found = match role {
            Role::Material => material::check(&subject),
            Role::Primitive => primitive::check(&subject),
            Role::Camera => camera::check(&subject),
            Role::Texture => texture::check(&subject),
            Role::Light => light::check(&subject).and_then(|mut found| {
                found.push(light_meeting::check(&subject)?);
                Ok(found)
            }),
        };
        match found {
            Ok(found) => findings.extend(found),
            Err(Stop::NoCode(diagnostic)) => return Err(*diagnostic),
            Err(Stop::Endless) => return Ok(report(instance, findings, subject)),
        }
    }
    if options.compare_bits {
        match agreement::check(instance, options) {
            Ok(found) => findings.push(found),
            Err(Stop::NoCode(diagnostic)) => return Err(*diagnostic),
            Err(Stop::Endless) => {}
        }
    }
    Ok(report(instance, findings, subject))
}

fn report(instance: &Instance, mut findings: Vec<Finding>, subject: Subject<'_>) -> Report {
    findings.push(subject.budget_finding());
    Report { class: instance.class().name.clone(), findings }
}
