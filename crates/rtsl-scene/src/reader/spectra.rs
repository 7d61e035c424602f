//! Conversion of spectral parameters to colours.

use rtsl::{Diagnostic, diagnostic_codes as codes, encoding, most_similar};
use rtsl_memory::{Amount, OverBudget};

use super::files::{Input, SceneFiles, unreadable};
use super::parameter::{COLOR, Parameter, ParameterType, Values};
use crate::spectrum::{ColorSpace, Sampled, blackbody, named, names};

/// Converts a spectrum to linear red, green and blue, or to one number if it is constant; leaves other parameters
/// unchanged. `emits` is true for spectra of lights, whose colours get luminance 1, and false for those of surfaces.
pub fn convert(
    parameter: &mut Parameter,
    emits: bool,
    files: SceneFiles<'_>,
) -> Result<(), Box<Diagnostic>> {
    let numbers = match (parameter.kind, &parameter.values) {
        (ParameterType::Blackbody, Values::Numbers(kelvin)) if kelvin.len() != 1 => {
            return Err(wrong(parameter, "one temperature in kelvin is expected"));
        }
        (ParameterType::Blackbody, Values::Numbers(kelvin)) => {
            blackbody(kelvin.first().copied().unwrap_or(0.0)).to_vec()
        }
        (ParameterType::Spectrum, Values::Numbers(numbers)) if is_color(numbers) => numbers.clone(),
        (ParameterType::Spectrum, Values::Numbers(numbers)) => match Sampled::from_pairs(numbers) {
            Some(spectrum) => color(&spectrum, emits),
            None => return Err(wrong(parameter, "wavelengths do not increase")),
        },
        (ParameterType::Spectrum, Values::Texts(texts)) => match texts.as_slice() {
            [name] => named_or_file(parameter, name, emits, files)?,
            _ => return Err(wrong(parameter, "one name is expected")),
        },
        _ => return Ok(()),
    };
    parameter.kind = COLOR;
    parameter.values = Values::Numbers(numbers);
    Ok(())
}

/// Converts the colours of an `rgb` parameter from a colour space to linear sRGB. Components of surfaces stay within
/// those of reflectances.
pub fn convert_space(parameter: &mut Parameter, emits: bool, space: &ColorSpace) {
    if space.is_srgb() || parameter.kind != COLOR {
        return;
    }
    if let Values::Numbers(numbers) = &mut parameter.values {
        let (colors, _) = numbers.as_chunks_mut::<3>();
        for color in colors {
            let converted =
                if emits { space.light_to_srgb(*color) } else { space.surface_to_srgb(*color) };
            *color = converted.map(|component| component.max(0.0));
        }
    }
}

/// True if the numbers are a grey or a colour rather than wavelengths and values.
pub fn is_color(numbers: &[f64]) -> bool {
    matches!(numbers.len(), 1 | 3)
}

fn color(spectrum: &Sampled, emits: bool) -> Vec<f64> {
    if emits { spectrum.light_color().to_vec() } else { spectrum.surface_color().to_vec() }
}

fn named_or_file(
    parameter: &Parameter,
    name: &str,
    emits: bool,
    files: SceneFiles<'_>,
) -> Result<Vec<f64>, Box<Diagnostic>> {
    if let Some(numbers) = named(name) {
        return Ok(numbers.to_vec());
    }
    let unknown = || {
        let message = format!("`{name}` is neither the name of a known spectrum nor a file");
        let diagnostic = Diagnostic::new(codes::UNKNOWN_SCENE_NAME, message);
        let diagnostic = diagnostic.at(parameter.values_span, "");
        match most_similar(name, names()) {
            Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
            None => diagnostic.help("give three numbers: linear red, green and blue"),
        }
    };
    let path = files.path(name);
    let input = files.read(&path).and_then(|mut input| {
        // The memory of the parsed numbers: a number of eight bytes may come from two bytes of text, and they are also
        // stored in pairs.
        input.held.grow_to(Amount(input.bytes.len() as u64).times(16))?;
        Ok(input)
    });
    let Input { bytes, held: _held } = input.map_err(|error| {
        Box::new(match OverBudget::of(&error) {
            Some(_) => unreadable(&path, &error).at(parameter.values_span, "named here"),
            None => unknown(),
        })
    })?;
    encoding::check_width(&bytes).map_err(|problem| wrong(parameter, problem))?;
    let text = String::from_utf8_lossy(encoding::without_mark(&bytes));
    let spectrum = Sampled::from_text(&text).ok_or_else(|| {
        wrong(parameter, "the file does not contain increasing wavelengths with values")
    })?;
    Ok(color(&spectrum, emits))
}

fn wrong(parameter: &Parameter, problem: &str) -> Box<Diagnostic> {
    let message = format!("`{}` is not a spectrum: {problem}", parameter.name);
    Box::new(Diagnostic::new(codes::WRONG_VALUE, message).at(parameter.values_span, ""))
}
