//! The light of scenes without lights: a photographer's studio as an image of all directions, which is in memory only.

use std::sync::{Arc, LazyLock};

use rtsl_math::{Transform, sine_and_cosine_of_degrees};
use rtsl_memory::Amount;

use super::builder::Builder;
use super::outline::Kind;
use crate::description::EntityKind;
use crate::reader::resolve;

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

/// The part of its light that scenes with lamps have.
const BESIDE_LAMPS: f64 = 0.25;

impl Builder<'_> {
    /// Adds the studio.
    pub fn add_studio(&mut self) {
        let amount = Amount::of::<u8>(PICTURE.len());
        let Ok(held) = self.budget.hold(amount) else { return };
        held.keep(amount);
        let file = self.path.file_name().unwrap_or_default().to_string_lossy();
        let name = format!("{file}#studio");
        self.description.embedded.insert(resolve(self.path, &name), PICTURE.clone());
        let mut parameters = self.parameters(Kind::File, 0).text("filename", &name);
        if self.has_lamps {
            parameters = parameters.numbers("scale", &[BESIDE_LAMPS]);
        }
        // The axis of skies is z.
        let upright = Transform::from_columns(&[
            1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0,
        ]);
        let light = self.add(EntityKind::Light, "infinite", Some("studio"), parameters, upright);
        self.description.lights.push(light);
    }
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
}
