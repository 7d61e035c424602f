//! The names and parameters of the format, and what stands for them: text in, instances out.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rtsl::{Backend, Engine, EngineOptions, Instance, Messages};
use rtsl_image::{Image, ImageOptions, write_image};
use rtsl_render::compiled::RenderScene;
use rtsl_scene::reader::{DiskFiles, MemoryFiles};
use rtsl_scene::{LoadOptions, Loaded, PlacedLight, load_scene};

fn load(world: &str) -> Result<Loaded, Messages> {
    let text = format!("Camera \"perspective\"\nWorldBegin\n{world}");
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text)].into());
    load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default())
}

fn loaded(world: &str) -> Loaded {
    load(world).unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

#[test]
fn a_texture_or_a_number_cuts_a_shape_out() {
    let shapes = "Texture \"holes\" \"float\" \"Checker\"\n\
        Shape \"sphere\" \"texture alpha\" \"holes\"\nShape \"Plane\" \"float alpha\" 0.25\n\
        Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"float alpha\" 1\nShape \"disk\"\n";
    let loaded = loaded(shapes);
    let alphas = loaded.scene.objects.iter().map(|object| object.alpha.as_ref());
    let classes: Vec<Option<&str>> =
        alphas.map(|alpha| alpha.map(|it| it.class().name.as_str())).collect();
    assert_eq!(classes, [Some("Checker"), Some("Constant"), None, None]);
    assert_eq!(loaded.warnings.to_text(false), "");
    let options = EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() };
    let (engine, _) = Engine::new(options).expect("the interpreter is there");
    let mut warnings = Messages::default();
    RenderScene::new(&loaded.scene, &engine, &[], &mut warnings, &|_| {}).expect("it compiles");
    assert_eq!(warnings.to_text(false), "");
}

#[test]
fn what_cuts_a_shape_out_has_to_be_a_texture() {
    let message = |shape: &str| load(shape).unwrap_err().to_text(false);
    let unknown = message("Shape \"Sphere\" \"texture alpha\" \"holes\"\n");
    assert!(unknown.contains("unknown texture `holes`"), "{unknown}");
    let wrong = message("Shape \"Sphere\" \"bool alpha\" true\n");
    assert!(wrong.contains("`alpha` refers to a texture"), "{wrong}");
}

/// The class and a member of each material, texture or light, as numbers.
fn numbers(instance: &Instance, member: &str) -> Vec<f32> {
    let words = instance.member(member).unwrap_or_default();
    words.iter().map(|word| f32::from_bits(*word)).collect()
}

#[test]
fn materials_of_the_format_have_classes() {
    let names = [
        "diffuse",
        "conductor",
        "dielectric",
        "thindielectric",
        "coateddiffuse",
        "coatedconductor",
        "diffusetransmission",
    ];
    let shapes = names.map(|name| format!("Material \"{name}\"\nShape \"sphere\"\n"));
    let loaded = loaded(&shapes.concat());
    let classes: Vec<&str> =
        loaded.scene.materials.iter().map(|it| it.class().name.as_str()).collect();
    assert_eq!(
        classes,
        [
            "Lambertian",
            "Conductor",
            "Dielectric",
            "ThinDielectric",
            "CoatedDiffuse",
            "CoatedConductor",
            "DiffuseTransmission",
        ]
    );
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings.to_text(false));
}

#[test]
fn flat_patches_are_parallelograms() {
    let patch = |rest: &str| {
        let text = format!("Shape \"bilinearmesh\" \"point3 P\" [0 0 0  2 0 0  0 1 1  2 1 1{rest}");
        let loaded = loaded(&text);
        (loaded.scene.objects[0].primitive.clone(), loaded.warnings.to_text(false))
    };
    let class = |rest: &str| patch(rest).0.class().name.clone();
    assert_eq!(class("]"), "Parallelogram");
    assert_eq!(class("] \"integer indices\" [0 1 2 3] \"float alpha\" 0.5"), "Parallelogram");
    assert_eq!(class("] \"integer indices\" [1 0 3 2]"), "BilinearMesh");
    assert_eq!(class("  3 3 3] \"integer indices\" [0 1 2 3  1 3 4 2]"), "BilinearMesh");
    assert_eq!(class("] \"normal N\" [0 0 1 0 0 1 0 0 1 0 0 1]"), "BilinearMesh");
    assert_eq!(class("] \"point2 uv\" [0 0 1 0 0 1 2 2]"), "BilinearMesh");
    let bent = loaded("Shape \"bilinearmesh\" \"point3 P\" [0 0 0  2 0 0  0 1 1  2 1 1.01]");
    assert_eq!(bent.scene.objects[0].primitive.class().name, "BilinearMesh");
    let (square, warnings) = patch("] \"point2 uv\" [1 0 3 0 1 4 3 4]");
    assert_eq!(warnings, "");
    assert_eq!(numbers(&square, "sideV"), [0.0, 1.0, 1.0]);
    assert_eq!(numbers(&square, "uv"), [1.0, 0.0]);
    assert_eq!(numbers(&square, "uvAlongV"), [0.0, 4.0]);
}

#[test]
fn spectra_become_colours() {
    let loaded = loaded(
        "LightSource \"infinite\" \"blackbody L\" 6500 \"float scale\" 2\n\
         LightSource \"point\" \"rgb I\" [1 2 3] \"float power\" 25.132741\n\
         LightSource \"spot\" \"float power\" 1 \"float coneangle\" 90 \"float conedeltaangle\" 30\n\
         Material \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\"\n\
         Shape \"sphere\"\nMaterial \"dielectric\" \"spectrum eta\" \"glass-BK7\"\nShape \"sphere\"\n\
         Material \"coatedconductor\" \"spectrum conductor.k\" [360 2 830 2]\nShape \"sphere\"\n",
    );
    let [gold, glass, coated] = loaded.scene.materials.as_slice() else { panic!() };
    assert_eq!(numbers(gold, "eta"), [0.1217, 0.3929, 1.5871]);
    assert_eq!(numbers(glass, "eta"), [1.5168]);
    assert!(numbers(coated, "k").iter().all(|k| (k - 2.0).abs() < 1e-6));
    let radiance = numbers(&loaded.scene.lights[0].light, "radiance");
    assert!(radiance.iter().all(|component| (component - 1.0).abs() < 0.08), "{radiance:?}");
    let strength = numbers(&loaded.scene.lights[1].light, "strength");
    assert!((strength[0] - 2.0).abs() < 1e-6, "{strength:?}");
    let strength = numbers(&loaded.scene.lights[2].light, "strength");
    // The cosine of the edge's middle is 1/4.
    assert!((strength[0] - 1.0 / (1.5 * std::f32::consts::PI)).abs() < 1e-6, "{strength:?}");
}

#[test]
fn wrong_spectra_are_errors() {
    for (spectrum, problem) in [
        ("\"spectrum eta\" \"metal-Ag\"", "did you mean `metal-"),
        ("\"spectrum eta\" [700 1 400 1]", "wavelengths do not increase"),
        ("\"spectrum eta\" [1 2 3 4 5]", "takes 2 numbers a value"),
        ("\"blackbody eta\" [-3]", "one temperature"),
    ] {
        let text = format!("Material \"conductor\" {spectrum}\nShape \"sphere\"\n");
        let messages = load(&text).unwrap_err().to_text(false);
        assert!(messages.contains(problem), "{messages}");
    }
}

#[test]
fn what_is_not_supported_is_said_once_and_left_out() {
    let loaded = loaded(
        "Texture \"rough\" \"float\" \"ptex\" \"string filename\" \"a.ptx\"\n\
         Material \"subsurface\"\nShape \"sphere\"\nMaterial \"subsurface\"\nShape \"sphere\"\n\
         Shape \"disk\" \"float shadowalpha\" 0.5\nShape \"disk\" \"float shadowalpha\" 0.5\n\
         Material \"dielectric\" \"texture eta\" \"rough\"\n\
         Shape \"sphere\"\nMaterial \"interface\"\nShape \"sphere\"\n\
         LightSource \"infinite\"\n",
    );
    let scene = &loaded.scene;
    assert_eq!((scene.objects.len(), scene.lights.len()), (5, 1));
    let classes: Vec<&str> = scene.materials.iter().map(|it| it.class().name.as_str()).collect();
    assert_eq!(classes, ["Subsurface", "Subsurface", "Dielectric"]);
    let warnings = loaded.warnings.to_text(false);
    for once in [
        "material `subsurface` is simplified: light leaves its surface where it enters it",
        "texture `ptex` is not supported: `Constant` takes its place",
        "`shadowalpha` of shape `disk` has no effect",
        "`eta` of material `dielectric` has no effect",
    ] {
        assert_eq!(warnings.matches(once).count(), 1, "{once}: {warnings}");
    }
    assert_eq!(warnings.matches("warning[").count(), 4, "{warnings}");
}

#[test]
fn relief_lies_over_materials() {
    let loaded = loaded(
        "Texture \"waves\" \"float\" \"fbm\"\n\
         MakeNamedMaterial \"rough\" \"string type\" \"diffuse\" \"texture displacement\" \"waves\"\n\
         NamedMaterial \"rough\"\nShape \"sphere\"\n\
         Material \"Phong\" \"texture displacement\" \"waves\"\nShape \"sphere\"\n\
         Material \"conductor\" \"float displacement\" 0.1\nShape \"sphere\"\n\
         MakeNamedMaterial \"smooth\" \"string type\" \"diffuse\"\n\
         Material \"mix\" \"string materials\" [\"rough\" \"smooth\"]\nShape \"sphere\"\n",
    );
    let materials = &loaded.scene.materials;
    let classes: Vec<&str> = materials.iter().map(|it| it.class().name.as_str()).collect();
    assert_eq!(classes, ["Bump", "Bump", "Conductor", "Mix"]);
    assert_eq!(loaded.warnings.to_text(false), "");
}

#[test]
fn wrong_relief_is_an_error() {
    for (relief, problem) in [
        ("\"texture displacement\" \"none\"", "unknown texture `none`"),
        ("\"string normalmap\" \"none.png\"", "cannot read `none.png`"),
        ("\"float normalmap\" 1", "`normalmap` takes the name of an image file"),
    ] {
        let messages = load(&format!("Material \"diffuse\" {relief}\nShape \"sphere\"\n"));
        let text = messages.unwrap_err().to_text(false);
        assert!(text.contains(problem), "{text}");
        assert_eq!(text.matches("error[").count(), 1, "{text}");
    }
}

#[test]
fn mixtures_and_textures_refer_to_their_parts() {
    let loaded = loaded(
        "Texture \"a\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [1 0 0] \"float uscale\" 4\n\
         Texture \"b\" \"spectrum\" \"scale\" \"texture tex\" \"a\" \"float scale\" 0.5\n\
         Texture \"c\" \"spectrum\" \"mix\" \"texture tex1\" \"b\" \"float amount\" 0.2\n\
         MakeNamedMaterial \"one\" \"string type\" \"diffuse\" \"texture reflectance\" \"c\"\n\
         MakeNamedMaterial \"other\" \"string type\" \"dielectric\"\n\
         Material \"mix\" \"string materials\" [\"one\" \"other\"] \"float amount\" 0.25\n\
         Shape \"sphere\"\n",
    );
    assert_eq!(loaded.scene.materials[0].class().name, "Mix");
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings.to_text(false));
}

#[test]
fn images_are_read_for_textures_and_skies() {
    let folder = tempfile::tempdir().unwrap();
    let mut image = Image::new(4, 2).unwrap();
    image.pixels[0] = [1.0, 0.0, 0.0];
    image.pixels[7] = [0.0, 0.0, 0.5];
    for name in ["image.exr", "image.png"] {
        write_image(&image, &folder.path().join(name), &ImageOptions::default()).unwrap();
    }
    let scene = folder.path().join("scene.pbrt");
    let text = "Camera \"perspective\"\nWorldBegin\n\
        LightSource \"infinite\" \"string filename\" \"image.exr\" \"float scale\" 3\n\
        Texture \"map\" \"spectrum\" \"imagemap\" \"string filename\" \"image.png\" \"string wrap\" \"clamp\" \"float vscale\" 2\n\
        Material \"diffuse\" \"texture reflectance\" \"map\"\nShape \"sphere\" \"texture alpha\" \"map\"\n";
    std::fs::write(&scene, text).unwrap();
    let loaded = load_scene(&scene, &DiskFiles, &LoadOptions::default());
    let loaded = loaded.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    let map = loaded.scene.objects[0].alpha.as_ref().unwrap();
    assert_eq!(map.class().name, "Image");
    assert_eq!(map.member("size"), Some(&[4, 2][..]));
    assert_eq!(map.member("wrap"), Some(&[1][..]));
    assert_eq!(numbers(map, "repeat"), [1.0, 2.0]);
    let sky = &loaded.scene.lights[0].light;
    assert_eq!((sky.class().name.as_str(), numbers(sky, "strength")), ("ImageSky", vec![3.0]));
    assert_eq!(sky.member("size"), Some(&[4, 2][..]));
}

/// A folder with a scene of this world and with images, loaded.
fn loaded_with(images: &[(&str, &Image)], world: &str) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    for (name, image) in images {
        write_image(image, &folder.path().join(name), &ImageOptions::default()).unwrap();
    }
    let scene = folder.path().join("scene.pbrt");
    std::fs::write(&scene, format!("Camera \"perspective\"\nWorldBegin\n{world}")).unwrap();
    let loaded = load_scene(&scene, &DiskFiles, &LoadOptions::default());
    loaded.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

fn near(found: f32, expected: f64) {
    assert!((f64::from(found) / expected - 1.0).abs() < 1e-3, "{found}, expected {expected}");
}

#[test]
fn lights_take_images_and_their_power() {
    let mut slide = Image::new(4, 2).unwrap();
    slide.pixels.iter_mut().for_each(|pixel| *pixel = [0.5; 3]);
    let mut sky = Image::new(4, 4).unwrap();
    sky.pixels.iter_mut().for_each(|pixel| *pixel = [2.0; 3]);
    let loaded = loaded_with(
        &[("slide.exr", &slide), ("sky.exr", &sky)],
        "LightSource \"goniometric\" \"string filename\" \"sky.exr\" \"float power\" 8 \"rgb I\" [1 2 3]\n\
         LightSource \"projection\" \"string filename\" \"slide.exr\" \"float scale\" 3 \"float fov\" 60\n\
         LightSource \"projection\" \"string filename\" \"slide.exr\" \"float power\" 5\n\
         LightSource \"infinite\" \"string filename\" \"sky.exr\" \"float illuminance\" 7\n\
         AreaLightSource \"diffuse\" \"string filename\" \"slide.exr\" \"bool twosided\" true\nShape \"sphere\"\n",
    );
    assert_eq!(loaded.warnings.to_text(false), "");
    let [goniometric, first, second, infinite] = &loaded.scene.lights[..] else {
        panic!("{}", loaded.scene.lights.len());
    };
    let gain = |light: &PlacedLight| numbers(&light.light, "gain")[0];
    // The mean of the map is 2.
    near(gain(goniometric), 8.0 / (8.0 * PI));
    assert_eq!(numbers(&goniometric.light, "intensity"), [1.0, 2.0, 3.0]);
    let image = first.light.reference("image").unwrap();
    assert_eq!((image.class().name.as_str(), image.member("wrap")), ("Image", Some(&[1][..])));
    assert!(is_shared(image, second.light.reference("image").unwrap()));
    assert_eq!(numbers(&first.light, "aspect"), [2.0]);
    assert_eq!((numbers(&first.light, "strength"), gain(first)), (vec![3.0], 1.0));
    // The centres of 4 by 2 texels on a slide of 4 by 2 at the distance 1.
    let weight = |x: f64, y: f64| {
        let square = 1.0 + x * x + y * y;
        1.0 / (square * square.sqrt())
    };
    let power = 8.0 * 0.5 * (weight(0.5, 0.5) + weight(1.5, 0.5)) / 2.0;
    near(gain(second), 5.0 / power);
    // By pbrt-v4's formula, for 4 by 4 texels that are 2: those in the upper half are 4 of the cosine 1 - 0.25^2 * 4,
    // 0.75, and the 4 on either side of the horizon count as 0.
    let cosines = 4.0 * 0.75;
    near(gain(infinite), 7.0 / (2.0 * PI / 16.0 * 2.0 * cosines));
    let glow = &loaded.scene.materials[loaded.scene.objects[0].emitter.unwrap() as usize];
    assert_eq!(glow.class().name, "Emissive");
    assert_eq!(glow.reference("image").unwrap().member("filtering"), Some(&[0][..]));
}

#[test]
fn area_lights_have_their_power_on_each_face() {
    let mut slide = Image::new(2, 1).unwrap();
    slide.pixels = vec![[1.0; 3], [0.5; 3]];
    let loaded = loaded_with(
        &[("slide.exr", &slide)],
        "AreaLightSource \"diffuse\" \"float power\" 6 \"float scale\" 2\nShape \"sphere\" \"float radius\" 2\n\
         Scale 3 3 3\nShape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0] \"integer indices\" [0 1 2 1 3 2]\n\
         AreaLightSource \"diffuse\" \"float power\" 6 \"bool twosided\" true \"string filename\" \"slide.exr\"\n\
         Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 2 0 1 2 0]\nShape \"Torus\"\n",
    );
    let scene = &loaded.scene;
    let gain = |object: usize| {
        numbers(&scene.materials[scene.objects[object].emitter.unwrap() as usize], "gain")[0]
    };
    near(gain(0), 6.0 / (PI * 16.0 * PI));
    near(gain(1), 6.0 / (PI * 4.5));
    near(gain(2), 6.0 / (PI * 18.0 * 2.0 * 0.75));
    assert_eq!(gain(3), 1.0);
    let warnings = loaded.warnings.to_text(false);
    assert!(warnings.contains("`power` of area light `diffuse` has no effect"), "{warnings}");
    assert_eq!(warnings.matches("warning[").count(), 1, "{warnings}");
}

#[test]
fn parts_of_quadrics_have_the_power_of_their_areas() {
    let loaded = loaded(
        "AreaLightSource \"diffuse\" \"float power\" 6\n\
         Shape \"sphere\" \"float radius\" 2 \"float zmin\" -1 \"float phimax\" 90\n\
         Shape \"disk\" \"float radius\" 2 \"float innerradius\" 1 \"float phimax\" 60\n\
         Shape \"cylinder\" \"float radius\" 2 \"float zmax\" 3 \"float phimax\" 45\n",
    );
    let scene = &loaded.scene;
    let areas = [PI / 2.0 * 2.0 * 3.0, PI / 3.0 * 0.5 * 3.0, PI / 4.0 * 2.0 * 4.0];
    for (object, area) in scene.objects.iter().zip(areas) {
        let emitter = &scene.materials[object.emitter.unwrap() as usize];
        near(numbers(emitter, "gain")[0], 6.0 / (PI * area));
    }
    assert_eq!(loaded.warnings.to_text(false), "");
}

#[test]
fn textures_have_mappings_and_places() {
    let texture = |class: &str, more: &str| {
        let world = format!(
            "Translate 1 2 3\nTexture \"t\" \"float\" \"{class}\" {more}\nShape \"sphere\" \"texture alpha\" \"t\"\n"
        );
        let loaded = loaded(&world);
        assert_eq!(loaded.warnings.to_text(false), "");
        loaded.scene.objects[0].alpha.clone().unwrap()
    };
    let to_texture = |texture: &Instance| numbers(texture, "toTexture")[12..15].to_vec();
    let planar = texture(
        "checkerboard",
        "\"string mapping\" \"planar\" \"vector3 v1\" [0 0 1] \"float vdelta\" 0.5 \"integer dimension\" 3",
    );
    assert_eq!(
        (planar.member("mapping"), planar.member("dimension")),
        (Some(&[3][..]), Some(&[3][..]))
    );
    assert_eq!(
        (numbers(&planar, "v1"), numbers(&planar, "offset")),
        (vec![0.0, 0.0, 1.0], vec![0.0, 0.5])
    );
    assert_eq!(to_texture(&planar), [-1.0, -2.0, -3.0]);
    let round = texture("dots", "\"string mapping\" \"spherical\" \"float udelta\" 3");
    assert_eq!(
        (round.member("mapping"), numbers(&round, "offset")),
        (Some(&[1][..]), vec![0.0, 0.0])
    );
    // In pbrt-v4 `inside` is what lies between the dots.
    let swapped = texture("dots", "\"float inside\" 0.25");
    let part = |name: &str| numbers(swapped.reference(name).unwrap(), "value");
    assert_eq!((part("outside"), part("inside")), (vec![0.25; 3], vec![0.0; 3]));
    let plain = texture("bilerp", "\"float v00\" 0.25 \"float uscale\" 2");
    assert_eq!(
        (numbers(&plain, "v00"), numbers(&plain, "repeat")),
        (vec![0.25; 3], vec![2.0, 1.0])
    );
    let wrinkled = texture("wrinkled", "\"integer octaves\" 3 \"float roughness\" 0.25");
    assert_eq!(wrinkled.class().name, "Wrinkled");
    assert_eq!(to_texture(&wrinkled), [-1.0, -2.0, -3.0]);
    for (name, class) in [("fbm", "PerlinFbm"), ("windy", "Windy"), ("marble", "PerlinMarble")] {
        assert_eq!(texture(name, "").class().name, class);
    }
    let turned = "Rotate 90 1 0 0\nTexture \"t\" \"float\" \"directionmix\"\n\
        Shape \"sphere\" \"texture alpha\" \"t\"\n";
    let turned = loaded(turned).scene.objects[0].alpha.clone().unwrap();
    let [x, y, z] = numbers(&turned, "direction")[..] else { panic!("a direction") };
    assert!(x.abs() < 1e-6 && y.abs() < 1e-6 && (z.abs() - 1.0).abs() < 1e-6, "{x} {y} {z}");
}

#[test]
fn a_file_that_is_no_image_is_an_error() {
    let errors = |parameters: &str| {
        let text = format!(
            "Texture \"t\" \"spectrum\" \"imagemap\" {parameters}\n\
            Material \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"\n"
        );
        load(&text).unwrap_err().to_text(false)
    };
    assert!(errors("").contains("names no file"));
    let none = errors("\"string filename\" \"scene.pbrt\"");
    let problem =
        "it is not an image in EXR, PNG, JPEG, WebP, TGA, HDR, PFM, BMP, QOI or KTX 2.0 format";
    assert!(none.contains(problem) && none.contains("help: convert the image"), "{none}");
    let encoding = errors("\"string filename\" \"scene.pbrt\" \"string encoding\" \"gamma x\"");
    assert!(encoding.contains("`encoding` is `gamma x`, expected `sRGB`, `linear`"), "{encoding}");
}

/// True if the images of two textures share their words.
fn is_shared(one: &Instance, other: &Instance) -> bool {
    let words = |texture: &Instance| texture.buffer("words").unwrap().as_ptr();
    words(one) == words(other)
}

#[test]
fn a_file_is_decoded_once_for_all_textures() {
    let folder = tempfile::tempdir().unwrap();
    let image = Image::new(4, 2).unwrap();
    let path = |name: &str| folder.path().join(name);
    for name in ["a.png", "same.png"] {
        write_image(&image, &path(name), &ImageOptions::default()).unwrap();
    }
    let texture = |name: &str, file: &str, more: &str| {
        format!(
            "Texture \"{name}\" \"spectrum\" \"imagemap\" \"string filename\" \"{file}\" {more}\n\
            Material \"diffuse\" \"texture reflectance\" \"{name}\"\n\
            Shape \"sphere\" \"texture alpha\" \"{name}\"\n"
        )
    };
    let text = [
        "Camera \"perspective\"\nWorldBegin\n".to_owned(),
        texture("one", "a.png", ""),
        texture("two", "a.png", "\"string wrap\" \"black\" \"string filter\" \"point\""),
        texture("three", "same.png", "\"bool invert\" true"),
        texture("four", "a.png", "\"string encoding\" \"gamma 2.2\""),
        "Texture \"unused\" \"spectrum\" \"imagemap\" \"string filename\" \"missing.png\"\n"
            .to_owned(),
    ];
    std::fs::write(path("scene.pbrt"), text.concat()).unwrap();
    let loaded = load_scene(&path("scene.pbrt"), &DiskFiles, &LoadOptions::default());
    let scene = loaded.unwrap_or_else(|messages| panic!("{}", messages.to_text(false))).scene;
    let textures: Vec<&Arc<Instance>> =
        scene.objects.iter().map(|object| object.alpha.as_ref().unwrap()).collect();
    let [one, two, three, four] = textures[..] else { panic!("{}", textures.len()) };
    assert!(is_shared(one, two) && is_shared(one, three));
    assert!(!is_shared(one, four));
    assert_ne!(one.buffer("decoded").unwrap()[128], four.buffer("decoded").unwrap()[128]);
    assert_eq!((two.member("wrap"), two.member("filtering")), (Some(&[2][..]), Some(&[1][..])));
    // A word a texel: 8 texels, 2, and 1.
    assert_eq!((one.buffer("words").unwrap().len(), one.member("channels")), (11, Some(&[3][..])));
}

#[test]
fn a_texture_for_a_number_is_refused_with_advice() {
    let text = "Texture \"holes\" \"float\" \"Checker\"\n\
        Material \"Principled\" \"texture eta\" \"holes\"\n";
    let messages = load(text).unwrap_err().to_text(false);
    assert!(messages.contains("error[E0607]: `eta` is of type `float`, found a texture"));
    let advice = "help: give a value; a class takes textures by members of type `rt_Texture`";
    assert!(messages.contains(advice), "{messages}");
}
