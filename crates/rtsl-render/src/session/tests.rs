//! Sessions of a small scene in a temporary folder.

use rtsl::Method;
use rtsl_image::Image;
use rtsl_scene::LoadOptions;
use tempfile::TempDir;

use super::*;
use crate::request::{RenderRequest, render_scene};

pub(super) const SCENE: &str = r#"
LookAt 0 2 -6   0 0.5 0   0 1 0
Camera "Pinhole" "float fov" 40
Film "rgb" "integer xresolution" 44 "integer yresolution" 30
Sampler "stratified" "integer pixelsamples" 4
Integrator "interactive" "integer budget" 5000
WorldBegin
LightSource "PointLight" "point3 position" [4 8 -4] "rgb intensity" [60 60 60] "string name" "lamp"
Texture "pattern" "spectrum" "Stripes"
Material "Lambertian" "texture kd" "pattern"
Shape "Plane"
MakeNamedMaterial "red" "string type" "Lambertian" "rgb kd" [0.8 0.1 0.1]
NamedMaterial "red"
Translate 0 1 0
Shape "Sphere" "float radius" 1 "string name" "ball"
"#;

pub(super) const STRIPES: &str = "class Stripes : rt_Texture;
[[label \"Width\", min 0.1, max 4, doc \"Of a stripe.\"]] public float width = 0.5;
public bool dark = false;
void lookup() {
    rt_TextureColor = color(fract(rt_TextureUV.x / width) < 0.5 ? 0.2 : dark ? 0.3 : 0.8);
}";

pub(super) const SLICE: Duration = Duration::from_millis(20);

/// A folder with a scene, which is removed at the end.
pub(super) struct Folder(TempDir);

impl Folder {
    pub(super) fn new(name: &str) -> Folder {
        let folder = Folder(tempfile::Builder::new().prefix(name).tempdir().unwrap());
        folder.write("scene.pbrt", SCENE);
        folder.write("stripes.rtsl", STRIPES);
        folder
    }

    pub(super) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.path().join(name), text).unwrap();
    }

    pub(super) fn open(&self) -> Session {
        let options = SessionOptions { threads: Some(2), ..SessionOptions::default() };
        let opened = Session::open(&self.0.path().join("scene.pbrt"), options);
        opened.unwrap_or_else(|messages| panic!("{}", messages.to_text(false))).0
    }

    /// Renders the scene offline.
    pub(super) fn render(&self, defines: &[&str]) -> Image {
        self.render_with(None, defines)
    }

    /// Renders the scene by an integrator.
    pub(super) fn render_by(&self, integrator: &str) -> Image {
        self.render_with(Some(integrator), &[])
    }

    pub(super) fn render_with(&self, integrator: Option<&str>, defines: &[&str]) -> Image {
        let request = RenderRequest {
            scene: self.0.path().join("scene.pbrt"),
            load: LoadOptions {
                integrator: integrator.map(str::to_owned),
                defines: defines.iter().map(|define| (*define).to_owned()).collect(),
                ..LoadOptions::default()
            },
            ..RenderRequest::default()
        };
        render_scene(&request).unwrap_or_else(|it| panic!("{}", it.to_text(false))).image
    }
}

/// Takes all samples.
pub(super) fn finish(session: &mut Session) -> Image {
    while session.advance(SLICE) {}
    assert_eq!(session.status().problem, None);
    session.film().image().unwrap()
}

pub(super) fn shown(session: &Session) -> Vec<u32> {
    let (width, height) = session.film().size();
    let mut pixels = vec![0; width * height];
    session.film().copy_to(&mut pixels, width);
    pixels
}

pub(super) fn find(session: &Session, title: &str) -> EntityId {
    let things = session.things();
    things.iter().find(|thing| thing.title == title).unwrap_or_else(|| panic!("{things:?}")).entity
}

/// The addresses of the kernels that take one instance.
fn kernels(session: &Session) -> Vec<(String, Method, *const rtsl::Kernel)> {
    let shaders = session.renderer.compiled().shaders.iter();
    let kernels = shaders.flat_map(|shader| {
        let name = &shader.program.class().name;
        let method = Method::ComputeBounds;
        shader.kernel(method).map(|kernel| (name.clone(), method, std::ptr::from_ref(kernel)))
    });
    kernels.collect()
}

#[test]
fn all_samples_make_the_image_of_a_batch_render() {
    let folder = Folder::new("equal");
    let mut session = folder.open();
    assert_eq!(session.status().samples_wanted, 4);
    assert_eq!(finish(&mut session), folder.render(&[]));
    let status = session.status();
    assert_eq!((status.samples, status.size), (4, (44, 30)));
    assert!(status.rays_per_second > 0.0);
    assert!(!session.advance(SLICE), "there is nothing left to do");
}

#[test]
fn slices_of_any_length_make_the_same_image() {
    let folder = Folder::new("slices");
    let mut session = folder.open();
    while session.advance(Duration::from_micros(1)) {}
    assert_eq!(session.film().image().unwrap(), folder.render(&[]));
}

#[test]
fn a_moved_camera_starts_again_and_comes_back() {
    let folder = Folder::new("camera");
    let mut session = folder.open();
    let first = finish(&mut session);
    let moved = session.camera().after(Transform::translate([0.5, 0.0, 0.0]));
    session.set_camera(moved);
    assert!(session.is_busy());
    assert_ne!(finish(&mut session), first);
    session.set_camera(session.scene_camera());
    assert_eq!(finish(&mut session), first);
    session.set_camera(session.scene_camera());
    assert!(!session.is_busy(), "it did not move");
}

#[test]
fn only_the_camera_of_the_scene_moves() {
    let folder = Folder::new("shutter");
    let slide = "ActiveTransform EndTime Translate 2 0 0 ActiveTransform All\n";
    folder.write("scene.pbrt", &format!("{slide}{SCENE}"));
    let mut session = folder.open();
    let moving = finish(&mut session);
    assert_eq!(moving, folder.render(&[]));
    let start = session.scene_camera();
    session.set_camera(start.after(Transform::translate([1e-9, 0.0, 0.0])));
    let still = finish(&mut session);
    folder.write("scene.pbrt", SCENE);
    assert_eq!(bytes(&still), bytes(&folder.render(&[])));
    session.set_camera(start);
    assert_eq!(finish(&mut session), moving);
}

/// The displayed bytes of an image.
fn bytes(image: &Image) -> Vec<u8> {
    image.to_srgb(0.0).unwrap()
}

#[test]
fn another_size_is_that_of_a_batch_render() {
    let folder = Folder::new("size");
    let mut session = folder.open();
    finish(&mut session);
    session.resize(21, 50);
    assert!(shown(&session).iter().any(|pixel| *pixel != 0), "the old image stays for the moment");
    let expected = folder.render(&["film.xresolution=21", "film.yresolution=50"]);
    assert_eq!(finish(&mut session), expected);
    session.resize(0, 7);
    assert_eq!(session.film().size(), (21, 50));
}

#[test]
fn frames_that_take_too_long_are_made_smaller() {
    let folder = Folder::new("reduction");
    let mut session = folder.open();
    // Half the resolution takes 40 ms.
    session.resolution.note(2, (22, 15), Duration::from_millis(40));
    session.advance(SLICE);
    assert_eq!(session.status().reduction, 2);
    assert_eq!(session.status().samples, 0, "a small frame is no sample of the film");
    let preview = shown(&session);
    let row = &preview[14 * 44..15 * 44];
    assert!(preview[29 * 44..].iter().all(|pixel| *pixel != 0), "the floor is everywhere");
    // The first object is the floor, the second the red ball.
    let objects: Vec<i32> = session.frame.preview().pixels.iter().map(|it| it.object).collect();
    assert_eq!((objects[0], objects[7 * 22 + 11], objects[14 * 22]), (-1, 1, 0));
    let is_red = |pixel: &u32| pixel >> 16 > 2 * (pixel >> 8 & 0xFF);
    let is_grey = |pixel: &u32| pixel >> 16 == pixel & 0xFF;
    assert!(row.iter().all(|pixel| is_red(pixel) || is_grey(pixel)), "objects are not mixed");
    let ball = objects[7 * 22..8 * 22].iter().filter(|object| **object == 1).count();
    assert!(row.iter().filter(|pixel| is_red(pixel)).count().abs_diff(2 * ball) <= 2);
    assert_eq!(finish(&mut session), folder.render(&[]));
}

#[test]
fn a_parameter_changes_the_image_and_no_code() {
    let folder = Folder::new("parameter");
    let mut session = folder.open();
    finish(&mut session);
    let before = kernels(&session);
    let (red, pattern) = (find(&session, "red"), find(&session, "pattern"));
    session.set_control(red, "kd", &[0.1, 0.2, 0.7]).unwrap();
    session.set_control(pattern, "width", &[1.5]).unwrap();
    session.set_control(pattern, "dark", &[1.0]).unwrap();
    let defines = ["red.kd=0.1,0.2,0.7", "pattern.width=1.5", "pattern.dark=true"];
    assert_eq!(finish(&mut session), folder.render(&defines));
    assert_eq!(kernels(&session), before);
    let width = &session.controls(pattern)[0];
    assert_eq!((width.label.as_str(), width.values[0]), ("Width", 1.5));
    assert_eq!((width.min, width.max), (Some(0.1), Some(4.0)));
}

#[test]
fn controls_know_the_choices_of_an_enumeration() {
    let folder = Folder::new("choices");
    let stripes = "class Stripes : rt_Texture;
        enum Profile { Soft = 2, Hard = 7 };
        public Profile profile = Soft;
        void lookup() {
            float place = fract(rt_TextureUV.x);
            rt_TextureColor = color(profile == Hard ? step(0.5, place) : place);
        }";
    folder.write("stripes.rtsl", stripes);
    folder.write(
        "scene.pbrt",
        &SCENE.replace("\"Stripes\"", "\"Stripes\" \"string profile\" \"Hard\""),
    );
    let mut session = folder.open();
    let pattern = find(&session, "pattern");
    let control = session.controls(pattern).remove(0);
    let choices = [("Soft", 2.0), ("Hard", 7.0)];
    assert_eq!(control.choices, choices.map(|(name, number)| (name.to_owned(), number)));
    assert_eq!(control.values, [7.0]);
    let hard = finish(&mut session);
    session.set_control(pattern, "profile", &[2.0]).unwrap();
    let soft = finish(&mut session);
    assert!(soft != hard);
    assert_eq!(soft, folder.render(&["pattern.profile=2"]));
    assert_eq!(soft, folder.render(&["pattern.profile=Soft"]));
    let messages = session.set_control(pattern, "profile", &[3.0]).unwrap_err();
    assert!(messages.to_text(false).contains("`Soft` (2)"), "{}", messages.to_text(false));
}

#[test]
fn a_parameter_of_a_shape_moves_its_box() {
    let folder = Folder::new("shape");
    let mut session = folder.open();
    let ball = find(&session, "ball");
    session.set_control(ball, "radius", &[1.75]).unwrap();
    assert_eq!(finish(&mut session), folder.render(&["ball.radius=1.75"]));
}

#[test]
fn a_value_without_a_meaning_changes_nothing() {
    let folder = Folder::new("range");
    let mut session = folder.open();
    let first = finish(&mut session);
    let pattern = find(&session, "pattern");
    let messages = session.set_control(pattern, "width", &[f64::NAN]).unwrap_err();
    assert!(messages.to_text(false).contains("width"), "{}", messages.to_text(false));
    assert!(!session.is_busy());
    assert_eq!(session.controls(pattern)[0].values, [0.5]);
    assert_eq!(session.film().image().unwrap(), first);
    assert!(session.set_control(pattern, "nothing", &[9.0]).is_err());
    // The range is that of the slider alone.
    session.set_control(pattern, "width", &[9.0]).unwrap();
    assert_eq!(session.controls(pattern)[0].values, [9.0]);
    session.set_control(pattern, "width", &[0.5]).unwrap();
}

#[test]
fn an_edited_shader_is_compiled_and_no_other() {
    let folder = Folder::new("edit");
    let mut session = folder.open();
    finish(&mut session);
    let before = session.renderer.scene().code();
    let red = find(&session, "red");
    session.set_control(red, "kd", &[0.5]).unwrap();
    assert!(!session.reload().unwrap().changed, "no file changed");
    folder.write("stripes.rtsl", &STRIPES.replace("0.8", "0.1"));
    assert!(session.reload().unwrap().changed);
    assert_eq!(finish(&mut session), folder.render(&["red.kd=0.5"]), "parameters stay");
    let after = session.renderer.scene().code();
    let kept = after.iter().filter(|it| before.contains(it)).count();
    assert!(0 < kept && kept < after.len(), "{kept} of {}: a material has no texture", after.len());
}

#[test]
fn an_error_is_told_and_the_scene_stays() {
    let folder = Folder::new("error");
    let mut session = folder.open();
    let first = finish(&mut session);
    folder.write("stripes.rtsl", &STRIPES.replace("fract", "frac"));
    let messages = session.reload().unwrap_err().to_text(false);
    assert!(messages.contains("frac") && messages.contains("stripes.rtsl"), "{messages}");
    assert!(!session.is_busy());
    assert_eq!(session.film().image().unwrap(), first);
    // Meanwhile the session continues to work.
    let lamp = find(&session, "lamp");
    session.set_control(lamp, "intensity", &[20.0, 20.0, 20.0]).unwrap();
    let darker = finish(&mut session);
    folder.write("stripes.rtsl", STRIPES);
    assert!(!session.reload().unwrap().changed, "the text is as it was");
    assert_eq!(darker, folder.render(&["lamp.intensity=20,20,20"]));
}

#[test]
fn an_edited_scene_is_read_again() {
    let folder = Folder::new("scene");
    let mut session = folder.open();
    finish(&mut session);
    folder.write("scene.pbrt", &SCENE.replace("[0.8 0.1 0.1]", "[0.1 0.1 0.8]"));
    assert!(session.reload().unwrap().changed);
    let blue = finish(&mut session);
    assert_eq!(blue, folder.render(&[]));
    folder.write("scene.pbrt", &SCENE.replace("WorldBegin", "WorldBegins"));
    assert!(session.reload().is_err());
    let lamp = find(&session, "lamp");
    session.set_control(lamp, "intensity", &[1.0, 1.0, 1.0]).unwrap();
    folder.write("scene.pbrt", SCENE);
    assert!(session.reload().unwrap().changed);
    assert_eq!(finish(&mut session), folder.render(&[]));
}

#[test]
fn a_shader_that_never_ends_is_stopped_and_told() {
    let folder = Folder::new("endless");
    let mut session = folder.open();
    finish(&mut session);
    let before = shown(&session);
    let endless = "float endless() { float x = width; while (x > 0.0) x += 1.0; return x; }\n";
    let text = STRIPES.replace("void lookup", &format!("{endless}void lookup"));
    folder.write("stripes.rtsl", &text.replace("rt_TextureUV.x", "endless()"));
    session.reload().unwrap();
    while session.advance(SLICE) {}
    let problem = session.status().problem.expect("it runs past its budget");
    assert!(problem.contains("5000 loop iterations"), "{problem}");
    assert!(!session.is_busy());
    assert_eq!(shown(&session), before, "the old picture stays");
    folder.write("stripes.rtsl", STRIPES);
    session.reload().unwrap();
    assert_eq!(finish(&mut session), folder.render(&[]));
}

#[test]
fn a_pixel_names_what_it_shows() {
    let folder = Folder::new("pick");
    let session = folder.open();
    let ball = session.pick(22, 14).expect("the ball");
    assert_eq!((ball.title.as_str(), ball.class.as_str()), ("ball", "Sphere"));
    assert_eq!(ball.material, Some(find(&session, "red")));
    assert_eq!(ball.material_class, "Lambertian");
    let from_center =
        ball.position.iter().zip([0.0, 1.0, 0.0]).map(|(x, c)| (x - c) * (x - c)).sum::<f64>();
    assert!((from_center - 1.0).abs() < 1e-3, "{ball:?}");
    assert!((4.0..6.0).contains(&ball.distance), "{ball:?}");
    assert_eq!(session.pick(0, 29).map(|picked| picked.title), Some("shape on line 11".to_owned()));
    assert_eq!(session.pick(0, 0), None, "the sky");
    assert_eq!(session.pick(44, 0), None, "outside");
}

#[test]
fn times_are_shown_as_heat() {
    let folder = Folder::new("heat");
    let mut session = folder.open();
    finish(&mut session);
    let image = shown(&session);
    session.set_view_mode(ViewMode::Time);
    let heat = shown(&session);
    assert_ne!(heat, image);
    assert_eq!(heat[0], heat[1], "all pixels of a tile have its time");
    session.set_view_mode(ViewMode::Image);
    assert_eq!(shown(&session), image);
}

#[test]
fn samples_go_first_where_the_picture_is_rough() {
    let folder = Folder::new("rough");
    let text = SCENE.replace("\"integer pixelsamples\" 4", "\"integer pixelsamples\" 64");
    // The sphere has the greatest noise, the floor none.
    let text = text.replace("\"Lambertian\" \"rgb kd\"", "\"Noise\" \"rgb kd\"");
    folder.write("scene.pbrt", &text);
    let noise = "class Noise : rt_Material; public color kd = color(0.5);
        void shade() { rt_SampleColor = kd * rand(); }";
    folder.write("noise.rtsl", noise);
    let mut session = folder.open();
    let tile = |session: &Session, x: usize, y: usize| {
        let tiles = session.film().tiles();
        tiles.iter().position(|it| (it.x, it.y) == (x, y)).unwrap()
    };
    let (ball, sky) = (tile(&session, 16, 8), tile(&session, 0, 0));
    while session.film().taken(ball) < 64 {
        assert!(session.advance(Duration::from_micros(1)));
    }
    assert!(session.film().taken(sky) < 64, "only as many as all have first");
    assert_eq!(finish(&mut session), folder.render(&[]));
    assert_eq!(session.film().taken(sky), 64);
}

#[test]
fn visits_and_lanes_are_shown_as_heat_and_leave_the_image_alone() {
    let folder = Folder::new("counts");
    let mut session = folder.open();
    let first = finish(&mut session);
    let image = shown(&session);
    for mode in [ViewMode::Nodes, ViewMode::Lanes] {
        session.set_view_mode(mode);
        assert!(session.is_busy(), "what is counted takes samples");
        assert_eq!(finish(&mut session), first);
        assert_ne!(shown(&session), image);
    }
    let heat = shown(&session);
    assert_eq!(heat[0], heat[1], "all pixels of a tile go together");
    let lanes = session.status().lane_utilisation.expect("they were counted");
    assert!(lanes > 0.5 && lanes < 1.0, "{lanes}");
    session.set_view_mode(ViewMode::Image);
    assert!(!session.is_busy());
    assert_eq!(shown(&session), image);
}
