//! Definitions from the command line: `NAME.PARAMETER=VALUE`.
//!
//! `NAME` is `camera`, `film`, `sampler` or `integrator`, or the name of a texture, a named
//! material, or of a shape, light or area light with a `"string name"`. `PARAMETER` is one of its
//! parameters, given in the scene or not. `VALUE` is numbers, `true`/`false`, or a name, several
//! of them separated by commas: `-D lamp.intensity=10,9,8`.

use rtsl::{Diagnostic, Diagnostics, SourceMap, Span, diagnostic_codes as codes, most_similar};
use rtsl_math::Transform;

use super::parameter::{Parameter, ParameterType, Values};
use crate::description::{Entity, EntityId};
use crate::{Description, EntityKind};

/// Applies definitions to a scene, in order.
pub fn apply_defines(
    description: &mut Description,
    defines: &[String],
    map: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) {
    for define in defines {
        let file = map.add("<command line>", define.clone());
        let span = Span::new(file, 0, define.len() as u32);
        if let Err(diagnostic) = apply_define(description, define, span) {
            diagnostics.push(*diagnostic);
        }
    }
}

/// Puts an integrator in the place of the scene's.
pub fn set_integrator(description: &mut Description, class: &str, map: &mut SourceMap) {
    let file = map.add("<command line>", class.to_owned());
    description.integrator = Some(EntityId(description.entities.len()));
    description.entities.push(Entity {
        kind: EntityKind::Integrator,
        class: class.to_owned(),
        class_span: Span::new(file, 0, class.len() as u32),
        name: None,
        parameters: Vec::new(),
        transform: Transform::IDENTITY,
        end_transform: None,
    });
}

fn apply_define(
    description: &mut Description,
    define: &str,
    span: Span,
) -> Result<(), Box<Diagnostic>> {
    let malformed = || {
        let message = format!("`{define}` is not of the form `name.parameter=value`");
        Box::new(Diagnostic::new(codes::BAD_DEFINE, message).at(span, ""))
    };
    let (path, value) = define.split_once('=').ok_or_else(malformed)?;
    let (name, parameter) = path.trim().rsplit_once('.').ok_or_else(malformed)?;
    let found: Vec<usize> = named(description, name);
    if found.is_empty() {
        let message = format!("nothing in the scene is named `{name}`");
        let diagnostic = Diagnostic::new(codes::BAD_DEFINE, message).at(span, "");
        let names = description.entities.iter().filter_map(|entity| entity.name.as_deref());
        let names = names.chain(["camera", "film", "sampler", "integrator"]);
        return Err(Box::new(match most_similar(name, names) {
            Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
            None => diagnostic.help("give the shape or light a `\"string name\"` in the scene"),
        }));
    }
    let values = parse_values(value).ok_or_else(malformed)?;
    for index in found {
        let parameters = &mut description.entities[index].parameters;
        parameters.retain(|earlier| earlier.name != parameter);
        parameters.push(Parameter {
            kind: ParameterType::Given,
            name: parameter.to_owned(),
            declaration: span,
            values: values.clone(),
            values_span: span,
        });
    }
    Ok(())
}

/// The entities to which `name` in a definition refers.
fn named(description: &Description, name: &str) -> Vec<usize> {
    let setting = match name {
        "camera" => Some(EntityKind::Camera),
        "film" => Some(EntityKind::Film),
        "filter" => Some(EntityKind::Filter),
        "sampler" => Some(EntityKind::Sampler),
        "integrator" => Some(EntityKind::Integrator),
        _ => None,
    };
    let entities = description.entities.iter().enumerate();
    entities
        .filter(|(_, entity)| entity.name.as_deref() == Some(name) || Some(entity.kind) == setting)
        .map(|(index, _)| index)
        .filter(|index| is_in_use(description, *index))
        .collect()
}

/// False for an integrator that another has replaced.
fn is_in_use(description: &Description, index: usize) -> bool {
    description.entities[index].kind != EntityKind::Integrator
        || description.integrator == Some(EntityId(index))
}

fn parse_values(text: &str) -> Option<Values> {
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    if parts.iter().any(|part| part.is_empty()) {
        return None;
    }
    let number = |part: &&str| part.parse::<f64>().ok().filter(|value| value.is_finite());
    if let Some(numbers) = parts.iter().map(number).collect() {
        return Some(Values::Numbers(numbers));
    }
    let boolean = |part: &&str| part.parse::<bool>().ok();
    if let Some(booleans) = parts.iter().map(boolean).collect() {
        return Some(Values::Booleans(booleans));
    }
    Some(Values::Texts(parts.iter().map(|part| (*part).to_owned()).collect()))
}
