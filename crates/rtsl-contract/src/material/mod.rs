//! Contracts of materials.

mod extremes;
mod meeting;
mod reciprocity;
mod scattering;
mod throughput;

use rtsl::Method;

use crate::Finding;
use crate::stop::Stop;
use crate::subject::Subject;

/// Checks a material.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>) -> Result<Vec<Finding>, Stop> {
    let mut findings = scattering::check(subject)?;
    findings.push(reciprocity::check(subject)?);
    findings.extend(extremes::check(subject)?);
    Ok(findings)
}

/// The reason why contracts of scattering do not apply to a class that has only `shade`.
const ONLY_SHADES: &str = "the class has neither BSDF nor sampleBSDF";

/// True if the class has the methods that a path tracer calls.
fn scatters(subject: &Subject<'_>) -> bool {
    subject.has(Method::SampleBsdf) && subject.has(Method::Bsdf)
}
