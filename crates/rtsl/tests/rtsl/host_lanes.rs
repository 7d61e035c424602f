//! Calls with a host's own arrays do what calls with blocks do, at every width, on machine code and the interpreter.

use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CallError, CallMode, CallStatus, Compiler, Engine, EngineOptions,
    HostArguments, HostLanes, Instance, Instances, LaneMask, Method, Program, Variant,
    lookup_state, new_state, state_component_count,
};

const BALL: &str = "class Ball : rt_Primitive; public float radius = 1.0; scratch vec2 variable;
    void intersect() {
        float b = dot(rt_RayOrigin, rt_RayDirection);
        float d = b * b - dot(rt_RayOrigin, rt_RayOrigin) + radius * radius;
        if (d > 0.0 && hit(-b - sqrt(d))) variable = rt_RayOrigin.xy + variable;
    }";

/// State and scratch of a host, component by component.
struct Arrays {
    state: Vec<Vec<f32>>,
    scratch: Vec<Vec<f32>>,
    lanes: usize,
}

impl Arrays {
    fn new(lanes: usize) -> Arrays {
        let first = |name| lookup_state(name).unwrap().first_component as usize;
        let mut state = vec![vec![0.0; lanes]; state_component_count() as usize];
        let x = (0..lanes).map(|lane| (lane as f32 - 8.0) * 0.2);
        state[first("rt_RayOrigin")] = x.collect();
        state[first("rt_RayOrigin") + 2].fill(-3.0);
        state[first("rt_RayDirection") + 2].fill(1.0);
        state[first("rt_HitDistance")].fill(f32::INFINITY);
        let scratch = vec![vec![0.5; lanes]; 2];
        Arrays { state, scratch, lanes }
    }

    fn call(
        &mut self,
        program: &Arc<Program>,
        variant: &Variant,
        instance: &Instance,
        count: usize,
        mask: &[i32],
        accepted: &mut [i32],
    ) -> Result<CallStatus, CallError> {
        let kernel = program.kernel(Method::Intersect, variant.clone()).unwrap();
        let mut state = HostLanes::new(self.state.len(), self.lanes);
        for (component, array) in self.state.iter_mut().enumerate() {
            state.bind(component, array);
        }
        let mut scratch = HostLanes::new(2, self.lanes);
        for (component, array) in self.scratch.iter_mut().enumerate() {
            scratch.bind(component, array);
        }
        kernel.call_host(HostArguments {
            state: &mut state,
            scratch: &mut scratch,
            count,
            mask: Some(mask),
            accepted: Some(accepted),
            instances: Instances::One(&program.block(instance)),
            host: &mut NoHost,
        })
    }
}

/// State, scratch and mask after a call with blocks.
fn expected(
    program: &Program,
    instance: &Instance,
    count: usize,
    mask: &[i32],
) -> (Arrays, Vec<bool>) {
    let mut arrays = Arrays::new(count);
    let (mut state, mut scratch) = (new_state(count), program.new_scratch(count));
    for (component, array) in arrays.state.iter().enumerate() {
        state.floats_mut(component).copy_from_slice(array);
    }
    (0..2).for_each(|array| scratch.floats_mut(array).fill(0.5));
    let mut accepted = LaneMask::new(count);
    let kernel = program.kernel(Method::Intersect, CallMode::Packet).unwrap();
    let _ = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut scratch,
        count,
        mask: Some(&LaneMask::from_fn(count, |lane| mask[lane] != 0)),
        accepted: Some(&mut accepted),
        instances: Instances::One(&program.block(instance)),
        host: &mut NoHost,
    });
    for (component, array) in arrays.state.iter_mut().enumerate() {
        array.copy_from_slice(state.floats(component));
    }
    for (component, array) in arrays.scratch.iter_mut().enumerate() {
        array.copy_from_slice(scratch.floats(component));
    }
    (arrays, (0..count).map(|lane| accepted.get(lane)).collect())
}

#[test]
fn host_arrays_are_worked_on_where_they_are() {
    let unit = Compiler::default().compile("ball.rtsl", BALL).unit.expect("it compiles");
    for backend in [Backend::Auto, Backend::Interpreter] {
        let (engine, _) = Engine::new(EngineOptions { backend, ..Default::default() }).unwrap();
        let ball = Instance::new(unit.class("Ball").unwrap(), []).unwrap();
        let program = engine.program(&ball);
        for (width, count) in [(1, 1_usize), (1, 7), (4, 3), (4, 4), (8, 13), (16, 17), (16, 32)] {
            let variant = Variant::new(CallMode::Packet).with_width(width);
            let lanes = count.next_multiple_of(width as usize);
            let mask: Vec<i32> = (0..lanes).map(|lane| -i32::from(lane % 5 != 2)).collect();
            let (mut arrays, mut accepted) = (Arrays::new(lanes), vec![7; lanes]);
            let status = arrays.call(&program, &variant, &ball, count, &mask, &mut accepted);
            assert_eq!(status, Ok(CallStatus::default()));
            let (expected, hits) = expected(&program, &ball, count, &mask);
            for (found, expected) in arrays.state.iter().zip(&expected.state) {
                assert_eq!(found[..count], expected[..]);
            }
            for (found, expected) in arrays.scratch.iter().zip(&expected.scratch) {
                assert_eq!(found[..count], expected[..]);
            }
            let accepted = accepted[..count].iter().map(|word| *word != 0);
            assert!(accepted.eq(hits), "width {width}, {count} rays");
        }
    }
}

#[test]
fn calls_that_do_not_fit_are_errors() {
    let unit = Compiler::default().compile("ball.rtsl", BALL).unit.expect("it compiles");
    let (engine, _) = Engine::new(EngineOptions::default()).unwrap();
    let ball = Instance::new(unit.class("Ball").unwrap(), []).unwrap();
    let program = engine.program(&ball);
    let variant = Variant::new(CallMode::Packet).with_width(8);
    let mut arrays = Arrays::new(7);
    let too_few = arrays.call(&program, &variant, &ball, 5, &[-1; 8], &mut [0; 8]);
    if engine.llvm().is_some() {
        assert_eq!(too_few, Err(CallError::TooFewLanes { rays: 5, needed: 8, given: 7 }));
    }
    arrays = Arrays::new(8);
    let short_mask = arrays.call(&program, &variant, &ball, 5, &[-1; 4], &mut [0; 8]);
    assert!(matches!(short_mask, Err(CallError::TooFewLanes { .. })));
    let many = arrays.call(&program, &variant, &ball, usize::MAX, &[-1; 8], &mut [0; 8]);
    assert_eq!(many, Err(CallError::TooManyRays(usize::MAX)));
    let wrong_width =
        program.kernel(Method::Intersect, Variant::new(CallMode::Packet).with_width(3));
    assert_eq!(wrong_width.unwrap_err().code.as_str(), "E0703");
}

/// A call of the single shape with arrays of as many lanes as rays, parts of larger ones; and what it changed of those.
fn single_call(
    backend: Backend,
    count: usize,
    mask: Option<&[i32]>,
) -> (Result<CallStatus, CallError>, Vec<f32>) {
    const LANES: usize = 4;
    let unit = Compiler::default().compile("ball.rtsl", BALL).unit.expect("it compiles");
    let (engine, _) = Engine::new(EngineOptions { backend, ..Default::default() }).unwrap();
    let ball = Instance::new(unit.class("Ball").unwrap(), []).unwrap();
    let program = engine.program(&ball);
    let kernel = program.kernel(Method::Intersect, CallMode::Single).unwrap();
    let lanes = count.min(LANES);
    let mut arrays = Arrays::new(LANES);
    let given = arrays.state.concat();
    let mut state = HostLanes::new(arrays.state.len(), lanes);
    for (component, array) in arrays.state.iter_mut().enumerate() {
        state.bind(component, &mut array[..lanes]);
    }
    let mut scratch = HostLanes::new(2, lanes);
    for (component, array) in arrays.scratch.iter_mut().enumerate() {
        scratch.bind(component, &mut array[..lanes]);
    }
    let status = kernel.call_host(HostArguments {
        state: &mut state,
        scratch: &mut scratch,
        count,
        mask,
        accepted: Some(&mut vec![0; lanes]),
        instances: Instances::One(&program.block(&ball)),
        host: &mut NoHost,
    });
    let found = arrays.state.concat();
    let changed = found.into_iter().zip(given).filter(|(found, given)| found != given);
    (status, changed.map(|(found, _)| found).collect())
}

/// Code of the single shape looks at neither the count nor the mask: it works on the first lane, there or not.
#[test]
fn the_single_shape_takes_one_ray_and_no_mask() {
    for backend in [Backend::Auto, Backend::Interpreter] {
        let refused = (Err(CallError::NotOneRay), Vec::new());
        for count in [0, 2, 4, i32::MAX as usize, usize::MAX] {
            assert_eq!(single_call(backend, count, None), refused, "{backend:?}, {count} rays");
        }
        assert_eq!(single_call(backend, 1, Some(&[0])), refused, "{backend:?}, a mask");
        assert_eq!(single_call(backend, 0, Some(&[])), refused, "{backend:?}, an empty mask");
        let (status, changed) = single_call(backend, 1, None);
        assert_eq!((status, changed.len()), (Ok(CallStatus::default()), 0), "the ray misses");
    }
}

#[test]
fn variables_that_came_later_need_no_storage_unless_methods_set_them() {
    let text = "class Flat : rt_Primitive;
        void computeNormal() { rt_GeometricNormal = vec3(0.0, 1.0, 0.0); }
        class Wide : rt_Primitive;
        void computeNormal() { rt_GeometricNormal = vec3(0.0, 1.0, 0.0); rt_SurfaceOffset = 0.5; }";
    let unit = Compiler::default().compile("shapes.rtsl", text).unit.expect("it compiles");
    let (engine, _) = Engine::new(EngineOptions::default()).expect("an engine");
    let writes = |class: &str| {
        let instance =
            Instance::new(unit.class(class).expect("it is there"), []).expect("no parameters");
        let method = engine.program(&instance).method(Method::ComputeNormal).expect("it has it");
        method.writes.iter().any(|it| it.name == "rt_SurfaceOffset")
    };
    assert!(!writes("Flat") && writes("Wide"));
}
