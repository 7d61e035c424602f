//! The light of scenes without lights: a photographer's studio as an image of all directions, which is in memory only.

use std::path::Path;
use std::sync::{Arc, LazyLock};

use rtsl::Span;
use rtsl_math::{Transform, sine_and_cosine_of_degrees};
use rtsl_memory::{Amount, InputBudget};

use crate::description::{Description, Entity, EntityId, EntityKind};
use crate::reader::{Parameter, ParameterType, Values, resolve};

const WIDTH: usize = 512;
const HEIGHT: usize = 256;

/// A soft light: its direction, its radiance and its width, which falls as the number grows.
type Softbox = ([f64; 3], f64, f64);

/// In front on the left and above; fainter on the right; behind.
const SOFTBOXES: [Softbox; 3] = [
    ([-0.45, 0.65, 0.6], 6.5, 30.0),
    ([0.9, 0.3, 0.35], 1.6, 20.0),
    ([0.25, 0.7, -0.75], 3.0, 25.0),
];

/// The name of the light, and the end of that of its image.
const NAME: &str = "studio";

/// Adds the studio to the scene in the file `path`, with so much of its light, unless it is there. Messages about it
/// point to `span`.
pub fn add_studio(
    description: &mut Description,
    path: &Path,
    scale: f64,
    span: Span,
    budget: &InputBudget,
) {
    let image = image_name(path);
    let file = resolve(path, &image);
    if description.embedded.contains_key(&file) {
        return;
    }
    let Ok(held) = budget.hold(Amount::of::<u8>(PICTURE.len())) else { return };
    held.keep(Amount::of::<u8>(PICTURE.len()));
    description.embedded.insert(file, PICTURE.clone());
    let parameter = |kind: ParameterType, name: &str, values: Values| Parameter {
        kind,
        name: name.to_owned(),
        declaration: span,
        values,
        values_span: span,
    };
    let mut parameters =
        vec![parameter(ParameterType::Text, "filename", Values::Texts(vec![image]))];
    if scale != 1.0 {
        parameters.push(parameter(ParameterType::Given, "scale", Values::Numbers(vec![scale])));
    }
    // The axis of skies is z.
    let upright = Transform::from_columns(&[
        1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0,
    ]);
    description.lights.push(EntityId(description.entities.len()));
    description.entities.push(Entity {
        kind: EntityKind::Light,
        class: "infinite".to_owned(),
        class_span: span,
        name: Some(NAME.to_owned()),
        parameters,
        transform: upright,
        end_transform: None,
    });
}

/// True if a scene has the studio.
pub fn has_studio(description: &Description, path: &Path) -> bool {
    description.embedded.contains_key(&resolve(path, &image_name(path)))
}

/// The name by which the scene in a file calls the image.
fn image_name(path: &Path) -> String {
    format!("{}#{NAME}", path.file_name().unwrap_or_default().to_string_lossy())
}

static PICTURE: LazyLock<Arc<[u8]>> = LazyLock::new(|| picture().into());

/// The studio as a PFM picture, whose rows count from the bottom: latitudes.
fn picture() -> Vec<u8> {
    let mut bytes = format!("PF\n{WIDTH} {HEIGHT}\n-1.0\n").into_bytes();
    for row in (0..HEIGHT).rev() {
        let (sine, cosine) = sine_and_cosine_of_degrees(180.0 * (row as f64 + 0.5) / HEIGHT as f64);
        for column in 0..WIDTH {
            let turn = 360.0 * (column as f64 + 0.5) / WIDTH as f64;
            let (around, along) = sine_and_cosine_of_degrees(turn);
            let radiance = radiance([sine * along, cosine, -sine * around]) as f32;
            (0..3).for_each(|_| bytes.extend(radiance.to_le_bytes()));
        }
    }
    bytes
}

/// The side of the octahedral map.
const SIDE: usize = 256;

/// The studio as a square PFM picture, an octahedral map of equal areas as pbrt-v4 has them.
pub fn octahedral_studio() -> Vec<u8> {
    let mut bytes = format!("PF\n{SIDE} {SIDE}\n-1.0\n").into_bytes();
    let place = |index: usize| (2 * index + 1) as f64 / SIDE as f64 - 1.0;
    for row in (0..SIDE).rev() {
        for column in 0..SIDE {
            let radiance = radiance(octahedral(place(column), place(row))) as f32;
            (0..3).for_each(|_| bytes.extend(radiance.to_le_bytes()));
        }
    }
    bytes
}

/// The direction at a place of an octahedral map of equal areas, whose coordinates are from -1 to 1 (Clarberg, "Fast
/// Equal-Area Mapping of the (Hemi)Sphere using SIMD", 2008).
fn octahedral(u: f64, v: f64) -> [f64; 3] {
    let inside = 1.0 - u.abs() - v.abs();
    let radius = 1.0 - inside.abs();
    let turn = if radius > 0.0 { (v.abs() - u.abs()) / radius } else { 0.0 };
    let (sine, cosine) = sine_and_cosine_of_degrees(45.0 * (turn + 1.0));
    let across = radius * (2.0 - radius * radius).max(0.0).sqrt();
    let height = (1.0 - radius * radius).copysign(inside);
    [(across * cosine).copysign(u), (across * sine).copysign(v), height]
}

/// The radiance from a direction: a grey that darkens downwards, and the soft boxes.
fn radiance(direction: [f64; 3]) -> f64 {
    let height = ((direction[1] + 0.5) / 1.2).clamp(0.0, 1.0);
    let rise = height * height * (3.0 - 2.0 * height);
    let boxes = SOFTBOXES.iter().map(|(towards, radiance, narrowness)| {
        let length = towards.iter().map(|part| part * part).sum::<f64>().sqrt();
        let cosine = (0..3).map(|axis| towards[axis] * direction[axis]).sum::<f64>() / length;
        radiance * rtsl_math::exponential(narrowness * (cosine - 1.0))
    });
    0.22 + 0.4 * rise + boxes.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_comes_from_above_rather_than_below() {
        assert!(radiance([0.0, 1.0, 0.0]) > 2.0 * radiance([0.0, -1.0, 0.0]));
        let bytes = picture();
        assert!(bytes.starts_with(b"PF\n512 256\n-1.0\n"));
        assert_eq!(bytes.len(), 16 + WIDTH * HEIGHT * 12);
    }

    #[test]
    fn octahedral_maps_have_all_directions_alike() {
        assert_eq!(octahedral(0.0, 0.0), [0.0, 0.0, 1.0]);
        let (mut sum, mut above) = ([0.0; 3], 0);
        for index in 0..SIDE * SIDE {
            let place = |index: usize| (2 * index + 1) as f64 / SIDE as f64 - 1.0;
            let direction = octahedral(place(index % SIDE), place(index / SIDE));
            let square: f64 = direction.iter().map(|part| part * part).sum();
            assert!((square - 1.0).abs() < 1e-9);
            (0..3).for_each(|axis| sum[axis] += direction[axis]);
            above += usize::from(direction[2] > 0.5);
        }
        assert!(sum.iter().all(|part| part.abs() < 1e-6), "{sum:?}");
        // A quarter of the sphere is above 60 degrees from the equator's plane.
        assert!((above as f64 / (SIDE * SIDE) as f64 - 0.25).abs() < 0.01, "{above}");
    }
}
