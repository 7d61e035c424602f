//! Placed objects against a ray that the test itself takes into the object's space.

use std::ops::Range;
use std::sync::Arc;

use rtsl::{
    Backend, CallArguments, CallMode, Class, Compiler, CompilerOptions, Engine, EngineOptions,
    Instance, Instances, LaneBlock, LaneIndices, LaneMask, LeafArguments, LeafTest, Math, Method,
    Objects, Placement, Program, Value, Variant, host::NoHost, lookup_state, new_state,
};
use rtsl_testing::random::Random;

/// Reads all of the ray, at a dynamic index, too.
const SLAB: &str = r#"
class Slab : rt_Primitive;
public float size = 1.0;
scratch vec3 where;
void intersect() {
    vec3 a = (vec3(-size) - rt_RayOrigin) * rt_InverseRayDirection;
    vec3 b = (vec3(size) - rt_RayOrigin) * rt_InverseRayDirection;
    vec3 low = min(a, b);
    vec3 high = max(a, b);
    float t = max(low.x, max(low.y, low.z));
    int axis = dominantAxis(rt_RayDirection);
    if (t <= min(high.x, min(high.y, high.z)) && hit(t))
        where = vec3(rt_RayDirection[axis], rt_RayOrigin[axis], t);
}
"#;

const COUNT: usize = 29;
/// The first object in the leaf shape, and the object of shapes that have one.
const FIRST: u32 = 8;
const OBJECT: usize = 9;

/// Origin and direction.
type Ray = [[f32; 3]; 2];

struct Scene {
    program: Arc<Program>,
    instances: Vec<Arc<Instance>>,
    placements: Vec<Placement>,
    /// A ray a lane.
    rays: Vec<Ray>,
    indices: LaneIndices,
}

fn class() -> Arc<Class> {
    let compilation = Compiler::new(CompilerOptions::default()).compile("placed.rtsl", SLAB);
    let unit = compilation.unit.as_ref().unwrap_or_else(|| panic!("{}", compilation.report(false)));
    unit.classes()[0].clone()
}

impl Scene {
    fn new(engine: &Engine) -> Scene {
        let (class, mut random) = (class(), Random::new(5));
        let objects = FIRST as usize + COUNT;
        let mut size = || Value::Float(0.75 + 0.5 * random.signed());
        let instances: Vec<Arc<Instance>> =
            (0..objects).map(|_| Instance::new(&class, [("size", size())]).unwrap()).collect();
        let placements = (0..objects).map(|_| std::array::from_fn(|_| random.signed())).collect();
        let rays = (0..COUNT).map(|_| {
            let origin = [random.signed(), random.signed(), -3.0];
            [origin, [random.signed() * 0.4, random.signed() * 0.4, 1.0]]
        });
        let rays = rays.collect();
        let mut indices = LaneIndices::new(COUNT);
        let numbers = indices.as_mut_slice().iter_mut().zip(0..);
        numbers.for_each(|(index, lane): (_, usize)| *index = (lane * 7 % objects) as u32);
        let program = engine.program(&instances[0]);
        Scene { program, instances, placements, rays, indices }
    }

    /// The hit of one ray with one object, by the method as it was written.
    fn expected(&self, ray: Ray, object: usize, contract: bool) -> Option<[u32; 4]> {
        let [origin, direction] = ray;
        let placement = &self.placements[object];
        let multiply_add =
            |a: f32, b: f32, c: f32| if contract { a.mul_add(b, c) } else { c + a * b };
        let map = |vector: [f32; 3], row: usize, start: Option<f32>| {
            let [a, b, c] = [0, 3, 6].map(|first| placement[first + row]);
            let sum = match start {
                Some(start) => multiply_add(a, vector[0], start),
                None => a * vector[0],
            };
            multiply_add(c, vector[2], multiply_add(b, vector[1], sum))
        };
        let origin = std::array::from_fn(|row| map(origin, row, Some(placement[9 + row])));
        let direction = std::array::from_fn(|row| map(direction, row, None));
        let block = self.program.block(&self.instances[object]);
        let mut state = state(&[[origin, direction]]);
        let variant = Variant::new(CallMode::Single);
        let found = call(&self.program, variant, &mut state, Instances::One(&block), 1);
        found.0[0]
    }

    /// Compares the hits of all lanes in all shapes.
    fn check(&self, contract: bool) {
        let objects = self.program.placed_objects(self.pairs());
        let block = self.program.placed_block(&self.instances[OBJECT], &self.placements[OBJECT]);
        for shape in CallMode::ALL {
            let instances = match shape {
                CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => {
                    Instances::One(&block)
                }
                CallMode::Stream => Instances::Many(&objects, &self.indices),
                CallMode::Leaf => Instances::Range(&objects, FIRST),
            };
            self.check_call(Variant::new(shape).placed(), instances, contract);
        }
        let of_objects = Variant::new(CallMode::Packet).placed().of_objects(objects.form().clone());
        self.check_call(of_objects, Instances::Object(&objects, OBJECT as u32), contract);
        for count in [1, 5, 8, COUNT] {
            self.check_tests(Arc::new(self.program.placed_objects(self.pairs())), count, contract);
        }
    }

    fn pairs(&self) -> impl Iterator<Item = (&Instance, &Placement)> {
        self.instances.iter().map(|it| &**it).zip(&self.placements)
    }

    /// Many tests in one call, each of another ray with `count` objects in a row: some from the first object on,
    /// some from [`FIRST`] on, and some rays are left out.
    fn check_tests(&self, objects: Arc<Objects>, count: usize, contract: bool) {
        let variant = Variant::new(CallMode::Leaf).placed();
        let kernel = self.program.kernel(Method::Intersect, variant).unwrap().for_leaves(objects);
        let (mut state, mut scratch) = (state(&self.rays), self.program.new_scratch(COUNT));
        let rays = (0..COUNT as u32).rev().filter(|ray| ray % 5 != 3);
        let tests = rays.map(|ray| LeafTest::new(ray, if ray % 3 == 0 { 0 } else { FIRST }));
        let mut tests: Vec<LeafTest> = tests.collect();
        let status = kernel.call(LeafArguments {
            state: &mut state,
            scratch: &mut scratch,
            count: count as u32,
            tests: &mut tests,
            host: &mut NoHost,
        });
        assert!(!status.budget_exhausted);
        let mut again = tests.clone();
        let status = kernel.call(LeafArguments {
            state: &mut new_state(COUNT),
            scratch: &mut self.program.new_scratch(COUNT),
            count: 0,
            tests: &mut again,
            host: &mut NoHost,
        });
        assert!(!status.budget_exhausted);
        assert!(again.iter().all(|test| test.nearest().is_none()), "there was nothing to hit");
        let mut found = [None; COUNT];
        tests.iter().for_each(|test| found[test.ray as usize] = Some(*test));
        let mut hits = 0;
        for (ray, test) in found.into_iter().enumerate() {
            let words = [0, 1, 2].map(|array| scratch.words(array)[ray]);
            let distance = state.words(component("rt_HitDistance"))[ray];
            let untouched = (f32::INFINITY.to_bits(), [0; 3]);
            let Some(test) = test else {
                assert_eq!((distance, words), untouched, "ray {ray} has no test");
                continue;
            };
            let range = test.first..test.first + count as u32;
            let expected = self.nearest(self.rays[ray], range, contract);
            assert_eq!(test.nearest(), expected.map(|(_, object)| object), "ray {ray}");
            let hit = expected.map_or(untouched, |([t, a, b, c], _)| (t, [a, b, c]));
            assert_eq!((distance, words), hit, "ray {ray}");
            hits += usize::from(expected.is_some());
        }
        assert!(hits > 0 && (count > 1 || hits < tests.len()), "{hits} hits");
    }

    /// The nearest hit of a ray with some objects, and which has it.
    fn nearest(&self, ray: Ray, objects: Range<u32>, contract: bool) -> Option<([u32; 4], u32)> {
        let hits = objects
            .filter_map(|object| Some((self.expected(ray, object as usize, contract)?, object)));
        let distance = |hit: &[u32; 4]| f32::from_bits(hit[0]);
        hits.min_by(|(a, _), (b, _)| distance(a).total_cmp(&distance(b)))
    }

    fn check_call(&self, variant: Variant, instances: Instances<'_>, contract: bool) {
        let shape = variant.mode;
        let mut rays = self.rays.clone();
        let origin = rays[0][0];
        if shape == CallMode::CommonOrigin {
            rays.iter_mut().for_each(|ray| ray[0] = origin);
        }
        let count = if shape == CallMode::Single { 1 } else { COUNT };
        let (found, nearest) = call(&self.program, variant, &mut state(&rays), instances, count);
        if shape == CallMode::Leaf {
            let expected = self.nearest(rays[0], FIRST..FIRST + COUNT as u32, contract);
            assert_eq!(nearest, expected.map(|(_, object)| object));
            assert!(expected.is_some_and(|(hit, _)| found[0] == Some(hit)), "{found:?}");
            return;
        }
        for (ray, found) in found.iter().enumerate() {
            let object = instances.number(ray).map_or(OBJECT, |number| number as usize);
            assert_eq!(*found, self.expected(rays[ray], object, contract), "{shape:?}, ray {ray}");
        }
    }
}

fn component(name: &str) -> usize {
    lookup_state(name).unwrap().first_component as usize
}

fn state(rays: &[Ray]) -> LaneBlock {
    let mut state = new_state(rays.len());
    for (lane, [origin, direction]) in rays.iter().enumerate() {
        for axis in 0..3 {
            state.floats_mut(component("rt_RayOrigin") + axis)[lane] = origin[axis];
            state.floats_mut(component("rt_RayDirection") + axis)[lane] = direction[axis];
            let inverse = 1.0 / direction[axis];
            state.floats_mut(component("rt_InverseRayDirection") + axis)[lane] = inverse;
        }
        state.floats_mut(component("rt_HitDistance"))[lane] = f32::INFINITY;
    }
    state
}

/// Distance and scratch of each lane's hit, by the kernel and by packet code; the nearest object.
fn call(
    program: &Program,
    variant: Variant,
    state: &mut LaneBlock,
    instances: Instances<'_>,
    count: usize,
) -> (Vec<Option<[u32; 4]>>, Option<u32>) {
    let kernel = program.kernel(Method::Intersect, variant.clone()).unwrap();
    let packets = program.packet_kernel(Method::Intersect, variant.clone()).unwrap();
    let run = |state: &mut LaneBlock, run: &dyn Fn(CallArguments<'_>) -> rtsl::CallStatus| {
        let mut accepted = LaneMask::new(count);
        let mut scratch = program.new_scratch(count);
        let status = run(CallArguments {
            state,
            scratch: &mut scratch,
            count,
            mask: None,
            accepted: Some(&mut accepted),
            instances,
            host: &mut NoHost,
        });
        let hits = (0..count).map(|lane| {
            let is_hit = accepted.get(lane) || (lane == 0 && status.nearest.is_some());
            let words = [0, 1, 2].map(|array| scratch.words(array)[lane]);
            let distance = state.words(component("rt_HitDistance"))[lane];
            is_hit.then_some([distance, words[0], words[1], words[2]])
        });
        (hits.collect::<Vec<_>>(), status.nearest)
    };
    let mut copy = state.clone();
    let found = run(state, &|call| kernel.call(call));
    assert_eq!(run(&mut copy, &|call| packets.run(call, u64::MAX).status), found);
    found
}

#[test]
fn placed_objects_see_the_ray_in_their_own_space() {
    for (backend, width) in [
        (Backend::Interpreter, 1),
        (Backend::Jit, 1),
        (Backend::Jit, 4),
        (Backend::Jit, 8),
        (Backend::Jit, 16),
    ] {
        for math in [Math::Contract, Math::Strict] {
            let options = EngineOptions { backend, width: Some(width), math, ..Default::default() };
            let (engine, _) = Engine::new(options).unwrap();
            Scene::new(&engine).check(math == Math::Contract);
        }
    }
}
