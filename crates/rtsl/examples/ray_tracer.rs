//! A ray tracer: a primitive and a material from files named on the command line, and a picture for each name that ends
//! with `.ppm`, with the parameters that were set before it:
//!
//!     ray_tracer torus.rtsl ward.rtsl minorRadius=0.2 thin.ppm minorRadius=0.5 alphaU=0.4 thick.ppm

use std::array::from_fn;
use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use rtsl::{host::*, *};

const WIDTH: usize = 512;
const HEIGHT: usize = 384;
const RAYS: usize = 64;
const EYE: [f32; 3] = [0.0, 2.4, -3.2];
const AHEAD: [f32; 3] = [0.0, -0.6, 0.8];
const UP: [f32; 3] = [0.0, 0.8, 0.6];

#[rustfmt::skip]
fn sky(component: usize, y: f32) -> f32 { 0.45 + 0.1 * component as f32 + 0.4 * y }

/// The surroundings of the material: a light from the upper right, and a sky that traced rays find.
struct World;

#[rustfmt::skip]
impl Host for World {
    fn trace(&mut self, _: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        *radiance = from_fn(|component| rays.direction[1].map(|y| sky(component, y)));
    }
    fn light_count(&mut self) -> u32 { 1 }
    fn light_sample(&mut self, lanes: LaneSet, _: u32, _: &LightQueryLanes, light: &mut LightLanes) -> u32 {
        light.direction = [[0.48; 16], [0.64; 16], [-0.6; 16]];
        light.color = [[3.2; 16], [3.0; 16], [2.6; 16]];
        lanes.active
    }
}

/// A class with what its parameters are set to.
struct Object {
    class: Arc<Class>,
    settings: Vec<(String, f32)>,
    /// Kept, so that its kernels are: instances of one class share a program.
    program: Arc<Program>,
    block: InstanceBlock,
}

impl Object {
    /// The first class of a file.
    fn load(path: &str, engine: &Engine) -> Result<Object, Box<dyn Error>> {
        let compilation = Compiler::default().compile_file(Path::new(path));
        let unit = compilation.unit.as_ref().ok_or_else(|| compilation.report(false))?;
        let class = unit.classes().first().ok_or("the file has no class")?.clone();
        let instance = Instance::new(&class, [])?;
        let program = engine.program(&instance);
        Ok(Object { class, settings: Vec::new(), block: program.block(&instance), program })
    }

    /// Sets a parameter. Nothing is compiled.
    fn set(&mut self, name: &str, value: f32) -> Result<(), Box<dyn Error>> {
        self.settings.retain(|(other, _)| other != name);
        self.settings.push((name.to_owned(), value));
        let settings = self.settings.iter().map(|(name, value)| (name.as_str(), (*value).into()));
        self.block = self.program.block(&*Instance::new(&self.class, settings)?);
        Ok(())
    }

    /// Calls a method for the rays of a mask, if the class has it; gives those that it found a hit for.
    #[rustfmt::skip]
    fn call(&self, method: Method, state: &mut LaneBlock, mask: Option<&LaneMask>) -> Result<LaneMask, Box<dyn Error>> {
        let mut accepted = LaneMask::new(RAYS);
        if self.program.has(method) {
            let kernel = self.program.kernel(method, CallMode::Packet)?;
            let (scratch, instances) = (&mut self.program.new_scratch(RAYS), Instances::One(&self.block));
            let (accepted, host) = (Some(&mut accepted), &mut World);
            let _ = kernel.call(CallArguments { state, scratch, count: RAYS, mask, accepted, instances, host });
        }
        Ok(accepted)
    }
}

/// The components of a state variable, an array each.
fn vectors<'a, const N: usize>(state: &'a mut LaneBlock, name: &str) -> [&'a mut [f32]; N] {
    state.vectors_mut(lookup_state(name).expect("the table has it").first_component as usize)
}

fn normalize(vectors: [&mut [f32]; 3]) {
    (0..RAYS).for_each(|ray| {
        let [x, y, z] = from_fn(|i| vectors[i][ray]);
        (0..3).for_each(|i| vectors[i][ray] /= (x * x + y * y + z * z).sqrt());
    });
}

/// The colours of `RAYS` pixels in a row from `x` on.
#[rustfmt::skip]
fn render(primitive: &Object, material: &Object, x: usize, y: usize) -> Result<Vec<u8>, Box<dyn Error>> {
    let state = &mut new_state(RAYS);
    [Role::Primitive, Role::Material].into_iter().for_each(|role| set_defaults(state, role));
    let v = ((HEIGHT / 2) as f32 - y as f32 - 0.5) / HEIGHT as f32;
    let u = |ray| ((x + ray) as f32 + 0.5 - (WIDTH / 2) as f32) / HEIGHT as f32;
    let mut direction: [[f32; RAYS]; 3] =
        from_fn(|i| from_fn(|ray| AHEAD[i] + if i == 0 { u(ray) } else { v * UP[i] }));
    normalize(direction.each_mut().map(|it| &mut it[..]));
    for i in 0..3 {
        vectors::<3>(state, "rt_RayOrigin")[i].fill(EYE[i]);
        vectors::<3>(state, "rt_RayDirection")[i].copy_from_slice(&direction[i]);
        vectors::<3>(state, "rt_InverseRayDirection")[i].copy_from_slice(&direction[i].map(|it| 1.0 / it));
    }
    let hits = primitive.call(Method::Intersect, state, None)?;
    let distance = vectors::<1>(state, "rt_HitDistance")[0].to_vec();
    for (i, point) in vectors::<3>(state, "rt_HitPoint").into_iter().enumerate() {
        (0..RAYS).for_each(|ray| point[ray] = EYE[i] + distance[ray] * direction[i][ray]);
    }
    primitive.call(Method::ComputeNormal, state, Some(&hits))?;
    normalize(vectors(state, "rt_GeometricNormal"));
    normalize(vectors(state, "rt_ShadingNormal"));
    primitive.call(Method::ComputeTextureCoordinates, state, Some(&hits))?;
    primitive.call(Method::ComputeDerivatives, state, Some(&hits))?;
    material.call(Method::Shade, state, Some(&hits))?;
    let color = vectors::<3>(state, "rt_SampleColor");
    let value = |ray, i: usize| if hits.get(ray) { color[i][ray] } else { sky(i, direction[1][ray]) };
    // A display's gamma is about 2.
    let pixel = |value: f32| (255.0 * value.clamp(0.0, 1.0).sqrt() + 0.5) as u8;
    Ok((0..3 * RAYS).map(|index| pixel(value(index / 3, index % 3))).collect())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [primitive, material, actions @ ..] = &arguments[..] else {
        return Err("ray_tracer PRIMITIVE.rtsl MATERIAL.rtsl [NAME=NUMBER | PICTURE.ppm]...".into());
    };
    let (engine, _) = Engine::new(EngineOptions::default())?;
    let mut objects = [Object::load(primitive, &engine)?, Object::load(material, &engine)?];
    for action in actions {
        if let Some((name, number)) = action.split_once('=') {
            let of_material = objects[1].class.parameters.iter().any(|it| it.name == name);
            objects[usize::from(of_material)].set(name, number.parse()?)?;
            continue;
        }
        let start = Instant::now();
        let mut picture = format!("P6\n{WIDTH} {HEIGHT}\n255\n").into_bytes();
        for pixel in (0..WIDTH * HEIGHT).step_by(RAYS) {
            picture.extend(render(&objects[0], &objects[1], pixel % WIDTH, pixel / WIDTH)?);
        }
        println!("{action}: {:.1?}", start.elapsed());
        std::fs::write(action, picture)?;
    }
    Ok(())
}
