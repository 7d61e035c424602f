//! Compiles a sphere and asks it about five rays: `cargo run -p rtsl --example rays`.

use rtsl::host::NoHost;
use rtsl::{
    CallArguments, CallMode, Compiler, Diagnostic, Diagnostics, Engine, EngineOptions, Instance,
    Instances, LaneMask, Method, Role, Value, lookup_state, new_state, set_defaults,
};

const SPHERE: &str = "
class Ball : rt_Primitive;
public float radius = 1.0;

void intersect() {
    float a = dot(rt_RayDirection, rt_RayDirection);
    float b = dot(rt_RayOrigin, rt_RayDirection);
    float c = dot(rt_RayOrigin, rt_RayOrigin) - radius * radius;
    float discriminant = b * b - a * c;
    if (discriminant >= 0.0) {
        float root = sqrt(discriminant);
        if (!hit((-b - root) / a)) hit((root - b) / a);
    }
}";

const RAYS: usize = 5;

fn main() {
    let compilation = Compiler::default().compile("ball.rtsl", SPHERE);
    eprint!("{}", compilation.report(false));
    let Some(unit) = &compilation.unit else { std::process::exit(1) };
    if let Err(diagnostic) = shoot(unit) {
        eprintln!("{}: {}", diagnostic.code, diagnostic.message);
        std::process::exit(1);
    }
}

fn shoot(unit: &rtsl::Unit) -> Result<(), Diagnostic> {
    let class = unit.class("Ball")?;
    let parameters = vec![("radius", Value::from(2.0))];
    let ball = Instance::new(class, parameters).map_err(first)?;

    let (engine, _warnings) = Engine::new(EngineOptions::default())?;
    let program = engine.program(&ball);
    let intersect = program.kernel(Method::Intersect, CallMode::Packet)?;

    // Rays along z, side by side.
    let mut state = new_state(RAYS);
    set_defaults(&mut state, Role::Primitive);
    let [x, _, z] = state.vectors_mut::<3>(first_component("rt_RayOrigin"));
    for (ray, x) in x.iter_mut().enumerate() {
        *x = ray as f32 * 0.6;
    }
    z.fill(-5.0);

    let mut accepted = LaneMask::new(RAYS);
    let status = intersect.call(CallArguments {
        state: &mut state,
        scratch: &mut program.new_scratch(RAYS),
        count: RAYS,
        mask: None,
        accepted: Some(&mut accepted),
        instances: Instances::One(&program.block(&ball)),
        host: &mut NoHost,
    });
    assert!(!status.budget_exhausted, "no budget was set");

    let distance = state.floats(first_component("rt_HitDistance"));
    for (ray, distance) in distance.iter().enumerate() {
        match accepted.get(ray) {
            true => println!("ray {ray} hits at {distance}"),
            false => println!("ray {ray} misses"),
        }
    }
    Ok(())
}

fn first(errors: Diagnostics) -> Diagnostic {
    errors.into_vec().swap_remove(0)
}

fn first_component(state: &str) -> usize {
    lookup_state(state).expect("the table has it").first_component as usize
}
