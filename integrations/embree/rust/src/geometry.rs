//! Instances of an RTSL class as a user geometry of Embree.

use std::array::from_fn;
use std::cell::RefCell;
use std::sync::Arc;

use anyhow::{Result, ensure};
use rtsl::host::NoHost;
use rtsl::{
    Engine, HostArguments, HostLanes, Instance, InstanceBlock, Instances, Kernel, LaneBlock,
    Method, Program, Role, Shape, Variant, lookup_state, new_state, set_defaults,
    state_component_count,
};

use crate::embree::{BoundsArguments, Embree, HitArguments};
use crate::rays::{
    DIRECTION, FAR, GEOMETRY, INSTANCE, MAX_RAYS, NEAR, NORMAL, ORIGIN, PRIMITIVE, TIME,
};

const WIDTHS: [u32; 4] = [1, 4, 8, 16];

/// A geometry whose primitive i is instance i.
pub struct Geometry {
    program: Arc<Program>,
    blocks: Vec<InstanceBlock>,
    /// For 1, 4, 8 and 16 rays.
    intersect: [Arc<Kernel>; 4],
    normal: [Arc<Kernel>; 4],
    bounds: Arc<Kernel>,
    embree_version: u32,
}

impl Geometry {
    /// Makes kernels for instances of one class.
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
        let kernel = |method: Method, width: u32| {
            let variant = Variant::new(Shape::Packet).with_width(width);
            program.kernel(method, variant).map_err(|problem| crate::told([&problem]))
        };
        let kernels = |method: Method| -> Result<[Arc<Kernel>; 4]> {
            let kernels: Vec<_> =
                WIDTHS.iter().map(|width| kernel(method, *width)).collect::<Result<_>>()?;
            Ok(kernels.try_into().expect("as many as widths"))
        };
        Ok(Geometry {
            blocks: instances.iter().map(|instance| program.block(instance)).collect(),
            intersect: kernels(Method::Intersect)?,
            normal: kernels(Method::ComputeNormal)?,
            bounds: kernel(Method::ComputeBounds, 1)?,
            embree_version,
            program,
        })
    }

    /// How many primitives.
    pub fn len(&self) -> usize {
        self.blocks.len()
    }

    /// The distance of the nearest hit of a ray that goes as far as this, without Embree.
    pub fn nearest(&self, origin: [f32; 3], direction: [f32; 3], near: f32, far: f32) -> f32 {
        let mut rows = [[0.0; 1]; 9];
        for axis in 0..3 {
            rows[ORIGIN + axis] = [origin[axis]];
            rows[DIRECTION + axis] = [direction[axis]];
        }
        (rows[NEAR], rows[FAR]) = ([near], [far]);
        let packet =
            Packet { rays: rows.as_mut_ptr().cast(), valid: [-1; MAX_RAYS], stride: 1, count: 1 };
        for primitive in 0..self.blocks.len() {
            // Safety: the rows are those of a ray without a hit.
            unsafe { self.call_intersect(primitive, &packet) };
        }
        rows[FAR][0]
    }

    /// Calls `intersect`, which shortens rays to their hits: which rays have one.
    ///
    /// # Safety
    /// The packet's rows are there, up to the far ends.
    unsafe fn call_intersect(&self, primitive: usize, packet: &Packet) -> [i32; MAX_RAYS] {
        let mut accepted = [0; MAX_RAYS];
        let kernel = &self.intersect[packet.width()];
        // Safety: the caller's promise.
        unsafe { self.call(kernel, primitive, packet, &packet.valid, Some(&mut accepted)) };
        accepted
    }

    /// Calls `computeNormal` for rays with hits, which writes to the packet.
    ///
    /// # Safety
    /// The packet's rows are there, up to the normals.
    unsafe fn call_normal(&self, primitive: usize, packet: &Packet, mask: &[i32; MAX_RAYS]) {
        // Safety: the caller's promise.
        unsafe { self.call(&self.normal[packet.width()], primitive, packet, mask, None) };
    }

    /// Calls a kernel on the packet's own rows.
    ///
    /// # Safety
    /// The packet's rows that the kernel reads or sets are there.
    unsafe fn call(
        &self,
        kernel: &Kernel,
        primitive: usize,
        packet: &Packet,
        mask: &[i32; MAX_RAYS],
        accepted: Option<&mut [i32]>,
    ) {
        LANES.with_borrow_mut(|lanes| {
            // Safety: the caller's promise.
            unsafe { lanes.bind(kernel, packet, &self.program) };
            // Safety: rows of the packet and arrays of this thread, with room for as many rays as the kernel does at a time.
            let mut state = unsafe { HostLanes::from_table(&lanes.state, packet.count) };
            // Safety: the same.
            let mut scratch = unsafe { HostLanes::from_table(&lanes.scratch_table, packet.count) };
            let call = HostArguments {
                state: &mut state,
                scratch: &mut scratch,
                count: packet.count,
                mask: Some(mask),
                accepted,
                instances: Instances::One(&self.blocks[primitive]),
                host: &mut NoHost,
            };
            let _ = kernel.call_host(call).expect("every array that the kernel touches is bound");
        });
    }
}

/// Rays of a callback, whose rows are `stride` words long.
struct Packet {
    rays: *mut f32,
    valid: [i32; MAX_RAYS],
    stride: usize,
    count: usize,
}

impl Packet {
    /// The packets that a callback is about: one, or one for each ray where it is of a size that no kernel has.
    ///
    /// # Safety
    /// The arguments are those of a callback of Embree.
    unsafe fn of_callback(arguments: &HitArguments) -> impl Iterator<Item = Packet> {
        let stride = arguments.count as usize;
        let count = if WIDTHS.contains(&arguments.count) { stride } else { 1 };
        (0..stride / count).map(move |packet| {
            let first = packet * count;
            // Safety: there are so many rays, and as many words that say which are valid.
            let (rays, valid) = unsafe {
                let valid = std::slice::from_raw_parts(arguments.valid.add(first), count);
                (arguments.rays.add(first), valid)
            };
            let valid = from_fn(|ray| valid.get(ray).copied().unwrap_or(0));
            Packet { rays, valid, stride, count }
        })
    }

    /// Which of [`WIDTHS`].
    fn width(&self) -> usize {
        WIDTHS.iter().position(|width| *width as usize == self.count).expect("one of the widths")
    }

    /// # Safety
    /// The row is there.
    unsafe fn row(&self, row: usize) -> *mut f32 {
        // Safety: the caller's promise.
        unsafe { self.rays.add(row * self.stride) }
    }

    /// # Safety
    /// The row is there.
    unsafe fn get(&self, row: usize, ray: usize) -> f32 {
        // Safety: the caller's promise.
        unsafe { *self.row(row).add(ray) }
    }

    /// Writes to rays with a hit.
    ///
    /// # Safety
    /// The row is there.
    unsafe fn set_where(&self, row: usize, accepted: &[i32; MAX_RAYS], value: f32) {
        for (ray, _) in accepted.iter().enumerate().take(self.count).filter(|(_, it)| **it != 0) {
            // Safety: the caller's promise.
            unsafe { *self.row(row).add(ray) = value };
        }
    }
}

/// Where calls of a thread find what is not Embree's.
struct Lanes {
    state: Vec<*mut f32>,
    /// The rows that are state components.
    rows: Vec<Option<usize>>,
    /// What methods find in components that nobody sets, and where they leave what nobody reads.
    others: LaneBlock,
    scratch: LaneBlock,
    scratch_table: Vec<*mut f32>,
}

thread_local! {
    static LANES: RefCell<Lanes> = RefCell::new(Lanes::new());
}

impl Lanes {
    fn new() -> Lanes {
        let mut others = new_state(MAX_RAYS);
        set_defaults(&mut others, Role::Primitive);
        let state = vec![std::ptr::null_mut(); state_component_count() as usize];
        let scratch = LaneBlock::new(0, MAX_RAYS);
        Lanes { state, rows: component_rows(), others, scratch, scratch_table: Vec::new() }
    }

    /// Binds what a kernel touches.
    ///
    /// # Safety
    /// The packet's rows that it touches are there.
    unsafe fn bind(&mut self, kernel: &Kernel, packet: &Packet, program: &Program) {
        self.state.fill(std::ptr::null_mut());
        for component in kernel.state_components().iter() {
            let component = component as usize;
            self.state[component] = match self.rows[component] {
                // Safety: the caller's promise.
                Some(row) => unsafe { packet.row(row) },
                None => self.others.words_mut(component).as_mut_ptr().cast(),
            };
        }
        // Safety: the caller's promise.
        unsafe { self.compute_inputs(packet) };
        let arrays = program.layout().scratch_arrays as usize;
        if self.scratch_table.len() < arrays {
            self.scratch = program.new_scratch(MAX_RAYS);
            self.scratch_table = (0..arrays)
                .map(|array| self.scratch.words_mut(array).as_mut_ptr().cast())
                .collect();
        }
    }

    /// What a renderer computes of a ray: the inverse of its direction, and the point where it ends.
    ///
    /// # Safety
    /// The packet's rows are there, up to the far ends.
    unsafe fn compute_inputs(&mut self, packet: &Packet) {
        let place =
            |name: &str| lookup_state(name).expect("the table has it").first_component as usize;
        let (inverse, point) = (place("rt_InverseRayDirection"), place("rt_HitPoint"));
        for axis in 0..3 {
            for ray in 0..packet.count {
                // Safety: the caller's promise.
                let (origin, direction, far) = unsafe {
                    (
                        packet.get(ORIGIN + axis, ray),
                        packet.get(DIRECTION + axis, ray),
                        packet.get(FAR, ray),
                    )
                };
                self.others.words_mut(inverse + axis)[ray] = (1.0 / direction).to_bits();
                self.others.words_mut(point + axis)[ray] = (origin + far * direction).to_bits();
            }
        }
    }
}

/// For each state component the row of Embree's that it is.
fn component_rows() -> Vec<Option<usize>> {
    let mut rows = vec![None; state_component_count() as usize];
    for (name, row) in [
        ("rt_RayOrigin", ORIGIN),
        ("rt_RayDirection", DIRECTION),
        ("rt_Epsilon", NEAR),
        ("rt_HitDistance", FAR),
        ("rt_TimeSeed", TIME),
        ("rt_GeometricNormal", NORMAL),
    ] {
        let variable = lookup_state(name).expect("the table has it");
        for component in 0..variable.ty.components() as usize {
            rows[variable.first_component as usize + component] = Some(row + component);
        }
    }
    rows
}

/// Embree's question for a primitive's box.
///
/// # Safety
/// Embree calls it for a geometry whose user data is a [`Geometry`].
pub unsafe extern "C" fn bounds(arguments: *const BoundsArguments) {
    // Safety: the caller's promise.
    let (arguments, geometry) = unsafe { (&*arguments, &*(*arguments).user.cast::<Geometry>()) };
    let mut state = new_state(MAX_RAYS);
    set_defaults(&mut state, Role::Primitive);
    let call = rtsl::CallArguments {
        state: &mut state,
        scratch: &mut geometry.program.new_scratch(MAX_RAYS),
        count: 1,
        mask: None,
        accepted: None,
        instances: Instances::One(&geometry.blocks[arguments.primitive as usize]),
        host: &mut NoHost,
    };
    let _ = geometry.bounds.call(call);
    let corner = |name: &str| -> [f32; 4] {
        let first = lookup_state(name).expect("the table has it").first_component as usize;
        from_fn(|axis| if axis < 3 { f32::from_bits(state.words(first + axis)[0]) } else { 0.0 })
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
    unsafe {
        let arguments = &*arguments;
        let geometry = &*arguments.user.cast::<Geometry>();
        let primitive = arguments.primitive as usize;
        for packet in Packet::of_callback(arguments) {
            let accepted = geometry.call_intersect(primitive, &packet);
            if accepted == [0; MAX_RAYS] {
                continue;
            }
            let instance = Embree::instance(geometry.embree_version, arguments.context);
            packet.set_where(PRIMITIVE, &accepted, f32::from_bits(arguments.primitive));
            packet.set_where(GEOMETRY, &accepted, f32::from_bits(arguments.geometry));
            packet.set_where(INSTANCE, &accepted, f32::from_bits(instance));
            geometry.call_normal(primitive, &packet, &accepted);
        }
    }
}

/// Embree's question whether there are hits.
///
/// # Safety
/// Embree calls it for a geometry whose user data is a [`Geometry`].
pub unsafe extern "C" fn occluded(arguments: *const HitArguments) {
    // Safety: the caller's promise.
    unsafe {
        let arguments = &*arguments;
        let geometry = &*arguments.user.cast::<Geometry>();
        for packet in Packet::of_callback(arguments) {
            // It shortens the rays first; then they end.
            let accepted = geometry.call_intersect(arguments.primitive as usize, &packet);
            packet.set_where(FAR, &accepted, f32::NEG_INFINITY);
        }
    }
}
