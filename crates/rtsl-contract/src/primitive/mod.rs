//! Contracts of primitives.

mod hits;
mod place;
mod sampling;
mod shot;
mod surface;

use self::place::Place;
use crate::report::Finding;
use crate::stop::Stop;
use crate::subject::Subject;

/// Checks a primitive.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>) -> Result<Vec<Finding>, Stop> {
    let place = Place::find(subject)?;
    let mut findings = hits::check(subject, &place)?;
    findings.extend(surface::check(subject, &place)?);
    findings.extend(sampling::check(subject, &place)?);
    Ok(findings)
}
