//! Scratch belongs to the ray: later methods of an object read the scratch of the call of `intersect` that accepted the
//! hit. Random programs that offer several hits check this with all renderers.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use rtsl::{Backend, EngineOptions};
use rtsl_render::request::render_scene_from;
use rtsl_render::{Execution, LoadOptions, RenderRequest};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{BATCH, INTERACTIVE};

/// A statement of `intersect`. Parameters of hits are those of a plane, plus `after`.
#[derive(Clone, Copy, Debug)]
enum Statement {
    /// Offers a hit and adds to scratch if it is accepted.
    Count { after: f32, adds: f32 },
    /// The same, and stores the hit's parameter.
    Note { after: f32, adds: f32 },
    /// Offers hits, each before the previous one.
    Nearer { after: f32, times: u8, adds: f32 },
    /// Offers one of two hits, depending on scratch.
    Either { above: f32, after: [f32; 2], adds: f32 },
    /// Offers a hit and sets scratch conditionally.
    Sometimes { after: f32, adds: f32 },
    /// Offers a hit and ignores the result.
    Offer { after: f32 },
    /// Adds to scratch, hit or not; a replacement for random numbers.
    Add { adds: f32 },
}

/// The state of a ray while `intersect` runs.
#[derive(Clone, Copy, Debug)]
struct Ray {
    plane: f32,
    limit: f32,
    is_accepted: bool,
    count: f32,
    noted: f32,
}

impl Ray {
    fn hit(&mut self, after: f32) -> bool {
        let parameter = self.plane + after;
        let accepted = parameter > 0.01 && parameter < self.limit;
        if accepted {
            (self.limit, self.is_accepted) = (parameter, true);
        }
        accepted
    }
}

impl Statement {
    fn text(self) -> String {
        match self {
            Statement::Count { after, adds } => format!("if (hit(t + {after:?})) n += {adds:?};"),
            Statement::Note { after, adds } => {
                format!("if (hit(t + {after:?})) {{ n = 2.0 * n + {adds:?}; m = rt_HitDistance; }}")
            }
            Statement::Nearer { after, times, adds } => format!(
                "for (int i = 0; i < {times}; i++) if (hit(t + {after:?} - 0.5 * float(i))) n += {adds:?};"
            ),
            Statement::Either { above, after: [one, other], adds } => format!(
                "if (n > {above:?}) {{ if (hit(t + {one:?})) m += {adds:?}; }}
                else if (hit(t + {other:?})) n += {adds:?};"
            ),
            Statement::Sometimes { after, adds } => {
                format!("if (hit(t + {after:?}) && n > 2.0) m = {adds:?};")
            }
            Statement::Offer { after } => format!("hit(t + {after:?});"),
            Statement::Add { adds } => format!("n += {adds:?} + rand();"),
        }
    }

    fn run(self, ray: &mut Ray) {
        match self {
            Statement::Count { after, adds } => {
                if ray.hit(after) {
                    ray.count += adds;
                }
            }
            Statement::Note { after, adds } => {
                if ray.hit(after) {
                    ray.count = 2.0 * ray.count + adds;
                    ray.noted = ray.limit;
                }
            }
            Statement::Nearer { after, times, adds } => {
                for time in 0..times {
                    if ray.hit(after - 0.5 * f32::from(time)) {
                        ray.count += adds;
                    }
                }
            }
            Statement::Either { above, after: [one, other], adds } => {
                if ray.count > above {
                    if ray.hit(one) {
                        ray.noted += adds;
                    }
                } else if ray.hit(other) {
                    ray.count += adds;
                }
            }
            Statement::Sometimes { after, adds } => {
                if ray.hit(after) && ray.count > 2.0 {
                    ray.noted = adds;
                }
            }
            Statement::Offer { after } => {
                ray.hit(after);
            }
            Statement::Add { adds } => ray.count += adds,
        }
    }
}

fn statement() -> impl Strategy<Value = Statement> {
    // Some parameters lie behind the rays' origins.
    let after = || (-14..14_i8).prop_map(|halves| 0.5 * f32::from(halves));
    let adds = || (1..5_u8).prop_map(f32::from);
    prop_oneof![
        (after(), adds()).prop_map(|(after, adds)| Statement::Count { after, adds }),
        (after(), adds()).prop_map(|(after, adds)| Statement::Note { after, adds }),
        (after(), 2..5_u8, adds()).prop_map(|(after, times, adds)| Statement::Nearer {
            after,
            times,
            adds
        }),
        (adds(), [after(), after()], adds()).prop_map(|(above, after, adds)| Statement::Either {
            above,
            after,
            adds
        }),
        (after(), adds()).prop_map(|(after, adds)| Statement::Sometimes { after, adds }),
        after().prop_map(|after| Statement::Offer { after }),
        adds().prop_map(|adds| Statement::Add { adds }),
    ]
}

/// The positions of the shape: the parameters at which the rays meet its plane.
const PLACES: [(f32, &str, &str); 3] = [
    (5.0, "", ""),
    (6.0, "Translate 0 0 1", ""),
    (7.0, "ObjectBegin \"placed\"", "ObjectEnd Translate 0 0 2 ObjectInstance \"placed\""),
];

/// The colour of a shape with these statements at a position; black if it is not hit.
fn expected(statements: &[Statement], place: usize) -> [f32; 3] {
    let plane = PLACES[place].0;
    let mut ray = Ray { plane, limit: f32::INFINITY, is_accepted: false, count: 0.0, noted: 0.0 };
    statements.iter().for_each(|statement| statement.run(&mut ray));
    match ray.is_accepted {
        true => [ray.count * 0.125, ray.noted * 0.125, 1.0],
        false => [0.0; 3],
    }
}

/// The pixels of an image of this shape, left to right; the left half shows another shape in front of it, with separate
/// scratch.
fn picture(
    statements: &[Statement],
    place: usize,
    renderer: &str,
    engine: EngineOptions,
) -> Vec<[f32; 3]> {
    let mut shaders = "class Offers : rt_Primitive, rt_Material;
        scratch float n;
        scratch float m;
        void intersect() {
            float t = -rt_RayOrigin.z / rt_RayDirection.z;
        "
    .to_owned();
    for statement in statements {
        writeln!(shaders, "{}", statement.text()).expect("text takes text");
    }
    shaders += "}
        void computeNormal() { rt_GeometricNormal = vec3(0.0, 0.0, -1.0); }
        void emission() { rt_EmissionColor = color(0.125 * n, 0.125 * m, 1.0); }";
    let front = "class Front : rt_Primitive, rt_Material;
        scratch vec3 left;
        void intersect() {
            float t = (-4.5 - rt_RayOrigin.z) / rt_RayDirection.z;
            if (rt_RayOrigin.x < 0.0 && hit(t)) left = vec3(100.0, 200.0, 300.0);
        }
        void computeNormal() { rt_GeometricNormal = vec3(0.0, 0.0, -1.0); }
        void emission() { rt_EmissionColor = color(left.x, left.y, left.z); }";
    let (_, before, behind) = PLACES[place];
    let scene = format!(
        "LookAt 0 0 -5  0 0 0  0 1 0
        Camera \"Orthographic\"
        PixelFilter \"box\"
        Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 8
        Sampler \"independent\" \"integer pixelsamples\" 2
        WorldBegin
        Shape \"Front\"
        {before} Shape \"Offers\" {behind}"
    );
    let files = [("scene.pbrt", &*scene), ("offers.rtsl", &*shaders), ("front.rtsl", front)];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let request = RenderRequest {
        scene: Path::new("scene.pbrt").to_owned(),
        load: LoadOptions::with_integrator(renderer),
        execution: Execution::on_threads(1),
        engine,
        ..RenderRequest::default()
    };
    let result = render_scene_from(&request, &MemoryFiles(files.into()));
    let result = result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    result.image.pixels[..16].to_vec()
}

fn check(statements: &[Statement], place: usize, engine: &EngineOptions) {
    let right = expected(statements, place);
    for renderer in [INTERACTIVE, BATCH] {
        let pixels = picture(statements, place, renderer, engine.clone());
        // The order of the two shapes is not tested here.
        let shown = &pixels[8..];
        let all = shown.iter().all(|pixel| *pixel == right);
        assert!(all, "{}, {statements:?}, place {place}: {right:?}, {shown:?}", renderer);
    }
}

#[test]
fn a_hit_that_was_offered_second_counts_both() {
    let statements =
        [Statement::Count { after: 1.0, adds: 1.0 }, Statement::Count { after: 0.0, adds: 1.0 }];
    check(&statements, 0, &EngineOptions::default());
    assert_eq!(expected(&statements, 0), [0.25, 0.0, 1.0]);
}

#[test]
fn scratch_that_nothing_sets_is_zero() {
    let statements = [Statement::Sometimes { after: 0.0, adds: 3.0 }];
    check(&statements, 0, &EngineOptions::default());
    assert_eq!(expected(&statements, 0), [0.0, 0.0, 1.0]);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn later_methods_read_what_the_accepted_call_left(
        statements in prop::collection::vec(statement(), 1..6), place in 0..PLACES.len(),
    ) {
        let engine = EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() };
        check(&statements, place, &engine);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4, ..ProptestConfig::default() })]

    #[test]
    fn so_does_machine_code(
        statements in prop::collection::vec(statement(), 3..6), place in 0..PLACES.len(),
    ) {
        check(&statements, place, &EngineOptions::default());
    }
}
