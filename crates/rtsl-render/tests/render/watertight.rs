//! Rays inside closed meshes, towards edges and corners: none leaves, in whatever way it is traced.

use std::collections::HashMap;
use std::fmt::Write;
use std::path::PathBuf;

use rtsl::{Backend, EngineOptions};
use rtsl_render::RenderRequest;
use rtsl_render::request::render_scene_from;
use rtsl_scene::reader::MemoryFiles;
use rtsl_testing::random::Random;
use rtsl_testing::turns::is_long_run;

type Vector = [f64; 3];

/// The camera's rays of a tile go to one face. The integrator's go to any; origins are around `middle`. Both give light
/// for each ray that leaves.
const CLASSES: &str = "
vec3 onEdge(vec3 a, vec3 b, float place) { return mix(a, b, max(2.0 * place - 1.0, 0.0)); }
class Aim : rt_Camera;
public vec3 positions[];
public int indices[];
public vec3 middle = vec3(0.0);
void generateRay() {
    vec2 tiles = 8.0 * rt_ScreenCoord;
    vec2 tile = floor(tiles);
    vec2 place = fract(tiles);
    int face = int(17.0 * tile.x + 131.0 * tile.y) % (indices.length() / 3);
    int corner = min(int(3.0 * place.x), 2);
    vec3 a = positions[indices[3 * face + corner]];
    vec3 b = positions[indices[3 * face + (corner + 1) % 3]];
    rt_RayOrigin = middle;
    rt_RayDirection = onEdge(a, b, place.y) - middle;
}
class Leaks : rt_Integrator;
public vec3 positions[];
public int indices[];
public vec3 middle = vec3(0.0);
public vec3 spread = vec3(0.0);
void radiance() {
    int side = min(int(sample1D(0) * float(indices.length())), indices.length() - 1);
    int next = side % 3 == 2 ? side - 2 : side + 1;
    vec3 target = onEdge(positions[indices[side]], positions[indices[next]], sample1D(1));
    vec3 origin = middle + spread * (vec3(sample2D(2), sample1D(3)) - 0.5);
    rt_Surface first = nearestHit();
    rt_Surface surface = nearestHit(origin, target - origin);
    bool isBlocked = occluded(origin, 3.0 * (target - origin), 1e3);
    rt_SampleColor = color(first.found ? 0.0 : 1.0, surface.found ? 0.0 : 1.0, isBlocked ? 0.0 : 1.0);
}";

/// A closed mesh of triangles.
#[derive(Default)]
struct Mesh {
    positions: Vec<Vector>,
    indices: Vec<usize>,
}

impl Mesh {
    /// An icosahedron whose faces are divided into four `times` times, on the sphere.
    fn icosphere(times: usize) -> Mesh {
        let t = 0.5 * (1.0 + 5.0_f64.sqrt());
        let signs = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)];
        let corners = |axis: usize| {
            signs.map(|(one, other)| {
                let mut corner = [0.0; 3];
                (corner[axis], corner[(axis + 1) % 3]) = (one, other * t);
                corner
            })
        };
        let mut mesh = Mesh { positions: [0, 1, 2].map(corners).concat(), indices: Vec::new() };
        let is_edge = |a: usize, b: usize| {
            let apart: f64 = (0..3)
                .map(|axis| mesh.positions[a][axis] - mesh.positions[b][axis])
                .map(|it| it * it)
                .sum();
            apart < 4.1
        };
        for a in 0..12 {
            for b in (a + 1..12).filter(|b| is_edge(a, *b)) {
                let faces = (b + 1..12).filter(|c| is_edge(a, *c) && is_edge(b, *c));
                mesh.indices.extend(faces.flat_map(|c| [a, b, c]));
            }
        }
        (0..times).for_each(|_| mesh.divide());
        mesh.mapped(|point| {
            let length = point.iter().map(|it| it * it).sum::<f64>().sqrt();
            point.map(|it| it / length)
        })
    }

    fn divide(&mut self) {
        let mut middles = HashMap::new();
        let mut indices = Vec::new();
        for face in self.indices.chunks(3) {
            let [x, y, z] = [0, 1, 2].map(|side| {
                let (a, b) = (face[side], face[(side + 1) % 3]);
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let (one, other) = (self.positions[a], self.positions[b]);
                    self.positions.push([0, 1, 2].map(|axis| 0.5 * (one[axis] + other[axis])));
                    self.positions.len() - 1
                })
            });
            indices.extend([face[0], x, z, face[1], y, x, face[2], z, y, x, y, z]);
        }
        self.indices = indices;
    }

    fn mapped(mut self, mut map: impl FnMut(Vector) -> Vector) -> Mesh {
        self.positions.iter_mut().for_each(|point| *point = map(*point));
        self
    }

    /// The parameters that a mesh, the camera and the integrator share, the name of positions given.
    fn parameters(&self, positions: &str) -> String {
        let mut text = format!("\"point3 {positions}\" [");
        for position in &self.positions {
            position.iter().for_each(|it| write!(text, "{} ", *it as f32).expect("it is memory"));
        }
        text += "] \"integer indices\" [";
        self.indices.iter().for_each(|it| write!(text, "{it} ").expect("it is memory"));
        text + "]"
    }
}

/// A mesh in a scene.
struct Scene {
    /// The mesh where it stands, at which rays aim.
    mesh: Mesh,
    middle: Vector,
    spread: Vector,
    /// The text of the shapes.
    shapes: String,
}

impl Scene {
    /// The mesh alone.
    fn of(mesh: Mesh, middle: Vector, spread: Vector) -> Scene {
        let shapes = format!("Shape \"trianglemesh\" {}", mesh.parameters("P"));
        Scene { mesh, middle, spread, shapes }
    }

    fn text(&self) -> String {
        let parameters = self.mesh.parameters("positions");
        let vector = |of: Vector| format!("[{} {} {}]", of[0], of[1], of[2]);
        let (middle, spread) = (vector(self.middle), vector(self.spread));
        format!(
            "Camera \"Aim\" {parameters} \"point3 middle\" {middle}\n\
             Integrator \"Leaks\" {parameters} \"point3 middle\" {middle} \"vector3 spread\" {spread}\n\
             WorldBegin\nMaterial \"diffuse\"\n{}\n",
            self.shapes
        )
    }

    /// The sums of light by camera rays, nearest hits, and shadow rays.
    fn leaks(&self, backend: Backend, width: u32, samples: u32) -> [f64; 3] {
        let files = [("scene.pbrt", self.text()), ("aim.rtsl", CLASSES.to_owned())];
        let files = files.map(|(name, text)| (PathBuf::from(name), text));
        let request = RenderRequest {
            scene: "scene.pbrt".into(),
            engine: EngineOptions { backend, width: Some(width), ..EngineOptions::default() },
            samples: Some(samples),
            size: Some((64, 64)),
            ..RenderRequest::default()
        };
        let result = render_scene_from(&request, &MemoryFiles(files.into()));
        let result = result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
        [0, 1, 2]
            .map(|channel| result.image.pixels.iter().map(|pixel| f64::from(pixel[channel])).sum())
    }
}

/// The shapes and ways to trace them: by name, and what they are.
fn scenes() -> Vec<(&'static str, Scene)> {
    let round =
        |times: usize| Mesh::icosphere(times).mapped(|[x, y, z]| [x + 0.4 * y, y, z - 0.2 * x]);
    let mut random = Random::new(3);
    let noisy = Mesh::icosphere(3).mapped(|it| {
        let part = 1.0 + 0.1 * f64::from(random.signed());
        it.map(|it| part * it)
    });
    let thin = Mesh::icosphere(2).mapped(|[x, y, z]| [x + 0.1, 1e-3 * y + 0.3 * x, z]);
    let far =
        Mesh::icosphere(2).mapped(|[x, y, z]| [50.0 * x + 1e4, 70.0 * y - 3e4, 40.0 * z + 500.0]);
    // A transform of the shapes, by which rays aim at where they stand.
    const TURN: &str = "ConcatTransform [1.2 1.6 0 0  -0.4 0.3 0 0  0 0 1.5 0  3 -2 5 1]\n";
    let turned = |mesh: Mesh, shapes: &dyn Fn(&str) -> String| {
        let shapes = shapes(&format!("Shape \"trianglemesh\" {}\n", mesh.parameters("P")));
        let mesh = mesh
            .mapped(|[x, y, z]| [1.2 * x - 0.4 * y + 3.0, 1.6 * x + 0.3 * y - 2.0, 1.5 * z + 5.0]);
        Scene { shapes, ..Scene::of(mesh, [3.0, -2.0, 5.0], [0.1; 3]) }
    };
    let placed = turned(round(1), &|shape| format!("{TURN}{shape}"));
    let instance = turned(round(2), &|shape| {
        format!("ObjectBegin \"ball\"\n{shape}ObjectEnd\n{TURN}ObjectInstance \"ball\"\n")
    });
    let moving = turned(round(2), &|shape| {
        let motion = "ActiveTransform EndTime Translate 0.1 0.05 0 ActiveTransform All\n";
        format!("ObjectBegin \"ball\"\n{shape}ObjectEnd\n{motion}{TURN}ObjectInstance \"ball\"\n")
    });
    vec![
        // All faces are tested by the stages of the integrator.
        ("few", Scene::of(round(0), [0.0; 3], [0.2; 3])),
        ("noisy", Scene::of(noisy, [0.0; 3], [0.2; 3])),
        ("thin", Scene::of(thin, [0.1, 0.0, 0.0], [0.0, 1e-4, 0.0])),
        ("far", Scene::of(far, [1e4, -3e4, 500.0], [10.0; 3])),
        ("placed", placed),
        ("instance", instance),
        ("moving", moving),
    ]
}

#[test]
fn no_ray_leaves_a_closed_mesh() {
    let ways = [(Backend::Auto, 8), (Backend::Auto, 4), (Backend::Auto, 16), (Backend::Auto, 1)];
    let samples = if is_long_run() { 1000 } else { 1 };
    for (index, (name, scene)) in scenes().iter().enumerate() {
        let (backend, width) = ways[index % ways.len()];
        let leaks = scene.leaks(backend, width, samples);
        assert_eq!(leaks, [0.0; 3], "{name} at width {width}");
    }
}
