//! A rasteriser of the meshes of egui: textured triangles with vertex colours and premultiplied alpha, blended in the
//! space of the colours, as egui wants.
//!
//! Between frames it keeps what it has drawn and draws again only the tiles in which something has changed, since most
//! frames change the picture of the scene and a few figures.

use std::collections::HashMap;

use egui::epaint::{ImageDelta, Primitive, Vertex};
use egui::{ClippedPrimitive, ImageData, TextureId, TexturesDelta};

/// The side of the squares that are drawn again as a whole, in pixels.
const TILE: usize = 64;

/// The number of positions in a pixel's side that the edges of triangles distinguish.
const STEPS: f32 = 256.0;

/// The largest difference, in pixels, of rectangles whose texture is copied texel by texel.
const EXACT: f32 = 1.0 / 64.0;

/// What has been drawn: a layer that is shown over other pixels.
#[derive(Default)]
pub struct Raster {
    textures: HashMap<TextureId, Texture>,
    width: usize,
    height: usize,
    /// Premultiplied colours, `0xAARRGGBB`.
    pixels: Vec<u32>,
    drawn: Vec<ClippedPrimitive>,
}

/// A texture of premultiplied colours, `0xAARRGGBB`.
#[derive(Default)]
struct Texture {
    width: usize,
    height: usize,
    texels: Vec<u32>,
}

/// A rectangle of pixels; the ends are outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Area {
    left: i32,
    top: i32,
    right: i32,
    bottom: i32,
}

/// A corner of a triangle, in pixels and texels.
#[derive(Clone, Copy, Debug)]
struct Corner {
    x: f32,
    y: f32,
    u: f32,
    v: f32,
    color: [f32; 4],
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

impl Texture {
    fn update(&mut self, delta: &ImageDelta) {
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

    fn texel(&self, x: i32, y: i32) -> u32 {
        let x = x.clamp(0, self.width as i32 - 1) as usize;
        let y = y.clamp(0, self.height as i32 - 1) as usize;
        self.texels.get(y * self.width + x).copied().unwrap_or(0)
    }

    /// The colour at a place in texels, interpolated.
    fn at(&self, u: f32, v: f32) -> [f32; 4] {
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

impl Area {
    fn of(rect: egui::Rect, scale: f32) -> Area {
        let side = |position: f32| (position * scale).round().clamp(-1e6, 1e6) as i32;
        let (min, max) = (rect.min, rect.max);
        Area { left: side(min.x), top: side(min.y), right: side(max.x), bottom: side(max.y) }
    }

    fn intersection(self, other: Area) -> Area {
        Area {
            left: self.left.max(other.left),
            top: self.top.max(other.top),
            right: self.right.min(other.right),
            bottom: self.bottom.min(other.bottom),
        }
    }

    fn is_empty(self) -> bool {
        self.left >= self.right || self.top >= self.bottom
    }
}

/// The pixels that a mesh is drawn to.
struct Target<'p> {
    pixels: &'p mut [u32],
    width: usize,
    clip: Area,
}

impl Target<'_> {
    fn draw(&mut self, vertices: &[Vertex], indices: &[u32], texture: &Texture, scale: f32) {
        let size = (texture.width as f32, texture.height as f32);
        let corner = |index: u32| vertices.get(index as usize).map(|it| Corner::of(it, scale, size));
        let mut rest = indices;
        while let [a, b, c, after @ ..] = rest {
            rest = after;
            let (Some(one), Some(two), Some(three)) = (corner(*a), corner(*b), corner(*c)) else {
                continue;
            };
            // Rectangles are the triangles (a, b, c) and (c, b, d).
            if let [c2, b2, d, behind @ ..] = rest
                && (c2, b2) == (c, b)
                && let Some(four) = corner(*d)
                && self.draw_rectangle([one, two, three, four], texture)
            {
                rest = behind;
                continue;
            }
            self.draw_triangle([one, two, three], texture);
        }
    }

    /// Draws an upright rectangle of one colour whose texture has the size of its pixels, or is one texel; false for
    /// others.
    fn draw_rectangle(&mut self, [one, two, three, four]: [Corner; 4], texture: &Texture) -> bool {
        let is_upright = one.x == three.x && two.x == four.x && one.y == two.y && three.y == four.y;
        let is_plain = [two, three, four].iter().all(|corner| corner.color == one.color);
        if !is_upright || !is_plain || one.x > four.x || one.y > four.y {
            return false;
        }
        let (width, height) = (four.x - one.x, four.y - one.y);
        let color = packed(one.color);
        if (one.u, one.v) == (four.u, four.v) {
            let color = modulated(texture.texel(one.u as i32, one.v as i32), color);
            // Pixels belong to it if it has their centres.
            let side = |position: f32| (position - 0.5).ceil() as i32;
            let area = Area {
                left: side(one.x),
                top: side(one.y),
                right: side(four.x),
                bottom: side(four.y),
            };
            self.fill(area, color);
            return true;
        }
        let is_whole = |number: f32| (number - number.round()).abs() < EXACT;
        let is_exact = (four.u - one.u - width).abs() < EXACT && (four.v - one.v - height).abs() < EXACT;
        if !is_exact || ![one.x, one.y, one.u, one.v].into_iter().all(is_whole) {
            return false;
        }
        let at = |position: f32| position.round() as i32;
        let whole =
            Area { left: at(one.x), top: at(one.y), right: at(four.x), bottom: at(four.y) };
        self.copy(whole, (at(one.u), at(one.v)), texture, color);
        true
    }

    fn fill(&mut self, area: Area, color: u32) {
        let area = area.intersection(self.clip);
        if area.is_empty() || color == 0 {
            return;
        }
        for y in area.top..area.bottom {
            self.fill_row(y, area.left, area.right, color);
        }
    }

    fn fill_row(&mut self, y: i32, left: i32, right: i32, color: u32) {
        let start = y as usize * self.width;
        let row = &mut self.pixels[start + left as usize..start + right as usize];
        match color >> 24 {
            255 => row.fill(color),
            _ => row.iter_mut().for_each(|pixel| *pixel = blend(*pixel, color)),
        }
    }

    /// Draws texels from `(u, v)` on, each times a colour.
    fn copy(&mut self, whole: Area, (u, v): (i32, i32), texture: &Texture, color: u32) {
        let area = whole.intersection(self.clip);
        if area.is_empty() {
            return;
        }
        for y in area.top..area.bottom {
            let start = y as usize * self.width;
            let row = &mut self.pixels[start + area.left as usize..start + area.right as usize];
            let from = (v + y - whole.top) as usize * texture.width;
            let from = from + (u + area.left - whole.left) as usize;
            let Some(texels) = texture.texels.get(from..from + row.len()) else { return };
            for (pixel, texel) in row.iter_mut().zip(texels) {
                if *texel != 0 {
                    *pixel = blend(*pixel, modulated(*texel, color));
                }
            }
        }
    }

    fn draw_triangle(&mut self, mut corners: [Corner; 3], texture: &Texture) {
        if area_of(&corners) < 0.0 {
            corners.swap(1, 2);
        }
        let [one, two, three] = corners;
        let xs = [one.x, two.x, three.x];
        let ys = [one.y, two.y, three.y];
        let (top, bottom) = (least(ys), -least(ys.map(|y| -y)));
        let (left, right) = (least(xs), -least(xs.map(|x| -x)));
        let edges = [Edge::new(one, two), Edge::new(two, three), Edge::new(three, one)];
        let rows = self.clip.top.max((top - 0.5).ceil() as i32)
            ..self.clip.bottom.min((bottom - 0.5).ceil() as i32);
        let columns = (
            self.clip.left.max((left - 0.5).ceil() as i32),
            self.clip.right.min((right - 0.5).ceil() as i32),
        );
        if columns.0 >= columns.1 {
            return;
        }
        let is_plain = [two, three].iter().all(|it| it.color == one.color)
            && [two, three].iter().all(|it| (it.u, it.v) == (one.u, one.v));
        let plain = modulated(texture.texel(one.u as i32, one.v as i32), packed(one.color));
        let shading = Shading::new(&corners);
        for y in rows {
            let within = |span: (i32, i32), edge: &Edge| edge.narrowed(span, y);
            let (start, end) = edges.iter().fold(columns, within);
            if start >= end {
                continue;
            }
            if is_plain {
                if plain != 0 {
                    self.fill_row(y, start, end, plain);
                }
                continue;
            }
            for x in start..end {
                let color = shading.at(x, y, texture);
                let pixel = &mut self.pixels[y as usize * self.width + x as usize];
                *pixel = blend(*pixel, color);
            }
        }
    }
}

impl Corner {
    fn of(vertex: &Vertex, scale: f32, (width, height): (f32, f32)) -> Corner {
        let [red, green, blue, alpha] = vertex.color.to_array().map(f32::from);
        // Rounded to the steps of edges, so that neighbours agree about the pixels between them.
        let place = |position: f32| (position * scale * STEPS).round() / STEPS;
        Corner {
            x: place(vertex.pos.x).clamp(-1e5, 1e5),
            y: place(vertex.pos.y).clamp(-1e5, 1e5),
            u: vertex.uv.x * width,
            v: vertex.uv.y * height,
            color: [alpha, red, green, blue],
        }
    }
}

/// An edge of a triangle: pixels for which `a x + b y + c` is not negative are inside of it.
struct Edge {
    a: i64,
    b: i64,
    c: i64,
}

impl Edge {
    fn new(from: Corner, to: Corner) -> Edge {
        let fixed = |position: f32| (position * STEPS) as i64;
        let (x, y) = (fixed(from.x), fixed(from.y));
        let (dx, dy) = (fixed(to.x) - x, fixed(to.y) - y);
        // The centre of a pixel on an edge belongs to the triangle if the edge is at its top or left.
        let is_top_left = dy < 0 || (dy == 0 && dx > 0);
        let half = (STEPS / 2.0) as i64;
        let c = (half - y) * dx - (half - x) * dy - i64::from(!is_top_left);
        Edge { a: -dy * STEPS as i64, b: dx * STEPS as i64, c }
    }

    /// Returns the part of a span of a row inside of the edge.
    fn narrowed(&self, (start, end): (i32, i32), y: i32) -> (i32, i32) {
        let rest = self.b * i64::from(y) + self.c;
        match self.a {
            0 if rest < 0 => (start, start),
            0 => (start, end),
            // a x >= -rest
            a if a > 0 => {
                let first = -rest.div_euclid(a);
                (start.max(first.clamp(-1_000_000, 1_000_000) as i32), end)
            }
            a => {
                let last = rest.div_euclid(-a);
                (start, end.min(last.clamp(-1_000_000, 1_000_000) as i32 + 1))
            }
        }
    }
}

/// Colours and places in the texture, which are linear over a triangle.
struct Shading {
    origin: (f32, f32),
    /// The values at the origin, and their changes per column and per row: alpha, red, green, blue, u, v.
    values: [[f32; 3]; 6],
    is_one_texel: bool,
}

impl Shading {
    fn new(corners: &[Corner; 3]) -> Shading {
        let [one, two, three] = corners;
        let area = area_of(corners);
        let inverse = if area == 0.0 { 0.0 } else { 1.0 / area };
        let plane = |of: &dyn Fn(&Corner) -> f32| {
            let (value, first, second) = (of(one), of(two) - of(one), of(three) - of(one));
            let by_x = (first * (three.y - one.y) - second * (two.y - one.y)) * inverse;
            let by_y = (second * (two.x - one.x) - first * (three.x - one.x)) * inverse;
            [value, by_x, by_y]
        };
        let channel = |index: usize| plane(&|corner| corner.color[index]);
        let values = [
            channel(0),
            channel(1),
            channel(2),
            channel(3),
            plane(&|corner| corner.u),
            plane(&|corner| corner.v),
        ];
        let is_one_texel = [two, three].iter().all(|it| (it.u, it.v) == (one.u, one.v));
        Shading { origin: (one.x, one.y), values, is_one_texel }
    }

    fn at(&self, x: i32, y: i32, texture: &Texture) -> u32 {
        let (dx, dy) = (x as f32 + 0.5 - self.origin.0, y as f32 + 0.5 - self.origin.1);
        let [alpha, red, green, blue, u, v] =
            self.values.map(|[value, by_x, by_y]| value + by_x * dx + by_y * dy);
        let texel = match self.is_one_texel {
            true => channels(texture.texel(u as i32, v as i32)),
            false => texture.at(u, v),
        };
        let color = [alpha, red, green, blue];
        packed(std::array::from_fn(|channel| color[channel] * texel[channel] / 255.0))
    }
}

/// Twice the signed area of a triangle.
fn area_of([one, two, three]: &[Corner; 3]) -> f32 {
    (two.x - one.x) * (three.y - one.y) - (three.x - one.x) * (two.y - one.y)
}

fn least([a, b, c]: [f32; 3]) -> f32 {
    a.min(b).min(c)
}

fn channels(pixel: u32) -> [f32; 4] {
    pixel.to_be_bytes().map(f32::from)
}

fn packed(channels: [f32; 4]) -> u32 {
    u32::from_be_bytes(channels.map(|channel| (channel + 0.5) as u8))
}

/// Multiplies two colours, channel by channel.
fn modulated(one: u32, other: u32) -> u32 {
    match (one, other) {
        (u32::MAX, color) | (color, u32::MAX) => color,
        _ => {
            let (one, other) = (one.to_be_bytes(), other.to_be_bytes());
            let product = |channel: usize| {
                let product = u32::from(one[channel]) * u32::from(other[channel]) + 128;
                ((product + (product >> 8)) >> 8) as u8
            };
            u32::from_be_bytes([product(0), product(1), product(2), product(3)])
        }
    }
}

/// Puts a premultiplied colour over another.
fn blend(below: u32, above: u32) -> u32 {
    let rest = 255 - (above >> 24);
    // Two channels at a time, with room for their products, divided by 255 and rounded.
    let pair = |two: u32| {
        let product = two * rest + 0x0080_0080;
        ((product + ((product >> 8) & 0x00FF_00FF)) >> 8) & 0x00FF_00FF
    };
    let low = pair(below & 0x00FF_00FF) + (above & 0x00FF_00FF);
    let high = pair((below >> 8) & 0x00FF_00FF) + ((above >> 8) & 0x00FF_00FF);
    saturated(low) | saturated(high) << 8
}

/// Two channels, each at most 255: colours of additive blending exceed it.
fn saturated(pair: u32) -> u32 {
    let over = (pair >> 8) & 0x0001_0001;
    (pair | over * 0xFF) & 0x00FF_00FF
}

#[cfg(test)]
#[path = "raster_tests.rs"]
mod tests;
