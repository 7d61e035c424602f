//! Textures.

use egui::ImageData;
use egui::epaint::ImageDelta;

use super::color::channels;

/// A texture of premultiplied colours, `0xAARRGGBB`.
#[derive(Default)]
pub struct Texture {
    pub width: usize,
    pub height: usize,
    pub texels: Vec<u32>,
}

impl Texture {
    pub fn update(&mut self, delta: &ImageDelta) {
        let ImageData::Color(image) = &delta.image;
        let texel = |color: &egui::Color32| {
            let [red, green, blue, alpha] = color.to_array();
            u32::from_be_bytes([alpha, red, green, blue])
        };
        let [width, height] = image.size;
        match delta.pos {
            None => {
                let texels = image.pixels.iter().map(texel).collect();
                *self = Texture { width, height, texels };
            }
            Some([left, top]) => {
                for (row, pixels) in image.pixels.chunks_exact(width.max(1)).enumerate() {
                    let start = (top + row) * self.width + left;
                    let Some(row) = self.texels.get_mut(start..start + width) else { return };
                    row.iter_mut().zip(pixels).for_each(|(to, from)| *to = texel(from));
                }
            }
        }
    }

    pub fn texel(&self, x: i32, y: i32) -> u32 {
        let x = x.clamp(0, self.width as i32 - 1) as usize;
        let y = y.clamp(0, self.height as i32 - 1) as usize;
        self.texels.get(y * self.width + x).copied().unwrap_or(0)
    }

    /// The colour at a place in texels, interpolated.
    pub fn at(&self, u: f32, v: f32) -> [f32; 4] {
        let (u, v) = (u - 0.5, v - 0.5);
        let (x, y) = (u.floor(), v.floor());
        let (s, t) = (u - x, v - y);
        let corner = |dx: i32, dy: i32| channels(self.texel(x as i32 + dx, y as i32 + dy));
        let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
        std::array::from_fn(|channel| {
            let above = a[channel] + (b[channel] - a[channel]) * s;
            let below = c[channel] + (d[channel] - c[channel]) * s;
            above + (below - above) * t
        })
    }
}
