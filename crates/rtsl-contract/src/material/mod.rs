//! What materials promise.

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
/// If a method has no code, or does not end.
pub fn check(subject: &Subject<'_>) -> Result<Vec<Finding>, Stop> {
    let mut findings = scattering::check(subject)?;
    findings.push(reciprocity::check(subject)?);
    findings.extend(extremes::check(subject)?);
    Ok(findings)
}

/// Why a class that only shades keeps no contract of scattering.
const ONLY_SHADES: &str = "the class has neither BSDF nor sampleBSDF";

/// Whether the class has what a path tracer calls.
fn scatters(subject: &Subject<'_>) -> bool {
    subject.has(Method::SampleBsdf) && subject.has(Method::Bsdf)
}
