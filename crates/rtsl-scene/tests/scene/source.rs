//! Instances that stay the same object when a scene is loaded again.

use std::path::Path;
use std::sync::Arc;

use rtsl_scene::reader::{DiskFiles, MemoryFiles, Values};
use rtsl_scene::{EntityId, EntityKind, LoadOptions, Loaded, Scene, SceneSource, Settings};
use tempfile::TempDir;

const SCENE: &str = r#"
Camera "Pinhole" "float fov" 40
WorldBegin
Texture "pattern" "spectrum" "Stripes"
MakeNamedMaterial "striped" "string type" "Lambertian" "texture kd" "pattern"
MakeNamedMaterial "plain" "string type" "Lambertian" "rgb kd" [0.1 0.2 0.3]
NamedMaterial "striped"
Shape "Sphere" "float radius" 1
NamedMaterial "plain"
Shape "Sphere" "float radius" 2
"#;

const STRIPES: &str = "#include \"shade.rtsl\"\nclass Stripes : rt_Texture;
void lookup() { rt_TextureColor = color(shade()); }";

/// A scene in a temporary folder, which is removed at the end.
struct Folder(TempDir);

impl Folder {
    fn new(name: &str) -> Folder {
        let folder = Folder(tempfile::Builder::new().prefix(name).tempdir().unwrap());
        folder.write("scene.pbrt", SCENE);
        folder.write("stripes.rtsl", STRIPES);
        folder.write("shade.rtsl", "float shade() { return 0.5; }");
        folder
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.path().join(name), text).unwrap();
    }

    fn source(&self) -> SceneSource<'static> {
        SceneSource::read(&self.0.path().join("scene.pbrt"), &DiskFiles, &LoadOptions::default())
    }
}

fn load(source: &mut SceneSource<'_>) -> Loaded {
    source.load().unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

/// Compares instances: the camera, the two materials, the two shapes.
fn same(one: &Loaded, other: &Loaded) -> [bool; 5] {
    let instances = |loaded: &Loaded| {
        let scene = &loaded.scene;
        let objects = scene.objects.iter().map(|object| &object.primitive);
        let all = [&scene.camera].into_iter().chain(&scene.materials).chain(objects);
        all.cloned().collect::<Vec<_>>()
    };
    let pairs = instances(one).into_iter().zip(instances(other));
    let same: Vec<bool> = pairs.map(|(one, other)| Arc::ptr_eq(&one, &other)).collect();
    same.try_into().unwrap()
}

fn entity(source: &SceneSource<'_>, kind: EntityKind, name: Option<&str>) -> EntityId {
    let entities = &source.description().entities;
    let found = entities.iter().position(|it| it.kind == kind && it.name.as_deref() == name);
    EntityId(found.unwrap())
}

#[test]
fn nothing_changed_and_nothing_is_made() {
    let folder = Folder::new("nothing");
    let mut source = folder.source();
    let first = load(&mut source);
    source.refresh_shaders();
    assert_eq!(same(&first, &load(&mut source)), [true; 5]);
}

#[test]
fn a_shader_and_what_refers_to_it_change() {
    let folder = Folder::new("shader");
    let mut source = folder.source();
    let first = load(&mut source);
    folder.write("stripes.rtsl", &STRIPES.replace("color(shade())", "color(1.0)"));
    assert_eq!(same(&first, &load(&mut source)), [true; 5], "files are read when it is asked for");
    source.refresh_shaders();
    assert_eq!(same(&first, &load(&mut source)), [true, false, true, true, true]);
}

#[test]
fn an_included_file_counts_as_part_of_the_shader() {
    let folder = Folder::new("include");
    let mut source = folder.source();
    let first = load(&mut source);
    assert!(source.source_files().iter().any(|path| path.ends_with("shade.rtsl")));
    folder.write("shade.rtsl", "float shade() { return 0.75; }");
    source.refresh_shaders();
    assert_eq!(same(&first, &load(&mut source)), [true, false, true, true, true]);
}

#[test]
fn an_error_leaves_what_was_made() {
    let folder = Folder::new("error");
    let mut source = folder.source();
    let first = load(&mut source);
    folder.write("stripes.rtsl", "class Stripes : rt_Texture; void lookup() { oops; }");
    source.refresh_shaders();
    let messages = source.load().unwrap_err().to_text(false);
    assert!(messages.contains("oops"), "{messages}");
    folder.write("stripes.rtsl", STRIPES);
    source.refresh_shaders();
    assert_eq!(same(&first, &load(&mut source)), [true; 5], "the text is as it was");
}

#[test]
fn a_parameter_changes_its_instance_alone() {
    let folder = Folder::new("parameter");
    let mut source = folder.source();
    let first = load(&mut source);
    let plain = entity(&source, EntityKind::Material, Some("plain"));
    source.set_parameter(plain, "kd", Values::Numbers(vec![0.5]));
    let second = load(&mut source);
    assert_eq!(same(&first, &second), [true, true, false, true, true]);
    let camera = entity(&source, EntityKind::Camera, None);
    let earlier = source.set_parameter(camera, "fov", Values::Numbers(vec![30.0, 40.0]));
    let messages = source.load().unwrap_err().to_text(false);
    assert!(messages.contains("fov"), "{messages}");
    source.restore_parameter(camera, "fov", earlier);
    assert_eq!(load(&mut source).scene.camera.member("fov"), Some(&[40.0_f32.to_bits()][..]));
}

/// The settings and the integrators of a scene whose own integrator is given, with another one in its place.
fn with_integrator(own: &str, other: Option<&str>) -> Scene {
    let text = format!("Camera \"Pinhole\"\n{own}\nWorldBegin\nShape \"Sphere\"\n");
    let path = Path::new("scene.pbrt");
    let files = MemoryFiles([(path.to_owned(), text)].into());
    let load = |source: &mut SceneSource<'_>| load(source).scene;
    let options = LoadOptions { integrator: other.map(str::to_owned), ..LoadOptions::default() };
    let scene = load(&mut SceneSource::read(path, &files, &options));
    // A viewer chooses it later, after another one.
    let mut source = SceneSource::read(path, &files, &LoadOptions::default());
    source.select_integrator(Some("Direct"));
    load(&mut source);
    source.select_integrator(other);
    let chosen = load(&mut source);
    assert_eq!(scene.settings, chosen.settings, "{own}, {other:?}");
    let data = |scene: &Scene| {
        let members = scene.integrator().class().members.iter();
        members
            .map(|it| scene.integrator().member(&it.name).map(<[u32]>::to_vec))
            .collect::<Vec<_>>()
    };
    assert_eq!(data(&scene), data(&chosen), "{own}, {other:?}");
    scene
}

#[test]
fn an_integrator_takes_over_what_the_scene_gives_its_own() {
    let depth_of = |scene: &Scene| scene.integrator().member("maxDepth").map(|it| it[0]);
    let named = "Integrator \"volpath\" \"integer maxdepth\" 20 \"float rrthreshold\" 0.25
        \"bool regularize\" true \"float epsilon\" 0.125 \"integer budget\" 5000";
    let own = with_integrator(named, None).settings;
    for other in ["path", "simplepath", "bdpt", "Path"] {
        let scene = with_integrator(named, Some(other));
        assert_eq!(scene.settings, own, "{other}");
        let path = ["maxDepth", "rouletteThreshold", "regularize"];
        let path = path.map(|name| scene.integrator().member(name).unwrap()[0]);
        assert_eq!(path, [20, 0.25_f32.to_bits(), 1], "{other}");
    }
    let interactive = with_integrator(named, Some("interactive")).settings;
    assert_eq!(Settings { integrator: own.integrator, ..interactive }, own);

    // Classes have their own names for these, and more parameters.
    let class = "Integrator \"Direct\" \"integer maxDepth\" 20 \"integer samples\" 3";
    for other in ["path", "Path", "Direct"] {
        assert_eq!(depth_of(&with_integrator(class, Some(other))), Some(20), "{other}");
    }
    let again = with_integrator(class, Some("Direct"));
    assert_eq!(again.integrator().member("samples"), Some(&[3][..]));
    assert_eq!(with_integrator(class, Some("interactive")).settings.max_depth, 20);
    with_integrator(class, Some("Normals"));

    // A depth without a limit is none in a class, either.
    let endless = "Integrator \"path\" \"integer maxdepth\" -1";
    assert_eq!(depth_of(&with_integrator(endless, Some("Direct"))), Some(1 << 16));
    assert_eq!(depth_of(&with_integrator("", Some("Direct"))), Some(8), "the default of the class");
}
