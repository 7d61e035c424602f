//! Looking at a scene, with nothing but arithmetic that has the same bits everywhere.

use std::array::from_fn;

use anyhow::{Result, ensure};

use crate::embree::Bounds;
use crate::rays::{DIRECTION, FAR, NEAR, NORMAL, ORIGIN, Rays};
use crate::scene::Scene;

const BACK: [f32; 3] = [-0.48, 0.64, -0.6];
const RIGHT: [f32; 3] = [0.780_868_8, 0.0, -0.624_695_05];
const UP: [f32; 3] = [0.399_804_8, 0.768_374_9, 0.499_756];
const AHEAD: [f32; 3] = [0.48, -0.64, 0.6];
const TO_LIGHT: [f32; 3] = [-0.8, 0.6, 0.0];

/// A picture.
pub struct Picture {
    /// Red, green and blue, row by row from the top.
    pub pixels: Vec<u8>,
    /// The number of distances that differ, by any bit, from those of a loop over all primitives.
    pub differences: usize,
}

impl Picture {
    /// Draws a square picture of `size` pixels a side with packets of `width` rays, and compares every hit with a loop
    /// over all primitives if `check` is set.
    ///
    /// # Errors
    /// If the scene's bounds are not finite.
    pub fn draw(scene: &Scene, size: usize, width: usize, check: bool) -> Result<Picture> {
        let camera = Camera::of(&scene.bounds())?;
        let mut picture = Picture { pixels: Vec::new(), differences: 0 };
        for pixel in (0..size * size).step_by(width) {
            let mut rays = Rays::new(width);
            for ray in 0..width {
                let direction = direction_to(pixel % size + ray, pixel / size, size);
                rays.set(ray, camera.eye, direction, 0.0);
            }
            scene.intersect(&mut rays);
            let mut shadows = shadow_rays(&rays);
            scene.occluded(&mut shadows);
            for ray in 0..width {
                picture.pixels.extend(color_of(&rays, ray, shadows.get(FAR, ray) > 0.0));
            }
            if check {
                picture.differences += count_differences(scene, &rays);
            }
        }
        Ok(picture)
    }
}

/// Looks at the middle of a box from the upper left.
struct Camera {
    eye: [f32; 3],
}

impl Camera {
    fn of(bounds: &Bounds) -> Result<Camera> {
        let half: [f32; 3] = from_fn(|axis| 0.5 * (bounds.upper[axis] - bounds.lower[axis]));
        let scale = dot(half, half).sqrt();
        ensure!(scale < 1e18, "the primitives' bounds are not finite, which Embree has no use for");
        let eye = from_fn(|axis| bounds.lower[axis] + half[axis] + 3.0 * scale * BACK[axis]);
        Ok(Camera { eye })
    }
}

fn direction_to(x: usize, y: usize, size: usize) -> [f32; 3] {
    let u = 0.7 * (2.0 * (x as f32 + 0.5) / size as f32 - 1.0);
    let v = 0.7 * (1.0 - 2.0 * (y as f32 + 0.5) / size as f32);
    from_fn(|axis| u * RIGHT[axis] + v * UP[axis] + 2.0 * AHEAD[axis])
}

/// A few roundings.
const ROUNDINGS: f32 = 1.0 / (1 << 20) as f32;

/// The point at which rays to the light begin: off the surface by more than rounding may have put the hit on the other
/// side, which follows from the sizes of the numbers that it is computed from, whatever the size of the scene.
fn start_of_shadow(rays: &Rays, ray: usize) -> [f32; 3] {
    let (origin, direction) = (rays.vector(ORIGIN, ray), rays.vector(DIRECTION, ray));
    let normal = seen_normal(rays, ray);
    let way = direction.map(|it| rays.get(FAR, ray) * it);
    let mut offset = 0.0;
    for axis in 0..3 {
        let size = origin[axis].abs() + way[axis].abs();
        offset += ROUNDINGS * normal[axis].abs() * size;
    }
    from_fn(|axis| origin[axis] + way[axis] + offset * normal[axis])
}

/// Rays from hits to the light; what hit nothing has none.
fn shadow_rays(rays: &Rays) -> Rays {
    let mut shadows = Rays::new(rays.count());
    for ray in (0..rays.count()).filter(|ray| rays.is_hit(*ray)) {
        shadows.set(ray, start_of_shadow(rays, ray), TO_LIGHT, 0.0);
    }
    shadows
}

fn color_of(rays: &Rays, ray: usize, is_lit: bool) -> [u8; 3] {
    let mut value = [0.85, 0.9, 0.95];
    if rays.is_hit(ray) {
        let normal = seen_normal(rays, ray);
        let light = 0.25 + if is_lit { 0.75 * dot(normal, TO_LIGHT).max(0.0) } else { 0.0 };
        value = normal.map(|it| light * (0.75 + 0.25 * it));
    }
    // A display's gamma is about 2.
    value.map(|it| (255.0 * it.sqrt() + 0.5) as u8)
}

/// The normal on the side that the ray sees.
fn seen_normal(rays: &Rays, ray: usize) -> [f32; 3] {
    let normal = rays.vector(NORMAL, ray);
    let length = dot(normal, normal).sqrt();
    let normal = normal.map(|it| it / length);
    let sign = if dot(normal, rays.vector(DIRECTION, ray)) > 0.0 { -1.0 } else { 1.0 };
    normal.map(|it| it * sign)
}

fn count_differences(scene: &Scene, rays: &Rays) -> usize {
    let differs = |ray: &usize| {
        let (origin, direction) = (rays.vector(ORIGIN, *ray), rays.vector(DIRECTION, *ray));
        let expected = scene.nearest_in_turn(origin, direction, rays.get(NEAR, *ray));
        expected.to_bits() != rays.get(FAR, *ray).to_bits()
    };
    (0..rays.count()).filter(differs).count()
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
