//! Instances of an RTSL class as a user geometry of Embree.

use std::array::from_fn;
use std::mem::{offset_of, transmute};
use std::sync::Arc;

use anyhow::{Result, ensure};
use rtsl::host::NoHost;
use rtsl::{
    CallArguments, CallMode, Callback, CompiledCallback, Engine, Instance, InstanceBlock,
    Instances, Kernel, LaneBlock, LaneMask, Mark, MarkWord, Method, Outputs, Program, RayRecord,
    Role, StateVariable, Variant, lookup_state, new_state, set_defaults,
};

use crate::embree::{BoundsArguments, Embree, HitArguments, HitFunction};
use crate::rays::{DIRECTION, FAR, GEOMETRY, INSTANCE, NEAR, NORMAL, ORIGIN, PRIMITIVE, TIME};

const WIDTHS: [u32; 4] = [1, 4, 8, 16];
/// Rows that callbacks for nearest hits touch, and those that callbacks for any hits do.
const HIT_ROWS: usize = INSTANCE + 1;
const RAY_ROWS: usize = FAR + 1;

/// A geometry whose primitive i is instance i.
pub struct Geometry {
    program: Arc<Program>,
    /// The data of one instance after the other.
    words: Vec<u64>,
    /// The same one by one, with what it refers to.
    blocks: Vec<InstanceBlock>,
    /// For 1, 4, 8 and 16 rays.
    intersect: [CompiledCallback; 4],
    occluded: [CompiledCallback; 4],
    /// Of one ray, to check the callbacks against.
    plain: Arc<Kernel>,
    bounds: Arc<Kernel>,
}

impl Geometry {
    /// Makes callbacks for instances of one class.
    ///
    /// # Errors
    /// If the class lacks a method, there is no machine code for it, or the instances differ in their classes.
    pub fn new(
        engine: &Engine,
        instances: &[Arc<Instance>],
        embree_version: u32,
    ) -> Result<Geometry> {
        let program = engine.program(&instances[0]);
        ensure!(
            instances.iter().all(|instance| program.serves(instance)),
            "the instances refer to instances of different classes"
        );
        let kernel = |method: Method| {
            let variant = Variant::new(CallMode::Packet).with_width(1);
            program.kernel(method, variant).map_err(|problem| crate::told([&problem]))
        };
        let blocks: Vec<InstanceBlock> =
            instances.iter().map(|instance| program.block(instance)).collect();
        let words = blocks.iter().flat_map(|block| block.words().as_chunks::<2>().0);
        let words = words.map(|[low, high]| u64::from(*low) | u64::from(*high) << 32);
        Ok(Geometry {
            words: words.collect(),
            blocks,
            intersect: nearest_hits(&program, embree_version)?,
            occluded: any_hits(&program)?,
            plain: kernel(Method::Intersect)?,
            bounds: kernel(Method::ComputeBounds)?,
            program,
        })
    }

    /// The number of primitives.
    pub fn len(&self) -> usize {
        self.blocks.len()
    }

    /// The distance of the nearest hit of a ray that goes as far as this, without Embree and callbacks.
    pub fn nearest(&self, origin: [f32; 3], direction: [f32; 3], near: f32, far: f32) -> f32 {
        let mut state = new_state(1);
        set_defaults(&mut state, Role::Primitive);
        let mut set = |name: &str, values: &[f32]| {
            let first = state_variable(name).first_component as usize;
            for (component, value) in values.iter().enumerate() {
                state.floats_mut(first + component)[0] = *value;
            }
        };
        set("rt_RayOrigin", &origin);
        set("rt_RayDirection", &direction);
        set("rt_InverseRayDirection", &direction.map(|it| 1.0 / it));
        set("rt_Epsilon", &[near]);
        set("rt_HitDistance", &[far]);
        let mut accepted = LaneMask::new(1);
        for primitive in 0..self.blocks.len() {
            self.call(&self.plain, primitive, &mut state, Some(&mut accepted));
        }
        state.floats(state_variable("rt_HitDistance").first_component as usize)[0]
    }

    /// Calls a kernel for one ray.
    fn call(
        &self,
        kernel: &Kernel,
        primitive: usize,
        state: &mut LaneBlock,
        accepted: Option<&mut LaneMask>,
    ) {
        let _ = kernel.call(CallArguments {
            state,
            scratch: &mut self.program.new_scratch(1),
            count: 1,
            mask: None,
            accepted,
            instances: Instances::One(&self.blocks[primitive]),
            host: &mut NoHost,
        });
    }
}

fn state_variable(name: &str) -> &'static StateVariable {
    lookup_state(name).expect("the table has it")
}

/// Callbacks for the nearest hits.
fn nearest_hits(program: &Program, embree_version: u32) -> Result<[CompiledCallback; 4]> {
    let outputs = ["rt_HitDistance", "rt_GeometricNormal"].map(state_variable);
    let argument = |row, offset| Mark { row, word: MarkWord::Argument(offset) };
    let instance = MarkWord::Behind {
        pointer: offset_of!(HitArguments, context) as u32,
        offset: Embree::instance_offset(embree_version),
    };
    let marks = vec![
        argument(PRIMITIVE as u32, offset_of!(HitArguments, primitive) as u32),
        argument(GEOMETRY as u32, offset_of!(HitArguments, geometry) as u32),
        Mark { row: INSTANCE as u32, word: instance },
    ];
    callbacks(program, Outputs::state(outputs), marks)
}

/// Callbacks for whether there are hits: the rays end.
fn any_hits(program: &Program) -> Result<[CompiledCallback; 4]> {
    let ended = MarkWord::Constant(f32::NEG_INFINITY.to_bits());
    callbacks(program, Outputs::NONE, vec![Mark { row: FAR as u32, word: ended }])
}

fn callbacks(
    program: &Program,
    outputs: Outputs,
    marks: Vec<Mark>,
) -> Result<[CompiledCallback; 4]> {
    let record = RayRecord {
        rays: offset_of!(HitArguments, rays) as u32,
        mask: Some(offset_of!(HitArguments, valid) as u32),
        instances: offset_of!(HitArguments, user) as u32,
        number: Some(offset_of!(HitArguments, primitive) as u32),
        rows: rows().collect(),
        marks,
    };
    let callbacks = WIDTHS.iter().map(|width| {
        let callback = Callback { width: *width, outputs, record: record.clone() };
        program.callback(&callback).map_err(|problem| crate::told([&problem]))
    });
    let callbacks: Vec<_> = callbacks.collect::<Result<_>>()?;
    Ok(callbacks.try_into().expect("as many as widths"))
}

/// The rows of Embree's that are components of the state.
fn rows() -> impl Iterator<Item = (u32, u32)> {
    let rows = [
        ("rt_RayOrigin", ORIGIN),
        ("rt_RayDirection", DIRECTION),
        ("rt_Epsilon", NEAR),
        ("rt_HitDistance", FAR),
        ("rt_TimeSeed", TIME),
        ("rt_GeometricNormal", NORMAL),
    ];
    rows.into_iter().flat_map(|(name, row)| {
        let variable = state_variable(name);
        let components = 0..variable.ty.components();
        components.map(move |it| (variable.first_component + it, row as u32 + it))
    })
}

/// Embree's question for a primitive's box.
///
/// # Safety
/// Embree calls it for a geometry whose user data is a [`Geometry`].
pub unsafe extern "C" fn bounds(arguments: *const BoundsArguments) {
    // Safety: the caller's promise.
    let (arguments, geometry) = unsafe { (&*arguments, &*(*arguments).user.cast::<Geometry>()) };
    let mut state = new_state(1);
    set_defaults(&mut state, Role::Primitive);
    geometry.call(&geometry.bounds, arguments.primitive as usize, &mut state, None);
    let corner = |name: &str| -> [f32; 4] {
        let first = state_variable(name).first_component as usize;
        from_fn(|axis| if axis < 3 { state.floats(first + axis)[0] } else { 0.0 })
    };
    // Safety: Embree's place for the box.
    let bounds = unsafe { &mut *arguments.bounds };
    (bounds.lower, bounds.upper) = (corner("rt_BoundMin"), corner("rt_BoundMax"));
}

/// Embree's question for nearest hits.
///
/// # Safety
/// Embree calls it for a geometry whose user data is a [`Geometry`].
pub unsafe extern "C" fn intersect(arguments: *const HitArguments) {
    // Safety: the caller's promise; the rows of the hits follow those of the rays.
    unsafe { answer::<HIT_ROWS>(&*arguments, |geometry| &geometry.intersect) };
}

/// Embree's question whether there are hits.
///
/// # Safety
/// Embree calls it for a geometry whose user data is a [`Geometry`].
pub unsafe extern "C" fn occluded(arguments: *const HitArguments) {
    // Safety: the caller's promise.
    unsafe { answer::<RAY_ROWS>(&*arguments, |geometry| &geometry.occluded) };
}

/// Calls the callback for the number of rays; the one for a single ray for each where there is none.
///
/// # Safety
/// The arguments are Embree's, with a [`Geometry`] as user data and so many rows.
unsafe fn answer<const ROWS: usize>(
    arguments: &HitArguments,
    callbacks: impl Fn(&Geometry) -> &[CompiledCallback; 4],
) {
    // Safety: the caller's promise.
    let geometry = unsafe { &*arguments.user.cast::<Geometry>() };
    let callbacks = callbacks(geometry);
    let packet = HitArguments { user: geometry.words.as_ptr().cast(), ..*arguments };
    let count = arguments.count as usize;
    if let Some(width) = WIDTHS.iter().position(|width| *width == arguments.count) {
        // Safety: the packet is as the record says.
        return unsafe { function(&callbacks[width])(&packet) };
    }
    for ray in 0..count {
        // Safety: there are so many rays and rows.
        unsafe {
            let mut one: [f32; ROWS] = from_fn(|row| *arguments.rays.add(row * count + ray));
            let valid = arguments.valid.add(ray);
            function(&callbacks[0])(&HitArguments {
                rays: one.as_mut_ptr(),
                valid,
                count: 1,
                ..packet
            });
            for (row, word) in one.into_iter().enumerate() {
                *arguments.rays.add(row * count + ray) = word;
            }
        }
    }
}

/// The function of a callback, which must not be called after it is gone.
fn function(callback: &CompiledCallback) -> HitFunction {
    // Safety: it was made for a record of `HitArguments`, of which it gets the address.
    unsafe { transmute(callback.address()) }
}
