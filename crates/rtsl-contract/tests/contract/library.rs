//! Every class of the standard library keeps its contracts: with its defaults, over the ranges of its
//! parameters, and as the table says.

use std::sync::{Arc, Mutex};

use rtsl::{Class, Compiler, Engine, Instance, Numbers, Role, Scalar, Value, library};
use rtsl_contract::{Contract, Options, check, engine_options, settings};

use crate::common::seeds::seeds;
use crate::outside_ranges;

/// The classes of a role.
fn classes(role: Role) -> Vec<Arc<Class>> {
    let compiler = Compiler::default();
    let units = library::files().iter().filter_map(|it| compiler.compile(it.path, it.text).unit);
    let classes = units.flat_map(|unit| unit.classes().to_vec());
    classes.filter(|class| class.roles.contains(&role)).collect()
}

/// Contracts that a model cannot keep.
fn exceptions(class: &str) -> &'static [Contract] {
    match class {
        // A curve faces each ray, so that rays have no surface in common.
        "Curve" => &[Contract::Points, Contract::Within, Contract::Normals, Contract::Derivatives],
        // The place across a strand belongs to the viewer alone.
        "Hair" => &[Contract::Reciprocity],
        // Neither are measurements the same both ways, nor made-up tables.
        "Measured" => &[Contract::Reciprocity, Contract::Energy],
        // Steps of light belong to its direction, not to the viewer's.
        "Toon" => &[Contract::Reciprocity],
        _ => &[],
    }
}

/// The broken contracts of a class, as text.
fn broken(engine: &Engine, name: &str, instance: &Arc<Instance>, options: &Options) -> String {
    let report = check(engine, instance, options);
    let report = report.unwrap_or_else(|problem| panic!("{name}: {}", problem.message));
    if std::env::var_os("RTSL_SHOW_REPORTS").is_some() {
        eprintln!("{name}\n{report}");
    }
    let exceptions = exceptions(&instance.class().name);
    let holds = report.broken().all(|(contract, _)| exceptions.contains(&contract));
    if holds { String::new() } else { format!("{name}\n{report}\n") }
}

/// Checks the classes of a role, on two threads: one would still check materials when all other tests have ended.
fn check_role(role: Role, options: &Options) {
    let (engine, _) = Engine::new(engine_options()).expect("an engine");
    let classes = Mutex::new(classes(role).into_iter());
    let next = || classes.lock().expect("no thread panics while it takes a class").next();
    let check = || {
        let checked = std::iter::from_fn(next).map(|it| broken_of_class(&engine, &it, options));
        checked.collect::<String>()
    };
    let all = std::thread::scope(|scope| {
        let other = scope.spawn(check);
        let own = check();
        own + &other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    });
    assert!(all.is_empty(), "{all}");
}

/// The broken contracts of a class, with each of its settings and each row of the table.
fn broken_of_class(engine: &Engine, class: &Arc<Class>, options: &Options) -> String {
    let mut all = String::new();
    let mut program = None;
    for setting in settings(class, &[]) {
        for (index, given) in table(&class.name).into_iter().enumerate() {
            let name = format!("{} with {setting}, row {index} of the table", class.name);
            let instance = match setting.instance(class, &given) {
                Ok(instance) => instance,
                // Without defaults only the table can say what it may be.
                Err(_) if given.is_empty() => continue,
                Err(problems) => panic!("{name}: {:?}", problems.into_vec()),
            };
            // Kernels are kept while somebody has the program.
            program.get_or_insert_with(|| engine.program(&instance));
            for seed in seeds() {
                let name = format!("{name}, seed {seed}");
                all += &broken(engine, &name, &instance, &Options { seed, ..*options });
            }
        }
    }
    all + &outside_ranges::problems(engine, class)
}

/// Values that annotations do not give, and those without a default, by class: a row for each instance.
pub fn table(class: &str) -> Vec<Vec<(String, Value)>> {
    let floats = |numbers: &[f32]| Value::Numbers(Numbers::floats(numbers.iter().copied()));
    let ints = |numbers: &[i32]| Value::Numbers(Numbers::ints(numbers.iter().copied()));
    let corners = [-0.5, 0.0, 0.2, 1.3, 0.2, -0.1, -0.4, 1.1, 0.5, 1.9, 1.4, 0.9];
    let parallelogram = [-0.5, 0.0, 0.2, 1.3, 0.2, -0.1, -0.4, 1.1, 0.5, 1.4, 1.3, 0.2];
    let leaning = [0.1, 0.2, 0.9, -0.2, 0.1, 0.9, 0.0, -0.2, 0.9, 0.1, 0.1, 0.9];
    let uvs = [0.1, 0.2, 0.9, 0.3, 0.2, 0.7, 0.8, 0.9];
    let mesh = |positions: &[f32], normals: &[f32], uvs: &[f32], indices: &[i32]| {
        vec![
            ("positions", floats(positions)),
            ("normals", floats(normals)),
            ("uvs", floats(uvs)),
            ("indices", ints(indices)),
        ]
    };
    let constant = |value: f32| of_library("Constant", vec![("value", value.into())]);
    let rows = match class {
        "TriangleMesh" => {
            vec![mesh(&corners, &[], &uvs, &[0, 1, 2]), mesh(&corners, &leaning, &[], &[1, 0, 3])]
        }
        "GltfMesh" => {
            let none = || floats(&[]);
            let rich = |normals: &[f32], more: [Value; 3]| {
                let [tangents, uvs1, colors] = more;
                let more = [("tangents", tangents), ("uvs1", uvs1), ("colors", colors)];
                mesh(&corners, normals, &uvs, &[0, 1, 2]).into_iter().chain(more).collect()
            };
            // Along the first coordinate.
            let tangents = [0.89, -0.01, -0.18, 1.0].repeat(4);
            let colors = [0.5; 16];
            vec![
                rich(&leaning, [floats(&tangents), none(), floats(&colors)]),
                rich(&[], [none(), floats(&uvs), floats(&colors)]),
                rich(&[], [none(), none(), none()]),
            ]
        }
        "BilinearMesh" => vec![
            mesh(&corners, &[], &[], &[0, 1, 2, 3]),
            mesh(&parallelogram, &leaning, &uvs, &[0, 1, 2, 3]),
        ],
        "Sphere" => vec![
            vec![],
            vec![("center", [0.5, -1.0, 2.0].into()), ("radius", 1.5.into())],
            vec![("center", [300.0, 20.0, -50.0].into()), ("radius", 0.7.into())],
        ],
        "Parallelogram" => vec![
            vec![],
            vec![
                ("corner", [-0.5, 0.0, 0.2].into()),
                ("sideU", [1.8, 0.2, -0.3].into()),
                ("sideV", [0.1, 1.1, 0.3].into()),
                ("uv", [0.1, 0.7].into()),
                ("uvAlongU", [0.5, 0.4].into()),
                ("uvAlongV", [-0.2, 1.5].into()),
            ],
        ],
        "Disk" => vec![
            vec![],
            vec![("radius", 1.3.into()), ("innerRadius", 0.6.into()), ("height", 0.4.into())],
        ],
        "Cylinder" => {
            vec![vec![("radius", 0.8.into()), ("yMin", (-0.7).into()), ("yMax", 1.1.into())]]
        }
        "PartialSphere" => vec![
            vec![("radius", 1.3.into()), ("yMin", (-0.4).into()), ("yMax", 1.1.into())],
            vec![("sweep", 200.0.into()), ("yMax", 0.3.into())],
        ],
        "PartialDisk" => vec![
            vec![],
            vec![("radius", 1.3.into()), ("innerRadius", 0.6.into()), ("height", 0.4.into())],
        ],
        "PartialCylinder" => {
            vec![vec![("radius", 0.8.into()), ("yMin", (-0.7).into()), ("sweep", 300.0.into())]]
        }
        "Curve" => {
            let points = [0.0, 0.0, 0.0, 0.4, 1.0, 0.3, 0.9, 0.2, -0.2, 1.4, 1.0, 0.5];
            let curve = |normals: &[f32], piece: i32| {
                vec![
                    ("points", floats(&points)),
                    ("widths", floats(&[0.2, 0.1])),
                    ("normals", floats(normals)),
                    ("pieces", ints(&[0, 1, 2, 3])),
                    ("piece", piece.into()),
                    ("splits", 2.into()),
                ]
            };
            let mut round = curve(&[], 3);
            round.push(("round", true.into()));
            vec![curve(&[], 1), round, curve(&[0.0, 0.1, 1.0, 0.8, 0.0, 0.6], 2)]
        }
        "ImageTiles" => vec![vec![
            ("images", Value::List(vec![constant(0.3), constant(0.7)])),
            ("numbers", ints(&[1001, 1012])),
        ]],
        "Hair" => vec![vec![], vec![("reflectance", constant(0.7)), ("betaN", 0.6.into())]],
        "Torus" => vec![vec![], vec![("majorRadius", 1.1.into()), ("minorRadius", 0.5.into())]],
        "Cone" => vec![
            vec![],
            vec![("radius", 0.4.into()), ("topRadius", 1.3.into()), ("yMin", (-0.7).into())],
            vec![("radius", 0.8.into()), ("topRadius", 0.8.into())],
        ],
        "Box" => vec![
            vec![],
            vec![("corner", [0.5, -1.0, 2.0].into()), ("opposite", [0.2, 1.5, 2.3].into())],
            // Much of its narrow faces is near an edge.
            vec![("corner", [-8.0, -0.1, 3.0].into()), ("opposite", [8.0, 6.0, 3.1].into())],
        ],
        "RoundCone" => vec![
            vec![],
            vec![("start", [1.0, 2.0, 0.5].into()), ("endRadius", 0.5.into())],
            // One ball contains the other.
            vec![("end", [0.3, -0.5, 0.2].into()), ("endRadius", 1.2.into())],
        ],
        "Superquadric" => vec![vec![], vec![("radii", [0.9, 1.3, 1.1].into())]],
        "HeightField" => vec![
            vec![("heights", floats(&[0.3, 0.7, 0.2, 0.5])), ("scale", (-1.5).into())],
            vec![
                ("heights", floats(&[0.3, 0.7, 0.2, 0.5, 0.9, 0.1, 0.4, 0.4, 0.6, 0.8, 0.2, 0.5])),
                ("size", [4, 3].into()),
                ("opposite", [2.0, 1.5].into()),
            ],
        ],
        "SdfUnion" => {
            let elements = |blend: f32| {
                vec![
                    ("centers", floats(&[0.0, 0.0, 0.0, 0.9, 0.2, 0.1])),
                    ("radii", floats(&[0.5, 0.4])),
                    ("corners", floats(&[-1.0, -0.6, -0.5, -0.2, -0.2, 0.5])),
                    ("edges", floats(&[0.05])),
                    ("ends", floats(&[-0.5, 0.8, 0.0, 0.5, 0.5, 0.4])),
                    ("endRadii", floats(&[0.1, 0.25])),
                    ("blend", blend.into()),
                ]
            };
            vec![elements(0.0), elements(0.05), elements(0.4)]
        }
        "Plane" => vec![
            vec![],
            vec![("point", [0.3, 0.2, -0.5].into()), ("normal", [0.5, 2.0, -0.7].into())],
        ],
        "Triangle" => vec![
            vec![],
            vec![
                ("a", [-0.5, 0.0, 0.2].into()),
                ("b", [1.5, 0.2, -0.1].into()),
                ("c", [0.1, 1.1, 0.4].into()),
                ("uvC", [0.3, 0.8].into()),
                ("normalA", [0.1, 0.0, 1.0].into()),
                ("normalB", [0.0, 0.2, 1.0].into()),
                ("normalC", [-0.1, 0.0, 0.9].into()),
            ],
        ],
        "Lambertian" => vec![vec![], vec![("kd", constant(1.0))]],
        "Phong" => vec![
            vec![],
            vec![("kd", constant(0.0)), ("ks", constant(1.0)), ("exponent", 8.0.into())],
            vec![("kd", constant(0.5)), ("ks", constant(0.5)), ("exponent", 2000.0.into())],
        ],
        "Ward" => vec![vec![], vec![("kd", constant(0.3)), ("ks", constant(0.7))]],
        "Conductor" => vec![
            vec![],
            vec![
                ("reflectance", constant(1.0)),
                ("roughnessU", 0.1.into()),
                ("roughnessV", 0.3.into()),
            ],
        ],
        "Dielectric" => vec![vec![], vec![("roughnessU", 0.2.into()), ("roughnessV", 0.6.into())]],
        "CoatedDiffuse" => vec![
            vec![],
            vec![
                ("thickness", 0.8.into()),
                ("albedo", [0.9, 0.5, 0.2].into()),
                ("g", 0.6.into()),
                ("maxDepth", 10.into()),
            ],
            vec![("roughnessU", 0.3.into()), ("albedo", 1.0.into()), ("thickness", 0.1.into())],
        ],
        "CoatedConductor" => vec![
            vec![],
            vec![("roughnessU", 0.1.into()), ("coatRoughnessV", 0.3.into())],
            vec![("thickness", 0.8.into()), ("albedo", [0.9, 0.5, 0.2].into()), ("g", 0.6.into())],
        ],
        "Measured" => vec![measured(1), measured(5)],
        "Subsurface" => {
            let albedos = || ("albedos", floats(&[0.0, 0.3, 0.5, 0.8, 0.97]));
            let white = vec![albedos(), ("reflectance", constant(1.0)), ("roughness", 0.1.into())];
            vec![vec![albedos()], white]
        }
        "AshikhminShirley" => vec![
            vec![],
            vec![
                ("kd", constant(1.0)),
                ("ks", constant(0.2)),
                ("exponentU", 10.0.into()),
                ("exponentV", 200.0.into()),
            ],
        ],
        "DiffuseTransmission" => {
            vec![vec![], vec![("reflectance", constant(0.7)), ("transmittance", constant(0.3))]]
        }
        "Mix" => vec![
            vec![],
            vec![
                ("first", of_library("Mirror", vec![])),
                ("second", of_library("Phong", vec![])),
                ("amount", constant(0.3)),
            ],
        ],
        "OpenPbr" => vec![
            vec![],
            vec![
                ("baseColor", [1.0, 1.0, 1.0].into()),
                ("specularWeight", 0.7.into()),
                ("coatColor", [0.9, 0.6, 0.3].into()),
                ("thinFilmThickness", 0.35.into()),
            ],
        ],
        "StandardSurface" => vec![
            vec![],
            vec![
                ("opacity", [0.3, 0.9, 1.0].into()),
                ("specularColor", [0.2, 0.8, 1.0].into()),
                ("thinFilmThickness", 300.0.into()),
            ],
        ],
        "Velvet" => {
            vec![vec![], vec![("pile", [1.0, 0.2, 0.5].into()), ("ground", [1.0, 1.0, 1.0].into())]]
        }
        "Cloth" => vec![vec![], vec![("weave", 2.into()), ("shine", 0.8.into())]],
        "Toon" => vec![
            vec![],
            vec![("kd", [1.0, 1.0, 1.0].into()), ("highlight", [0.5, 0.5, 0.5].into())],
        ],
        "ImageSky" => vec![vec![
            ("texels", floats(&(0..36).map(|it| (it * 7 % 5) as f32).collect::<Vec<_>>())),
            ("size", [4, 3].into()),
            ("rows", floats(&[0.0, 0.2, 0.7, 1.0])),
            (
                "columns",
                floats(
                    &[
                        [0.0, 0.1, 0.4, 0.8, 1.0],
                        [0.0, 0.3, 0.3, 0.9, 1.0],
                        [0.0, 0.25, 0.5, 0.75, 1.0],
                    ]
                    .concat(),
                ),
            ),
        ]],
        "PortalSky" => vec![
            vec![],
            vec![
                ("texels", floats(&(0..192).map(|it| (it * 7 % 5) as f32).collect::<Vec<_>>())),
                ("size", [8, 8].into()),
                ("sums", floats(&sums_of_cells(4))),
                ("cells", [4, 4].into()),
                ("corner", [-3.0, -2.0, 2.0].into()),
                ("side1", [6.0, 0.0, 0.0].into()),
                ("side2", [0.0, 5.0, 0.0].into()),
            ],
        ],
        "Image" => vec![
            vec![("texels", floats(&image_levels())), ("size", [4, 4].into())],
            vec![
                (
                    "words",
                    Value::Numbers(Numbers::from_words(
                        Scalar::U32,
                        image_levels().iter().map(|it| it.to_bits()).collect::<Vec<_>>(),
                    )),
                ),
                ("channels", 4.into()),
                ("bits", 32.into()),
                ("size", [4, 4].into()),
            ],
        ],
        "Ramp" => {
            let points = || ("positions", floats(&[0.0, 0.4, 0.4, 1.0]));
            let colors = (0..12).map(|it| (it * 5 % 12) as f32 / 11.0).collect::<Vec<_>>();
            let colors = || ("colors", floats(&colors));
            let ramp = |blending: i32| vec![points(), colors(), ("blending", blending.into())];
            vec![ramp(0), ramp(1), ramp(2)]
        }
        "Dots" => vec![vec![("inside", constant(0.3)), ("outside", constant(0.6))]],
        "PointLight" => vec![vec![("position", [1.0, 2.0, 0.5].into())]],
        "SpotLight" | "GoboLight" => vec![vec![("position", [1.0, 2.0, 0.5].into())]],
        "IesLight" => {
            let profile = |verticals: &[f32], horizontals: &[f32], candela: &[f32]| {
                vec![
                    ("verticals", floats(verticals)),
                    ("horizontals", floats(horizontals)),
                    ("candela", floats(candela)),
                ]
            };
            vec![
                vec![],
                profile(&[0.0, 40.0, 90.0], &[0.0], &[900.0, 700.0, 10.0]),
                profile(&[0.0, 90.0], &[0.0, 30.0, 90.0], &[9.0, 1.0, 9.0, 3.0, 9.0, 5.0]),
                profile(&[90.0, 180.0], &[0.0, 180.0], &[9.0, 1.0, 4.0, 3.0]),
                profile(&[0.0, 180.0], &[0.0, 120.0, 240.0], &[9.0, 1.0, 9.0, 3.0, 9.0, 5.0]),
            ]
        }
        "SunSky" => vec![
            vec![],
            vec![("sunSize", 20.0.into()), ("azimuth", 130.0.into())],
            vec![("tables", floats(&[0.1; 3600]))],
        ],
        _ => vec![vec![]],
    };
    let named = |row: Vec<(&str, Value)>| {
        row.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    };
    rows.into_iter().map(named).collect()
}

/// Sums over the lower columns and rows of a grid of cells, some of which are ten times as bright as others.
fn sums_of_cells(side: usize) -> Vec<f32> {
    let light =
        |column: usize, row: usize| if (column + 2 * row).is_multiple_of(3) { 10.0 } else { 1.0 };
    let sum = |columns: usize, rows: usize| {
        (0..rows).flat_map(|row| (0..columns).map(move |column| light(column, row))).sum::<f32>()
    };
    let all = sum(side, side);
    let corners = (0..=side).flat_map(|row| (0..=side).map(move |column| (column, row)));
    corners.map(|(columns, rows)| sum(columns, rows) / all).collect()
}

/// Tables of the class `Measured` for three angles and some azimuths of views.
fn measured(azimuths: usize) -> Vec<(&'static str, Value)> {
    const SIDE: usize = 6;
    let angles = [0.0, 0.7, 1.5];
    let azimuth = |index: usize| (index as f32 / 4.0 - 0.5) * std::f32::consts::TAU;
    let mut tables = angles.to_vec();
    tables.extend((0..azimuths).map(azimuth));
    let table = |slope: f32, turn: f32| -> Vec<f32> {
        let number = |index: usize| {
            let [x, y] = [index % SIDE, index / SIDE].map(|it| it as f32 / (SIDE - 1) as f32);
            // Azimuths of facets meet at the ends.
            1.0 - slope * x + turn * y * (1.0 - y)
        };
        (0..SIDE * SIDE).map(number).collect()
    };
    tables.extend(table(0.9, 0.4));
    tables.extend(table(0.6, 0.0));
    let slopes = (0..3 * azimuths).map(|slice| 0.2 + 0.7 * slice as f32 / (3 * azimuths) as f32);
    let slopes: Vec<f32> = slopes.collect();
    for turn in [2.0, 0.5] {
        let slices: Vec<_> = slopes.iter().map(|slope| warp(table(*slope, turn), SIDE)).collect();
        for part in 0..3 {
            tables.extend(slices.iter().flat_map(|slice| &slice[part]));
        }
    }
    tables.extend((0..3 * azimuths * SIDE * SIDE * 3).map(|it| (it % 7) as f32 / 40.0));
    let side = || Value::from([SIDE as i32, SIDE as i32]);
    vec![
        ("tables", Value::Numbers(Numbers::floats(tables))),
        ("views", [3, azimuths as i32].into()),
        ("facets", side()),
        ("areas", side()),
        ("visible", side()),
        ("lit", side()),
    ]
}

/// The densities of a slice, the sums along its rows, and the sums of rows.
fn warp(numbers: Vec<f32>, side: usize) -> [Vec<f32>; 3] {
    let sums = |numbers: &[f32]| -> Vec<f32> {
        let mean = |two: &[f32]| 0.5 * (two[0] + two[1]);
        let sum = |sum: &mut f32, two: &[f32]| {
            *sum += mean(two);
            Some(*sum)
        };
        std::iter::once(0.0).chain(numbers.windows(2).scan(0.0, sum)).collect()
    };
    let along: Vec<Vec<f32>> = numbers.chunks(side).map(sums).collect();
    let up = sums(&along.iter().map(|row| row[side - 1]).collect::<Vec<_>>());
    let whole = up[side - 1];
    [numbers, along.concat(), up].map(|part| part.iter().map(|it| it / whole).collect())
}

/// Texels of an image of 4 by 4 and of its coarser levels.
fn image_levels() -> Vec<f32> {
    let texel = |x: usize, y: usize| [(x * 7 + y * 3) % 5, x, y, 4].map(|it| it as f32 / 4.0);
    let mut level: Vec<Vec<[f32; 4]>> =
        (0..4).map(|y| (0..4).map(|x| texel(x, y)).collect()).collect();
    let mut all: Vec<f32> = level.concat().concat();
    while level.len() > 1 {
        let half = level.len() / 2;
        let mean = |x: usize, y: usize, component: usize| {
            let four = [(0, 0), (0, 1), (1, 0), (1, 1)];
            four.map(|(i, j)| level[2 * y + i][2 * x + j][component]).iter().sum::<f32>() / 4.0
        };
        let texel = |x, y| [0, 1, 2, 3].map(|component| mean(x, y, component));
        level = (0..half).map(|y| (0..half).map(|x| texel(x, y)).collect()).collect();
        all.extend(level.concat().concat());
    }
    all
}

/// An instance of a class of the library.
fn of_library(class: &str, arguments: Vec<(&str, Value)>) -> Value {
    let header = format!("class {class} :");
    let file = library::files().iter().find(|file| file.text.contains(&header));
    let file = file.unwrap_or_else(|| panic!("no class {class}"));
    let unit = Compiler::default().compile(file.path, file.text).unit.expect("it compiles");
    Instance::new(unit.class(class).expect("it is there"), arguments)
        .expect("its parameters")
        .into()
}

/// The library's bits are compared by a test of `rtsl`, more thoroughly.
const OPTIONS: Options = Options { samples: 5_000, seed: 0, compare_bits: false };

#[test]
fn primitives() {
    check_role(Role::Primitive, &OPTIONS);
}

/// Radii below their range are taken as their magnitudes, by samples as by rays.
#[test]
fn shapes_of_negative_radii_are_sampled_where_rays_meet_them() {
    let (engine, _) = Engine::new(engine_options()).expect("an engine");
    let cases: [(&str, &[&str]); 9] = [
        ("Sphere", &["radius"]),
        ("PartialSphere", &["radius"]),
        ("Cylinder", &["radius"]),
        ("PartialCylinder", &["radius"]),
        ("Disk", &["radius", "innerRadius"]),
        ("PartialDisk", &["radius", "innerRadius"]),
        ("Torus", &["majorRadius", "minorRadius"]),
        ("Cone", &["radius", "topRadius"]),
        ("RoundCone", &["startRadius", "endRadius"]),
    ];
    let all_classes = classes(Role::Primitive);
    let mut all = String::new();
    for (name, radii) in cases {
        let class = all_classes.iter().find(|it| it.name == name).expect("the library has it");
        let radius = |index: usize| Value::Float(-1.2 + 0.8 * index as f32);
        let given = radii.iter().enumerate().map(|(index, it)| (*it, radius(index)));
        let instance = Instance::new(class, given).expect("parameters with a warning");
        assert_eq!(instance.outside_range().len(), radii.len(), "{name}");
        all += &broken(&engine, name, &instance, &OPTIONS);
    }
    let class = all_classes.iter().find(|it| it.name == "Superquadric").expect("it is there");
    let radii = [("radii", Value::from([-0.9, 1.3, -1.1]))];
    let instance = Instance::new(class, radii).expect("parameters with a warning");
    all += &broken(&engine, "Superquadric", &instance, &OPTIONS);
    assert!(all.is_empty(), "{all}");
}

#[test]
fn materials() {
    check_role(Role::Material, &OPTIONS);
}

/// If view and light are nearly opposite, rounding decides the sign of the half vector's cosine with them.
#[test]
fn narrow_highlights_have_no_negative_density_on_tilted_surfaces() {
    let (engine, _) = Engine::new(engine_options()).expect("an engine");
    let class = classes(Role::Material).into_iter().find(|it| it.name == "Ward").expect("a class");
    let narrow = [("alphaU", Value::Float(0.001)), ("alphaV", Value::Float(0.001))];
    let instance = Instance::new(&class, narrow).expect("within its range");
    for seed in [16, 57, 99] {
        let name = format!("Ward, seed {seed}");
        let broken = broken(&engine, &name, &instance, &Options { seed, ..OPTIONS });
        assert!(broken.is_empty(), "{broken}");
    }
}

/// Each material that has others below it, over matte, polished, rough, transparent and layered ones.
#[test]
fn materials_on_top_of_others() {
    let rough = |class, roughness: f32| of_library(class, vec![("roughness", roughness.into())]);
    let matte = of_library("Lambertian", vec![]);
    let mirror = of_library("Mirror", vec![]);
    let glass = rough("Dielectric", 0.4);
    let plastic = rough("CoatedDiffuse", 0.2);
    let metal = rough("Conductor", 0.3);
    let tilted = of_library("Constant", vec![("value", [0.7, 0.35, 0.9].into())]);
    let clouds = of_library("Fbm", vec![("scale", 3.0.into())]);
    let half = of_library("Constant", vec![("value", 0.4.into())]);
    let bump = [("displacement", clouds), ("scale", 0.3.into())];
    // A class, materials for one of its parameters, and values of the others.
    type Case<'a> = (&'a str, &'a [Value], &'a str, &'a [(&'a str, Value)]);
    let velvet = [("sheen", [0.5, 0.2, 0.9].into()), ("roughness", 0.4.into())];
    let lacquer = [("normals", tilted.clone()), ("roughness", 0.3.into()), ("coat", 0.7.into())];
    let varnish = of_library("Dielectric", vec![]);
    let dusty = [("base", metal.clone()), ("cover", 0.7.into())];
    let tinted = [("roughness", 0.3.into()), ("transmittance", [0.9, 0.5, 0.2].into())];
    // Many facets of a coat so rough send light below it, where glass has a density.
    let rough_coat = [("roughness", 0.8.into()), ("eta", 1.8.into())];
    let painted = of_library("GltfPbr", vec![("roughness", 0.4.into()), ("metallic", 0.5.into())]);
    let cases: [Case<'_>; 11] = [
        ("Coat", &[matte.clone(), mirror.clone(), painted, plastic.clone()], "base", &tinted),
        ("Coat", &[glass.clone(), metal.clone()], "base", &rough_coat),
        ("GltfSheen", &[matte.clone(), plastic.clone(), mirror.clone()], "base", &velvet),
        ("GltfCoat", &[matte.clone(), glass.clone(), mirror.clone()], "base", &lacquer),
        (
            "NormalMap",
            &[matte.clone(), mirror.clone(), glass, plastic.clone()],
            "base",
            &[("normals", tilted)],
        ),
        ("Bump", &[matte.clone(), metal.clone()], "base", &bump),
        ("Layered", &[matte.clone(), metal.clone(), mirror.clone()], "base", &[("coat", varnish)]),
        ("Layered", std::slice::from_ref(&plastic), "coat", &dusty),
        ("TwoSided", std::slice::from_ref(&plastic), "front", &[]),
        ("TwoSided", &[metal], "back", &[("front", matte.clone())]),
        ("Masked", &[matte, mirror], "base", &[("opacity", half)]),
    ];
    let (engine, _) = Engine::new(engine_options()).expect("an engine");
    let all_classes = classes(Role::Material);
    let mut all = String::new();
    for (name, bases, parameter, others) in cases {
        let class = all_classes.iter().find(|it| it.name == name).expect("the library has it");
        for base in bases {
            let given = others.iter().cloned().chain([(parameter, base.clone())]);
            let instance = Instance::new(class, given).expect("its parameters");
            let below = instance.reference(parameter).map_or("", |it| &it.class().name);
            for seed in seeds() {
                let name = format!("{name} over {below}, seed {seed}");
                all += &broken(&engine, &name, &instance, &Options { seed, ..OPTIONS });
            }
        }
    }
    assert!(all.is_empty(), "{all}");
}

#[test]
fn lights() {
    check_role(Role::Light, &OPTIONS);
}

#[test]
fn cameras_and_textures() {
    check_role(Role::Camera, &OPTIONS);
    check_role(Role::Texture, &OPTIONS);
}
