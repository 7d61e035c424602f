//! Bounding boxes of objects, computed by `computeBounds` of their classes.

use rayon::prelude::*;
use rtsl::host::NoHost;
use rtsl::{
    CallMode, Diagnostic, Instance, Instances, Kernel, LaneBlock, Method, Program, Role, Variant,
    new_state, set_defaults,
};
use rtsl_bvh::Bounds;
use rtsl_memory::on_all_processors;

use super::calls::Callee;
use super::runtime_errors::RuntimeErrors;
use super::shader_instance::ShaderInstance;
use super::shaders::Shader;
use super::variables::{variables, vector};

/// The number of elements that one call bounds.
const CALL: usize = 256;

/// The number of elements that are created, bounded and discarded at a time: all at once would not fit into caches.
const MADE: usize = 8192;

/// Computes the bounds of single objects, with one block of state.
pub struct BoundsMaker {
    state: LaneBlock,
}

impl Default for BoundsMaker {
    fn default() -> Self {
        BoundsMaker { state: new_state(1) }
    }
}

impl BoundsMaker {
    /// Returns the bounds of an object in its own space; `None` if it is unbounded.
    pub fn bounds(&mut self, shader: &Shader, instance: &ShaderInstance) -> Option<Bounds> {
        let kernel = shader.kernel(Method::ComputeBounds)?;
        let instances = Instances::One(&instance.block);
        let mut scratch = shader.program.new_scratch(1);
        let class = &shader.program.class().name;
        call(class, kernel, &mut self.state, &mut scratch, 1, instances)
            .then(|| read(&self.state, 0))?
    }
}

/// Returns the bounds of an instance that has no elements in its own space; `None` if it is unbounded.
///
/// # Errors
/// If its bounds cannot be compiled.
pub fn instance_bounds(
    program: &Program,
    instance: &Instance,
) -> Result<Option<Bounds>, Diagnostic> {
    if !program.has(Method::ComputeBounds) {
        return Ok(None);
    }
    let kernel = program.kernel(Method::ComputeBounds, Variant::new(CallMode::Packet))?;
    let (mut state, mut scratch) = (new_state(1), program.new_scratch(1));
    let block = program.block(instance);
    let (class, instances) = (&program.class().name, Instances::One(&block));
    let is_bounded = call(class, &kernel, &mut state, &mut scratch, 1, instances);
    Ok(is_bounded.then(|| read(&state, 0)).flatten())
}

/// Returns the bounds of an instance's `count` elements in their own space.
///
/// # Errors
/// If the elements cannot be created, or their bounds cannot be compiled.
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
    let class = &program.class().name;
    let memory = || (new_state(CALL), program.new_scratch(CALL));
    let bound = |(state, scratch): &mut (LaneBlock, LaneBlock),
                 (chunk, bounds): (usize, &mut [Option<Bounds>])| {
        let first = (chunk * MADE) as u32;
        let indices: Vec<u32> = (first..first + bounds.len() as u32).collect();
        let elements = program.elements_in_order(instance, None, &indices)?;
        for (chunk, bounds) in bounds.chunks_mut(CALL).enumerate() {
            let instances = Instances::Range(&elements, (chunk * CALL) as u32);
            if call(class, &kernel, state, scratch, bounds.len(), instances) {
                let read = |lane| read(state, lane);
                bounds.iter_mut().enumerate().for_each(|(lane, bounds)| *bounds = read(lane));
            }
        }
        Ok(())
    };
    on_all_processors(|| bounds.par_chunks_mut(MADE).enumerate().try_for_each_init(memory, bound))?;
    Ok(bounds)
}

/// Calls the method. Returns false if it exceeds its budget, and then there are no bounds.
fn call(
    class: &str,
    kernel: &Kernel,
    state: &mut LaneBlock,
    scratch: &mut LaneBlock,
    count: usize,
    instances: Instances<'_>,
) -> bool {
    set_defaults(state, Role::Primitive);
    let errors = RuntimeErrors::default();
    let callee = Callee { class, method: Method::ComputeBounds, errors: &errors };
    callee.call_for_first(kernel, count, instances, state, scratch, &mut NoHost);
    !errors.any()
}

fn read(state: &LaneBlock, lane: usize) -> Option<Bounds> {
    let v = variables();
    Bounds::new(vector(state, v.bound_min, lane), vector(state, v.bound_max, lane))
}
