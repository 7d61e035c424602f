//! Files of meshes: of shapes, and as scenes.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use expect_test::expect;
use rtsl_scene::reader::{FileSource, MemoryFiles};
use rtsl_scene::{LoadOptions, Loaded, load_scene};

/// A square of so many by so many squares.
fn grid(side: usize) -> String {
    let (vertices, faces) = ((side + 1) * (side + 1), side * side);
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property float z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    );
    for row in 0..=side {
        (0..=side).for_each(|column| text.push_str(&format!("{column} {row} 0\n")));
    }
    for row in 0..side {
        for column in 0..side {
            let first = row * (side + 1) + column;
            let after = first + side + 1;
            text.push_str(&format!("4 {first} {} {} {after}\n", first + 1, after + 1));
        }
    }
    text
}

fn load(path: &str, files: &dyn FileSource) -> Result<Loaded, String> {
    let loaded = load_scene(Path::new(path), files, &LoadOptions::default());
    loaded.map_err(|errors| errors.to_text(false))
}

#[test]
fn a_mesh_is_a_scene() {
    let files = MemoryFiles::<String>::default().with("models/Square.PLY", grid(2));
    let loaded = load("models/Square.PLY", &files).unwrap();
    assert_eq!(loaded.scene.objects[0].elements, Some(8));
    assert_eq!(loaded.scene.lights[0].light.class().name, "ImageSky");
    let notes: Vec<&str> = loaded.warnings.notes().collect();
    assert_eq!(notes, ["the file is a mesh: all of it is shown in a studio"]);
    assert_eq!(loaded.warnings.to_text(false), "");
    // The camera sees the square in the middle.
    let inverse = loaded.scene.camera_to_world.inverse().unwrap();
    let [x, y, z] = inverse.point([1.0, 1.0, 0.0]);
    assert!(x.abs() < 1e-9 && y.abs() < 1e-9 && z > 1.0, "{x} {y} {z}");
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let stl = "solid a\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendsolid a\n";
    let files = MemoryFiles::<String>::default().with("a.obj", obj).with("a.stl", stl);
    for name in ["a.obj", "a.stl"] {
        let loaded = load(name, &files).unwrap();
        assert_eq!(loaded.scene.objects[0].primitive.class().name, "TriangleMesh");
        assert_eq!(loaded.scene.objects[0].elements, None);
    }
    let broken = grid(2).replace("element face", "element faces");
    let files = MemoryFiles::<String>::default().with("a.ply", broken);
    expect![[r#"
        error[E0620]: `a.ply` cannot be used: it has no face
         = help: a mesh needs at least one face with three corners

    "#]]
    .assert_eq(&load("a.ply", &files).unwrap_err());
    expect![[r#"
        error[E0601]: cannot read `b.ply`: entity not found

    "#]]
    .assert_eq(&load("b.ply", &files).unwrap_err());
}

/// Equal arrays are one array: of one file in several shapes, of copies, and of numbers in the text.
#[test]
fn equal_meshes_are_one() {
    let mesh = |name: &str| format!("Shape \"plymesh\" \"string filename\" \"{name}\"\n");
    let list = |numbers: &mut dyn Iterator<Item = f64>| {
        numbers.map(|number| number.to_string()).collect::<Vec<_>>().join(" ")
    };
    let corners = |last: f64| {
        let points = (0..900).map(|number| f64::from(number % 17)).chain([0.0, 0.0, last]);
        let indices = (0..300).map(f64::from);
        format!(
            "Shape \"trianglemesh\" \"point3 P\" [{}] \"integer indices\" [{}]\n",
            list(&mut points.into_iter()),
            list(&mut indices.into_iter())
        )
    };
    let text = format!(
        "Camera \"perspective\"\nWorldBegin\n{}{}{}{}{}{}",
        mesh("a.ply"),
        mesh("a.ply"),
        mesh("copy.ply"),
        corners(1.0),
        corners(1.0),
        corners(2.0)
    );
    let files = MemoryFiles::<String>::default()
        .with("scene.pbrt", text)
        .with("a.ply", grid(20))
        .with("copy.ply", grid(20));
    let counted = Counted { files, reads: AtomicUsize::new(0) };
    let loaded = load("scene.pbrt", &counted).unwrap();
    assert_eq!(counted.reads.load(Ordering::Relaxed), 2);
    let array = |object: usize, name: &str| {
        let words = loaded.scene.objects[object].primitive.buffer(name).unwrap();
        words.as_ptr().addr()
    };
    for name in ["positions", "indices"] {
        assert_eq!(array(0, name), array(1, name));
        assert_eq!(array(0, name), array(2, name));
        assert_eq!(array(3, name), array(4, name));
    }
    assert_ne!(array(3, "positions"), array(5, "positions"));
    assert_eq!(array(3, "indices"), array(5, "indices"));
}

/// Files of which the meshes that are read are counted.
struct Counted {
    files: MemoryFiles,
    reads: AtomicUsize,
}

impl FileSource for Counted {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let is_mesh = path.extension().is_some_and(|it| it == "ply");
        self.reads.fetch_add(usize::from(is_mesh), Ordering::Relaxed);
        self.files.read(path)
    }

    fn size(&self, path: &Path) -> io::Result<u64> {
        self.files.size(path)
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        self.files.list(folder)
    }
}

/// All files that do not exist are reported together, before meshes are read.
#[test]
fn files_are_looked_for_first() {
    let text = "Camera \"realistic\" \"string lensfile\" \"wide.dat\"\nWorldBegin\n\
        LightSource \"infinite\" \"string filename\" \"sky.exr\"\n\
        Texture \"wood\" \"spectrum\" \"imagemap\" \"string filename\" \"wood.png\"\n\
        Texture \"unused\" \"spectrum\" \"imagemap\" \"string filename\" \"unused.png\"\n\
        Material \"diffuse\" \"texture reflectance\" \"wood\" \"string normalmap\" \"bumps.png\"\n\
        Shape \"plymesh\" \"string filename\" \"a.ply\"\n\
        Shape \"plymesh\" \"string filename\" \"b.ply\"\n\
        Shape \"plymesh\" \"string filename\" \"b.ply\"\n";
    let files = MemoryFiles::<String>::default().with("scene.pbrt", text).with("a.ply", grid(1));
    let counted = Counted { files, reads: AtomicUsize::new(0) };
    expect![[r#"
        error[E0601]: cannot read `wide.dat`: entity not found
          ┌─ scene.pbrt:1:38
          │
        1 │ Camera "realistic" "string lensfile" "wide.dat"
          │                                      ^^^^^^^^^^ named here
          │
          = help: paths are relative to the folder of the scene

        error[E0601]: cannot read `sky.exr`: entity not found
          ┌─ scene.pbrt:3:42
          │
        3 │ LightSource "infinite" "string filename" "sky.exr"
          │                                          ^^^^^^^^^ named here
          │
          = help: paths are relative to the folder of the scene

        error[E0601]: cannot read `wood.png`: entity not found
          ┌─ scene.pbrt:4:56
          │
        4 │ Texture "wood" "spectrum" "imagemap" "string filename" "wood.png"
          │                                                        ^^^^^^^^^^ named here
          │
          = help: paths are relative to the folder of the scene

        error[E0601]: cannot read `bumps.png`: entity not found
          ┌─ scene.pbrt:6:68
          │
        6 │ Material "diffuse" "texture reflectance" "wood" "string normalmap" "bumps.png"
          │                                                                    ^^^^^^^^^^^ named here
          │
          = help: paths are relative to the folder of the scene

        error[E0601]: cannot read `b.ply`: entity not found
          ┌─ scene.pbrt:8:35
          │
        8 │ Shape "plymesh" "string filename" "b.ply"
          │                                   ^^^^^^^ named here
          │
          = help: paths are relative to the folder of the scene

    "#]].assert_eq(&load("scene.pbrt", &counted).unwrap_err());
    assert_eq!(counted.reads.load(Ordering::Relaxed), 0);
}

/// A vertex that is not finite and that no face uses is said, once for a file.
#[test]
fn unused_vertices_may_be_anything() {
    let text = "Camera \"perspective\"\nWorldBegin\n\
        Shape \"plymesh\" \"string filename\" \"a.ply\"\nShape \"plymesh\" \"string filename\" \"a.ply\"\n";
    let mesh = |corners: &str| {
        grid(1).replace("element vertex 4", "element vertex 5").replace("\n4 0 1 3 2", corners)
    };
    let files = |mesh: String| {
        MemoryFiles::<String>::default().with("scene.pbrt", text).with("a.ply", mesh)
    };
    let said = |path: &str, mesh: String| match load(path, &files(mesh)) {
        Ok(loaded) => loaded.warnings.to_text(false),
        Err(errors) => errors,
    };
    expect![[r#"
        warning[W0606]: vertex 4 of `a.ply` has a coordinate that is not finite, and no face uses it: it is left out
          ┌─ scene.pbrt:3:7
          │
        3 │ Shape "plymesh" "string filename" "a.ply"
          │       ^^^^^^^^^

    "#]].assert_eq(&said("scene.pbrt", mesh("\nnan 0 inf\n4 0 1 3 2")));
    expect![[r#"
        warning[W0606]: vertex 4 has a coordinate that is not finite, and no face uses it: it is left out
          ┌─ a.ply#contents:1:1
          │
        1 │ 2 triangles, 5 vertices
          │ ^^^^^^^^^^^^^^^^^^^^^^^

    "#]].assert_eq(&said("a.ply", mesh("\nnan 0 inf\n4 0 1 3 2")));
    expect![[r#"
        error[E0620]: `a.ply` cannot be used: vertex 4 has a coordinate that is not finite
         = help: remove infinite and NaN coordinates

    "#]]
    .assert_eq(&said("a.ply", mesh("\nnan 0 inf\n4 0 1 4 2")));
}
