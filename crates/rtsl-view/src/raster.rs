//! A rasteriser of the meshes of egui: textured triangles with vertex colours and premultiplied alpha, blended in the
//! space of the colours, as egui wants.
//!
//! Between frames it keeps what it has drawn and draws again only the tiles in which something has changed, since most
//! frames change the picture of the scene and a few figures.

mod area;
mod color;
mod target;
mod texture;
mod triangle;

use std::collections::HashMap;

use egui::epaint::Primitive;
use egui::{ClippedPrimitive, TextureId, TexturesDelta};

use area::Area;
use color::blend;
use target::Target;
use texture::Texture;

/// The side of the squares that are drawn again as a whole, in pixels.
const TILE: usize = 64;

/// A layer of drawn meshes, which is shown over other pixels.
#[derive(Default)]
pub struct Raster {
    textures: HashMap<TextureId, Texture>,
    width: usize,
    height: usize,
    /// Premultiplied colours, `0xAARRGGBB`.
    pixels: Vec<u32>,
    drawn: Vec<ClippedPrimitive>,
}

impl Raster {
    /// Draws these meshes instead of the last ones, on a layer of this size. `scale` is the number of pixels per point.
    pub fn draw(
        &mut self,
        (width, height): (usize, usize),
        primitives: Vec<ClippedPrimitive>,
        mut textures: TexturesDelta,
        scale: f32,
    ) {
        let mut is_all_new = (self.width, self.height) != (width, height);
        if is_all_new {
            (self.width, self.height) = (width, height);
            self.pixels.clear();
            self.pixels.resize(width * height, 0);
        }
        for (id, deltas) in std::mem::take(&mut textures.set) {
            for delta in deltas {
                // Patches add glyphs that nothing drawn has used.
                is_all_new |= delta.pos.is_none();
                self.textures.entry(id).or_default().update(&delta);
            }
        }
        let changed = self.changed_tiles(&primitives, is_all_new, scale);
        for area in self.runs(&changed) {
            self.clear(area);
            for primitive in &primitives {
                let clip = Area::of(primitive.clip_rect, scale).intersection(area);
                if let (Primitive::Mesh(mesh), false) = (&primitive.primitive, clip.is_empty())
                    && let Some(texture) = self.textures.get(&mesh.texture_id)
                {
                    let mut target = Target { pixels: &mut self.pixels, width: self.width, clip };
                    target.draw(&mesh.vertices, &mesh.indices, texture, scale);
                }
            }
        }
        self.drawn = primitives;
        let free = std::mem::take(&mut textures.free);
        free.iter().for_each(|id| _ = self.textures.remove(id));
    }

    /// Shows the layer over pixels `0x00RRGGBB` of a picture of the same size.
    pub fn show_over(&self, pixels: &mut [u32]) {
        for (below, layer) in pixels.iter_mut().zip(&self.pixels) {
            match layer >> 24 {
                0 => {}
                255 => *below = layer & 0x00FF_FFFF,
                _ => *below = blend(*below, *layer) & 0x00FF_FFFF,
            }
        }
    }

    /// The tiles, row by row, that differ from what was drawn.
    fn changed_tiles(&self, now: &[ClippedPrimitive], all: bool, scale: f32) -> Vec<bool> {
        let (columns, rows) = (self.width.div_ceil(TILE), self.height.div_ceil(TILE));
        let mut changed = vec![all; columns * rows];
        if all {
            return changed;
        }
        let mut mark = |primitive: &ClippedPrimitive| {
            let area = bounds(primitive, scale).intersection(self.area());
            if area.is_empty() {
                return;
            }
            let of = |position: i32| position as usize / TILE;
            for row in of(area.top)..=of(area.bottom - 1) {
                changed[row * columns..][of(area.left)..=of(area.right - 1)].fill(true);
            }
        };
        let count = now.len().max(self.drawn.len());
        for index in 0..count {
            let (before, now) = (self.drawn.get(index), now.get(index));
            if !is_same(before, now) {
                before.into_iter().chain(now).for_each(&mut mark);
            }
        }
        changed
    }

    /// The areas of runs of tiles.
    fn runs(&self, changed: &[bool]) -> Vec<Area> {
        let columns = self.width.div_ceil(TILE).max(1);
        let mut areas = Vec::new();
        for (row, tiles) in changed.chunks(columns).enumerate() {
            let mut column = 0;
            while column < columns {
                let run = tiles[column..].iter().take_while(|is_changed| **is_changed).count();
                if run > 0 {
                    let area = Area {
                        left: (column * TILE) as i32,
                        top: (row * TILE) as i32,
                        right: ((column + run) * TILE) as i32,
                        bottom: ((row + 1) * TILE) as i32,
                    };
                    areas.push(area.intersection(self.area()));
                }
                column += run.max(1);
            }
        }
        areas
    }

    fn area(&self) -> Area {
        Area { left: 0, top: 0, right: self.width as i32, bottom: self.height as i32 }
    }

    fn clear(&mut self, area: Area) {
        for y in area.top..area.bottom {
            let start = y as usize * self.width;
            self.pixels[start + area.left as usize..start + area.right as usize].fill(0);
        }
    }
}

/// True if both are the same mesh with the same clip.
fn is_same(before: Option<&ClippedPrimitive>, now: Option<&ClippedPrimitive>) -> bool {
    let (Some(before), Some(now)) = (before, now) else { return false };
    match (&before.primitive, &now.primitive) {
        (Primitive::Mesh(one), Primitive::Mesh(other)) => {
            before.clip_rect == now.clip_rect && one == other
        }
        // Nothing of this program asks for the callbacks of GPU painters.
        _ => false,
    }
}

/// The pixels that a mesh can touch.
fn bounds(primitive: &ClippedPrimitive, scale: f32) -> Area {
    let clip = Area::of(primitive.clip_rect, scale);
    match &primitive.primitive {
        Primitive::Mesh(mesh) => clip.intersection(Area::of(mesh.calc_bounds().expand(1.0), scale)),
        Primitive::Callback(_) => clip,
    }
}

#[cfg(test)]
mod tests;
