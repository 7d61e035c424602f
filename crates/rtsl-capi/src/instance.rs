//! Instances, whose parameters change.

use std::collections::BTreeMap;
use std::ffi::{c_char, c_void};
use std::sync::{Arc, Mutex, PoisonError};

use rtsl::{
    AttributeTable, Class, Instance, InstanceBlock, Numbers, Parameter, ParameterType, Program,
    Scalar, SourceMap, Value,
};

use crate::error::{Error, RtslResult, guard, guard_with_warnings, place, slice, text};
use crate::kept_diagnostic::KeptDiagnostic;
use crate::registry::{RtslInstanceId, RtslKernelId, RtslUnitId, id};

/// A class with values for its parameters, and what was last made of them.
pub struct InstanceEntry {
    class: Arc<Class>,
    state: Mutex<InstanceState>,
}

id!(RtslInstanceId, InstanceEntry, "instance");

#[derive(Default)]
struct InstanceState {
    /// By path: a parameter, or a field of one that is a struct.
    values: BTreeMap<String, Given>,
    committed: Option<Arc<Instance>>,
    /// Of the committed instance, for the programs that asked.
    blocks: Vec<(Arc<Program>, Arc<InstanceBlock>)>,
}

/// What a host gave.
#[derive(Clone)]
enum Given {
    Numbers(Numbers),
    Choices(Vec<String>),
    Instances(Vec<Arc<Instance>>),
}

impl InstanceEntry {
    fn set(&self, path: &str, given: Given) -> Result<(), Error> {
        if !self.class.parameters.iter().any(|parameter| has_path(parameter, path)) {
            return Err(self.unknown_path(path));
        }
        self.state().values.insert(path.to_owned(), given);
        Ok(())
    }

    /// The instance made last.
    pub fn committed(&self) -> Result<Arc<Instance>, Error> {
        let problem = "the instance was not committed: call `rtsl_instance_commit` when its parameters are set";
        let committed = self.state().committed.clone();
        committed.ok_or_else(|| Error::new(RtslResult::Instance, problem))
    }

    /// The data of the instance made last, for kernels of a program of its class.
    pub fn block(&self, program: &Arc<Program>) -> Result<Arc<InstanceBlock>, Error> {
        let mut state = self.state();
        if let Some((_, block)) = state.blocks.iter().find(|(other, _)| Arc::ptr_eq(other, program))
        {
            return Ok(block.clone());
        }
        let committed = state.committed.clone();
        drop(state);
        let instance = match committed {
            Some(instance) => instance,
            None => self.committed()?,
        };
        if !program.serves(&instance) {
            let problem = format!(
                "the instance is of `{}`, the kernel of `{}`, or what they refer to differs",
                instance.class().name,
                program.class().name
            );
            return Err(Error::new(RtslResult::Instance, problem));
        }
        let block = Arc::new(program.block(&instance));
        state = self.state();
        // Another thread may have committed meanwhile; then the block is that of the values as they were.
        if state.committed.as_ref().is_some_and(|committed| Arc::ptr_eq(committed, &instance)) {
            state.blocks.push((program.clone(), block.clone()));
        }
        Ok(block)
    }

    /// Makes the instance, and returns warnings about values outside of their ranges.
    fn commit(&self) -> Result<Vec<KeptDiagnostic>, Error> {
        let values = self.state().values.clone();
        let arguments =
            self.class.parameters.iter().filter_map(|parameter| {
                Some((parameter.name.as_str(), assemble(parameter, &values)?))
            });
        let arguments: Vec<(&str, Value)> = arguments.collect();
        let made = Instance::new(&self.class, arguments);
        let instance = made.map_err(|problems| {
            Error::of_diagnostics(&SourceMap::new(), &problems, RtslResult::Parameter)
        })?;
        let sources = SourceMap::new();
        let outside = instance.outside_range().iter();
        let warnings = outside.map(|it| KeptDiagnostic::new(&sources, &it.warning)).collect();
        let mut state = self.state();
        state.committed = Some(instance);
        state.blocks.clear();
        Ok(warnings)
    }

    /// Replaces the instance made last by one with these attributes.
    fn attach(&self, attributes: &AttributeTable) -> Result<(), Error> {
        let attached = self.committed()?.with_attributes(attributes);
        let mut state = self.state();
        state.committed = Some(attached);
        state.blocks.clear();
        Ok(())
    }

    fn state(&self) -> std::sync::MutexGuard<'_, InstanceState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn unknown_path(&self, path: &str) -> Error {
        let names: Vec<&str> = self.class.parameters.iter().map(|it| it.name.as_str()).collect();
        let problem = format!("`{}` has no parameter `{path}`", self.class.name);
        let problem = match rtsl::most_similar(path, names.iter().copied()) {
            Some(meant) => format!("{problem}; did you mean `{meant}`?"),
            None if names.is_empty() => problem,
            None => format!("{problem}; it has `{}`", names.join("`, `")),
        };
        Error::new(RtslResult::Unknown, problem)
    }
}

/// Whether the path is the parameter, or leads to a scalar, vector or array of them in a struct.
fn has_path(parameter: &Parameter, path: &str) -> bool {
    fn leads(ty: &ParameterType, rest: &str) -> bool {
        match ty {
            ParameterType::Struct(_, fields) => rest.strip_prefix('.').is_some_and(|rest| {
                fields.iter().any(|(name, ty)| {
                    rest.strip_prefix(name.as_str()).is_some_and(|rest| leads(ty, rest))
                })
            }),
            ParameterType::Array(element, _) | ParameterType::Buffer(element) => {
                leads(element, rest)
            }
            ParameterType::Scalar(_)
            | ParameterType::Vector(..)
            | ParameterType::Matrix(..)
            | ParameterType::Color
            | ParameterType::Reference(_)
            | ParameterType::Textured(_) => rest.is_empty(),
        }
    }
    path.strip_prefix(parameter.name.as_str()).is_some_and(|rest| leads(&parameter.ty, rest))
}

/// The value of a parameter; `None` where nothing of it is set.
fn assemble(parameter: &Parameter, values: &BTreeMap<String, Given>) -> Option<Value> {
    let is_given = |path: &String| has_path(parameter, path);
    values.keys().any(is_given).then(|| value_at(&parameter.ty, &parameter.name, values, Part::ALL))
}

/// Of the numbers at a path, those of one element of arrays of structs: part `index` of `count` equal ones.
#[derive(Clone, Copy)]
struct Part {
    index: usize,
    count: usize,
}

impl Part {
    const ALL: Part = Part { index: 0, count: 1 };

    fn of(self, numbers: &Numbers) -> Numbers {
        let words = numbers.words();
        let size = words.len() / self.count.max(1);
        if self.count == 1 {
            return numbers.clone();
        }
        let start = size * self.index;
        Numbers::from_words(numbers.scalar(), words[start..start + size].to_vec())
    }
}

fn value_at(ty: &ParameterType, path: &str, values: &BTreeMap<String, Given>, part: Part) -> Value {
    let elements = |element: &ParameterType, count: usize| {
        let of = |index| Part { index: part.index * count + index, count: part.count * count };
        Value::List((0..count).map(|index| value_at(element, path, values, of(index))).collect())
    };
    match ty {
        ParameterType::Struct(_, fields) => {
            // A field that is not set is left out, and the message names it.
            let fields = fields.iter().filter_map(|(name, ty)| {
                let path = format!("{path}.{name}");
                let is_given = |key: &String| {
                    let rest = key.strip_prefix(&path);
                    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
                };
                let given = values.keys().any(is_given);
                given.then(|| (name.clone(), value_at(ty, &path, values, part)))
            });
            Value::Struct(fields.collect())
        }
        ParameterType::Array(element, count) if has_struct(element) => {
            elements(element, *count as usize)
        }
        ParameterType::Buffer(element) if has_struct(element) => {
            elements(element, element_count(element, path, values) / part.count)
        }
        _ => match values.get(path) {
            Some(Given::Numbers(numbers)) => Value::Numbers(part.of(numbers)),
            Some(Given::Choices(names)) => match &names[..] {
                [only] => Value::Text(only.clone()),
                names => Value::List(names.iter().cloned().map(Value::Text).collect()),
            },
            Some(Given::Instances(instances)) => match (ty, &instances[..]) {
                (ParameterType::Reference(_) | ParameterType::Textured(_), [only]) => {
                    Value::Instance(only.clone())
                }
                (_, instances) => {
                    Value::List(instances.iter().cloned().map(Value::Instance).collect())
                }
            },
            None => Value::List(Vec::new()),
        },
    }
}

fn has_struct(ty: &ParameterType) -> bool {
    match ty {
        ParameterType::Struct(..) => true,
        ParameterType::Array(element, _) | ParameterType::Buffer(element) => has_struct(element),
        ParameterType::Scalar(_)
        | ParameterType::Vector(..)
        | ParameterType::Matrix(..)
        | ParameterType::Color
        | ParameterType::Reference(_)
        | ParameterType::Textured(_) => false,
    }
}

/// How many elements of a struct the numbers of its first scalar that is set are.
fn element_count(ty: &ParameterType, path: &str, values: &BTreeMap<String, Given>) -> usize {
    match ty {
        ParameterType::Struct(_, fields) => fields
            .iter()
            .map(|(name, ty)| element_count(ty, &format!("{path}.{name}"), values))
            .find(|count| *count > 0)
            .unwrap_or(0),
        ParameterType::Array(element, count) => {
            element_count(element, path, values) / (*count as usize).max(1)
        }
        ParameterType::Buffer(element) => element_count(element, path, values),
        ParameterType::Scalar(_) => number_count(path, values),
        ParameterType::Vector(_, count) => number_count(path, values) / usize::from(*count),
        ParameterType::Matrix(columns, rows) => {
            number_count(path, values) / (usize::from(*columns) * usize::from(*rows))
        }
        ParameterType::Color => number_count(path, values) / rtsl::COLOR_COMPONENTS as usize,
        ParameterType::Textured(value) => element_count(value, path, values),
        ParameterType::Reference(_) => 0,
    }
}

fn number_count(path: &str, values: &BTreeMap<String, Given>) -> usize {
    match values.get(path) {
        Some(Given::Numbers(numbers)) => numbers.words().len(),
        Some(Given::Choices(_) | Given::Instances(_)) | None => 0,
    }
}

/// Makes an instance of a class. Its parameters have their defaults until they are set; it can be used when it is
/// committed.
///
/// # Safety
/// `class_name` is null or a text; `instance` is null or leads to an id.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_instance_new(
    unit: RtslUnitId,
    class_name: *const c_char,
    instance: *mut RtslInstanceId,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let (name, id) = unsafe { (text(class_name, "class_name")?, place(instance, "instance")?) };
        let class = unit.get()?.class(name)?.clone();
        *id = RtslInstanceId::give(InstanceEntry { class, state: Mutex::default() });
        Ok(())
    })
}

/// Sets a parameter that is made of floats: a number, a vector, a matrix (column by column), a colour (linear RGB, or one
/// grey number), an array or a buffer of them. The path is its name, for a field of a struct "light.position"; for
/// an array of structs the field of all elements, one after another. The numbers are copied. Whether they fit, the
/// commit tells.
///
/// # Safety
/// `path` is null or a text; `values` is null or leads to so many numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_instance_set_floats(
    instance: RtslInstanceId,
    path: *const c_char,
    values: *const f32,
    count: usize,
) -> RtslResult {
    // Safety: the caller's promise.
    guard(|| unsafe {
        set_numbers(instance, path, values, count, Scalar::F32, |value| value.to_bits())
    })
}

/// The same with ints, for parameters of ints and floats.
///
/// # Safety
/// `path` is null or a text; `values` is null or leads to so many numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_instance_set_ints(
    instance: RtslInstanceId,
    path: *const c_char,
    values: *const i32,
    count: usize,
) -> RtslResult {
    // Safety: the caller's promise.
    guard(|| unsafe {
        set_numbers(instance, path, values, count, Scalar::I32, |value| value.cast_unsigned())
    })
}

/// The same with uints, for parameters of uints and floats.
///
/// # Safety
/// `path` is null or a text; `values` is null or leads to so many numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_instance_set_uints(
    instance: RtslInstanceId,
    path: *const c_char,
    values: *const u32,
    count: usize,
) -> RtslResult {
    // Safety: the caller's promise.
    guard(|| unsafe { set_numbers(instance, path, values, count, Scalar::U32, |value| *value) })
}

/// The same for bools: bytes of 0 or another number.
///
/// # Safety
/// `path` is null or a text; `values` is null or leads to so many numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_instance_set_bools(
    instance: RtslInstanceId,
    path: *const c_char,
    values: *const u8,
    count: usize,
) -> RtslResult {
    // Safety: the caller's promise.
    guard(|| unsafe {
        set_numbers(instance, path, values, count, Scalar::Bool, |value| u32::from(*value != 0))
    })
}

/// # Safety
/// As for [`rtsl_instance_set_floats`].
unsafe fn set_numbers<T>(
    instance: RtslInstanceId,
    path: *const c_char,
    values: *const T,
    count: usize,
    scalar: Scalar,
    word: impl Fn(&T) -> u32,
) -> Result<(), Error> {
    // Safety: the caller's promise.
    let (path, values) = unsafe { (text(path, "path")?, slice(values, count, "values")?) };
    let words: Vec<u32> = values.iter().map(word).collect();
    instance.get()?.set(path, Given::Numbers(Numbers::from_words(scalar, words)))
}

/// Sets a parameter whose type is an enumeration, or an array of them, to choices by their names.
///
/// # Safety
/// `path` is null or a text; `names` is null or leads to so many texts or nulls.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_instance_set_choices(
    instance: RtslInstanceId,
    path: *const c_char,
    names: *const *const c_char,
    count: usize,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let (path, names) = unsafe { (text(path, "path")?, slice(names, count, "names")?) };
        // Safety: the same.
        let names = names.iter().map(|name| unsafe { text(*name, "names") }.map(str::to_owned));
        let names = names.collect::<Result<_, _>>()?;
        instance.get()?.set(path, Given::Choices(names))
    })
}

/// Sets a reference, an array of references, or a `texture` parameter to what instances are now. Later commits of theirs
/// do not change it.
///
/// # Safety
/// `path` is null or a text; `instances` is null or leads to so many ids.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_instance_set_instances(
    instance: RtslInstanceId,
    path: *const c_char,
    instances: *const RtslInstanceId,
    count: usize,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let (path, ids) = unsafe { (text(path, "path")?, slice(instances, count, "instances")?) };
        let instances = ids.iter().map(|id| id.get()?.committed());
        let instances = instances.collect::<Result<_, _>>()?;
        instance.get()?.set(path, Given::Instances(instances))
    })
}

/// Gives a parameter its default again.
///
/// # Safety
/// `path` is null or a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_instance_unset(
    instance: RtslInstanceId,
    path: *const c_char,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let path = unsafe { text(path, "path")? };
        let instance = instance.get()?;
        let removed = instance.state().values.remove(path);
        removed.map(drop).ok_or_else(|| {
            Error::new(RtslResult::Unknown, format!("the parameter `{path}` is not set"))
        })
    })
}

/// Makes what the parameters say now: checks them and runs the constructor. Nothing is compiled. Where it fails the instance stays
/// what it was. Numbers outside of the ranges of their parameters are warnings among the diagnostics.
#[unsafe(no_mangle)]
pub extern "C" fn rtsl_instance_commit(instance: RtslInstanceId) -> RtslResult {
    guard_with_warnings(|| instance.get()?.commit())
}

/// Lets shapes pass attributes to materials and textures: those that `readers` or what they refer to read and that one of
/// `shapes` gives. All are committed. `computeTextureCoordinates` of the shapes then sets `RTSL_STATE__Attributes`, and
/// methods of the readers read it. Kernels for instances with other attributes than before are to be made anew. A commit
/// takes an instance out again, with the defaults of the attributes that it reads.
///
/// # Safety
/// `readers` and `shapes` are null or lead to so many ids.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_instances_share_attributes(
    readers: *const RtslInstanceId,
    reader_count: usize,
    shapes: *const RtslInstanceId,
    shape_count: usize,
) -> RtslResult {
    guard(|| {
        let entries = |ids: &[RtslInstanceId]| {
            let entries = ids.iter().map(|id| id.get());
            entries.collect::<Result<Vec<_>, _>>()
        };
        // Safety: the caller's promise.
        let readers = entries(unsafe { slice(readers, reader_count, "readers")? })?;
        // Safety: the same.
        let shapes = entries(unsafe { slice(shapes, shape_count, "shapes")? })?;
        let committed = |entries: &[Arc<InstanceEntry>]| {
            let committed = entries.iter().map(|entry| entry.committed());
            committed.collect::<Result<Vec<_>, _>>()
        };
        let (reading, giving) = (committed(&readers)?, committed(&shapes)?);
        let (reading, giving) = (reading.iter().map(|it| &**it), giving.iter().map(|it| &**it));
        let attributes = Instance::attributes(reading, giving)?;
        readers.iter().chain(&shapes).try_for_each(|entry| entry.attach(&attributes))
    })
}

/// The data of an instance as a kernel reads it, for calls of its function. Good until the instance is committed
/// again or released.
///
/// # Safety
/// `block` is null or leads to a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_instance_block(
    instance: RtslInstanceId,
    kernel: RtslKernelId,
    block: *mut *const c_void,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let block = unsafe { place(block, "block")? };
        let data = instance.get()?.block(&kernel.get()?.program)?;
        *block = data.words().as_ptr().cast();
        Ok(())
    })
}

/// Releases an instance. What refers to it keeps what it was.
#[unsafe(no_mangle)]
pub extern "C" fn rtsl_instance_release(instance: RtslInstanceId) -> RtslResult {
    guard(|| instance.release())
}
