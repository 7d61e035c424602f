//! Meshes in, pixels out.

use egui::epaint::{ColorImage, ImageDelta, Mesh, Vertex};
use egui::{Color32, Rect, TextureOptions, pos2, vec2};

use super::*;

const SIZE: (usize, usize) = (200, 100);

/// Layers with a texture of two texels: white, and half of red.
struct Layer(Raster);

impl Layer {
    fn new() -> Layer {
        let mut raster = Raster::default();
        let texels = vec![Color32::WHITE, Color32::from_rgba_premultiplied(128, 0, 0, 128)];
        let image = ColorImage::new([2, 1], texels);
        let mut textures = TexturesDelta::default();
        textures.push(TextureId::default(), ImageDelta::full(image, TextureOptions::NEAREST));
        raster.draw(SIZE, Vec::new(), textures, 1.0);
        Layer(raster)
    }

    fn draw(&mut self, meshes: impl IntoIterator<Item = Mesh>) {
        let all = Rect::from_min_size(pos2(0.0, 0.0), vec2(1e4, 1e4));
        let clipped = |mesh| ClippedPrimitive { clip_rect: all, primitive: Primitive::Mesh(mesh) };
        let primitives = meshes.into_iter().map(clipped).collect();
        self.0.draw(SIZE, primitives, TexturesDelta::default(), 1.0);
    }

    fn at(&self, x: usize, y: usize) -> u32 {
        self.0.pixels[y * SIZE.0 + x]
    }
}

fn vertex(x: f32, y: f32, color: Color32) -> Vertex {
    // The middle of the white texel.
    Vertex { pos: pos2(x, y), uv: pos2(0.25, 0.5), color }
}

fn triangle(corners: [(f32, f32); 3], color: Color32) -> Mesh {
    let vertices = corners.map(|(x, y)| vertex(x, y, color)).to_vec();
    Mesh { indices: vec![0, 1, 2], vertices, ..Mesh::default() }
}

fn rectangle(rect: Rect, uv: Rect, color: Color32) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_rect_with_uv(rect, uv, color);
    mesh
}

#[test]
fn triangles_that_share_an_edge_cover_each_pixel_once() {
    let mut layer = Layer::new();
    let half = Color32::from_rgba_premultiplied(64, 64, 64, 128);
    // A fan about an inner point, whose edges cross pixels in all directions.
    let middle = (61.37, 43.81);
    let around = [(10.0, 10.0), (90.4, 3.3), (150.0, 60.0), (70.2, 95.0), (5.5, 70.1)];
    let fan = (0..5).map(|index| {
        // Both windings.
        let (one, other) = (around[index], around[(index + 1) % 5]);
        triangle(if index % 2 == 0 { [middle, one, other] } else { [other, one, middle] }, half)
    });
    layer.draw(fan);
    let drawn = layer.0.pixels.iter().filter(|pixel| **pixel != 0);
    assert!(drawn.clone().count() > 5000);
    assert!(drawn.clone().all(|pixel| *pixel == 0x8040_4040), "no pixel is drawn twice");
    assert!((12..130).all(|x| layer.at(x, 43) == 0x8040_4040), "there are no gaps");
}

#[test]
fn colours_are_interpolated() {
    let mut layer = Layer::new();
    let mut mesh = triangle([(0.0, 0.0), (100.0, 0.0), (0.0, 100.0)], Color32::BLACK);
    mesh.vertices[1].color = Color32::WHITE;
    layer.draw([mesh]);
    let [near, far] = [layer.at(10, 5), layer.at(80, 5)].map(|pixel| pixel & 0xFF);
    assert!((20..35).contains(&near) && (195..215).contains(&far), "{near} {far}");
}

#[test]
fn rectangles_are_filled_and_textures_copied() {
    let mut layer = Layer::new();
    let color = Color32::from_rgb(10, 20, 30);
    let white = Rect::from_min_max(pos2(0.25, 0.5), pos2(0.25, 0.5));
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    layer.draw([
        rectangle(Rect::from_min_size(pos2(5.0, 5.0), vec2(10.0, 4.0)), white, color),
        // One pixel per texel, at a whole position.
        rectangle(Rect::from_min_size(pos2(50.0, 50.0), vec2(2.0, 1.0)), whole, Color32::WHITE),
    ]);
    assert_eq!([layer.at(5, 5), layer.at(14, 8)], [0xFF0A_141E; 2]);
    assert_eq!([layer.at(4, 5), layer.at(15, 8), layer.at(14, 9)], [0; 3]);
    assert_eq!([layer.at(50, 50), layer.at(51, 50), layer.at(52, 50)], [u32::MAX, 0x8080_0000, 0]);
}

#[test]
fn what_changes_is_drawn_again() {
    let mut layer = Layer::new();
    let white = Rect::from_min_max(pos2(0.25, 0.5), pos2(0.25, 0.5));
    let at = |x: f32| Rect::from_min_size(pos2(x, 10.0), vec2(20.0, 20.0));
    let (one, other) = (rectangle(at(10.0), white, Color32::RED), at(150.0));
    layer.draw([one.clone(), rectangle(other, white, Color32::BLUE)]);
    // The first one is not drawn again: what is there stays.
    layer.0.pixels[15 * SIZE.0 + 15] = 7;
    layer.draw([one.clone(), rectangle(other, white, Color32::GREEN)]);
    assert_eq!((layer.at(15, 15), layer.at(155, 15)), (7, 0xFF00_FF00));
    layer.draw([one]);
    assert_eq!((layer.at(15, 15), layer.at(155, 15)), (7, 0));
    layer.draw([]);
    assert!(layer.0.pixels.iter().all(|pixel| *pixel == 0));
}

#[test]
fn layers_are_shown_over_pictures() {
    let mut layer = Layer::new();
    let white = Rect::from_min_max(pos2(0.25, 0.5), pos2(0.25, 0.5));
    let half = Color32::from_rgba_premultiplied(0, 0, 64, 128);
    layer.draw([rectangle(Rect::from_min_size(pos2(0.0, 0.0), vec2(1.0, 1.0)), white, half)]);
    let mut pixels = vec![0x00FF_FFFF; SIZE.0 * SIZE.1];
    layer.0.show_over(&mut pixels);
    assert_eq!(pixels[..2], [0x007F_7FBF, 0x00FF_FFFF]);
}

#[test]
fn additive_colours_do_not_overflow() {
    // Colours without alpha are added.
    assert_eq!(blend(0xFFC0_C0C0, 0x0080_8080), 0xFFFF_FFFF);
    assert_eq!(blend(0xFF10_2030, 0xFF01_0203), 0xFF01_0203);
}
