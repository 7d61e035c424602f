//! Kernels: methods, ready to be called.

use std::ffi::{CString, c_char, c_void};
use std::sync::Arc;

use rtsl::{CallMode, Kernel, Method, Program, Variant, call_mode_of_number, most_similar};

use crate::engine::EngineEntry;
use crate::error::{Error, RtslResult, guard, place, text};
use crate::kept_diagnostic::c_text;
use crate::registry::{RtslEngineId, RtslInstanceId, RtslKernelId, RtslObjectsId, id};

/// What a kernel is; as in libraries that are compiled ahead of time.
#[repr(C)]
pub struct RtslMethod {
    /// "intersect".
    pub name: *const c_char,
    /// The machine code, an `RtslKernel`; null on the interpreter.
    pub kernel: *const c_void,
    /// The state components that it reads.
    pub reads: *const u32,
    /// Those that it sets.
    pub writes: *const u32,
    /// How many.
    pub read_count: u32,
    /// How many.
    pub write_count: u32,
    /// An `RtslShape`.
    pub shape: u32,
    /// Rays at a time.
    pub width: u32,
    /// Bits of `RtslMethodFlag`.
    pub flags: u32,
    /// Not used.
    pub unused: u32,
}

/// A kernel with what it belongs to.
pub struct KernelEntry {
    pub program: Arc<Program>,
    pub kernel: Arc<Kernel>,
    pub shape: CallMode,
    name: CString,
    description: rtsl::description::KernelDescription,
}

id!(RtslKernelId, KernelEntry, "kernel");

impl KernelEntry {
    /// Whether it says which rays it found a hit for.
    pub fn accepts(&self) -> bool {
        self.description.method == Method::Intersect
    }

    fn new(
        program: &Arc<Program>,
        method: Method,
        variant: &Variant,
    ) -> Result<KernelEntry, Error> {
        program.refuse_questions(method, "hosts of the C interface")?;
        Ok(KernelEntry {
            kernel: program.kernel(method, variant.clone())?,
            description: program.describe_kernel(method, variant)?,
            shape: variant.mode,
            name: c_text(method.name()),
            program: program.clone(),
        })
    }
}

/// A kernel of a method for instances like this one: of its class, referring to instances of the same classes. `shape` is an
/// `RtslShape` for one object at a time. `width` is 1, 4, 8 or 16, or 0 for that of the engine; it never changes results. It is
/// compiled if no kernel like it was.
///
/// # Safety
/// `method` is null or a text; `kernel` is null or leads to an id.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_kernel_new(
    engine: RtslEngineId,
    instance: RtslInstanceId,
    method: *const c_char,
    shape: u32,
    width: u32,
    kernel: *mut RtslKernelId,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let (method, id) = unsafe { (text(method, "method")?, place(kernel, "kernel")?) };
        let engine: Arc<EngineEntry> = engine.get()?;
        let program = engine.engine.program(&*instance.get()?.committed()?);
        let variant = variant(shape, width)?;
        if variant.mode.has_many_objects() {
            let problem = "this shape takes objects: call `rtsl_kernel_of_objects`";
            return Err(Error::new(RtslResult::Argument, problem));
        }
        *id = RtslKernelId::give(KernelEntry::new(&program, find_method(method)?, &variant)?);
        Ok(())
    })
}

/// A kernel for objects: of the shape stream, which has one for each ray, or leaf, which has one ray for many.
///
/// # Safety
/// As for `rtsl_kernel_new`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_kernel_of_objects(
    objects: RtslObjectsId,
    method: *const c_char,
    shape: u32,
    width: u32,
    kernel: *mut RtslKernelId,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let (method, id) = unsafe { (text(method, "method")?, place(kernel, "kernel")?) };
        let objects = objects.get()?;
        let variant = variant(shape, width)?;
        if !variant.mode.has_many_objects() {
            let problem =
                "the shapes stream and leaf take objects; for others call `rtsl_kernel_new`";
            return Err(Error::new(RtslResult::Argument, problem));
        }
        let variant = variant.of_objects(objects.objects.form().clone());
        let entry = KernelEntry::new(&objects.program, find_method(method)?, &variant)?;
        *id = RtslKernelId::give(entry);
        Ok(())
    })
}

fn variant(shape: u32, width: u32) -> Result<Variant, Error> {
    let problem = || Error::new(RtslResult::Argument, format!("there is no shape {shape}"));
    let variant = Variant::new(call_mode_of_number(shape).ok_or_else(problem)?);
    Ok(if width == 0 { variant } else { variant.with_width(width) })
}

fn find_method(name: &str) -> Result<Method, Error> {
    Method::from_name(name).ok_or_else(|| {
        let names = Method::ALL.iter().map(|method| method.name());
        let problem = format!("there is no method `{name}`");
        Error::new(
            RtslResult::Unknown,
            match most_similar(name, names) {
                Some(meant) => format!("{problem}; did you mean `{meant}`?"),
                None => problem,
            },
        )
    })
}

/// What a kernel is. All that it leads to is good until the kernel is released. Its function is that of libraries compiled
/// ahead of time: it checks nothing.
///
/// # Safety
/// `info` is null or leads to an `RtslMethod`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_kernel_info(
    kernel: RtslKernelId,
    info: *mut RtslMethod,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let info = unsafe { place(info, "info")? };
        let entry = kernel.get()?;
        let description = &entry.description;
        *info = RtslMethod {
            name: entry.name.as_ptr(),
            kernel: entry.kernel.address().unwrap_or(std::ptr::null()),
            reads: description.reads.as_ptr(),
            writes: description.writes.as_ptr(),
            read_count: description.reads.len() as u32,
            write_count: description.writes.len() as u32,
            shape: rtsl::call_mode_number(entry.shape),
            width: description.width,
            flags: description.flags(),
            unused: 0,
        };
        Ok(())
    })
}

/// How many scratch arrays the kernel's class has.
///
/// # Safety
/// `count` is null or leads to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_kernel_scratch_arrays(
    kernel: RtslKernelId,
    count: *mut u32,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let count = unsafe { place(count, "count")? };
        *count = kernel.get()?.program.layout().scratch_arrays;
        Ok(())
    })
}

/// How many words the data of an instance has, as the kernel reads it: hosts that call its function for many instances may
/// copy their blocks to one array, where they lie close to each other. What was copied is good as long as the block.
///
/// # Safety
/// `count` is null or leads to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_kernel_block_words(
    kernel: RtslKernelId,
    count: *mut u32,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let count = unsafe { place(count, "count")? };
        *count = kernel.get()?.program.layout().block_words;
        Ok(())
    })
}

/// Releases a kernel. Its function must not be called any more.
#[unsafe(no_mangle)]
pub extern "C" fn rtsl_kernel_release(kernel: RtslKernelId) -> RtslResult {
    guard(|| kernel.release())
}
