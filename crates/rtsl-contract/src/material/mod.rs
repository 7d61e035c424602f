//! Contracts of materials.

mod cycles;
mod extremes;
mod meeting;
mod path_methods;
mod reciprocity;
mod scattering;
mod throughput;

use crate::report::Finding;
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
