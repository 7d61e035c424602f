//! Lights with the photometric profile of a luminaire, as values of the class `IesLight`.

use rtsl::{Diagnostic, Numbers, Value, diagnostic_codes as codes};
use rtsl_memory::Amount;

use super::images::Images;
use super::named_file::NamedFile;
use super::photometry::Photometry;
use crate::description::Entity;
use crate::reader::{Input, SceneFiles};

/// The parameters that are read here: the file, and the degrees by which the luminaire is tilted.
pub const PARAMETERS: &[&str] = &["filename", "tilt"];

/// The parameters of the class that a file gives.
const OF_FILE: [&str; 3] = ["verticals", "horizontals", "candela"];

/// The values of the class for the file that a light names.
pub fn values(
    entity: &Entity,
    files: SceneFiles<'_>,
    _: &mut Images,
) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
    let file = NamedFile::of(entity, files)?;
    if let Some(given) = OF_FILE.iter().find_map(|name| entity.parameter(name)) {
        let message = format!("`{}` is given by a file, and once more here", given.name);
        let diagnostic = Diagnostic::new(codes::DUPLICATE_NAME, message);
        let help = "remove it, or `filename`";
        return Err(Box::new(diagnostic.at(given.declaration, "").help(help)));
    }
    // A number takes two bytes of the file at least, and the multipliers of a tilt are longer.
    let Input { bytes, held } = file.read(files, 6)?;
    let tilt = tilt(entity)?;
    let photometry = Photometry::read(&bytes, tilt).map_err(|error| {
        let message = format!("cannot read `{}`, {error}", file.path.display());
        file.at(Diagnostic::new(codes::UNREADABLE_FILE, message).help(error.remedy))
    })?;
    let Photometry { verticals, horizontals, candela } = photometry;
    held.keep(Amount::of::<f32>(verticals.len() + horizontals.len() + candela.len()));
    let values = OF_FILE.into_iter().zip([verticals, horizontals, candela]);
    let values = values.map(|(name, it)| (name.to_owned(), Value::Numbers(Numbers::floats(it))));
    Ok(values.collect())
}

/// The degrees by which the luminaire is tilted.
fn tilt(entity: &Entity) -> Result<f64, Box<Diagnostic>> {
    let Some(parameter) = entity.parameter("tilt") else { return Ok(0.0) };
    entity.number("tilt").ok_or_else(|| {
        let found = parameter.values.description();
        let message = format!("`tilt` takes a number of degrees, found {found}");
        Box::new(Diagnostic::new(codes::WRONG_VALUE, message).at(parameter.values_span, ""))
    })
}
