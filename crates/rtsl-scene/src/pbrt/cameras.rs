//! Cameras.

use rtsl::{Diagnostic, Diagnostics, diagnostic_codes as codes};
use rtsl_math::Transform;

use super::lenses;
use super::name::{Names, PbrtName};
use super::translation::Translation;
use crate::description::{Description, Entity, EntityId, EntityKind};
use crate::reader::{Parameter, ReferenceKind, Values};

pub static NAMES: Names = Names {
    kind: EntityKind::Camera,
    implemented: &[
        camera("perspective", "Pinhole")
            .with_defaults(&[("fov", &[90.0])])
            .translated_by(|camera| drop_all(camera, &["lensradius", "focaldistance"])),
        camera("orthographic", "Orthographic").renaming(&LENS).translated_by(use_window),
        camera("spherical", "Spherical").translated_by(|camera| {
            // The format has these for all projections, and they have no effect on this one.
            drop_all(camera, &["lensradius", "focaldistance", "screenwindow", "frameaspectratio"]);
            set_mapping(camera);
        }),
        camera("realistic", "Realistic").made_by(lenses::values, lenses::PARAMETERS),
    ],
    left_out: &[],
    without_effect: &[],
    choose: |entity| has_lens_or_window(entity).then_some(&THIN_LENS),
};

/// A perspective camera that needs more than a field of view.
static THIN_LENS: PbrtName = camera("perspective", "ThinLens")
    .renaming(&LENS)
    .with_defaults(&[("fov", &[90.0]), ("lensRadius", &[0.0]), ("focalDistance", &[1e6])])
    .translated_by(|camera| {
        use_window(camera);
        limit_distance(camera);
    });

const LENS: [(&str, &str); 3] =
    [("lensradius", "lensRadius"), ("focaldistance", "focalDistance"), ("screenwindow", "window")];

const fn camera(name: &'static str, class: &'static str) -> PbrtName {
    PbrtName::new(EntityKind::Camera, name, class)
}

/// Gives a scene without a camera that of pbrt, which looks along z from the origin.
pub fn add_missing_camera(description: &mut Description, diagnostics: &mut Diagnostics) {
    let no_camera = (ReferenceKind::Camera, String::new());
    let Some(span) = description.world_begin else { return };
    if description.camera.is_some() || description.failed.contains(&no_camera) {
        return;
    }
    let message = "the scene has no camera: `perspective` at the origin takes its place";
    diagnostics.push(
        Diagnostic::new(codes::IGNORED_SETTING, message)
            .at(span, "")
            .help("give one before `WorldBegin`: `Camera \"perspective\"`"),
    );
    description.camera = Some(EntityId(description.entities.len()));
    description.entities.push(Entity {
        kind: EntityKind::Camera,
        class: "perspective".to_owned(),
        class_span: span,
        name: None,
        parameters: Vec::new(),
        transform: Transform::IDENTITY,
        end_transform: None,
    });
}

/// Gives a camera with lenses the size of the film.
pub fn share_film_size(description: &mut Description) {
    let (Some(camera), Some(film)) = (description.camera, description.film) else { return };
    let film = &description.entities[film.0].parameters;
    let Some(diagonal) = film.iter().find(|it| it.name == lenses::DIAGONAL).cloned() else {
        return;
    };
    let camera = &mut description.entities[camera.0];
    if camera.class == "realistic" && find(camera, lenses::DIAGONAL).is_none() {
        camera.parameters.push(diagonal);
    }
}

fn find<'e>(entity: &'e Entity, name: &str) -> Option<&'e Parameter> {
    entity.parameter(name)
}

fn has_lens_or_window(entity: &Entity) -> bool {
    let has_lens = match find(entity, "lensradius").map(|radius| &radius.values) {
        Some(Values::Numbers(radius)) => radius.first().is_some_and(|radius| *radius != 0.0),
        Some(Values::Booleans(_) | Values::Texts(_) | Values::Buffer(_)) => true,
        None => false,
    };
    let has_window =
        ["screenwindow", "frameaspectratio"].into_iter().any(|name| find(entity, name).is_some());
    entity.class == "perspective" && (has_lens || has_window)
}

fn drop_all(camera: &mut Translation<'_>, names: &[&str]) {
    for name in names {
        camera.take(name);
    }
}

/// Replaces the aspect ratio of the frame by the window that it means, unless the camera has one.
fn use_window(camera: &mut Translation<'_>) {
    let Some(Some(aspect)) = camera.take_number("frameaspectratio") else { return };
    if camera.find("window").is_none() && aspect > 0.0 {
        let (x, y) = if aspect > 1.0 { (aspect, 1.0) } else { (1.0, 1.0 / aspect) };
        camera.set("window", vec![-x, x, -y, y]);
    }
}

/// Limits the focal distance to numbers whose squares a shader can compute with.
fn limit_distance(camera: &mut Translation<'_>) {
    const FARTHEST: f64 = 1e15;
    if camera.number("focalDistance", 0.0) > FARTHEST {
        camera.take("focalDistance");
        camera.set("focalDistance", vec![FARTHEST]);
    }
}

/// Replaces the name of a mapping. Another name is kept, and reported as a parameter that the class does not have.
fn set_mapping(camera: &mut Translation<'_>) {
    let Some(parameter) = camera.take("mapping") else { return };
    let equal_area = match &parameter.values {
        Values::Texts(texts) => match texts.first().map(String::as_str) {
            Some("equalarea") => Some(true),
            Some("equirectangular") => Some(false),
            _ => None,
        },
        Values::Numbers(_) | Values::Booleans(_) | Values::Buffer(_) => None,
    };
    let mut parameter = parameter.into_owned();
    if let Some(equal_area) = equal_area {
        parameter.name = "equalArea".to_owned();
        parameter.values = Values::Booleans(vec![equal_area]);
        parameter.kind = crate::reader::ParameterType::Given;
    }
    camera.push(parameter);
}
