//! Texts and their classes.

use std::ffi::{CString, c_char};
use std::path::{Path, PathBuf};
use std::ptr::null;
use std::sync::Arc;

use rtsl::{
    AnnotationValue, Class, Compilation, Compiler, CompilerOptions, Constant, Parameter, Role,
    Unit, default_value, library, type_name,
};

use crate::error::{Error, RtslResult, check_size, guard, guard_with_warnings, place, slice, text};
use crate::kept_diagnostic::{KeptDiagnostic, c_text, keep};
use crate::registry::{RtslUnitId, id};

/// How a text is compiled. All zeros but for the size are the defaults.
#[repr(C)]
pub struct RtslCompilerOptions {
    /// `sizeof(RtslCompilerOptions)`: later versions may add fields at the end.
    pub size: u32,
    /// The greatest number of loop iterations of a constructor, all loops taken together; 0 for no limit. A commit that
    /// passes it is `RTSL_RESULT_BUDGET`. That of methods is the engine's.
    pub loop_budget: u32,
    /// The folders in which `#include` looks after that of the including file, so many texts.
    pub search_path: *const *const c_char,
    /// How many.
    pub search_path_count: usize,
}

/// A class, as hosts see it. All that it leads to is good until its unit is released.
#[repr(C)]
pub struct RtslClassInfo {
    /// Its name.
    pub name: *const c_char,
    /// Its documentation comment, or null.
    pub documentation: *const c_char,
    /// What hosts may set.
    pub parameters: *const RtslParameterInfo,
    /// The methods that it has: "intersect".
    pub methods: *const *const c_char,
    /// How many parameters.
    pub parameter_count: u32,
    /// How many methods.
    pub method_count: u32,
    /// Bits of `RtslRole`.
    pub roles: u32,
    /// Not used.
    pub unused: u32,
}

/// What a host may set.
#[repr(C)]
pub struct RtslParameterInfo {
    /// Its name.
    pub name: *const c_char,
    /// Its type as RTSL writes it: "float", "color", "vec3[]", "rt_Texture".
    pub type_name: *const c_char,
    /// A name for people, or null.
    pub label: *const c_char,
    /// What it is, for people, or null.
    pub documentation: *const c_char,
    /// The scalars that it has by default, as bits; null where they are none, as for references and buffers.
    pub default_words: *const u32,
    /// Everything that the class says of it in `[[...]]`, the above too.
    pub annotations: *const RtslAnnotation,
    /// How many scalars.
    pub default_count: u32,
    /// How many annotations.
    pub annotation_count: u32,
    /// The least number that is allowed; -infinity where the class does not say.
    pub minimum: f32,
    /// The greatest.
    pub maximum: f32,
    /// 1 if it must be set.
    pub is_required: u32,
    /// Not used.
    pub unused: u32,
}

/// One `key value`.
#[repr(C)]
pub struct RtslAnnotation {
    /// The key.
    pub key: *const c_char,
    /// The value as text; null for a flag.
    pub value: *const c_char,
}

/// A unit with what C programs see of its classes.
pub struct UnitEntry {
    pub unit: Unit,
    classes: Vec<RtslClassInfo>,
    /// What the pointers lead to.
    _texts: Texts,
}

id!(RtslUnitId, UnitEntry, "unit");

// Safety: the pointers lead to memory that the entry owns and nobody changes.
unsafe impl Send for UnitEntry {}
// Safety: the same.
unsafe impl Sync for UnitEntry {}

/// Memory that pointers lead to, none of which moves when more is added.
#[derive(Default)]
struct Texts {
    texts: Vec<CString>,
    words: Vec<Box<[u32]>>,
    parameters: Vec<Box<[RtslParameterInfo]>>,
    annotations: Vec<Box<[RtslAnnotation]>>,
    methods: Vec<Box<[*const c_char]>>,
}

impl UnitEntry {
    fn new(unit: Unit) -> UnitEntry {
        let mut texts = Texts::default();
        let classes = unit.classes().iter().map(|class| texts.class(class)).collect();
        UnitEntry { unit, classes, _texts: texts }
    }

    pub fn class(&self, name: &str) -> Result<&Arc<Class>, Error> {
        self.unit.class(name).map_err(Error::from)
    }
}

impl Texts {
    fn text(&mut self, text: &str) -> *const c_char {
        self.texts.push(c_text(text));
        self.texts.last().map_or(null(), |text| text.as_ptr())
    }

    fn optional(&mut self, text: Option<&str>) -> *const c_char {
        text.map_or(null(), |text| self.text(text))
    }

    fn class(&mut self, class: &Class) -> RtslClassInfo {
        let parameters: Box<[RtslParameterInfo]> =
            class.parameters.iter().map(|it| self.parameter(class, it)).collect();
        let methods: Box<[*const c_char]> =
            class.methods.keys().map(|method| self.text(method.name())).collect();
        let info = RtslClassInfo {
            name: self.text(&class.name),
            documentation: self.optional(class.documentation.as_deref()),
            parameters: parameters.as_ptr(),
            methods: methods.as_ptr(),
            parameter_count: parameters.len() as u32,
            method_count: methods.len() as u32,
            roles: Role::bits(&class.roles),
            unused: 0,
        };
        self.parameters.push(parameters);
        self.methods.push(methods);
        info
    }

    fn parameter(&mut self, class: &Class, parameter: &Parameter) -> RtslParameterInfo {
        let annotation = |key: &str| parameter.annotation(key).map(annotation_text);
        let number = |key: &str| match parameter.annotation(key) {
            Some(AnnotationValue::Constant(value)) => Some(as_float(*value)),
            Some(AnnotationValue::None | AnnotationValue::Text(_)) | None => None,
        };
        let annotations = parameter.annotations.iter().map(|annotation| RtslAnnotation {
            key: self.text(&annotation.key),
            value: self.optional(annotation_text(&annotation.value).as_deref()),
        });
        let annotations: Box<[RtslAnnotation]> = annotations.collect();
        let words = default_value(class, parameter).unwrap_or_default().into_boxed_slice();
        let info = RtslParameterInfo {
            name: self.text(&parameter.name),
            type_name: self.text(&type_name(&parameter.ty)),
            label: self.optional(annotation("label").flatten().as_deref()),
            documentation: self.optional(annotation("doc").flatten().as_deref()),
            default_words: if words.is_empty() { null() } else { words.as_ptr() },
            annotations: annotations.as_ptr(),
            default_count: words.len() as u32,
            annotation_count: annotations.len() as u32,
            minimum: number("min").unwrap_or(f32::NEG_INFINITY),
            maximum: number("max").unwrap_or(f32::INFINITY),
            is_required: parameter.required.into(),
            unused: 0,
        };
        self.words.push(words);
        self.annotations.push(annotations);
        info
    }
}

fn annotation_text(value: &AnnotationValue) -> Option<String> {
    match value {
        AnnotationValue::None => None,
        AnnotationValue::Text(text) => Some(text.clone()),
        AnnotationValue::Constant(Constant::F32(value)) => Some(value.to_string()),
        AnnotationValue::Constant(Constant::I32(value)) => Some(value.to_string()),
        AnnotationValue::Constant(Constant::U32(value)) => Some(value.to_string()),
        AnnotationValue::Constant(Constant::Bool(value)) => Some(value.to_string()),
    }
}

fn as_float(value: Constant) -> f32 {
    match value {
        Constant::F32(value) => value,
        Constant::I32(value) => value as f32,
        Constant::U32(value) => value as f32,
        Constant::Bool(value) => f32::from(u8::from(value)),
    }
}

/// Compiles a text. `name` is what diagnostics call it; what it includes is not looked for anywhere. Where the text has
/// errors, the result is `RTSL_RESULT_COMPILATION` and the diagnostics tell them; where it has none, they tell warnings.
///
/// # Safety
/// `name` and `source` are null or texts that end with a zero byte; `unit` is null or leads to an id.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_compile(
    name: *const c_char,
    source: *const c_char,
    unit: *mut RtslUnitId,
) -> RtslResult {
    guard_with_warnings(|| {
        // Safety: the caller's promise.
        let (name, source, unit) =
            unsafe { (text(name, "name")?, text(source, "source")?, place(unit, "unit")?) };
        give_unit(Compiler::default().compile(name, source), unit)
    })
}

/// Compiles a file. What it includes is looked for beside it, then in the folders of `search_path`, so many texts.
///
/// # Safety
/// As for `rtsl_compile`; `search_path` leads to so many texts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_compile_file(
    path: *const c_char,
    search_path: *const *const c_char,
    search_path_count: usize,
    unit: *mut RtslUnitId,
) -> RtslResult {
    guard_with_warnings(|| {
        // Safety: the caller's promise.
        let (path, unit) = unsafe { (text(path, "path")?, place(unit, "unit")?) };
        // Safety: the caller's promise.
        let search_path = unsafe { folders(search_path, search_path_count)? };
        let options = CompilerOptions { search_path, ..CompilerOptions::default() };
        give_unit(Compiler::new(options).compile_file(Path::new(path)), unit)
    })
}

/// Compiles a text as the options say. Of texts that a host does not know they bound what a constructor does.
///
/// # Safety
/// As for `rtsl_compile`; `options` is null, for the defaults, or leads to so many bytes as its size says, with a
/// `search_path` of so many texts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_compile_with(
    name: *const c_char,
    source: *const c_char,
    options: *const RtslCompilerOptions,
    unit: *mut RtslUnitId,
) -> RtslResult {
    guard_with_warnings(|| {
        // Safety: the caller's promise.
        let (name, source, unit) =
            unsafe { (text(name, "name")?, text(source, "source")?, place(unit, "unit")?) };
        // Safety: the caller's promise.
        let compiler = unsafe { compiler(options)? };
        give_unit(compiler.compile(name, source), unit)
    })
}

/// Compiles a file as the options say.
///
/// # Safety
/// As for `rtsl_compile_with`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_compile_file_with(
    path: *const c_char,
    options: *const RtslCompilerOptions,
    unit: *mut RtslUnitId,
) -> RtslResult {
    guard_with_warnings(|| {
        // Safety: the caller's promise.
        let (path, unit) = unsafe { (text(path, "path")?, place(unit, "unit")?) };
        // Safety: the caller's promise.
        let compiler = unsafe { compiler(options)? };
        give_unit(compiler.compile_file(Path::new(path)), unit)
    })
}

/// # Safety
/// As for `rtsl_compile_with`.
unsafe fn compiler(options: *const RtslCompilerOptions) -> Result<Compiler, Error> {
    if options.is_null() {
        return Ok(Compiler::default());
    }
    // Safety: the caller's promise; the struct is whole if its size is right.
    let options = unsafe {
        check_size(options, "options")?;
        options.as_ref().ok_or_else(|| Error::null("options"))?
    };
    // Safety: the caller's promise.
    let search_path = unsafe { folders(options.search_path, options.search_path_count)? };
    let loop_budget = Some(options.loop_budget).filter(|budget| *budget != 0);
    Ok(Compiler::new(CompilerOptions { loop_budget, search_path, traced: false }))
}

/// # Safety
/// The pointer is null or leads to so many texts.
unsafe fn folders(paths: *const *const c_char, count: usize) -> Result<Vec<PathBuf>, Error> {
    // Safety: the caller's promise.
    let folders = unsafe { slice(paths, count, "search_path")? };
    // Safety: the caller's promise.
    let folders = folders.iter().map(|it| unsafe { text(*it, "search_path") });
    folders.map(|it| it.map(PathBuf::from)).collect()
}

/// The unit of the standard library that has a class: "Sphere".
///
/// # Safety
/// As for `rtsl_compile`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_standard_unit(
    class_name: *const c_char,
    unit: *mut RtslUnitId,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let (name, unit) = unsafe { (text(class_name, "class_name")?, place(unit, "unit")?) };
        let found = library::unit_of_class(&Compiler::default(), name)?;
        *unit = RtslUnitId::give(UnitEntry::new(found));
        Ok(())
    })
}

fn give_unit(
    compilation: Compilation,
    unit: &mut RtslUnitId,
) -> Result<Vec<KeptDiagnostic>, Error> {
    let Compilation { unit: compiled, diagnostics, sources } = compilation;
    let failed = || Error::of_diagnostics(&sources, &diagnostics, RtslResult::Compilation);
    *unit = RtslUnitId::give(UnitEntry::new(compiled.ok_or_else(failed)?));
    Ok(keep(&sources, &diagnostics))
}

/// How many classes a unit has.
///
/// # Safety
/// `count` is null or leads to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_unit_class_count(unit: RtslUnitId, count: *mut u32) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let count = unsafe { place(count, "count")? };
        *count = unit.get()?.classes.len() as u32;
        Ok(())
    })
}

/// A class by its number.
///
/// # Safety
/// `class_info` is null or leads to a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_unit_class(
    unit: RtslUnitId,
    index: u32,
    class_info: *mut *const RtslClassInfo,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let info = unsafe { place(class_info, "class_info")? };
        let unit = unit.get()?;
        let class = unit.classes.get(index as usize);
        *info = class.ok_or_else(|| {
            let problem =
                format!("the unit has {} classes, none of number {index}", unit.classes.len());
            Error::new(RtslResult::Unknown, problem)
        })?;
        Ok(())
    })
}

/// The class of a name.
///
/// # Safety
/// `name` is null or a text; `class_info` is null or leads to a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_unit_find_class(
    unit: RtslUnitId,
    name: *const c_char,
    class_info: *mut *const RtslClassInfo,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let (name, info) = unsafe { (text(name, "name")?, place(class_info, "class_info")?) };
        let unit = unit.get()?;
        let class = unit.class(name)?;
        let index = unit.unit.classes().iter().position(|it| Arc::ptr_eq(it, class));
        *info = &raw const unit.classes[index.unwrap_or_default()];
        Ok(())
    })
}

/// Releases a unit. Instances of its classes stay.
#[unsafe(no_mangle)]
pub extern "C" fn rtsl_unit_release(unit: RtslUnitId) -> RtslResult {
    guard(|| unit.release())
}
