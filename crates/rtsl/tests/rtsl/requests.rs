//! Requests for rays and light: hosts answer them chunk by chunk, may call kernels, and may panic.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use rtsl::host::{Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, RayLanes};
use rtsl::{
    Backend, CallArguments, CallMode, Engine, EngineOptions, Instance, InstanceBlock, Instances,
    Kernel, LaneMask, Method, lookup_state, new_state,
};

use crate::common::class;

/// Rays below 20 trace; the others ask whether something is in the way, and for a light. Then all trace again.
const SHADE: &str = "
function Test.shade
state rt_SampleColor: f32[3]
{
  %zero: f32 = constant 0.0
  %one: f32 = constant 1.0
  %first: i32 = constant 1
  %limit: f32 = constant 20.0
  %ray: f32 = rand
  %few: bool = less %ray, %limit
  %chosen: f32 = if %few {
    %r: f32, %g: f32, %b: f32 = trace %ray, %zero, %zero, %one, %zero, %zero, %one, %one
    yield %r
  } else {
    %hidden: bool = occluded %ray, %zero, %zero, %one, %zero, %zero, %one
    %reached: bool, %x: f32, %y: f32, %z: f32, %distance: f32, %lr: f32, %lg: f32, %lb: f32, %pdf: f32 = \
light_sample %first, %ray, %zero, %zero, %one, %zero, %zero, %zero
    %lit: f32 = select %hidden, %zero, %distance
    yield %lit
  }
  %tr: f32, %tg: f32, %tb: f32 = trace %ray, %zero, %zero, %zero, %one, %zero, %one, %one
  return state:rt_SampleColor@0 = %chosen, state:rt_SampleColor@1 = %tr, state:rt_SampleColor@2 = %tg
}";

/// `shade`, ready to be called.
struct Shader {
    kernel: Arc<Kernel>,
    block: InstanceBlock,
}

impl Shader {
    fn new(backend: Backend, width: u32) -> Option<Shader> {
        let options = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
        let (engine, _) = Engine::new(options).ok()?;
        let class = class(Method::Shade, &SHADE.replace("\\\n", ""));
        let instance = Instance::new(&class, []).unwrap();
        let program = engine.program(&instance);
        let kernel = program.kernel(Method::Shade, CallMode::Packet).unwrap();
        Some(Shader { kernel, block: program.block(&instance) })
    }

    fn shade(&self, count: usize, mask: Option<&LaneMask>, host: &mut dyn Host) -> Vec<[f32; 3]> {
        let mut state = new_state(count);
        let status = self.kernel.call(CallArguments {
            state: &mut state,
            scratch: &mut rtsl::LaneBlock::new(0, count),
            count,
            mask,
            accepted: None,
            instances: Instances::One(&self.block),
            host,
        });
        assert!(!status.budget_exhausted);
        let color = lookup_state("rt_SampleColor").unwrap().first_component as usize;
        (0..count).map(|ray| [0, 1, 2].map(|it| state.floats(color + it)[ray])).collect()
    }
}

/// Answers by what is asked alone, shades again up to a depth, and counts.
struct Scene<'a> {
    shader: &'a Shader,
    depth: u32,
    /// The number of requests.
    asked: usize,
    /// It panics when it is asked so often.
    patience: usize,
}

impl<'a> Scene<'a> {
    fn new(shader: &'a Shader, depth: u32) -> Self {
        Scene { shader, depth, asked: 0, patience: usize::MAX }
    }

    fn count(&mut self) {
        assert!(self.asked < self.patience, "the host has had enough");
        self.asked += 1;
    }
}

impl Host for Scene<'_> {
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        self.count();
        for lane in lanes.iter() {
            radiance[0][lane] = 2.0 * rays.origin[0][lane] + rays.direction[0][lane];
            assert_eq!(rays.origin[0][lane], (lanes.base as usize + lane) as f32);
        }
        if self.depth > 0 {
            // A call from within a call.
            let mut inner = Scene::new(self.shader, self.depth - 1);
            let shaded = self.shader.shade(33, None, &mut inner);
            lanes
                .iter()
                .for_each(|lane| radiance[1][lane] = shaded[(lanes.base as usize + lane) % 33][1]);
        }
    }

    fn occluded(&mut self, lanes: LaneSet, rays: &RayLanes) -> u32 {
        self.count();
        lanes
            .iter()
            .filter(|lane| (rays.origin[0][*lane] as u32).is_multiple_of(2))
            .fold(0, |m, it| m | 1 << it)
    }

    fn light_count(&mut self) -> u32 {
        2
    }

    fn light_sample(
        &mut self,
        _: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        self.count();
        assert_eq!(index, 1);
        light.distance = query.point[0].map(|x| x + 0.5);
        u32::MAX
    }

    fn ambient(&mut self) -> [f32; 3] {
        [0.0; 3]
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        lanes.iter().for_each(|lane| values[lane] = (lanes.base as usize + lane) as f32);
    }
}

fn shaders() -> impl Iterator<Item = (u32, Shader)> {
    let widths = Engine::WIDTHS.into_iter();
    widths.filter_map(|width| Some((width, Shader::new(Backend::Jit, width)?)))
}

#[test]
fn answers_do_not_depend_on_the_width() {
    let oracle = Shader::new(Backend::Interpreter, 1).unwrap();
    let some = LaneMask::from_fn(150, |ray| ray % 7 != 3 && !(16..40).contains(&ray));
    for (width, shader) in shaders() {
        for count in [1, 20, 64, 150] {
            for (mask, depth) in [(None, 0), (None, 2), (Some(&some), 1)] {
                let expected = oracle.shade(count, mask, &mut Scene::new(&oracle, depth));
                let shaded = shader.shade(count, mask, &mut Scene::new(&shader, depth));
                assert_eq!(shaded, expected, "width {width}, {count} rays, depth {depth}");
            }
        }
    }
}

#[test]
fn each_chunk_asks_once_for_all_of_its_rays() {
    for (width, shader) in shaders().filter(|(width, _)| *width > 1) {
        let mut scene = Scene::new(&shader, 0);
        shader.shade(64, None, &mut scene);
        let chunks = 64 / width as usize;
        let first = 20_usize.div_ceil(width as usize);
        let others = chunks - 20 / width as usize;
        assert_eq!(scene.asked, first + 2 * others + chunks, "width {width}");
    }
}

#[test]
fn a_panic_of_the_host_resumes_when_the_kernel_has_returned() {
    for (width, shader) in shaders() {
        for patience in 0..3 {
            let mut scene = Scene { patience, ..Scene::new(&shader, 1) };
            let result = catch_unwind(AssertUnwindSafe(|| shader.shade(64, None, &mut scene)));
            let message = *result.err().unwrap().downcast::<&str>().unwrap();
            assert_eq!(message, "the host has had enough", "width {width}");
            assert_eq!(scene.asked, patience);
        }
    }
}

#[test]
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn calls_that_are_too_deep_panic_with_an_error() {
    for backend in [Backend::Jit, Backend::Interpreter] {
        let Some(shader) = Shader::new(backend, 16) else { continue };
        let endless = || {
            let mut scene = Scene::new(&shader, u32::MAX);
            let result = catch_unwind(AssertUnwindSafe(|| shader.shade(1, None, &mut scene)));
            *result.err().unwrap().downcast::<String>().unwrap()
        };
        let thread = std::thread::Builder::new().stack_size(4 << 20);
        let message = std::thread::scope(|scope| {
            thread.spawn_scoped(scope, endless).unwrap().join().unwrap()
        });
        assert!(message.contains("stack has too little room"), "{backend:?}: {message}");
    }
}
