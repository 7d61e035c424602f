//! Checks of the contracts between classes and renderers.
//!
//! A renderer relies on more than types: that `evaluatePDF` is the density of `sampleBSDF`, that no surface reflects
//! more light than it receives, that hits lie within bounds. Each such property is a [`Contract`]; [`check`] calls the
//! methods of an instance for many rays and returns a [`Report`] of the contracts that hold and of those that are
//! broken, with the inputs that break them.
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
//! Random numbers are counter-based and no arithmetic depends on the platform, so a report is the same on every machine
//! and backend.
//!
//! This crate depends on `rtsl` only: not on scenes, renderers or stages of the compiler.

mod agreement;
mod camera;
mod contract;
mod distribution;
mod furnace;
mod integrator;
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
pub use settings::{Setting, TEXTURE, settings, stand_in};

use crate::stop::Stop;
use crate::subject::Subject;

/// Checks the contracts of an instance's class in each of its roles.
///
/// The engine should have a loop budget, as that of [`engine_options`] has. It keeps the code of a class only as long
/// as a reference to its [program](Engine::program) exists: keep one to check many instances of a class.
///
/// # Errors
/// If a method cannot be compiled, which is not a mistake of the class.
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
            Role::Integrator => integrator::check(&subject),
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
