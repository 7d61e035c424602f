//! Triangles: their corners, their edges, and what is interpolated between them.

use egui::epaint::Vertex;

use super::color::{channels, packed};
use super::texture::Texture;

/// The number of positions in a pixel's side that the edges of triangles distinguish.
const STEPS: f32 = 256.0;

/// A corner of a triangle, in pixels and texels.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    pub x: f32,
    pub y: f32,
    pub u: f32,
    pub v: f32,
    pub color: [f32; 4],
}

impl Corner {
    pub fn of(vertex: &Vertex, scale: f32, (width, height): (f32, f32)) -> Corner {
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
pub struct Edge {
    a: i64,
    b: i64,
    c: i64,
}

impl Edge {
    pub fn new(from: Corner, to: Corner) -> Edge {
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
    pub fn narrowed(&self, (start, end): (i32, i32), y: i32) -> (i32, i32) {
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
pub struct Shading {
    origin: (f32, f32),
    /// The values at the origin, and their changes per column and per row: alpha, red, green, blue, u, v.
    values: [[f32; 3]; 6],
    is_one_texel: bool,
}

impl Shading {
    pub fn new(corners: &[Corner; 3]) -> Shading {
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

    pub fn at(&self, x: i32, y: i32, texture: &Texture) -> u32 {
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
pub fn area_of([one, two, three]: &[Corner; 3]) -> f32 {
    (two.x - one.x) * (three.y - one.y) - (three.x - one.x) * (two.y - one.y)
}

pub fn least([a, b, c]: [f32; 3]) -> f32 {
    a.min(b).min(c)
}
