//! Rays that leave surfaces: none hits the surface that it leaves, whatever the scale and position of a scene, and no
//! light leaks through walls; yet near objects cast shadows.

use std::fmt::Write;
use std::path::PathBuf;

use rtsl_render::request::render_scene_from;
use rtsl_render::{LoadOptions, RenderRequest};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{BATCH, INTERACTIVE};

type Pixels = Vec<[f32; 3]>;

const RENDERERS: [&str; 2] = [INTERACTIVE, BATCH];

/// Materials that show if rays from the visible side of a surface, most of them at grazing angles, hit something near.
const PROBE: &str = r"
vec3 flat_direction(vec3 normal, float first, float second) {
    float height = max(pow(first, 6.0), 1e-5);
    float angle = 6.2831853 * second;
    float across = sqrt(1.0 - height * height);
    return toWorld(makeFrame(normal), vec3(across * cos(angle), across * sin(angle), height));
}
class Probe : rt_Material;
public float near = 1.0;
void shade() {
    vec3 normal = faceforward(rt_GeometricNormal, rt_RayDirection, rt_GeometricNormal);
    float met = 0.0;
    for (int i = 0; i < 16; i++) {
        vec3 direction = flat_direction(normal, rand(), rand());
        if (occluded(rt_HitPoint, direction, near)) met += 1.0;
        met += luminance(trace(rt_HitPoint, 3.0 * direction, near / 3.0));
    }
    rt_SampleColor = color(1.0 + 1e4 * met);
}
class Close : rt_Material;
public float near = 1.0;
void emission() { rt_EmissionColor = color(rt_HitDistance > near ? 1.0 : 1e4); }
void BSDF() { rt_BSDFValue = color(1e-3); }
void sampleBSDF() {
    vec3 normal = faceforward(rt_GeometricNormal, rt_RayDirection, rt_GeometricNormal);
    rt_LightDirection = flat_direction(normal, rt_BSDFSeed.x, rt_BSDFSeed.y);
    rt_BSDFValue = color(1.0 / dot(normal, rt_LightDirection));
    rt_PDF = 1.0;
}
void evaluatePDF() { rt_PDF = 1.0; }
class Facet : rt_Primitive;
public vec3 corner = vec3(-0.5, 0.0, -0.5);
public vec3 along = vec3(1.0, 0.0, 0.0);
public vec3 across = vec3(0.0, 0.0, 1.0);
void intersect() {
    vec3 n = cross(across, along);
    float t = dot(corner - rt_RayOrigin, n) / dot(rt_RayDirection, n);
    vec3 p = rt_RayOrigin + t * rt_RayDirection - corner;
    float u = dot(p, along) / dot(along, along);
    float v = dot(p, across) / dot(across, across);
    if (u >= 0.0 && u <= 1.0 && v >= 0.0 && v <= 1.0) hit(t);
}
void computeBounds() {
    vec3 far = corner + along + across;
    rt_BoundMin = min(corner, far);
    rt_BoundMax = max(corner, far);
}
void computeNormal() { rt_GeometricNormal = cross(across, along); }
class Egg : rt_Primitive;
float field(vec3 p) { return length(p * vec3(1.0, 0.8, 1.2)) - 0.8; }
void intersect() {
    float speed = length(rt_RayDirection);
    float t = max(-dot(rt_RayOrigin, rt_RayDirection) / (speed * speed) - 1.1 / speed, 0.0);
    float side = field(rt_RayOrigin) < 0.0 ? -1.0 : 1.0;
    for (int i = 0; i < 300 && t < rt_HitDistance; i++) {
        float apart = side * field(rt_RayOrigin + t * rt_RayDirection);
        if (apart < 1e-6 && t > 0.0) { hit(t); return; }
        if (apart > 3.0) return;
        t += max(0.8 * apart, 1e-6) / speed;
    }
}
void computeBounds() { rt_BoundMin = vec3(-1.1); rt_BoundMax = vec3(1.1); }
";

fn render(scene: &str, renderer: &str) -> Pixels {
    let files = [("scene.pbrt", scene), ("probe.rtsl", PROBE)];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let request = RenderRequest {
        scene: "scene.pbrt".into(),
        load: LoadOptions::with_integrator(renderer),
        ..RenderRequest::default()
    };
    let result = render_scene_from(&request, &MemoryFiles(files.into()));
    result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false))).image.pixels
}

/// Vertices and faces.
#[derive(Default)]
struct Mesh {
    points: Vec<[f64; 3]>,
    corners: Vec<usize>,
}

impl Mesh {
    /// A ball of flat faces.
    fn ball(sides: usize, rings: usize) -> Mesh {
        let mut ball = Mesh::default();
        for ring in 0..=rings {
            let (sine, cosine) = libm::sincos(std::f64::consts::PI * ring as f64 / rings as f64);
            for side in 0..sides {
                let (z, x) = libm::sincos(std::f64::consts::TAU * side as f64 / sides as f64);
                ball.points.push([sine * x, cosine, sine * z]);
            }
        }
        for ring in 0..rings {
            for side in 0..sides {
                let (one, other) = (ring * sides + side, ring * sides + (side + 1) % sides);
                if ring > 0 {
                    ball.corners.extend([one, other, one + sides]);
                }
                if ring + 1 < rings {
                    ball.corners.extend([other, other + sides, one + sides]);
                }
            }
        }
        ball
    }

    fn map(&self, map: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
        let points = self.points.iter().map(|point| map(*point)).collect();
        Mesh { points, corners: self.corners.clone() }
    }

    fn text(&self) -> String {
        let mut text = "Shape \"trianglemesh\" \"point3 P\" [".to_owned();
        for [x, y, z] in &self.points {
            let _ = write!(text, "{x} {y} {z} ");
        }
        text += "] \"integer indices\" [";
        for corner in &self.corners {
            let _ = write!(text, "{corner} ");
        }
        text + "]\n"
    }
}

/// A direction that is aligned with no axis.
const ASKEW: [f64; 3] = [0.577, -0.642, 0.505];

fn placed([x, y, z]: [f64; 3], scale: f64, shape: &str) -> String {
    format!("Translate {x} {y} {z} Scale {scale} {scale} {scale} Rotate 37 0.3 1 0.2\n{shape}\n")
}

fn at(place: [f64; 3], scale: f64) -> impl Fn([f64; 3]) -> [f64; 3] {
    move |point| std::array::from_fn(|axis| place[axis] + scale * point[axis])
}

/// A square that leans towards the camera.
fn square([x, y, z]: [f64; 3], scale: f64) -> [[f64; 3]; 3] {
    let corner = [x - 0.5 * scale, y - 0.3 * scale, z - 0.2 * scale];
    [corner, [scale, 0.3 * scale, -0.2 * scale], [-0.1 * scale, 0.9 * scale, 0.4 * scale]]
}

fn row([x, y, z]: [f64; 3]) -> String {
    format!("[{x} {y} {z}]")
}

/// Convex shapes of about size 1, by functions that return their text at a point and a scale.
const SHAPES: &[fn([f64; 3], f64) -> String] = &[
    |place, scale| placed(place, scale, "Shape \"Sphere\""),
    |place, scale| {
        format!("Shape \"Sphere\" \"point3 center\" {} \"float radius\" {scale}\n", row(place))
    },
    |place, scale| placed(place, scale, "Scale 1 0.02 0.4 Rotate 20 1 0.2 0.4\nShape \"Sphere\""),
    |place, scale| {
        let instance = placed(place, 0.5 * scale, "ObjectInstance \"ball\"");
        format!("ObjectBegin \"ball\" Scale 2 1 2 Shape \"Sphere\" ObjectEnd\n{instance}")
    },
    |place, scale| placed(place, scale, "Rotate 70 1 0.3 0\nShape \"Disk\""),
    |place, scale| {
        let [corner, u, v] = square(place, scale).map(row);
        format!(
            "Shape \"Parallelogram\" \"point3 corner\" {corner} \"vector3 sideU\" {u} \"vector3 sideV\" {v}\n"
        )
    },
    |place, scale| {
        let [corner, u, v] = square(place, scale).map(row);
        format!(
            "Shape \"Facet\" \"point3 corner\" {corner} \"vector3 along\" {u} \"vector3 across\" {v}\n"
        )
    },
    |place, scale| {
        let [corner, u, v] = square(place, scale);
        let [b, c] = [u, v].map(|side| row(std::array::from_fn(|axis| corner[axis] + side[axis])));
        format!(
            "Shape \"Triangle\" \"point3 a\" {} \"point3 b\" {b} \"point3 c\" {c}\n",
            row(corner)
        )
    },
    |place, scale| Mesh::ball(12, 8).map(at(place, scale)).text(),
    |place, scale| placed(place, scale, &Mesh::ball(40, 30).text()),
    |place, scale| placed(place, scale, &Mesh::ball(300, 3).text()),
];

/// Convex shapes that put their hits back on the surface.
const ROUND_SHAPES: &[fn([f64; 3], f64) -> String] = &[
    |place, scale| placed(place, scale, "Shape \"PartialSphere\" \"float radius\" 0.9"),
    |place, scale| {
        let cone = "Shape \"Cone\" \"float radius\" 0.8 \"float yMin\" -0.6 \"float yMax\" 0.9";
        placed(place, scale, cone)
    },
    |place, scale| {
        let cone = "Rotate 90 1 0 0 Shape \"Cone\" \"float radius\" 0.8 \"float topRadius\" 0.7
            \"float yMin\" -0.7 \"float yMax\" 0.7";
        placed(place, scale, cone)
    },
    |place, scale| placed(place, scale, "Rotate 70 1 0.3 0 Shape \"RoundCone\""),
    |place, scale| {
        let [from, to] = [[0.4, 0.3, -0.2], [-0.5, -0.2, 0.3]];
        let [from, to] = [from, to].map(|point| row(at(place, scale)(point)));
        format!(
            "Shape \"RoundCone\" \"point3 start\" {from} \"point3 end\" {to} \"float startRadius\" {}
            \"float endRadius\" {}\n",
            0.3 * scale,
            0.5 * scale
        )
    },
    |place, scale| {
        let block = "Rotate 50 1 0.3 0 Shape \"Superquadric\" \"vector3 radii\" [0.9 0.5 0.7]
            \"float profile\" 0.4 \"float section\" 0.7";
        placed(place, scale, block)
    },
    |place, scale| {
        let union = "Shape \"SdfUnion\" \"point3 centers\" [0 0 0] \"float radii\" [0.8]";
        placed(place, scale, union)
    },
    |place, scale| placed(place, scale, "Rotate 50 1 0.3 0 Shape \"Egg\""),
];

/// Columns of pixels for each shape of a row.
const COLUMNS: usize = 22;

/// A row of shapes, apart from each other, as the camera sees it from aside.
fn scene_of_row(
    shapes: &[fn([f64; 3], f64) -> String],
    place: [f64; 3],
    scale: f64,
    material: &str,
    integrator: &str,
) -> String {
    const WAY: [f64; 3] = [0.4, 0.7, -0.6];
    const ALONG: [f64; 3] = [0.9, -0.17, 0.401];
    let eye = at(place, 30.0 * scale)(WAY);
    let mut text = format!(
        "LookAt {} {} {}  {} {} {}  0.1 1 0.2
        Camera \"Pinhole\" \"float fov\" 3.917
        Film \"rgb\" \"integer xresolution\" {} \"integer yresolution\" 10
        Sampler \"independent\" \"integer pixelsamples\" 4\n{integrator}\nWorldBegin
        Material {material} \"float near\" {}\n",
        eye[0],
        eye[1],
        eye[2],
        place[0],
        place[1],
        place[2],
        COLUMNS * shapes.len(),
        2.2 * scale,
    );
    for (index, shape) in shapes.iter().enumerate() {
        let aside = 4.536 * (index as f64 - 0.5 * (shapes.len() - 1) as f64);
        let place = at(place, scale * aside)(ALONG);
        let _ = writeln!(text, "AttributeBegin {} AttributeEnd", shape(place, scale));
    }
    text
}

/// Checks rows of shapes of many scales, in many places. Pixels are 0 where nothing is seen, and above 100 where a ray
/// meets what it left.
fn check_everywhere(
    renderer: &str,
    shapes: &[fn([f64; 3], f64) -> String],
    material: &str,
    integrator: &str,
) {
    let mut wrong = String::new();
    for (scale, away) in [
        (1e-4, 0.0),
        (1e-4, 3.0),
        (1e-2, 1e3),
        (1.0, 0.0),
        (1.0, 30.0),
        (3.0, 1e5),
        (3e2, 1e5),
        (1e6, 1e5),
    ] {
        let place = ASKEW.map(|axis| axis * away);
        let scene = scene_of_row(shapes, place, scale, material, integrator);
        let pixels = render(&scene, renderer);
        for shape in 0..shapes.len() {
            let rows = pixels.chunks(COLUMNS * shapes.len());
            let of_shape = || rows.clone().flat_map(|row| &row[COLUMNS * shape..][..COLUMNS]);
            let seen = of_shape().filter(|pixel| pixel[0] > 0.0).count();
            let met = of_shape().filter(|pixel| pixel[0] > 100.0).count();
            let most = of_shape().fold(0.0, |most: f32, pixel| most.max(pixel[0]));
            // Where the rounding of coordinates is a few percent of the shape, one pixel in forty may be wrong.
            let allowed = if scale <= 5e-5 * away { seen / 40 } else { 0 };
            if met > allowed || seen < 2 {
                let _ = writeln!(
                    wrong,
                    "shape {shape}, scale {scale}, {away} away: {met} of {seen}, {most}"
                );
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn no_ray_of_shade_meets_the_convex_shape_that_it_leaves() {
    let integrator = "Integrator \"interactive\" \"integer maxdepth\" 1";
    check_everywhere(INTERACTIVE, SHAPES, "\"Probe\"", integrator);
    check_everywhere(INTERACTIVE, ROUND_SHAPES, "\"Probe\"", integrator);
}

#[test]
fn no_path_meets_the_convex_shape_that_it_leaves() {
    let integrator = "Integrator \"path\" \"integer maxdepth\" 1 \"float rrthreshold\" 0";
    check_everywhere(BATCH, SHAPES, "\"Close\"", integrator);
    check_everywhere(BATCH, ROUND_SHAPES, "\"Close\"", integrator);
}

/// A ground so large that its vertices are far from the origin, though its coordinates in view are small.
#[test]
fn rays_leave_a_ground_that_reaches_far() {
    let view = "LookAt 0 2 -6  0 0 0  0 1 0\nCamera \"Pinhole\" \"float fov\" 40
        Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 24
        Sampler \"independent\" \"integer pixelsamples\" 1
        Integrator \"interactive\" \"integer maxdepth\" 1\nWorldBegin\nMaterial \"Probe\"\n";
    let leaning = Mesh {
        points: vec![
            [-900.0, -300.0, -1500.0],
            [1200.0, 300.0, -1500.0],
            [900.0, 300.0, 1500.0],
            [-1200.0, -300.0, 1500.0],
        ],
        corners: vec![0, 1, 2, 0, 2, 3],
    };
    let grounds = [
        "Shape \"Sphere\" \"point3 center\" [0 -1000 0] \"float radius\" 1000\n".to_owned(),
        "Translate 0 -1000 0 Scale 1000 1000 1000 Shape \"Sphere\"\n".to_owned(),
        leaning.text(),
    ];
    for ground in grounds {
        let pixels = render(&format!("{view}{ground}"), INTERACTIVE);
        assert!(pixels.iter().filter(|pixel| pixel[0] > 0.5).count() > 200, "{ground}");
        assert!(pixels.iter().all(|pixel| pixel[0] <= 1.0), "{ground}");
    }
}

/// A lamp in a closed ball of faces, small and far from the origin, beside a fine mesh: nothing of it is seen.
#[test]
fn no_light_leaves_a_closed_housing() {
    let place = [30.0, 2.0, 30.0];
    let housing = Mesh::ball(32, 16).map(at(place, 0.25));
    let fine = Mesh::ball(100, 101).map(at([36.0, 0.0, 36.0], 0.5));
    assert_eq!(fine.corners.len() / 3, 20_000);
    let scene = format!(
        "LookAt 54 10 6  30 2 30  0 1 0
        Camera \"Pinhole\" \"float fov\" 1
        Film \"rgb\" \"integer xresolution\" 48 \"integer yresolution\" 48
        Sampler \"independent\" \"integer pixelsamples\" 8\nWorldBegin
        AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [10000 10000 10000]
        Material \"diffuse\" \"rgb reflectance\" [0 0 0]
        Translate 30 2 30 Shape \"Sphere\" \"float radius\" 0.1 AttributeEnd
        Material \"diffuse\" \"rgb reflectance\" [0.7 0.7 0.7]\n{}{}",
        housing.text(),
        fine.text(),
    );
    let pixels = render(&scene, BATCH);
    let lit = pixels.iter().filter(|pixel| **pixel != [0.0; 3]).count();
    // A camera ray may slip between two faces.
    assert!(lit <= 2, "{lit} of {} pixels", pixels.len());
}

/// An occluder close to a light casts a shadow far away.
#[test]
fn a_shade_close_to_a_lamp_keeps_its_light() {
    for renderer in RENDERERS {
        let scene = "LookAt 0 3 0  0 0 0  0 0 1\nCamera \"Pinhole\" \"float fov\" 30
            Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16
            Sampler \"independent\" \"integer pixelsamples\" 16\nWorldBegin
            AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [100 100 100]
            Translate 0 100 0 ReverseOrientation Shape \"Disk\" \"float radius\" 5 AttributeEnd
            Material \"diffuse\" \"rgb reflectance\" [0.7 0.7 0.7]
            AttributeBegin Translate 0 99.98 0 Shape \"Disk\" \"float radius\" 6 AttributeEnd
            Shape \"Disk\" \"float radius\" 5";
        let lit = render(scene, renderer).iter().filter(|pixel| **pixel != [0.0; 3]).count();
        assert_eq!(lit, 0, "{renderer:?}");
    }
}

/// The sun is low behind a kerb: the shadow begins at the kerb and ends where the sun's angle requires.
#[test]
fn contact_shadows_begin_at_the_contact() {
    let scene = |from: f64, to: f64| {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        format!(
            "LookAt {middle} 5 0  {middle} 0 0  0 0 1\nCamera \"Orthographic\" \"float scale\" {half}
            Film \"rgb\" \"integer xresolution\" 32 \"integer yresolution\" 32
            Sampler \"stratified\" \"integer xsamples\" 1 \"integer ysamples\" 1 \"bool jitter\" false
            WorldBegin\nLightSource \"DirectionalLight\" \"vector3 direction\" [1 -0.01 0]
            Material \"diffuse\" \"rgb reflectance\" [0.7 0.7 0.7]
            Shape \"bilinearmesh\" \"point3 P\" [-9 0 -9  9 0 -9  -9 0 9  9 0 9]
            Shape \"bilinearmesh\" \"point3 P\" [0 0 -9  0 0.02 -9  0 0 9  0 0.02 9]"
        )
    };
    for renderer in RENDERERS {
        let lit = |from, to| {
            let pixels = render(&scene(from, to), renderer);
            pixels.iter().filter(|pixel| **pixel != [0.0; 3]).count()
        };
        assert_eq!(lit(0.0, 1e-3), 0, "{renderer:?}");
        assert_eq!(lit(1.0, 1.99), 0, "{renderer:?}");
        assert_eq!(lit(2.01, 3.0), 32 * 32, "{renderer:?}");
    }
}
