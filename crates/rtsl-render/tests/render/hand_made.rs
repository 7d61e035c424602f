//! The renderer with classes that are built without the compiler's front end: the radiance of a ray does not depend on
//! width, threads or backend, and scenes of known radiance are correct.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::Arc;

use rtsl::{
    Backend, Class, Compiler, Engine, EngineOptions, Instance, Messages, Method, Role, Variable,
};
use rtsl_image::Image;
use rtsl_ir::{Function, Scalar};
use rtsl_math::Transform;
use rtsl_math::sampling::{FilterShape, PixelFilter, Sampler, SamplerKind};
use rtsl_render::Execution;
use rtsl_render::compiled::RenderScene;
use rtsl_render::schedule::{RenderOptions, render};
use rtsl_scene::{PlacedGroup, PlacedLight, Scene, SceneObject, Settings, WHITTED};

fn class(name: &str, role: Role, scratch: &[&str], methods: &[(Method, &str)]) -> Arc<Instance> {
    let function = |text: &str| -> Function { text.parse().expect("the test's text is right") };
    let methods = methods.iter().map(|(method, text)| (*method, function(text)));
    let place = |name: &&str| Variable {
        kind: rtsl_ir::VariableKind::Scratch,
        name: (*name).to_owned(),
        scalar: Scalar::F32,
        len: 1,
    };
    let class = Arc::new(Class {
        name: name.to_owned(),
        roles: vec![role],
        documentation: None,
        parameters: Vec::new(),
        members: Vec::new(),
        buffers: Vec::new(),
        scratch: scratch.iter().map(place).collect(),
        scratch_types: Vec::new(),
        outputs: Vec::new(),
        attributes: Vec::new(),
        method_documentation: Default::default(),
        is_traced: false,
        differentiable: Default::default(),
        references: Vec::new(),
        initializer: function("function initializer { return }"),
        constructor: None,
        methods: methods.collect::<BTreeMap<_, _>>(),
    });
    Instance::new(&class, []).expect("the class has no parameters")
}

/// Lines of operations from a shorthand: `c = a + b`, three times for vectors `c.`.
struct Text {
    head: String,
    body: String,
}

impl Text {
    fn new(places: &str) -> Self {
        Text { head: format!("function f {places}"), body: String::new() }
    }

    fn op(mut self, result: &str, operation: &str) -> Self {
        writeln!(self.body, "%{result}: f32 = {operation}").expect("strings can be written to");
        self
    }

    fn raw(mut self, line: &str) -> Self {
        self.body.push_str(line);
        self.body.push('\n');
        self
    }

    fn load(self, name: &str, variable: &str) -> Self {
        (0..3).fold(self, |text, i| {
            text.op(&format!("{name}{i}"), &format!("load state:{variable}@{i}"))
        })
    }

    fn each(self, result: &str, operation: &str) -> Self {
        (0..3).fold(self, |text, i| {
            text.op(&format!("{result}{i}"), &operation.replace('#', &i.to_string()))
        })
    }

    fn dot(self, result: &str, a: &str, b: &str) -> Self {
        self.each(&format!("{result}p"), &format!("multiply %{a}#, %{b}#"))
            .op(&format!("{result}s"), &format!("add %{result}p0, %{result}p1"))
            .op(result, &format!("add %{result}s, %{result}p2"))
    }

    fn end(self, outputs: &str) -> String {
        format!("{} {{ {} return {outputs} }}", self.head, self.body)
    }
}

fn vector_output(variable: &str, value: &str) -> String {
    let each = (0..3).map(|i| format!("state:{variable}@{i} = %{value}{i}"));
    each.collect::<Vec<_>>().join(", ")
}

const RAY: &str = "state rt_RayOrigin: f32[3] state rt_RayDirection: f32[3] ";
const HIT: &str =
    "state rt_HitPoint: f32[3] state rt_ShadingNormal: f32[3] state rt_SampleColor: f32[3] ";

fn camera() -> Arc<Instance> {
    let text = Text::new(&format!("{RAY} state rt_ScreenCoord: f32[2]"))
        .op("x", "load state:rt_ScreenCoord@0")
        .op("y", "load state:rt_ScreenCoord@1")
        .op("half", "constant 0.5")
        .op("o0", "constant 0.0")
        .op("o1", "constant 0.0")
        .op("o2", "constant -5.0")
        .op("d0", "subtract %x, %half")
        .op("d1", "subtract %y, %half")
        .op("d2", "constant 1.0");
    let outputs = format!(
        "{}, {}",
        vector_output("rt_RayOrigin", "o"),
        vector_output("rt_RayDirection", "d")
    );
    class("Eye", Role::Camera, &[], &[(Method::GenerateRay, &text.end(&outputs))])
}

/// The unit sphere. `intersect` leaves the side that was hit in scratch; the normal reads it.
fn sphere() -> Arc<Instance> {
    let intersect = Text::new(&format!(
        "{RAY} state rt_HitDistance: f32[1] state rt_Epsilon: f32[1] scratch side: f32[1] \
         accepted accepted: bool[1]"
    ))
    .load("o", "rt_RayOrigin")
    .load("d", "rt_RayDirection")
    .op("least", "load state:rt_Epsilon@0")
    .op("most", "load state:rt_HitDistance@0")
    .op("one", "constant 1.0")
    .op("minus", "constant -1.0")
    .dot("a", "d", "d")
    .dot("b", "o", "d")
    .dot("oo", "o", "o")
    .op("c", "subtract %oo, %one")
    .op("bb", "multiply %b, %b")
    .op("ac", "multiply %a, %c")
    .op("square", "subtract %bb, %ac")
    .op("root", "sqrt %square")
    .op("negative", "negate %b")
    .op("sum0", "subtract %negative, %root")
    .op("sum1", "add %negative, %root")
    .op("t0", "divide %sum0, %a")
    .op("t1", "divide %sum1, %a")
    .raw("%after0: bool = less %least, %t0 %before0: bool = less %t0, %most")
    .raw("%after1: bool = less %least, %t1 %before1: bool = less %t1, %most")
    .raw("%first: bool = and %after0, %before0 %second: bool = and %after1, %before1")
    .raw("%any: bool = or %first, %second")
    .op("t", "select %first, %t0, %t1")
    .op("side", "select %first, %one, %minus")
    .end("accepted:accepted@0 = %any, state:rt_HitDistance@0 = %t, scratch:side@0 = %side");
    let bounds = Text::new("state rt_BoundMin: f32[3] state rt_BoundMax: f32[3]")
        .each("a", "constant -1.0")
        .each("b", "constant 1.0");
    let outputs =
        format!("{}, {}", vector_output("rt_BoundMin", "a"), vector_output("rt_BoundMax", "b"));
    // The normal is scaled by |side|, to show that scratch arrives.
    let normal = Text::new(
        "state rt_HitPoint: f32[3] state rt_GeometricNormal: f32[3] state rt_ShadingNormal: f32[3] \
         scratch side: f32[1]",
    )
    .load("p", "rt_HitPoint")
    .op("side", "load scratch:side@0")
    .op("length", "multiply %side, %side")
    .each("n", "multiply %p#, %length");
    let normals = format!(
        "{}, {}",
        vector_output("rt_GeometricNormal", "n"),
        vector_output("rt_ShadingNormal", "n")
    );
    class(
        "Ball",
        Role::Primitive,
        &["side"],
        &[
            (Method::Intersect, &intersect),
            (Method::ComputeBounds, &bounds.end(&outputs)),
            (Method::ComputeNormal, &normal.end(&normals)),
        ],
    )
}

/// Half the radiance of the reflected ray, and a little noise.
fn mirror() -> Arc<Instance> {
    let text = Text::new(&format!("{RAY} {HIT}"))
        .load("p", "rt_HitPoint")
        .load("n", "rt_ShadingNormal")
        .load("d", "rt_RayDirection")
        .dot("dn", "d", "n")
        .op("two", "constant -2.0")
        .op("half", "constant 0.5")
        .op("little", "constant 0.1")
        .op("far", "constant inf")
        .op("one", "constant 1.0")
        .op("k", "multiply %dn, %two")
        .each("kn", "multiply %n#, %k")
        .each("r", "add %d#, %kn#")
        .raw("%l0: f32, %l1: f32, %l2: f32 = trace %p0, %p1, %p2, %r0, %r1, %r2, %far, %one")
        .op("random", "rand")
        .op("noise", "multiply %random, %little")
        .each("h", "multiply %l#, %half")
        .each("c", "add %h#, %noise");
    class(
        "Glass",
        Role::Material,
        &[],
        &[(Method::Shade, &text.end(&vector_output("rt_SampleColor", "c")))],
    )
}

/// An integrator of the standard library.
fn integrator(path: &str, class: &str) -> Arc<Instance> {
    let file = rtsl::library::file(path).unwrap();
    let compilation = Compiler::default().compile(file.path, file.text);
    Instance::new(compilation.unit.unwrap().class(class).unwrap(), []).unwrap()
}

/// The first light, by the cosine, and the ambient light.
fn matte() -> Arc<Instance> {
    let text = Text::new(HIT)
        .load("p", "rt_HitPoint")
        .load("n", "rt_ShadingNormal")
        .op("zero", "constant 0.0")
        .raw("%first: i32 = constant 0")
        .raw(
            "%lit: bool, %d0: f32, %d1: f32, %d2: f32, %far: f32, %l0: f32, %l1: f32, %l2: f32, \
             %pdf: f32 = light_sample %first, %p0, %p1, %p2, %n0, %n1, %n2, %zero",
        )
        .raw("%a0: f32, %a1: f32, %a2: f32 = ambient")
        .dot("cosine", "d", "n")
        .each("e", "multiply %l#, %cosine")
        .each("g", "select %lit, %e#, %zero")
        .each("c", "add %g#, %a#");
    class(
        "Chalk",
        Role::Material,
        &[],
        &[(Method::Shade, &text.end(&vector_output("rt_SampleColor", "c")))],
    )
}

fn sun() -> Arc<Instance> {
    let text = Text::new("state rt_LightDirection: f32[3] state rt_LightDistance: f32[1] state rt_LightColor: f32[3]")
        .op("d0", "constant 0.6")
        .op("d1", "constant 0.8")
        .op("d2", "constant 0.0")
        .op("far", "constant inf")
        .each("c", "constant 2.0");
    let outputs = format!(
        "{}, {}, state:rt_LightDistance@0 = %far",
        vector_output("rt_LightDirection", "d"),
        vector_output("rt_LightColor", "c")
    );
    class("Sun", Role::Light, &[], &[(Method::Illumination, &text.end(&outputs))])
}

fn white_sky() -> Arc<Instance> {
    let text = Text::new("state rt_EmissionColor: f32[3]").each("c", "constant 1.0");
    class(
        "Sky",
        Role::Light,
        &[],
        &[(Method::Emission, &text.end(&vector_output("rt_EmissionColor", "c")))],
    )
}

fn scene() -> Scene {
    let ball = sphere();
    let object = |center: [f64; 3], scale: f64, material: u32| SceneObject {
        primitive: ball.clone(),
        elements: None,
        motion: None,
        transform: Transform::translate(center).after(Transform::scale([scale, scale, scale])),
        material,
        emitter: None,
        reverse_orientation: false,
        alpha: None,
    };
    let light = |light: Arc<Instance>| PlacedLight { light, transform: Transform::IDENTITY };
    let mut objects: Vec<SceneObject> = (0..30)
        .map(|index| {
            let (x, y) = (f64::from(index % 6), f64::from(index / 6));
            object([x - 2.5, y - 2.0, y * 0.3], 0.6, (index % 2) as u32)
        })
        .collect();
    objects.push(object([0.0, 0.0, 0.0], 0.25, 0));
    Scene {
        integrator: None,
        path_tracer: integrator("shaders/integrators/path.rtsl", "Path"),
        whitted: integrator("shaders/integrators/whitted.rtsl", "Whitted"),
        settings: Settings {
            width: 50,
            height: 37,
            sampler: Sampler {
                kind: SamplerKind::Stratified { jitter: true },
                columns: 2,
                rows: 1,
                seed: 7,
            },
            max_depth: 4,
            integrator: Some(WHITTED),
            ..Settings::default()
        },
        camera: camera(),
        camera_to_world: Transform::IDENTITY,
        camera_motion: None,
        materials: vec![mirror(), matte()],
        lights: vec![light(sun()), light(white_sky())],
        ambient: [0.1, 0.2, 0.3],
        world: (0..30).collect(),
        groups: vec![vec![30]],
        instances: [[-1.0, 1.5, -2.0], [1.0, -1.0, -2.5]]
            .map(|place| PlacedGroup {
                group: 0,
                transform: Transform::translate(place).into(),
                motion: None,
            })
            .to_vec(),
        objects,
    }
}

fn image(scene: Scene, backend: Backend, width: u32, threads: usize) -> Image {
    let options = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
    let (engine, _) = Engine::new(options).expect("the width is one of those there are");
    let mut messages = Messages::default();
    let scene = RenderScene::new(&scene, &engine, &[], &mut messages, &|_| {})
        .unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    let options =
        RenderOptions { execution: Execution::on_threads(threads), ..RenderOptions::default() };
    render(&scene, options).expect("no shader loops").rendered.image
}

fn bits(image: &Image) -> Vec<[u32; 3]> {
    image.pixels.iter().map(|pixel| pixel.map(f32::to_bits)).collect()
}

#[test]
fn the_image_is_the_same_for_every_width_thread_count_and_backend() {
    let reference = image(scene(), Backend::Interpreter, 1, 1);
    let brightest = reference.pixels.iter().flatten().fold(0.0_f32, |most, x| most.max(*x));
    assert!(brightest > 0.5, "the image shows something: {brightest}");
    for (backend, width, threads) in [
        (Backend::Interpreter, 8, 2),
        (Backend::Auto, 1, 2),
        (Backend::Auto, 4, 1),
        (Backend::Auto, 8, 2),
        (Backend::Auto, 16, 2),
    ] {
        let image = image(scene(), backend, width, threads);
        assert!(bits(&image) == bits(&reference), "{backend:?}, width {width}, {threads} threads");
    }
}

#[test]
fn scrambled_points_and_filters_give_the_same_image_everywhere() {
    let filtered = || {
        let mut scene = scene();
        let kind = SamplerKind::Sobol;
        scene.settings.sampler = Sampler { kind, columns: 3, rows: 1, seed: 7 };
        let mitchell = FilterShape::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 };
        scene.settings.filter = PixelFilter::new(mitchell, [2.0; 2]);
        scene
    };
    let reference = image(filtered(), Backend::Interpreter, 1, 1);
    assert!(bits(&reference) != bits(&image(scene(), Backend::Interpreter, 1, 1)));
    for (width, threads) in [(4, 1), (8, 2)] {
        let image = image(filtered(), Backend::Auto, width, threads);
        assert!(bits(&image) == bits(&reference), "width {width}, {threads} threads");
    }
}

#[test]
fn a_ray_that_meets_nothing_sees_the_sky_and_ambient_light_is_added() {
    let mut scene = scene();
    scene.lights = vec![PlacedLight { light: white_sky(), transform: Transform::IDENTITY }];
    scene.objects.truncate(1);
    scene.objects[0].material = 1;
    scene.objects[0].transform = Transform::IDENTITY;
    scene.world = vec![0];
    (scene.groups, scene.instances) = (Vec::new(), Vec::new());
    scene.settings.sampler.kind = SamplerKind::Independent;
    let image = image(scene, Backend::Auto, 4, 2);
    assert_eq!(image.pixels[0], [1.0; 3]);
    assert_eq!(image.pixels[18 * 50 + 25], [0.1, 0.2, 0.3]);
}
