//! Many instances of one class by number.

use std::ffi::c_void;
use std::sync::Arc;

use rtsl::{Instance, Objects, Program};

use crate::error::{Error, RtslResult, guard, place, slice};
use crate::registry::{RtslEngineId, RtslInstanceId, RtslObjectsId, id};

/// Objects with the program whose kernels take them.
pub struct ObjectsEntry {
    pub program: Arc<Program>,
    pub objects: Objects,
}

id!(RtslObjectsId, ObjectsEntry, "objects");

/// Objects of instances as they are now, which are all of one class and refer to instances of the same classes. Object `i` is
/// instance `i`.
///
/// # Safety
/// `instances` is null or leads to so many ids; `objects` is null or leads to an id.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_objects_new(
    engine: RtslEngineId,
    instances: *const RtslInstanceId,
    count: usize,
    objects: *mut RtslObjectsId,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let (ids, id) =
            unsafe { (slice(instances, count, "instances")?, place(objects, "objects")?) };
        let instances = ids.iter().map(|id| id.get()?.committed());
        let instances: Vec<Arc<Instance>> = instances.collect::<Result<_, _>>()?;
        let first = instances.first().ok_or_else(|| {
            Error::new(RtslResult::Argument, "objects are of one instance at least")
        })?;
        let program = engine.get()?.engine.program(first);
        if !instances.iter().all(|instance| program.serves(instance)) {
            let problem =
                "the instances are of several classes, or refer to instances of different classes";
            return Err(Error::new(RtslResult::Instance, problem));
        }
        let objects = program.objects(instances.iter().map(AsRef::as_ref));
        *id = RtslObjectsId::give(ObjectsEntry { program, objects });
        Ok(())
    })
}

/// The elements of an instance whose class counts them, such as the triangles of a mesh: object `i` is element `i`.
///
/// # Safety
/// `objects` is null or leads to an id.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_elements_new(
    engine: RtslEngineId,
    instance: RtslInstanceId,
    objects: *mut RtslObjectsId,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let id = unsafe { place(objects, "objects")? };
        let instance = instance.get()?.committed()?;
        let program = engine.get()?.engine.program(&instance);
        let objects = program.elements(&instance)?;
        *id = RtslObjectsId::give(ObjectsEntry { program, objects });
        Ok(())
    })
}

/// How many objects there are.
///
/// # Safety
/// `count` is null or leads to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_objects_count(objects: RtslObjectsId, count: *mut u32) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let count = unsafe { place(count, "count")? };
        *count = objects.get()?.objects.len() as u32;
        Ok(())
    })
}

/// The blocks of objects and the block of what they share, for calls of kernels' functions. Good until the objects are
/// released.
///
/// # Safety
/// `blocks` and `shared` are null or lead to pointers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_objects_blocks(
    objects: RtslObjectsId,
    blocks: *mut *const c_void,
    shared: *mut *const c_void,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let (blocks, shared) = unsafe { (place(blocks, "blocks")?, place(shared, "shared")?) };
        let objects = objects.get()?;
        *blocks = objects.objects.rows().as_ptr().cast();
        *shared = objects.objects.shared().words().as_ptr().cast();
        Ok(())
    })
}

/// Releases objects.
#[unsafe(no_mangle)]
pub extern "C" fn rtsl_objects_release(objects: RtslObjectsId) -> RtslResult {
    guard(|| objects.release())
}
