//! A kernel with the calls by which it is timed, and the profile of its packet code.

use std::sync::Arc;

use rtsl::{CallMode, Diagnostic, Kernel, Method, Profile, Program, Variant};

use super::call::{Call, count};
use super::inputs::Inputs;
use super::objects::Objects;
use super::timing::Subject;

/// The number of rays that are timed together, if necessary in several calls, because the clock is too coarse for a
/// few.
const RAYS_TOGETHER: usize = 256;
/// The greatest number of such calls, which have separate memory: all of it still fits the first-level cache.
const MAX_CALLS: usize = 16;
/// The number of rays for which the leaf call mode is called in turn.
const LEAF_RAYS: usize = 4;

/// A kernel and its calls.
pub struct KernelSubject<'a> {
    /// The kernel's call mode.
    pub mode: CallMode,
    /// The kernel's width.
    pub width: u32,
    /// The operations of the same kernel's packet code in the same calls.
    pub profile: Profile,
    kernel: Arc<Kernel>,
    objects: &'a Objects,
    calls: Vec<Call>,
}

impl<'a> KernelSubject<'a> {
    /// Compiles the kernel of a method for calls with these inputs.
    ///
    /// # Errors
    /// As for [`Program::kernel`] and [`Program::packet_kernel`].
    pub fn new(
        program: &Program,
        method: Method,
        variant: &Variant,
        objects: &'a Objects,
        inputs: &Inputs,
    ) -> Result<KernelSubject<'a>, Diagnostic> {
        let mode = variant.mode;
        let kernel = program.kernel(method, variant.clone())?;
        let profile = profile(program, method, variant, objects, inputs)?;
        let method = program.method(method)?;
        let calls = inputs_of_calls(mode, inputs).into_iter();
        let calls = calls.map(|inputs| Call::new(&method, inputs)).collect();
        let width = mode.width(program.width());
        Ok(KernelSubject { mode, width, profile, kernel, objects, calls })
    }

    /// Returns the number of calls that are timed together.
    pub fn calls(&self) -> usize {
        self.calls.len()
    }
}

fn profile(
    program: &Program,
    method: Method,
    variant: &Variant,
    objects: &Objects,
    inputs: &Inputs,
) -> Result<Profile, Diagnostic> {
    let (mode, packets) = (variant.mode, program.packet_kernel(method, variant.clone())?);
    let mut whole = Profile::default();
    for inputs in inputs_of_calls(mode, inputs) {
        whole.add(&count(&packets, objects.of_mode(mode), &inputs, u64::MAX).profile);
    }
    Ok(whole)
}

/// The inputs of calls that are timed together: for all rays or, if a call takes one ray, for some.
fn inputs_of_calls(mode: CallMode, inputs: &Inputs) -> Vec<Inputs> {
    match mode {
        CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream => {
            let calls = (RAYS_TOGETHER / inputs.lanes()).clamp(1, MAX_CALLS);
            vec![inputs.clone(); calls]
        }
        CallMode::Single => some_rays(inputs, MAX_CALLS).map(|ray| inputs.lane(ray)).collect(),
        CallMode::Leaf => {
            let calls = some_rays(inputs, LEAF_RAYS).map(|ray| {
                // The ray is lane 0; the others are for the results.
                let mut call = inputs.clone();
                call.copy_lane(0, inputs, ray);
                call
            });
            calls.collect()
        }
    }
}

/// Returns up to `most` rays, far apart.
fn some_rays(inputs: &Inputs, most: usize) -> impl Iterator<Item = usize> {
    let (lanes, count) = (inputs.lanes(), inputs.lanes().min(most));
    (0..count).map(move |ray| ray * lanes / count)
}

impl Subject for KernelSubject<'_> {
    fn prepare(&mut self) {
        self.calls.iter_mut().for_each(Call::restore);
    }

    fn call(&mut self) {
        let instances = self.objects.of_mode(self.mode);
        for call in &mut self.calls {
            call.run(&self.kernel, instances);
        }
    }

    fn lanes(&self) -> usize {
        self.calls.iter().map(Call::lanes).sum()
    }

    fn is_repeatable(&self) -> bool {
        !self.calls.iter().any(Call::changes_in_place)
    }
}
