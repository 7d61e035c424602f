//! Tests of one ray against several objects: one call in the leaf call mode compared with a call in the single call
//! mode for each object.

use std::fmt::{self, Display, Formatter};
use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    CallArguments, CallMode, InstanceBlock, Instances, Kernel, LaneBlock, LaneMask, LeafArguments,
    LeafKernel, LeafTest, Method, lookup_state, new_state,
};
use serde::Serialize;

use crate::contenders::{Engines, class, object};
use crate::measure::{Plan, Subject, measure};
use crate::race::{Parameter, Shader};
use crate::random::{Random, normalize, subtract};

/// The number of objects of a leaf.
pub const OBJECTS: usize = 16;

/// The number of rays, tested one at a time.
const RAYS: usize = 64;

/// A class of objects.
pub struct Leaf {
    name: &'static str,
    shader: Shader,
    object: fn(&mut Random) -> Vec<Parameter>,
}

/// A result, in nanoseconds per ray and object.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct LeafResult {
    /// The class.
    pub leaf: &'static str,
    /// By a call in the single call mode for each object.
    pub single: f64,
    /// By one call in the leaf call mode.
    pub together: f64,
}

/// Returns the classes whose names contain `filter`.
pub fn leaves(filter: Option<&str>) -> Vec<Leaf> {
    let shader =
        |file, class| Shader { file, class, method: Method::Intersect, mode: CallMode::Leaf };
    let all = [
        Leaf { name: "sphere", shader: shader("sphere.rtsl", "Sphere"), object: sphere },
        Leaf { name: "triangle", shader: shader("triangle.rtsl", "Triangle"), object: triangle },
    ];
    all.into_iter().filter(|leaf| filter.is_none_or(|it| leaf.name.contains(it))).collect()
}

fn sphere(random: &mut Random) -> Vec<Parameter> {
    vec![
        Parameter::new("center", &random.point(1.0)),
        Parameter::new("radius", &[random.between(0.1, 0.4)]),
        Parameter::new("id", &[7.0]),
    ]
}

fn triangle(random: &mut Random) -> Vec<Parameter> {
    vec![
        Parameter::new("corner", &random.point(1.0)),
        Parameter::new("edge1", &random.point(1.0)),
        Parameter::new("edge2", &random.point(1.0)),
        Parameter::new("tolerance", &[1e-6]),
        Parameter::new("id", &[7.0]),
    ]
}

/// The two methods that are compared.
enum Way {
    Single(Arc<Kernel>),
    Together(LeafKernel),
}

/// Rays, each in separate memory, and objects.
struct Rays {
    states: Vec<LaneBlock>,
    scratch: LaneBlock,
    accepted: LaneMask,
    distance: usize,
    instances: Vec<InstanceBlock>,
}

/// Measures a class, and checks that both methods find the same hits.
///
/// # Errors
/// If the shader does not compile, or the hits differ.
pub fn run_leaf(leaf: &Leaf, engines: &Engines, plan: Plan) -> Result<LeafResult, String> {
    let engine = engines.widest().ok_or("there is no engine")?;
    let mut random = Random::new(7);
    let class = class(leaf.shader)?;
    let instances = (0..OBJECTS).map(|_| object(&class, &(leaf.object)(&mut random)));
    let instances = instances.collect::<Result<Vec<_>, _>>()?;
    let program = engine.program(&instances[0]);
    let kernel = |mode| {
        let kernel = program.kernel(Method::Intersect, mode);
        kernel.map_err(|error| error.message)
    };
    let objects = Arc::new(program.objects(instances.iter().map(|it| &**it)));
    let together = kernel(CallMode::Leaf)?.for_leaves(objects);
    let ways = [Way::Single(kernel(CallMode::Single)?), Way::Together(together)];
    let mut rays = Rays {
        states: (0..RAYS).map(|_| ray(&mut random)).collect(),
        scratch: program.new_scratch(OBJECTS),
        accepted: LaneMask::new(1),
        distance: component("rt_HitDistance"),
        instances: instances.iter().map(|instance| program.block(instance)).collect(),
    };
    let hits = ways.iter().map(|way| rays.hits(way)).collect::<Vec<_>>();
    if hits[0] != hits[1] {
        return Err(format!(
            "{}: the call mode `leaf` finds other hits than single calls",
            leaf.name
        ));
    }
    let timings = measure(&ways, &mut rays, RAYS * OBJECTS, plan);
    Ok(LeafResult { leaf: leaf.name, single: timings[0].median, together: timings[1].median })
}

fn component(name: &str) -> usize {
    lookup_state(name).expect("a variable of the language").first_component as usize
}

fn ray(random: &mut Random) -> LaneBlock {
    let mut state = new_state(1);
    let origin = [random.between(-1.0, 1.0), random.between(-1.0, 1.0), -5.0];
    let direction = normalize(subtract(random.point(1.0), origin));
    for axis in 0..3 {
        state.floats_mut(component("rt_RayOrigin") + axis)[0] = origin[axis];
        state.floats_mut(component("rt_RayDirection") + axis)[0] = direction[axis];
    }
    state.floats_mut(component("rt_Epsilon"))[0] = 1e-4;
    state
}

impl Rays {
    /// Returns the closest hit of each ray.
    fn hits(&mut self, way: &Way) -> Vec<u32> {
        way.run(self, 1);
        self.states.iter().map(|state| state.words(self.distance)[0]).collect()
    }
}

impl Subject<Rays> for Way {
    fn run(&self, rays: &mut Rays, times: u32) {
        let Rays { states, scratch, accepted, distance, instances } = rays;
        for _ in 0..times {
            for state in &mut *states {
                state.floats_mut(*distance)[0] = f32::INFINITY;
                match self {
                    Way::Single(kernel) => {
                        for block in &*instances {
                            call(kernel, state, scratch, accepted, Instances::One(block));
                        }
                    }
                    Way::Together(kernel) => {
                        let (count, host) = (OBJECTS as u32, &mut NoHost);
                        let tests = &mut [LeafTest::new(0, 0)];
                        let call = LeafArguments { state, scratch, count, tests, host };
                        let status = kernel.call(call);
                        debug_assert!(!status.budget_exhausted, "there is no budget");
                    }
                }
            }
        }
    }
}

/// Inlined, as `Kernel::call` is, so that passing arguments costs nothing.
#[inline(always)]
fn call(
    kernel: &Kernel,
    state: &mut LaneBlock,
    scratch: &mut LaneBlock,
    accepted: &mut LaneMask,
    instances: Instances<'_>,
) {
    let status = kernel.call(CallArguments {
        state,
        scratch,
        count: 1,
        mask: None,
        accepted: Some(accepted),
        instances,
        host: &mut NoHost,
    });
    debug_assert!(!status.budget_exhausted, "there is no budget");
}

impl Display for LeafResult {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let LeafResult { leaf, single, together } = self;
        let gain = single / together;
        write!(f, "{leaf:<21} single {single:7.3}  leaf {together:7.3}  {gain:5.1} times as fast")
    }
}
