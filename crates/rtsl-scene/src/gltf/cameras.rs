//! Cameras: one of the file's, or one that shows all of the scene.

use gltf::json::camera::{Camera, Type};
use gltf::json::validation::Checked;
use rtsl::{Diagnostic, diagnostic_codes as codes, most_similar};
use rtsl_math::Transform;

use super::builder::Builder;
use super::hierarchy::Hierarchy;
use super::outline::Kind;
use crate::bounds::Bounds;
use crate::description::EntityKind;
use crate::framing::{FIELD_OF_VIEW, frame, look, tangent};
use crate::reader::Values;

/// The rows of pictures by cameras that have an aspect ratio.
const ROWS: f64 = 720.0;

impl Builder<'_> {
    /// Adds the camera `wanted`, by its name or index, or else the first one, or one that shows all of the scene.
    /// Returns true if the file has cameras.
    pub fn add_camera(
        &mut self,
        hierarchy: &Hierarchy,
        bounds: &Bounds,
        wanted: Option<&str>,
    ) -> bool {
        let placed = self.placed_cameras(hierarchy);
        let chosen = match wanted {
            Some(wanted) => {
                let found = placed.iter().find(|(camera, node)| {
                    self.camera_names(*camera, *node).any(|name| name == wanted)
                });
                if found.is_none() {
                    self.report_unknown_camera(wanted, &placed);
                }
                found
            }
            None => placed.first(),
        };
        let Some((camera, node)) = chosen.copied() else {
            self.add_framing_camera(bounds);
            return !placed.is_empty();
        };
        let definition = self.file.root.cameras[camera].clone();
        let world_to_camera = world_to_camera(hierarchy.world(node));
        let parameters = self.parameters(Kind::Camera, camera);
        let (class, parameters, aspect) = match (projection(&definition), world_to_camera) {
            (Some(Projection::Perspective { degrees, aspect }), Some(_)) => {
                ("Pinhole", parameters.numbers("fov", &[degrees]), aspect)
            }
            (Some(Projection::Orthographic { scale, aspect }), Some(_)) => {
                ("Orthographic", parameters.numbers("scale", &[scale]), Some(aspect))
            }
            (None, _) | (_, None) => {
                let message = format!("camera {camera} is invalid: another one shows the scene");
                self.warn(message, self.outline.span(Kind::Camera, camera));
                self.add_framing_camera(bounds);
                return true;
            }
        };
        let transform = world_to_camera.unwrap_or(Transform::IDENTITY);
        let id = self.add(EntityKind::Camera, class, Some("camera"), parameters, transform);
        self.description.camera = Some(id);
        self.add_film(aspect, bounds);
        true
    }

    /// The cameras of visible nodes, each with its node.
    fn placed_cameras(&self, hierarchy: &Hierarchy) -> Vec<(usize, usize)> {
        let root = &self.file.root;
        let camera = |node: &usize| root.nodes[*node].camera.map(|camera| (camera.value(), *node));
        let placed = hierarchy.visible.iter().filter_map(camera);
        placed.filter(|(camera, _)| *camera < root.cameras.len()).collect()
    }

    /// The names by which a camera can be chosen.
    fn camera_names(&self, camera: usize, node: usize) -> impl Iterator<Item = String> {
        let own = self.file.root.cameras[camera].name.clone();
        let of_node = self.file.root.nodes[node].name.clone();
        own.into_iter().chain(of_node).chain([camera.to_string()])
    }

    fn report_unknown_camera(&mut self, wanted: &str, placed: &[(usize, usize)]) {
        let names: Vec<String> =
            placed.iter().flat_map(|(camera, node)| self.camera_names(*camera, *node)).collect();
        let message = format!("unknown camera `{wanted}`");
        let diagnostic = Diagnostic::new(codes::UNKNOWN_SCENE_NAME, message);
        self.diagnostics.push(match most_similar(wanted, names.iter().map(String::as_str)) {
            Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
            None if names.is_empty() => diagnostic.note("the file has no camera"),
            None => diagnostic.note(format!("there are {}", names.join(", "))),
        });
    }

    /// A film with the camera's aspect ratio, exposed for the lights.
    fn add_film(&mut self, aspect: Option<f64>, bounds: &Bounds) {
        let exposure = self.exposure(bounds);
        if aspect.is_none() && exposure == 0.0 {
            return;
        }
        let mut parameters = self.parameters(Kind::File, 0);
        if let Some(aspect) = aspect {
            let aspect = aspect.clamp(0.1, 10.0);
            parameters = parameters
                .numbers("xresolution", &[(ROWS * aspect).round()])
                .numbers("yresolution", &[ROWS]);
        }
        if exposure != 0.0 {
            parameters = parameters.numbers("exposure", &[exposure]);
        }
        let film = self.add(EntityKind::Film, "rgb", None, parameters, Transform::IDENTITY);
        self.description.film = Some(film);
    }

    /// The exposure in whole stops, at most 0, under which the radiance of a white surface in the middle of the scene
    /// that faces all lights is at most 2: many files have lights as bright as the sun.
    fn exposure(&self, bounds: &Bounds) -> f64 {
        let center = if bounds.is_empty() { [0.0; 3] } else { bounds.center() };
        // No light is in the middle itself.
        let nearest = if bounds.is_empty() { 0.0 } else { 1e-3 * bounds.radius() };
        let nearest = (nearest * nearest).max(f64::MIN_POSITIVE);
        let lights = self.description.lights.iter().map(|light| {
            let light = &self.description.entities[light.0];
            let strength = light.number("strength").unwrap_or(0.0);
            match light.parameter("position").map(|it| &it.values) {
                Some(Values::Numbers(position)) if position.len() == 3 => {
                    let parts = (0..3).map(|axis| position[axis] - center[axis]);
                    strength / parts.map(|part| part * part).sum::<f64>().max(nearest)
                }
                Some(_) | None => strength,
            }
        });
        let mut radiance = lights.sum::<f64>() / std::f64::consts::PI;
        let mut stops = 0.0;
        while radiance > 2.0 && stops > -40.0 {
            radiance *= 0.5;
            stops -= 1.0;
        }
        stops
    }

    fn add_framing_camera(&mut self, bounds: &Bounds) {
        self.add_film(None, bounds);
        let parameters = self.parameters(Kind::File, 0).numbers("fov", &[FIELD_OF_VIEW]);
        let transform = frame(bounds);
        let id = self.add(EntityKind::Camera, "Pinhole", Some("camera"), parameters, transform);
        self.description.camera = Some(id);
    }
}

enum Projection {
    Perspective { degrees: f64, aspect: Option<f64> },
    Orthographic { scale: f64, aspect: f64 },
}

/// The projection of a camera, by the shorter side of the picture as the classes have it; `None` if it is invalid.
fn projection(camera: &Camera) -> Option<Projection> {
    match (&camera.type_, &camera.perspective, &camera.orthographic) {
        (Checked::Valid(Type::Perspective), Some(it), _) => {
            let vertical = f64::from(it.yfov);
            let aspect = it.aspect_ratio.map(f64::from).filter(|it| *it > 0.0);
            let upright = aspect.unwrap_or(1.0).min(1.0);
            if !(vertical > 0.0 && vertical < std::f64::consts::PI) {
                return None;
            }
            let half = 0.5 * vertical.to_degrees();
            let degrees = 2.0 * if upright < 1.0 { narrowed(half, upright) } else { half };
            Some(Projection::Perspective { degrees: degrees.clamp(0.01, 170.0), aspect })
        }
        (Checked::Valid(Type::Orthographic), _, Some(it)) => {
            let (x, y) = (f64::from(it.xmag).abs(), f64::from(it.ymag).abs());
            let is_valid = x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite();
            is_valid.then(|| Projection::Orthographic { scale: x.min(y), aspect: x / y })
        }
        _ => None,
    }
}

/// The angle in degrees whose tangent is so many times that of another, found by halving, whose steps are the same on
/// every machine.
fn narrowed(degrees: f64, factor: f64) -> f64 {
    let wanted = factor * tangent(degrees);
    let (mut low, mut high) = (0.0, degrees);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if tangent(middle) < wanted { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// From the world to a camera that looks along its z, with y up and x to the right; glTF's looks along -z. The scale of
/// its node does not count. `None` if its axes span no space.
fn world_to_camera(node: Transform) -> Option<Transform> {
    let origin = node.point([0.0; 3]);
    let axis = |tip: [f64; 3]| {
        let tip = node.point(tip);
        std::array::from_fn::<f64, 3, _>(|axis| tip[axis] - origin[axis])
    };
    look(origin, axis([0.0, 0.0, -1.0]), axis([0.0, 1.0, 0.0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_upright_picture_narrows_the_field_of_view() {
        let half = narrowed(45.0, 0.5);
        assert!((tangent(half) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn cameras_look_along_the_negative_axis_of_their_nodes() {
        let node = Transform::translate([1.0, 2.0, 3.0]).after(Transform::scale([2.0; 3]));
        let to_camera = world_to_camera(node).expect("it has an inverse");
        let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|axis| (a[axis] - b[axis]).abs() < 1e-12);
        assert!(near(to_camera.point([1.0, 2.0, 3.0]), [0.0; 3]));
        assert!(near(to_camera.point([2.0, 2.0, -7.0]), [1.0, 0.0, 10.0]));
        assert!(near(to_camera.point([1.0, 5.0, 3.0]), [0.0, 3.0, 0.0]));
    }
}
