//! Generates the scenes of the ray tracing benchmarks, in any size:
//!
//! ```text
//! cargo run -p rtsl-bench --example make_scene -- spheres 10000 0.4 OUT.pbrt
//! cargo run -p rtsl-bench --example make_scene -- terrain 708 OUT.pbrt
//! cargo run -p rtsl-bench --example make_scene -- metals OUT.pbrt
//! ```
//!
//! - `spheres COUNT LARGEST`: spheres at random in a cube of side 20, with radii up to `LARGEST` and a quarter of it at
//!   least, one of four of glass, under a white sky. 1000 with 0.8 and 10000 with 0.4 fill about the same share of the
//!   cube.
//! - `terrain SIDE`: hills of `SIDE * SIDE` squares of two triangles each, in a PLY file beside the scene. 708 makes a
//!   million triangles, 2236 ten million.
//! - `metals`: three brushed metal spheres on a matte square, under an even sky and a lamp.
//!
//! All are square images of 1024 pixels; one sample a pixel.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let written = match arguments[..] {
        ["spheres", count, largest, out] => match (count.parse(), largest.parse()) {
            (Ok(count), Ok(largest)) => std::fs::write(out, spheres(count, largest)),
            _ => return usage(),
        },
        ["terrain", side, out] => match side.parse() {
            Ok(side) if (1..=10_000).contains(&side) => terrain(side, Path::new(out)),
            _ => return usage(),
        },
        ["metals", out] => std::fs::write(out, metals()),
        _ => return usage(),
    };
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("cannot write the scene: {error}");
            ExitCode::from(1)
        }
    }
}

fn usage() -> ExitCode {
    eprintln!("make_scene spheres COUNT LARGEST OUT | terrain SIDE OUT | metals OUT");
    ExitCode::from(2)
}

/// The beginning of all scenes: a camera at `eye` that looks at `target`.
fn head(eye: &str, target: &str, field_of_view: u32) -> String {
    format!(
        "Scale -1 1 1\nLookAt {eye}  {target}  0 1 0\n\
         Camera \"perspective\" \"float fov\" {field_of_view}\n\
         Film \"rgb\" \"integer xresolution\" 1024 \"integer yresolution\" 1024\n\
         Sampler \"independent\" \"integer pixelsamples\" 1\n\
         Integrator \"path\" \"integer maxdepth\" 7\nWorldBegin\n"
    )
}

/// The linear congruential generator of Knuth's MMIX; numbers in [0,1) of its upper 24 bits.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        const FACTOR: u64 = 6_364_136_223_846_793_005;
        self.0 = self.0.wrapping_mul(FACTOR).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / f64::from(1 << 24)
    }
}

/// Half the side of the cube.
const HALF_SIDE: f64 = 10.0;
/// The number of matte colours.
const COLORS: u32 = 16;

fn spheres(count: usize, largest: f64) -> String {
    let mut scene = head("0 0 32", "0 0 0", 40);
    scene += "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";
    for index in 0..COLORS {
        let [red, green, blue] = [5, 7, 11].map(|step| color_channel(index * step));
        let _ = writeln!(
            scene,
            "MakeNamedMaterial \"m{index}\" \"string type\" \"diffuse\" \
             \"rgb reflectance\" [{red:.4} {green:.4} {blue:.4}]"
        );
    }
    scene += "MakeNamedMaterial \"glass\" \"string type\" \"dielectric\" \"float eta\" 1.5\n";
    let mut numbers = Numbers(42);
    for _ in 0..count {
        let [x, y, z] = [0; 3].map(|_| ((2.0 * numbers.next() - 1.0) * HALF_SIDE) as f32);
        let radius = (largest * (0.25 + 0.75 * numbers.next())) as f32;
        let is_glass = numbers.next() < 0.25;
        let material = if is_glass {
            "glass".to_owned()
        } else {
            format!("m{}", (numbers.next() * f64::from(COLORS)) as u32)
        };
        let _ = writeln!(
            scene,
            "AttributeBegin\nTranslate {x} {y} {z}\nNamedMaterial \"{material}\"\n\
             Shape \"sphere\" \"float radius\" {radius}\nAttributeEnd"
        );
    }
    scene
}

/// From 0.2 to 0.8.
fn color_channel(step: u32) -> f64 {
    0.2 + 0.6 * f64::from(step % COLORS) / f64::from(COLORS - 1)
}

fn terrain(side: u32, out: &Path) -> io::Result<()> {
    let ply = out.with_extension("ply");
    let mut file = io::BufWriter::new(std::fs::File::create(&ply)?);
    write_ply(side, &mut file)?;
    file.flush()?;
    let name = ply.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut scene = head("0 9 17", "0 0 0", 45);
    scene += "LightSource \"distant\" \"point3 from\" [4 6 3] \"rgb L\" [2.4 2.3 2]\n\
              LightSource \"infinite\" \"rgb L\" [0.3 0.4 0.6]\n\
              Material \"diffuse\" \"rgb reflectance\" [0.4 0.5 0.3]\n";
    let _ = writeln!(scene, "Shape \"plymesh\" \"string filename\" \"{name}\"");
    std::fs::write(out, scene)
}

fn write_ply(side: u32, file: &mut impl Write) -> io::Result<()> {
    let row = side + 1;
    let (vertices, faces) = (row * row, 2 * side * side);
    write!(
        file,
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\n\
         property float y\nproperty float z\nelement face {faces}\n\
         property list uchar int vertex_indices\nend_header\n"
    )?;
    for z in 0..row {
        for x in 0..row {
            let at = |index: u32| 20.0 * f64::from(index) / f64::from(side) - HALF_SIDE;
            for coordinate in [at(x), height(at(x), at(z)), at(z)] {
                file.write_all(&(coordinate as f32).to_le_bytes())?;
            }
        }
    }
    for z in 0..side {
        for x in 0..side {
            let corner = z * row + x;
            let (right, below, opposite) = (corner + 1, corner + row, corner + row + 1);
            for triangle in [[corner, below, right], [right, below, opposite]] {
                file.write_all(&[3])?;
                for vertex in triangle {
                    file.write_all(&vertex.to_le_bytes())?;
                }
            }
        }
    }
    Ok(())
}

/// Hills of three sizes, superimposed.
#[expect(clippy::disallowed_methods, reason = "figures do not depend on the last bit of a height")]
fn height(x: f64, z: f64) -> f64 {
    let hills = 1.2 * (0.9 * x).sin() * (0.7 * z).cos();
    let mounds = 0.4 * (3.1 * x + 1.0).sin() * (2.7 * z).sin();
    let bumps = 0.1 * (11.0 * x).sin() * (13.0 * z).cos();
    hills + mounds + bumps
}

fn metals() -> String {
    let mut scene = head("0 2.2 8", "0 0.9 0", 45);
    scene += "LightSource \"infinite\" \"rgb L\" [0.4 0.5 0.7]\n\
              LightSource \"point\" \"rgb I\" [60 60 60] \"point3 from\" [4 6 4]\n\
              AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n\
              Shape \"trianglemesh\" \"point3 P\" [-20 0 -20  20 0 -20  -20 0 20  20 0 20] \
              \"integer indices\" [0 2 1  1 2 3]\nAttributeEnd\n";
    let metals = [
        (-2.2, "0.95 0.64 0.54", 0.10, 0.30),
        (0.0, "0.91 0.92 0.92", 0.05, 0.20),
        (2.2, "1 0.78 0.34", 0.30, 0.10),
    ];
    for (x, reflectance, across, along) in metals {
        let _ = writeln!(
            scene,
            "AttributeBegin\nTranslate {x} 1 0\n\
             Material \"conductor\" \"rgb reflectance\" [{reflectance}] \"float uroughness\" {across} \
             \"float vroughness\" {along} \"bool remaproughness\" false\nShape \"sphere\"\nAttributeEnd"
        );
    }
    scene
}
