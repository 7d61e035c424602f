//! Meshes that are drawn to pixels.

use egui::epaint::Vertex;

use super::area::Area;
use super::color::{blend, modulated, packed};
use super::texture::Texture;
use super::triangle::{Corner, Edge, Shading, area_of, least};

/// The largest difference, in pixels, of rectangles whose texture is copied texel by texel.
const EXACT: f32 = 1.0 / 64.0;

/// The pixels that a mesh is drawn to.
pub struct Target<'p> {
    pub pixels: &'p mut [u32],
    pub width: usize,
    pub clip: Area,
}

impl Target<'_> {
    pub fn draw(&mut self, vertices: &[Vertex], indices: &[u32], texture: &Texture, scale: f32) {
        let size = (texture.width as f32, texture.height as f32);
        let corner =
            |index: u32| vertices.get(index as usize).map(|it| Corner::of(it, scale, size));
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
        let is_exact =
            (four.u - one.u - width).abs() < EXACT && (four.v - one.v - height).abs() < EXACT;
        if !is_exact || ![one.x, one.y, one.u, one.v].into_iter().all(is_whole) {
            return false;
        }
        let at = |position: f32| position.round() as i32;
        let whole = Area { left: at(one.x), top: at(one.y), right: at(four.x), bottom: at(four.y) };
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
