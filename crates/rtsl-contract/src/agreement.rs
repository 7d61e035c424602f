//! Agreement of results, bit by bit, between all widths and the interpreter.

use std::sync::Arc;

use rtsl::host::Host;
use rtsl::{Backend, Engine, EngineOptions, Instance, LaneBlock, Method, Role};

use crate::contract::Contract;
use crate::furnace::Furnace;
use crate::options::{Options, engine_options};
use crate::rays::Rays;
use crate::report::Finding;
use crate::stop::Stop;
use crate::subject::Subject;
use crate::tally::Tally;

/// The number of rays in a call: a multiple of no width but 1.
const RAYS: u64 = 37;

/// Compares all methods of an instance.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(instance: &Arc<Instance>, options: &Options) -> Result<Finding, Stop> {
    let mut tally = Tally::new(Contract::SameBits);
    let oracle = engine(Backend::Interpreter, 1)?;
    let oracle = Subject::new(&oracle, instance, options);
    let expected = results(&oracle, instance)?;
    for width in Engine::WIDTHS {
        // Without LLVM only the interpreter is available.
        let Ok(engine) = engine(Backend::Jit, width) else { continue };
        let found = results(&Subject::new(&engine, instance, options), instance)?;
        for ((method, expected), (_, found)) in expected.iter().zip(&found) {
            tally.test(expected == found, || {
                format!(
                    "{} gives other bits at width {width} than on the interpreter",
                    method.name()
                )
            });
        }
    }
    Ok(tally.finish("there is no LLVM to compare the interpreter with"))
}

fn engine(backend: Backend, width: u32) -> Result<Engine, Stop> {
    let options = EngineOptions { backend, width: Some(width), ..engine_options() };
    Ok(Engine::new(options).map(|(engine, _)| engine)?)
}

/// The state after each method, called with random values in all of its inputs.
fn results(subject: &Subject<'_>, instance: &Instance) -> Result<Vec<(Method, Vec<u32>)>, Stop> {
    let stream = subject.stream(Contract::SameBits);
    let methods = instance.class().methods.keys();
    let each = methods.map(|method| {
        let mut rays = subject.rays(Role::Camera, stream.at(*method as u64), 0..RAYS);
        fill(&mut rays, |item, component| stream.number(item, component));
        // An integrator has surfaces to ask about.
        let mut furnace = Furnace::new(stream, RAYS as usize);
        let host: Option<&mut dyn Host> = match method {
            Method::Radiance => Some(&mut furnace),
            _ => None,
        };
        subject.call_with(*method, &mut rays, host)?;
        Ok((*method, words(&rays)))
    });
    each.collect()
}

fn fill(rays: &mut Rays, number: impl Fn(u64, u32) -> f32) {
    let fill = |block: &mut LaneBlock, first: u32| {
        for component in 0..block.components() {
            for (ray, lane) in block.floats_mut(component).iter_mut().enumerate() {
                *lane = 4.0 * number(ray as u64, first + component as u32) - 2.0;
            }
        }
    };
    fill(&mut rays.state, 0);
    fill(&mut rays.scratch, 1000);
}

/// The bits of all values, with all NaNs made equal: arithmetic does not define the bits of a NaN.
fn words(rays: &Rays) -> Vec<u32> {
    let blocks = [&rays.state, &rays.scratch];
    let values =
        blocks.iter().flat_map(|it| (0..it.components()).flat_map(|array| it.floats(array)));
    let canonical = |it: &f32| if it.is_nan() { f32::NAN.to_bits() } else { it.to_bits() };
    values.map(canonical).collect()
}
