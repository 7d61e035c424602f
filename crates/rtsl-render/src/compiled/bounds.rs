//! The boxes of objects, as their classes' `computeBounds` gives them.

use rayon::prelude::*;
use rtsl::host::NoHost;
use rtsl::{
    CallArguments, CallMode, Diagnostic, Instance, Instances, Kernel, LaneBlock, Method, Program,
    Role, Variant, new_state, set_defaults,
};
use rtsl_bvh::Bounds;

use super::compiled_scene::ShaderInstance;
use super::shaders::Shader;
use super::variables::{variables, vector};

/// Elements that one call bounds.
const CALL: usize = 256;

/// Elements that are made at a time, to be bounded and forgotten: all at once would be more than caches hold.
const MADE: usize = 8192;

/// Asks objects one by one, with one block of state.
pub struct BoundsMaker {
    state: LaneBlock,
}

impl Default for BoundsMaker {
    fn default() -> Self {
        BoundsMaker { state: new_state(1) }
    }
}

impl BoundsMaker {
    /// The box of an object in its own space; `None` if it is unbounded.
    pub fn bounds(&mut self, shader: &Shader, instance: &ShaderInstance) -> Option<Bounds> {
        let kernel = shader.kernel(Method::ComputeBounds)?;
        let instances = Instances::One(&instance.block);
        let mut scratch = shader.program.new_scratch(1);
        call(kernel, &mut self.state, &mut scratch, 1, instances).then(|| read(&self.state, 0))?
    }
}

/// The boxes of an instance's elements, of which there are so many, in their own space.
///
/// # Errors
/// If the elements can't be made, or their bounds have no code.
pub fn element_bounds(
    program: &Program,
    instance: &Instance,
    count: u32,
) -> Result<Vec<Option<Bounds>>, Diagnostic> {
    let mut bounds = vec![None; count as usize];
    if !program.has(Method::ComputeBounds) || count == 0 {
        return Ok(bounds);
    }
    let one = program.elements_in_order(instance, None, &[0])?;
    let variant = Variant::new(CallMode::Leaf).of_objects(one.form().clone());
    let kernel = program.kernel(Method::ComputeBounds, variant)?;
    bounds.par_chunks_mut(MADE).enumerate().try_for_each_init(
        || (new_state(CALL), program.new_scratch(CALL)),
        |(state, scratch), (chunk, bounds)| {
            let first = (chunk * MADE) as u32;
            let numbers: Vec<u32> = (first..first + bounds.len() as u32).collect();
            let elements = program.elements_in_order(instance, None, &numbers)?;
            for (chunk, bounds) in bounds.chunks_mut(CALL).enumerate() {
                let instances = Instances::Range(&elements, (chunk * CALL) as u32);
                if call(&kernel, state, scratch, bounds.len(), instances) {
                    let read = |lane| read(state, lane);
                    bounds.iter_mut().enumerate().for_each(|(lane, bounds)| *bounds = read(lane));
                }
            }
            Ok(())
        },
    )?;
    Ok(bounds)
}

/// Whether all went well: a method that runs past its budget bounds nothing.
fn call(
    kernel: &Kernel,
    state: &mut LaneBlock,
    scratch: &mut LaneBlock,
    count: usize,
    instances: Instances<'_>,
) -> bool {
    set_defaults(state, Role::Primitive);
    let status = kernel.call(CallArguments {
        state,
        scratch,
        count,
        mask: None,
        accepted: None,
        instances,
        host: &mut NoHost,
    });
    !status.budget_exhausted
}

fn read(state: &LaneBlock, lane: usize) -> Option<Bounds> {
    let v = variables();
    Bounds::new(vector(state, v.bound_min, lane), vector(state, v.bound_max, lane))
}
