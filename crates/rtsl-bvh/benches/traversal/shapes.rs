//! Spheres and triangles, and their tests, which are calls as those of compiled `intersect` methods are.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8, mask32x8};
use rtsl_bvh::{
    Bvh8, LANES, LaneMask, Lanes, Leaf, LeafHead, LoadedRay, Objects, PacketSpace, Pair, PairHit,
    RayLeafTest, RayStream, TraversalRay,
};
use rtsl_math::normalize_or;

/// A shape.
#[derive(Clone, Copy)]
pub enum Shape {
    /// A sphere.
    Sphere {
        /// The centre.
        center: [f32; 3],
        /// The radius.
        radius: f32,
    },
    /// A triangle.
    Triangle([[f32; 3]; 3]),
}

impl Shape {
    /// Returns the sphere at a fraction of its distance from the origin, with that fraction of its radius.
    pub fn scaled(&self, by: f32) -> Shape {
        match *self {
            Shape::Sphere { center, radius } => {
                Shape::Sphere { center: center.map(|it| it * by), radius: radius * by }
            }
            Shape::Triangle(corners) => {
                Shape::Triangle(corners.map(|corner| corner.map(|it| it * by)))
            }
        }
    }

    /// Returns the class of the shape's item.
    pub fn class(&self) -> u32 {
        u32::from(matches!(self, Shape::Triangle(_)))
    }

    /// Returns a sphere's centre and radius, or a triangle's corner and the edges to the others.
    fn numbers(&self) -> [f32; 9] {
        match *self {
            Shape::Sphere { center: [x, y, z], radius } => {
                [x, y, z, radius, 0.0, 0.0, 0.0, 0.0, 0.0]
            }
            Shape::Triangle([a, b, c]) => {
                let [e, f] = [b, c].map(|other| [0, 1, 2].map(|axis| other[axis] - a[axis]));
                [a[0], a[1], a[2], e[0], e[1], e[2], f[0], f[1], f[2]]
            }
        }
    }
}

/// Eight shapes of one leaf, number by number.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
struct Block([[f32; 8]; 9]);

/// The shapes of a scene, in the order of the leaves of each class.
pub struct Shapes {
    all: Vec<Shape>,
    blocks: [Vec<Block>; 2],
}

impl Shapes {
    /// Orders shapes as the leaves of a tree.
    pub fn new(tree: &Bvh8, shapes: &[Shape]) -> Self {
        let mut blocks = [Vec::new(), Vec::new()];
        for leaf in &tree.leaves {
            let mut block = Block([[0.0; 8]; 9]);
            for (index, item) in leaf.items.iter().enumerate() {
                for (row, number) in block.0.iter_mut().zip(shapes[*item as usize].numbers()) {
                    row[index] = number;
                }
            }
            blocks[leaf.class as usize].push(block);
        }
        Shapes { all: shapes.to_vec(), blocks }
    }

    /// Returns the normal of a shape at a point, on the side that a ray came from.
    pub fn normal(&self, shape: u32, point: [f32; 3], direction: [f32; 3]) -> [f32; 3] {
        let normal = match self.all[shape as usize] {
            Shape::Sphere { center, .. } => [0, 1, 2].map(|axis| point[axis] - center[axis]),
            triangle @ Shape::Triangle(_) => {
                let [_, _, _, e, f, g, u, v, w] = triangle.numbers();
                [f * w - g * v, g * u - e * w, e * v - f * u]
            }
        };
        let normal = normalize_or(normal, [0.0, 1.0, 0.0]);
        let behind = (0..3).map(|axis| normal[axis] * direction[axis]).sum::<f32>() > 0.0;
        normal.map(|it| if behind { -it } else { it })
    }
}

/// Tests of shapes.
pub struct Tests<'a> {
    shapes: &'a Shapes,
    distance: Lanes,
}

impl<'a> Tests<'a> {
    /// Prepares tests.
    pub fn new(shapes: &'a Shapes) -> Self {
        Tests { shapes, distance: [0.0; LANES] }
    }
}

/// The numbers of eight shapes. A trait, because closures would be calls.
trait Rows<S: Simd> {
    /// Returns a number of all.
    fn row(&self, row: usize) -> f32x8<S>;
}

/// One shape of a block, eight times.
struct Repeated<'a, S> {
    simd: S,
    block: &'a Block,
    index: usize,
}

impl<S: Simd> Rows<S> for Repeated<'_, S> {
    #[inline(always)]
    fn row(&self, row: usize) -> f32x8<S> {
        f32x8::splat(self.simd, self.block.0[row][self.index])
    }
}

/// Eight shapes, number by number.
struct Eight<'a, S> {
    simd: S,
    rows: &'a [[f32; 8]],
}

impl<S: Simd> Rows<S> for Eight<'_, S> {
    #[inline(always)]
    fn row(&self, row: usize) -> f32x8<S> {
        f32x8::load_array_ref(self.simd, &self.rows[row])
    }
}

/// Rays in vectors.
struct Rays<S: Simd> {
    origin: [f32x8<S>; 3],
    direction: [f32x8<S>; 3],
    epsilon: f32x8<S>,
    limit: f32x8<S>,
}

/// Tests eight rays against eight shapes. Returns those that hit, and the distances.
#[inline(always)]
fn test<S: Simd>(
    simd: S,
    class: u32,
    shape: impl Rows<S>,
    rays: Rays<S>,
) -> (mask32x8<S>, f32x8<S>) {
    if class == 0 { sphere(simd, shape, rays) } else { triangle(simd, shape, rays) }
}

#[inline(always)]
fn dot<S: Simd>(a: [f32x8<S>; 3], b: [f32x8<S>; 3]) -> f32x8<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross<S: Simd>(a: [f32x8<S>; 3], b: [f32x8<S>; 3]) -> [f32x8<S>; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn sphere<S: Simd>(simd: S, shape: impl Rows<S>, rays: Rays<S>) -> (mask32x8<S>, f32x8<S>) {
    let Rays { origin, direction, epsilon, limit } = rays;
    let from = [origin[0] - shape.row(0), origin[1] - shape.row(1), origin[2] - shape.row(2)];
    let a = dot(direction, direction);
    let b = dot(from, direction);
    let c = dot(from, from) - shape.row(3) * shape.row(3);
    let square = b * b - a * c;
    let root = square.sqrt();
    let inverse = f32x8::splat(simd, 1.0) / a;
    let (first, second) = ((-b - root) * inverse, (root - b) * inverse);
    let is_within = |it: f32x8<S>| epsilon.simd_lt(it) & it.simd_lt(limit);
    let distance = is_within(first).select(first, second);
    (is_within(distance), distance)
}

#[inline(always)]
fn triangle<S: Simd>(simd: S, shape: impl Rows<S>, rays: Rays<S>) -> (mask32x8<S>, f32x8<S>) {
    let Rays { origin, direction, epsilon, limit } = rays;
    let corner = [shape.row(0), shape.row(1), shape.row(2)];
    let first = [shape.row(3), shape.row(4), shape.row(5)];
    let second = [shape.row(6), shape.row(7), shape.row(8)];
    let across = cross(direction, second);
    let inverse = f32x8::splat(simd, 1.0) / dot(first, across);
    let from = [origin[0] - corner[0], origin[1] - corner[1], origin[2] - corner[2]];
    let u = dot(from, across) * inverse;
    let other = cross(from, first);
    let v = dot(direction, other) * inverse;
    let distance = dot(second, other) * inverse;
    let zero = f32x8::splat(simd, 0.0);
    let is_inside = u.simd_ge(zero) & v.simd_ge(zero) & (u + v).simd_le(1.0);
    (is_inside & epsilon.simd_lt(distance) & distance.simd_lt(limit), distance)
}

/// A call for a packet.
#[inline(never)]
fn call_for_packet<S: Simd>(
    simd: S,
    block: &Block,
    class: u32,
    index: usize,
    space: &PacketSpace<'_>,
    lanes: LaneMask,
    distance: &mut Lanes,
) -> LaneMask {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut hits = 0;
            for start in (0..LANES).step_by(8).filter(|start| lanes >> start & 0xFF != 0) {
                let load = |lanes: &Lanes| f32x8::from_slice(simd, &lanes[start..start + 8]);
                let rays = space.rays;
                let ([x, y, z], [u, v, w]) = (&rays.origin, &rays.direction);
                let origin = [load(x), load(y), load(z)];
                let direction = [load(u), load(v), load(w)];
                let (epsilon, limit) = (load(&rays.epsilon), load(&rays.limit));
                let of_rays = Rays { origin, direction, epsilon, limit };
                let shape = Repeated { simd, block, index };
                let (hit, found) = test(simd, class, shape, of_rays);
                found.store_slice(&mut distance[start..start + 8]);
                hits |= hit.to_bitmask() << start;
            }
            hits & lanes
        },
    )
}

/// A call for leaves, for the objects at the indices of a mask.
#[inline(never)]
fn call_for_leaves<S: Simd>(
    simd: S,
    shapes: &Shapes,
    rays: &[LoadedRay],
    tests: &mut [RayLeafTest],
    items: u64,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            for RayLeafTest { ray, head, nearest, distance: least, .. } in tests {
                let ray = &rays[*ray as usize];
                let block = &shapes.blocks[head.class as usize][head.index_in_class as usize];
                let splat = |number: f32| f32x8::splat(simd, number);
                let ([x, y, z], [u, v, w]) = (ray.origin, ray.direction);
                let origin = [splat(x), splat(y), splat(z)];
                let direction = [splat(u), splat(v), splat(w)];
                let (epsilon, limit) = (splat(ray.epsilon), splat(ray.limit));
                let rays = Rays { origin, direction, epsilon, limit };
                let shape = Eight { simd, rows: &block.0 };
                let (hit, distance) = test(simd, head.class, shape, rays);
                let hit = hit.to_bitmask() & ((1 << head.count) - 1) & items;
                let infinite = splat(f32::INFINITY);
                let distance = mask32x8::from_bitmask(simd, hit).select(distance, infinite);
                *least = distance.reduce_min();
                let is_least = distance.simd_eq(splat(*least)).to_bitmask() & hit;
                *nearest =
                    if is_least == 0 { RayLeafTest::NO_ITEM } else { is_least.trailing_zeros() };
            }
        },
    );
}

/// A call for pairs.
#[inline(never)]
fn call_for_pairs<S: Simd>(
    simd: S,
    shapes: &Shapes,
    class: u32,
    stream: &RayStream,
    pairs: &[Pair],
    found: &mut Vec<PairHit>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            for (start, pairs) in (0..).step_by(8).zip(pairs.chunks(8)) {
                let mut rows = [[0.0; 8]; 17];
                for (lane, pair) in pairs.iter().enumerate() {
                    let ray = pair.ray as usize;
                    let (from, along) = (stream.rays()[ray].start, stream.lines()[ray].along);
                    let block = &shapes.blocks[class as usize][pair.object as usize / 8].0;
                    let shape = block.iter().map(|row| row[pair.object as usize % 8]);
                    for (row, number) in
                        rows.iter_mut().zip(from.into_iter().chain(along).chain(shape))
                    {
                        row[lane] = number;
                    }
                }
                let (of_rays, of_shapes) = rows.split_at(8);
                let of_rays = Eight { simd, rows: of_rays };
                let origin = [of_rays.row(0), of_rays.row(1), of_rays.row(2)];
                let direction = [of_rays.row(4), of_rays.row(5), of_rays.row(6)];
                let (epsilon, limit) = (of_rays.row(3), of_rays.row(7));
                let rays = Rays { origin, direction, epsilon, limit };
                let (hit, distance) = test(simd, class, Eight { simd, rows: of_shapes }, rays);
                let distance = distance.to_array();
                let mut hit = hit.to_bitmask() & ((1 << pairs.len()) - 1);
                while hit != 0 {
                    let lane = hit.trailing_zeros();
                    hit &= hit - 1;
                    found.push(PairHit { pair: start + lane, distance: distance[lane as usize] });
                }
            }
        },
    );
}

impl Objects for Tests<'_> {
    #[inline(always)]
    fn packet<S: Simd>(
        &mut self,
        simd: S,
        space: &PacketSpace<'_>,
        leaf: &Leaf,
        index: usize,
        lanes: LaneMask,
    ) -> LaneMask {
        let block = &self.shapes.blocks[leaf.class as usize][leaf.index_in_class as usize];
        call_for_packet(simd, block, leaf.class, index, space, lanes, &mut self.distance)
    }

    #[inline(always)]
    fn distance(&self) -> &Lanes {
        &self.distance
    }

    #[inline(always)]
    fn load_packet<S: Simd>(&mut self, _: S, _: &PacketSpace<'_>) {}

    #[inline(always)]
    fn load_ray(&mut self, _: &TraversalRay) {}

    #[inline(always)]
    fn prefetch(&self, head: &LeafHead) {
        // Instances have no class.
        let Some(blocks) = self.shapes.blocks.get(head.class as usize) else { return };
        let block = &blocks[head.index_in_class as usize];
        (0..9).step_by(2).for_each(|row| rtsl_memory::prefetch(&block.0[row]));
    }

    fn pairs(&mut self, stream: &RayStream, class: u32, pairs: &[Pair], found: &mut Vec<PairHit>) {
        let shapes = self.shapes;
        dispatch!(Level::new(), simd => call_for_pairs(simd, shapes, class, stream, pairs, found));
    }

    #[inline(always)]
    fn leaves(&mut self, rays: &[LoadedRay], _: &[Leaf], tests: &mut [RayLeafTest]) {
        dispatch!(Level::new(), simd => call_for_leaves(simd, self.shapes, rays, tests, u64::MAX));
    }

    fn ray_against_one(&mut self, ray: &LoadedRay, leaf: &Leaf, index: usize) -> Option<f32> {
        let (rays, mut tests) = (std::slice::from_ref(ray), [RayLeafTest::new(0, 0, leaf.head())]);
        let item = 1 << index;
        dispatch!(Level::new(), simd => call_for_leaves(simd, self.shapes, rays, &mut tests, item));
        (tests[0].nearest != RayLeafTest::NO_ITEM).then_some(tests[0].distance)
    }
}
