//! Functions for a host's own packets of rays.

use std::collections::BTreeMap;
use std::ffi::c_void;

use rtsl::{Callback, CompiledCallback, Mark, MarkWord, Outputs, RayRecord, state_variables};

use crate::error::{Error, RtslResult, check_size, guard, place, slice};
use crate::registry::{RtslCallbackId, RtslEngineId, RtslInstanceId, id};

id!(RtslCallbackId, CompiledCallback, "callback");

/// `RTSL_NONE`.
const NONE: u32 = u32::MAX;

/// How a host keeps a packet of rays, and how it asks about them. What says "where" is bytes of the callback's argument, which is a
/// struct of the host's. Rays are rows of one word a ray: row r of ray i is the word r * width + i.
#[repr(C)]
pub struct RtslRecord {
    /// `sizeof(RtslRecord)`: later versions may add fields at the end.
    pub size: u32,
    /// Rays in a packet: 1, 4, 8 or 16.
    pub width: u32,
    /// Where the address of the first row stands.
    pub rays: u32,
    /// Where the address of the mask stands, 0 for rays that are left out; `RTSL_NONE`: all rays take part.
    pub mask: u32,
    /// Where the address of the first instance's block stands. Blocks are 8-byte aligned and lie one after the other, each of
    /// as many words as `rtsl_kernel_block_words` says.
    pub instances: u32,
    /// Where the number of the instance stands, a `uint32_t`; `RTSL_NONE`: it is the first.
    pub number: u32,
    /// The rows that are components of the state, floats. State that has none holds its default, but for the inverse of the
    /// direction, which is computed.
    pub rows: *const RtslRow,
    /// What is written for rays with a hit of what methods set: the first component of each variable, as
    /// `RTSL_STATE_HitDistance`. All of its components have rows.
    pub outputs: *const u32,
    /// What else is written for rays with a hit.
    pub marks: *const RtslMark,
    /// How many.
    pub row_count: u32,
    /// How many.
    pub output_count: u32,
    /// How many.
    pub mark_count: u32,
}

/// A row that is a component of the state.
#[repr(C)]
pub struct RtslRow {
    /// As `RTSL_STATE_RayOrigin`.
    pub component: u32,
    /// The row.
    pub row: u32,
}

/// A word that is written to a row.
#[repr(C)]
pub struct RtslMark {
    /// The row.
    pub row: u32,
    /// An `RtslMarkSource`.
    pub source: u32,
    /// The word itself, or where it stands, or where the address stands behind which it does.
    pub value: u32,
    /// `RTSL_MARK_SOURCE_BEHIND`: how many bytes behind that address.
    pub offset: u32,
}

/// Where a mark's word comes from.
#[repr(C)]
#[derive(Clone, Copy)]
pub enum RtslMarkSource {
    /// It is the value.
    Constant = 0,
    /// It stands in the argument.
    Argument = 1,
    /// It stands behind an address that stands in the argument.
    Behind = 2,
}

/// A function for packets as the record describes them: `intersect`, and for rays with a hit what is wanted of `computeNormal`,
/// `computeTextureCoordinates` and `computeDerivatives`, in one call on the rays where they lie. It serves all instances
/// like this one: of its class, referring to instances of the same classes. It is compiled if none like it was; on the
/// interpreter there is none.
///
/// # Safety
/// `record` is null or leads to so many bytes as its size says; its pointers lead to so many entries as it says; `callback` is null or leads to an
/// id.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_callback_new(
    engine: RtslEngineId,
    instance: RtslInstanceId,
    record: *const RtslRecord,
    callback: *mut RtslCallbackId,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let id = unsafe { place(callback, "callback")? };
        // Safety: the same; the struct is whole if its size is right.
        let record = unsafe {
            check_size(record, "record")?;
            record.as_ref().ok_or_else(|| Error::null("record"))?
        };
        // Safety: the same.
        let callback = unsafe { description(record)? };
        let program = engine.get()?.engine.program(&*instance.get()?.committed()?);
        *id = RtslCallbackId::give(program.callback(&callback)?);
        Ok(())
    })
}

/// The function, `void (*)(const void *)`. It checks nothing, and is good until the callback is released.
///
/// # Safety
/// `function` is null or leads to a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_callback_function(
    callback: RtslCallbackId,
    function: *mut *const c_void,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let function = unsafe { place(function, "function")? };
        *function = callback.get()?.address();
        Ok(())
    })
}

/// Releases a callback. Its function must not be called any more.
#[unsafe(no_mangle)]
pub extern "C" fn rtsl_callback_release(callback: RtslCallbackId) -> RtslResult {
    guard(|| callback.release())
}

/// What `rtsl` calls it.
///
/// # Safety
/// The record's pointers lead to so many entries as it says.
unsafe fn description(record: &RtslRecord) -> Result<Callback, Error> {
    // Safety: the caller's promise.
    let (rows, outputs, marks) = unsafe {
        (
            slice(record.rows, record.row_count as usize, "rows")?,
            slice(record.outputs, record.output_count as usize, "outputs")?,
            slice(record.marks, record.mark_count as usize, "marks")?,
        )
    };
    let optional = |offset: u32| (offset != NONE).then_some(offset);
    let rows: BTreeMap<u32, u32> = rows.iter().map(|row| (row.component, row.row)).collect();
    let variables = outputs.iter().map(|component| {
        let variable = state_variables().iter().find(|it| it.first_component == *component);
        let problem = || format!("no variable of the state begins with component {component}");
        variable.ok_or_else(|| Error::new(RtslResult::Argument, problem()))
    });
    let outputs = Outputs::state(variables.collect::<Result<Vec<_>, _>>()?);
    let marks = marks.iter().map(mark).collect::<Result<_, _>>()?;
    let record_of_rays = RayRecord {
        rays: record.rays,
        mask: optional(record.mask),
        instances: record.instances,
        number: optional(record.number),
        rows,
        marks,
    };
    Ok(Callback { width: record.width, outputs, record: record_of_rays })
}

fn mark(mark: &RtslMark) -> Result<Mark, Error> {
    const CONSTANT: u32 = RtslMarkSource::Constant as u32;
    const ARGUMENT: u32 = RtslMarkSource::Argument as u32;
    const BEHIND: u32 = RtslMarkSource::Behind as u32;
    let word = match mark.source {
        CONSTANT => MarkWord::Constant(mark.value),
        ARGUMENT => MarkWord::Argument(mark.value),
        BEHIND => MarkWord::Behind { pointer: mark.value, offset: mark.offset },
        other => {
            let problem = format!("there is no source {other} of marks");
            return Err(Error::new(RtslResult::Argument, problem));
        }
    };
    Ok(Mark { row: mark.row, word })
}
