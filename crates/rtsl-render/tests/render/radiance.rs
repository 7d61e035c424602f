//! Scenes whose radiance is known.

use std::path::PathBuf;

use expect_test::expect;
use rtsl_render::request::render_scene_from;
use rtsl_render::{Messages, RenderRequest, RenderResult};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{BATCH, INTERACTIVE, LoadOptions};

fn try_render(scene: &str, shaders: &[(&str, &str)]) -> Result<RenderResult, Messages> {
    try_render_by(Some(INTERACTIVE), scene, shaders)
}

fn try_render_by(
    renderer: Option<&str>,
    scene: &str,
    shaders: &[(&str, &str)],
) -> Result<RenderResult, Messages> {
    let shaders = shaders.iter().map(|(name, text)| (PathBuf::from(name), (*text).to_owned()));
    let scene = (PathBuf::from("scene.pbrt"), scene.to_owned());
    let files = MemoryFiles(shaders.chain([scene]).collect());
    let load = renderer.map(LoadOptions::with_integrator).unwrap_or_default();
    let request = RenderRequest { scene: "scene.pbrt".into(), load, ..RenderRequest::default() };
    render_scene_from(&request, &files)
}

fn render(scene: &str, shaders: &[(&str, &str)]) -> RenderResult {
    try_render(scene, shaders).unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

fn codes(result: Result<RenderResult, Messages>) -> Vec<&'static str> {
    let Err(messages) = result else { return Vec::new() };
    messages.iter().map(|(_, diagnostic)| diagnostic.code.as_str()).collect()
}

const HEAD: &str = r#"
LookAt 0 0 -5  0 0 0  0 1 0
Camera "Pinhole" "float fov" 40
Film "rgb" "integer xresolution" 9 "integer yresolution" 9
Sampler "stratified" "integer pixelsamples" 4
"#;

/// Reflects a known part of what it sees in directions with cosine density.
const FURNACE: &str = r"
class Furnace : rt_Material;
public color albedo = color(0.5);
void shade() {
    float z = rand() * 2.0 - 1.0;
    float angle = rand() * 6.2831853;
    float r = sqrt(max(0.0, 1.0 - z * z));
    vec3 onSphere = vec3(r * cos(angle), r * sin(angle), z);
    rt_SampleColor = albedo * trace(rt_HitPoint, rt_ShadingNormal + 0.999 * onSphere);
}
";

#[test]
fn a_sphere_in_a_furnace_shows_its_albedo() {
    let scene = format!(
        "{HEAD}WorldBegin\nLightSource \"SkyLight\" \"rgb zenith\" [1 1 1] \"rgb horizon\" [1 1 1] \
         \"rgb ground\" [1 1 1]\nMaterial \"Furnace\" \"rgb albedo\" [0.25 0.5 0.75]\nShape \"Sphere\""
    );
    let image = render(&scene, &[("furnace.rtsl", FURNACE)]).image;
    for (found, expected) in image.pixels[4 * 9 + 4].iter().zip([0.25, 0.5, 0.75]) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
    assert!(image.pixels[0].iter().all(|channel| (channel - 1.0).abs() < 1e-6));
}

/// A sheet that reflects 0.3 of the light and lets 0.5 through, with a sky on either side.
#[test]
fn skies_shine_through_sheets() {
    let even = "\"rgb zenith\" [1 1 1] \"rgb horizon\" [1 1 1] \"rgb ground\" [1 1 1]";
    for (sky, parameters) in [("ConstantSky", ""), ("SkyLight", even)] {
        let scene = format!(
            "{HEAD}WorldBegin\n\
             LightSource \"{sky}\" {parameters}\nMaterial \"DiffuseTransmission\" \
             \"rgb reflectance\" [0.3 0.3 0.3] \"rgb transmittance\" [0.5 0.5 0.5]\n\
             Shape \"Plane\" \"normal normal\" [0 0 1]"
        );
        let pixel = render(&scene, &[]).image.pixels[4 * 9 + 4][0];
        assert!((pixel - 0.8).abs() < 1e-5, "{sky}: {pixel}");
    }
}

#[test]
fn light_falls_with_the_square_of_distance_and_the_cosine() {
    // A matte square seen from above; the light is 2 above its middle.
    let scene = r#"
LookAt 0 1 0  0 0 0  0 0 1
Camera "Orthographic" "float scale" 1
Film "rgb" "integer xresolution" 9 "integer yresolution" 9
Sampler "stratified" "integer xsamples" 1 "integer ysamples" 1 "bool jitter" false
WorldBegin
LightSource "PointLight" "point3 position" [0 2 0] "rgb intensity" [8 4 2]
Material "Lambertian" "rgb kd" [0.5 0.5 0.5]
Shape "Plane"
"#;
    let image = render(scene, &[]).image;
    let middle = image.pixels[4 * 9 + 4];
    for (found, intensity) in middle.iter().zip([8.0, 4.0, 2.0]) {
        let expected = 0.5 / std::f32::consts::PI * intensity / 4.0;
        assert!((found - expected).abs() < 1e-5 * expected, "{found} {expected}");
    }
    let corner = image.pixels[0][0];
    assert!(corner < middle[0] && corner > 0.5 * middle[0], "{corner}");
}

#[test]
fn what_stands_between_throws_a_shadow() {
    let scene = format!(
        "{HEAD}WorldBegin\nLightSource \"DirectionalLight\" \"vector3 direction\" [0 0 1]\n\
         Shape \"Sphere\" \"float radius\" 0.5\nTranslate 0 0 -3\nScale 0.02 0.02 0.02\n\
         Shape \"Sphere\""
    );
    let pixels = render(&scene, &[]).image.pixels;
    assert!(pixels.iter().any(|pixel| pixel[0] > 0.1));
    // Far from the small sphere's shadow the large one is lit; both are hit in the middle column.
    assert!(pixels[0] == [0.0; 3]);
}

#[test]
fn a_shape_may_be_its_own_material_and_light_up() {
    let lamp = r"
class Lamp : rt_Primitive, rt_Material;
scratch float side;
void intersect() {
    float b = dot(rt_RayOrigin, rt_RayDirection), a = dot(rt_RayDirection, rt_RayDirection);
    float root = sqrt(b * b - a * (dot(rt_RayOrigin, rt_RayOrigin) - 1.0));
    if (hit((-b - root) / a)) side = 3.0;
}
void computeBounds() { rt_BoundMin = vec3(-1.0); rt_BoundMax = vec3(1.0); }
void computeNormal() { rt_GeometricNormal = rt_HitPoint; }
void shade() { rt_SampleColor = color(side); }
";
    let scene = format!("{HEAD}WorldBegin\nShape \"Lamp\"");
    let image = render(&scene, &[("bulbs.rtsl", lamp)]).image;
    assert_eq!(image.pixels[4 * 9 + 4], [3.0; 3]);
    assert_eq!(image.pixels[0], [0.0; 3]);
}

#[test]
fn a_shader_that_never_ends_is_reported() {
    let endless = "class Endless : rt_Material;\nvoid shade() {\n    float x = 0.0;\n    \
        while (x < 1.0) x = x * 0.5;\n    rt_SampleColor = color(x);\n}\n";
    let head = format!("{HEAD}Integrator \"interactive\" \"integer budget\" 10000\n");
    let scene = format!("{head}WorldBegin\nMaterial \"Endless\"\nShape \"Sphere\"");
    assert_eq!(codes(try_render(&scene, &[("endless.rtsl", endless)])), ["E0619"]);
}

/// The loop is in the texture, though the kernel is the material's.
#[test]
fn a_loop_that_never_ends_is_blamed_on_its_class() {
    let endless = "class Endless : rt_Texture;\nvoid lookup() {\n    float x = 0.0;\n    \
        while (x < 1.0) x = x * 0.5;\n    rt_FloatTextureValue = x;\n}\n";
    let matte = "class Matte : rt_Material;\npublic rt_Texture kd;\n\
        void BSDF() { rt_BSDFValue = isSet(kd) ? kd.lookup() : color(0.5); }\n";
    for renderer in ["interactive", "batch"] {
        let scene = format!(
            "{HEAD}Integrator \"{renderer}\" \"integer budget\" 10000\nWorldBegin\nLightSource \"SkyLight\"\n\
             Texture \"t\" \"color\" \"Endless\"\nMaterial \"Matte\" \"texture kd\" \"t\"\nShape \"Sphere\""
        );
        let shaders = [("endless.rtsl", endless), ("matte.rtsl", matte)];
        let messages = try_render_by(None, &scene, &shaders).expect_err("it never ends");
        let text = messages.to_text(false);
        assert!(
            text.contains("error[E0619]: `lookup` of `Endless`, which `"),
            "{renderer}: {text}"
        );
    }
}

#[test]
fn references_that_are_not_set_are_warned_about_by_both_renderers() {
    let matte = "class Matte : rt_Material;\npublic rt_Texture kd;\npublic rt_Texture tested;\n\
        void BSDF() { rt_BSDFValue = isSet(tested) ? tested.lookup() : kd.lookup(); }\n";
    let scene = format!(
        "{HEAD}WorldBegin\nLightSource \"SkyLight\"\nMaterial \"Matte\"\nShape \"Sphere\"\n\
         Material \"Matte\"\nShape \"Disk\"\n"
    );
    for renderer in [INTERACTIVE, BATCH] {
        let rendered = try_render_by(Some(renderer), &scene, &[("matte.rtsl", matte)])
            .unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
        expect![[r#"
            warning[W0501]: the reference `kd` of `Matte` is used but not set
              ┌─ scene.pbrt:8:10
              │
            8 │ Material "Matte"
              │          ^^^^^^^
              │
              = note: a call through it gives the defaults of its role: black, zero
              = help: set `kd`, or test it with `isSet(kd)`

        "#]]
        .assert_eq(&rendered.warnings.to_text(false));
    }
}

#[test]
fn what_scenes_get_wrong_has_its_codes() {
    let table = [
        ("Shape \"Sphere\" \"float radus\" 2", "E0608"),
        ("Shape \"Sphere\" \"rgb radius\" [1 2 3]", "E0607"),
        ("Shape \"Sphere\" \"string radius\" \"two\"", "E0607"),
        ("Shape \"Spheer\"", "E0609"),
        ("Shape \"Lambertian\"", "E0616"),
        ("Material \"Lambertian\" \"texture kd\" \"none\" Shape \"Sphere\"", "E0610"),
        (
            "MakeNamedMaterial \"a\" \"string type\" \"Mix\" \"material first\" \"b\"\n\
             MakeNamedMaterial \"b\" \"string type\" \"Mix\" \"material first\" \"a\"",
            "E0505",
        ),
        ("Shape \"Broken\"", "E0201"),
    ];
    let broken = "class Broken : rt_Primitive;\nvoid intersect() { hit(nothing); }\n";
    for (text, code) in table {
        let scene = format!("{HEAD}WorldBegin\n{text}");
        let found = codes(try_render(&scene, &[("broken.rtsl", broken)]));
        assert!(found.contains(&code), "{text}: {code} expected, found {found:?}");
    }
}

#[test]
fn values_outside_of_ranges_are_rendered_with_a_warning() {
    let looking = HEAD.replace("\"Pinhole\" \"float fov\" 40", "\"perspective\" \"float fov\" 0.5");
    let scene = format!(
        "{looking}WorldBegin\nLightSource \"infinite\"\n\
         Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n\
         Shape \"sphere\" \"float radius\" -1\nShape \"sphere\" \"float radius\" -2\n"
    );
    let result = render(&scene, &[]);
    assert!(result.image.pixels.iter().all(|pixel| (pixel[0] - 0.5).abs() < 0.05), "{result:?}");
    // One for each parameter of a class.
    expect![[r#"
        warning[W0502]: the parameter `fov` of camera `perspective` is outside of its range: 0.5 is not between 1 and 170
          ┌─ scene.pbrt:3:34
          │
        3 │ Camera "perspective" "float fov" 0.5
          │                                  ^^^

        warning[W0502]: the parameter `radius` of shape `sphere` is outside of its range: -1 is not at least 0
          ┌─ scene.pbrt:9:31
          │
        9 │ Shape "sphere" "float radius" -1
          │                               ^^

    "#]].assert_eq(&result.warnings.to_text(false));
}

/// pbrt's falloff of a spot light whose soft edge is wider than its cone begins beyond the axis.
#[test]
fn a_soft_edge_may_be_wider_than_its_cone() {
    let scene = |delta: u32| {
        format!(
            "LookAt 0 0 -50  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [-4 4 -4 4]\n\
             Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16\n\
             PixelFilter \"box\"\nWorldBegin\n\
             LightSource \"spot\" \"point3 from\" [0 0 -4] \"point3 to\" [0 0 0] \"rgb I\" [16 16 16]\n\
             \"float coneangle\" 30 \"float conedeltaangle\" {delta}\n\
             Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n\
             Shape \"bilinearmesh\" \"point3 P\" [-9 -9 0 9 -9 0 -9 9 0 9 9 0]"
        )
    };
    let [wide, same] = [40, 20].map(|delta| render(&scene(delta), &[]).image);
    // The light is full up to 10 degrees on either side of the axis.
    assert!(wide == same);
}

/// A white matte plane, lit by one lamp overhead only, seen from the side in one point below it.
fn under_lamp(lamp: &str) -> f32 {
    let scene = format!(
        "LookAt 3 1 0  0 0 0  0 1 0\nCamera \"Orthographic\" \"float scale\" 0.01\n\
         Film \"rgb\" \"integer xresolution\" 1 \"integer yresolution\" 1\n\
         Sampler \"stratified\" \"integer pixelsamples\" 1024\nWorldBegin\n\
         AttributeBegin\nAreaLightSource \"Emissive\" \"rgb radiance\" [2 2 2]\n\
         Translate 0 2 0\n{lamp}\nAttributeEnd\n\
         Material \"Lambertian\" \"rgb kd\" [1 1 1]\nShape \"Plane\""
    );
    render(&scene, &[]).image.pixels[0][0]
}

#[test]
fn lamps_light_by_their_form_factors() {
    // What leaves a white matte surface is the lamp's radiance times its form factor.
    let table = [
        ("Shape \"Sphere\" \"float radius\" 0.5", 0.0625),
        ("Scale 0.25 0.25 0.25 Shape \"Sphere\" \"float radius\" 2", 0.0625),
        // Disks glow to their upper side unless turned.
        ("ReverseOrientation Shape \"Disk\" \"float radius\" 1", 0.2),
        ("Rotate 180 1 0 0 Shape \"Disk\" \"float radius\" 1", 0.2),
        ("Shape \"Disk\" \"float radius\" 1", 0.0),
        // Uneven scaling: the same disk from a narrow one; height must not matter.
        ("ReverseOrientation Scale 2 7 2 Shape \"Disk\" \"float radius\" 0.5", 0.2),
        // An ellipsoid looks like the disk-shaped cone that touches it: the sphere's cone where its
        // height is stretched so that sine squared is r^2 / (d^2 - h^2 + r^2).
        ("Scale 0.5 1 0.5 Shape \"Sphere\"", 0.25 / (4.0 - 1.0 + 0.25)),
        // An occluder blocks the light.
        (
            "Shape \"Sphere\" \"float radius\" 0.5 AttributeEnd AttributeBegin\n\
          Translate 0 1 0 Shape \"Disk\" \"float radius\" 1",
            0.0,
        ),
    ];
    for (lamp, form_factor) in table {
        let expected = 2.0 * form_factor;
        let found = under_lamp(lamp);
        assert!((found - expected).abs() <= 0.01 * expected, "{lamp}: {found} {expected}");
    }
}

#[test]
fn moving_lamps_light_by_the_mean_of_their_form_factors() {
    // A sphere of radius r at height d: (r / d)^2, over the time.
    let table = [
        ("ActiveTransform EndTime Translate 0 1 0 ActiveTransform All", 0.25 / 6.0),
        (
            "ActiveTransform StartTime Scale 0.5 0.5 0.5 ActiveTransform EndTime Scale 1.5 1.5 1.5\n\
             ActiveTransform All",
            0.25 / 4.0 * 13.0 / 12.0,
        ),
    ];
    for (motion, form_factor) in table {
        let expected = 2.0 * form_factor;
        let found = under_lamp(&format!("{motion} Shape \"Sphere\" \"float radius\" 0.5"));
        assert!((found - expected).abs() <= 0.01 * expected, "{motion}: {found} {expected}");
    }
}

#[test]
fn thin_lamps_count_one_side_once() {
    // A tube of radius r = 0.001 and half length 2 seen from 2 below: as bright as the strip of width
    // 2 r that it looks like, whose form factor is 2 r / pi times the integral of 4 / (4 + y^2)^2.
    let tube = "Rotate 90 1 0 0 Shape \"Cylinder\" \"float radius\" 0.001 \"float yMin\" -2 \
                \"float yMax\" 2";
    let expected = 2.0 * 4.0916e-4;
    let found = under_lamp(tube);
    assert!((found - expected).abs() < 0.1 * expected, "{found} {expected}");
}

#[test]
fn lamps_look_as_bright_as_they_are() {
    let scene = format!(
        "{HEAD}WorldBegin\nMaterial \"Lambertian\"\nAreaLightSource \"Emissive\" \"rgb radiance\" [3 2 1]\n\
         Shape \"Sphere\""
    );
    let image = render(&scene, &[]).image;
    assert_eq!(image.pixels[4 * 9 + 4], [3.0, 2.0, 1.0]);
}

#[test]
fn names_of_the_format_have_its_space_and_its_defaults() {
    let seen = |world: &str| {
        let scene = format!("{HEAD}WorldBegin\n{world}");
        render(&scene, &[]).image.pixels[4 * 9 + 4][0]
    };
    // A disk lies across the z axis, so that this camera sees its face; by the name of its class, its edge.
    let glow = r#"AreaLightSource "diffuse" "rgb L" 2 "float scale" 3 "bool twosided" true"#;
    assert_eq!(seen(&format!("{glow}\nShape \"disk\" \"float radius\" 4")), 6.0);
    assert_eq!(seen(&format!("{glow}\nTranslate 0 0.01 0\nShape \"Disk\"")), 0.0);
    // Its normal points along +z, and lamps glow in front.
    let front = r#"AreaLightSource "diffuse""#;
    assert_eq!(seen(&format!("{front}\nShape \"disk\"")), 0.0);
    assert_eq!(seen(&format!("{front}\nScale 1 1 -1\nShape \"disk\"")), 1.0);
    // Without its points, a distant light shines along +z.
    let matte = seen("LightSource \"distant\"\nMaterial \"diffuse\"\nShape \"disk\"");
    assert!((matte - 0.5 / std::f32::consts::PI).abs() < 1e-6, "{matte}");
}

#[test]
fn a_class_beside_the_scene_wins_over_a_name_of_the_format() {
    let own = "class disk : rt_Primitive, rt_Material;\nvoid intersect() { hit(1.0); }\n\
        void shade() { rt_SampleColor = color(rt_RayDirection.z); }";
    let scene = format!("{HEAD}WorldBegin\nScale 1 1 3\nShape \"disk\"");
    assert!(render(&scene, &[("disk.rtsl", own)]).image.pixels[4 * 9 + 4][0] > 0.9);
}

/// Either side of a thin object may be visible: environment lights sample directions around the normal on that side.
#[test]
fn the_sky_lights_the_side_that_is_seen() {
    let matte = "LightSource \"infinite\"\nMaterial \"diffuse\"\nScale 9 9 9\n";
    for turn in ["", "ReverseOrientation", "Scale 1 1 -1"] {
        let scene = format!("{HEAD}WorldBegin\n{matte}{turn}\nShape \"disk\"");
        let pixel = render(&scene, &[]).image.pixels[4 * 9 + 4][0];
        assert!((pixel - 0.5).abs() < 1e-5, "{turn}: {pixel}");
    }
}
