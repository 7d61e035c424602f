/* The C interface of RTSL. Made of the crate rtsl-capi by `UPDATE_EXPECT=1 cargo test -p rtsl-capi --test header`.

   A program with an error gets a result that is not RTSL_RESULT_OK, and rtsl_last_error() tells what went wrong. */

#ifndef RTSL_H
#define RTSL_H

#include <stddef.h>
#include <stdint.h>
#include "rtsl_kernel.h"

// How a call ended.
typedef enum {
    // As asked.
    RTSL_RESULT_OK = 0,
    // The shader's text has errors: see the diagnostics.
    RTSL_RESULT_COMPILATION = 1,
    // A pointer is null that must not be, a text is no UTF-8, a number is none of those that there are.
    RTSL_RESULT_ARGUMENT = 2,
    // An id is that of nothing.
    RTSL_RESULT_ID = 3,
    // There are more rays than lanes, or arrays that a kernel touches are missing.
    RTSL_RESULT_LANES = 4,
    // There is no class, method or parameter of that name.
    RTSL_RESULT_UNKNOWN = 5,
    // A parameter has a wrong type or a value without a meaning, or one that is required is not set.
    RTSL_RESULT_PARAMETER = 6,
    // An instance or objects belong to another class than the kernel's, or were not committed.
    RTSL_RESULT_INSTANCE = 7,
    // Machine code is asked for and there is no LLVM.
    RTSL_RESULT_NO_LLVM = 8,
    // A method can't be linked or compiled.
    RTSL_RESULT_CODE_GENERATION = 9,
    // A mistake in RTSL itself; please report it.
    RTSL_RESULT_INTERNAL = 10,
    // A constructor ran past its budget of loop iterations.
    RTSL_RESULT_BUDGET = 11,
    // This process was forked while a call was under way in its parent: what the thread of that call held stays locked here.
    RTSL_RESULT_FORKED = 12,
    // The process is ending, and nothing is compiled any more.
    RTSL_RESULT_ENDING = 13,
    // The calling thread's stack has too little room left for the kernel and its host; nothing was called.
    RTSL_RESULT_MEMORY = 14,
} RtslResult;

// What runs kernels.
typedef enum {
    // Machine code where there is an LLVM, else the interpreter, with a warning.
    RTSL_BACKEND_AUTO = 0,
    // Machine code; without LLVM an error.
    RTSL_BACKEND_JIT = 1,
    // The interpreter.
    RTSL_BACKEND_INTERPRETER = 2,
} RtslBackend;

// Where a mark's word comes from.
typedef enum {
    // It is the value.
    RTSL_MARK_SOURCE_CONSTANT = 0,
    // It stands in the argument.
    RTSL_MARK_SOURCE_ARGUMENT = 1,
    // It stands behind an address that stands in the argument.
    RTSL_MARK_SOURCE_BEHIND = 2,
} RtslMarkSource;

// How exact arithmetic is.
typedef enum {
    // `a * b + c` is rounded once where one rule says so; the same on every machine.
    RTSL_MATH_CONTRACT = 0,
    // Every operation is rounded.
    RTSL_MATH_STRICT = 1,
    // Results may differ from machine to machine.
    RTSL_MATH_FAST = 2,
} RtslMath;

// A diagnostic. Its texts are good until the thread's next call that gives an `RtslResult`.
typedef struct {
    // Its stable code: "E0201".
    const char *code;
    // What was found and what was expected, one line.
    const char *message;
    // The whole for people, with an excerpt of the text.
    const char *text;
    // The file, or null where it has no place in a text.
    const char *file;
    // Counted from 1; 0 where it has no place.
    uint32_t line;
    // Counted from 1.
    uint32_t column;
    // The line of its end.
    uint32_t end_line;
    // The column after its end.
    uint32_t end_column;
    // 1 for an error, 0 for a warning.
    uint32_t is_error;
} RtslDiagnostic;

// The classes of a text. 0 is the id of nothing; so for all ids.
typedef struct {
    // The number.
    uint64_t id;
} RtslUnitId;

// How a text is compiled. All zeros but for the size are the defaults.
typedef struct {
    // `sizeof(RtslCompilerOptions)`: later versions may add fields at the end.
    uint32_t size;
    // The greatest number of loop iterations of a constructor, all loops taken together; 0 for no limit. A commit that
    // passes it is `RTSL_RESULT_BUDGET`. That of methods is the engine's.
    uint32_t loop_budget;
    // The folders in which `#include` looks after that of the including file, so many texts.
    const char *const *search_path;
    // How many.
    size_t search_path_count;
} RtslCompilerOptions;

// One `key value`.
typedef struct {
    // The key.
    const char *key;
    // The value as text; null for a flag.
    const char *value;
} RtslAnnotation;

// What a host may set.
typedef struct {
    // Its name.
    const char *name;
    // Its type as RTSL writes it: "float", "color", "vec3[]", "rt_Texture".
    const char *type_name;
    // A name for people, or null.
    const char *label;
    // What it is, for people, or null.
    const char *documentation;
    // The scalars that it has by default, as bits; null where they are none, as for references and buffers.
    const uint32_t *default_words;
    // Everything that the class says of it in `[[...]]`, the above too.
    const RtslAnnotation *annotations;
    // How many scalars.
    uint32_t default_count;
    // How many annotations.
    uint32_t annotation_count;
    // The least number that is allowed; -infinity where the class does not say.
    float minimum;
    // The greatest.
    float maximum;
    // 1 if it must be set.
    uint32_t is_required;
    // Not used.
    uint32_t unused;
} RtslParameterInfo;

// A class, as hosts see it. All that it leads to is good until its unit is released.
typedef struct {
    // Its name.
    const char *name;
    // Its documentation comment, or null.
    const char *documentation;
    // What hosts may set.
    const RtslParameterInfo *parameters;
    // The methods that it has: "intersect".
    const char *const *methods;
    // How many parameters.
    uint32_t parameter_count;
    // How many methods.
    uint32_t method_count;
    // Bits of `RtslRole`.
    uint32_t roles;
    // Not used.
    uint32_t unused;
} RtslClassInfo;

// A class with its parameters.
typedef struct {
    // The number.
    uint64_t id;
} RtslInstanceId;

// A method, ready to be called.
typedef struct {
    // The number.
    uint64_t id;
} RtslKernelId;

// How an engine makes kernels. All zeros but for the size are the defaults.
typedef struct {
    // `sizeof(RtslEngineOptions)`: later versions may add fields at the end.
    uint32_t size;
    // An `RtslBackend`.
    uint32_t backend;
    // An `RtslMath`.
    uint32_t math;
    // Rays at a time where a kernel is asked for without a width: 1, 4, 8 or 16; 0 for what suits the machine.
    uint32_t width;
    // The greatest number of loop iterations of a ray in a call; 0 for no limit.
    uint32_t loop_budget;
    // How much work goes into machine code: 1 to 3; 0 for the default, which is 2.
    uint32_t optimization;
} RtslEngineOptions;

// What makes kernels.
typedef struct {
    // The number.
    uint64_t id;
} RtslEngineId;

// What an engine is.
typedef struct {
    // The LLVM that compiles, "19.1.7", or null on the interpreter. Good until the engine is released.
    const char *llvm;
    // Rays at a time where a kernel is asked for without a width.
    uint32_t width;
    // Not used.
    uint32_t unused;
} RtslEngineInfo;

// Many instances of one class by number.
typedef struct {
    // The number.
    uint64_t id;
} RtslObjectsId;

// The arguments of a call for many rays. All zeros, but for the size, is a call for no rays; kernels of the shape single
// are called for one.
typedef struct {
    // `sizeof(RtslArguments)`: later versions may add fields at the end.
    uint32_t size;
    // How many rays: 1 of the shape single; of the shape leaf how many objects.
    uint32_t count;
    // How many words each array has: at least the count rounded up to a multiple of the kernel's width; of the shape leaf at
    // least 1.
    uint32_t lanes;
    // How many pointers `state` has: `RTSL_STATE_COMPONENTS`.
    uint32_t state_count;
    // How many pointers `scratch` has.
    uint32_t scratch_count;
    // Bits of `RtslStatus` are set.
    uint32_t status;
    // A lane array for each state component; null for those that the method neither reads nor sets.
    float *const *state;
    // A lane array for each of the class's scratch arrays; null where it has none.
    float *const *scratch;
    // 0 or -1 a ray, as many words as the arrays have; of the shape leaf 0 or -1 an object, `count` of them. Null: all
    // rays, and always of the shape single.
    const int32_t *mask;
    // `intersect`, leaf shape apart: written, -1 for rays with a hit and 0 for others; as many words as the arrays have.
    int32_t *accepted;
    // What answers the shader's questions, or null: zeros.
    const RtslHostFunctions *host;
    // Passed to the host's functions.
    void *user;
    // The instance, for shapes with one object.
    RtslInstanceId instance;
    // The objects, for the shapes stream and leaf.
    RtslObjectsId objects;
    // The shape stream: the number of each ray's object, `count` of them.
    const uint32_t *index;
    // The shape leaf: the number of the first object, a multiple of `RTSL_OBJECTS_IN_BLOCK`.
    uint32_t first;
    // `intersect` in the shape leaf: written, the number of the object with the nearest hit, or `RTSL_NONE`. What else the
    // method set is in lane 0.
    uint32_t nearest;
} RtslArguments;

// A row that is a component of the state.
typedef struct {
    // As `RTSL_STATE_RayOrigin`.
    uint32_t component;
    // The row.
    uint32_t row;
} RtslRow;

// A word that is written to a row.
typedef struct {
    // The row.
    uint32_t row;
    // An `RtslMarkSource`.
    uint32_t source;
    // The word itself, or where it stands, or where the address stands behind which it does.
    uint32_t value;
    // `RTSL_MARK_SOURCE_BEHIND`: how many bytes behind that address.
    uint32_t offset;
} RtslMark;

// How a host keeps a packet of rays, and how it asks about them. What says "where" is bytes of the callback's argument, which is a
// struct of the host's. Rays are rows of one word a ray: row r of ray i is the word r * width + i.
typedef struct {
    // `sizeof(RtslRecord)`: later versions may add fields at the end.
    uint32_t size;
    // Rays in a packet: 1, 4, 8 or 16.
    uint32_t width;
    // Where the address of the first row stands.
    uint32_t rays;
    // Where the address of the mask stands, 0 for rays that are left out; `RTSL_NONE`: all rays take part.
    uint32_t mask;
    // Where the address of the first instance's block stands. Blocks are 8-byte aligned and lie one after the other, each of
    // as many words as `rtsl_kernel_block_words` says.
    uint32_t instances;
    // Where the number of the instance stands, a `uint32_t`; `RTSL_NONE`: it is the first.
    uint32_t number;
    // The rows that are components of the state, floats. State that has none holds its default, but for the inverse of the
    // direction, which is computed.
    const RtslRow *rows;
    // What is written for rays with a hit of what methods set: the first component of each variable, as
    // `RTSL_STATE_HitDistance`. All of its components have rows.
    const uint32_t *outputs;
    // What else is written for rays with a hit.
    const RtslMark *marks;
    // How many.
    uint32_t row_count;
    // How many.
    uint32_t output_count;
    // How many.
    uint32_t mark_count;
} RtslRecord;

// A function for packets of a host's own.
typedef struct {
    // The number.
    uint64_t id;
} RtslCallbackId;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The version of the kernel interface: `RTSL_ABI` of the header that a host was compiled with must be the same.
uint32_t rtsl_abi(void);

// The version of RTSL, "0.1.0".
const char *rtsl_version(void);

// What went wrong in the last call of this thread, for people: with places and excerpts where a text is at fault. Empty if
// it went well. Good until the thread's next call. In handlers of `exit` and in destructors there is no message but that
// the thread is ending: results are there as always.
const char *rtsl_last_error(void);

// How many diagnostics the last call of this thread had: errors where it failed, warnings where it went well.
size_t rtsl_last_diagnostic_count(void);

// One of the diagnostics of the last call of this thread. It leaves them as they are.
//
// # Safety
// `diagnostic` is null or leads to an `RtslDiagnostic`.
RtslResult rtsl_last_diagnostic(size_t index, RtslDiagnostic *diagnostic);

// Compiles a text. `name` is what diagnostics call it; what it includes is not looked for anywhere. Where the text has
// errors, the result is `RTSL_RESULT_COMPILATION` and the diagnostics tell them; where it has none, they tell warnings.
//
// # Safety
// `name` and `source` are null or texts that end with a zero byte; `unit` is null or leads to an id.
RtslResult rtsl_compile(const char *name, const char *source, RtslUnitId *unit);

// Compiles a file. What it includes is looked for beside it, then in the folders of `search_path`, so many texts.
//
// # Safety
// As for `rtsl_compile`; `search_path` leads to so many texts.
RtslResult rtsl_compile_file(const char *path,
                             const char *const *search_path,
                             size_t search_path_count,
                             RtslUnitId *unit);

// Compiles a text as the options say. Of texts that a host does not know they bound what a constructor does.
//
// # Safety
// As for `rtsl_compile`; `options` is null, for the defaults, or leads to so many bytes as its size says, with a
// `search_path` of so many texts.
RtslResult rtsl_compile_with(const char *name,
                             const char *source,
                             const RtslCompilerOptions *options,
                             RtslUnitId *unit);

// Compiles a file as the options say.
//
// # Safety
// As for `rtsl_compile_with`.
RtslResult rtsl_compile_file_with(const char *path, const RtslCompilerOptions *options, RtslUnitId *unit);

// The unit of the standard library that has a class: "Sphere".
//
// # Safety
// As for `rtsl_compile`.
RtslResult rtsl_standard_unit(const char *class_name, RtslUnitId *unit);

// How many classes a unit has.
//
// # Safety
// `count` is null or leads to a number.
RtslResult rtsl_unit_class_count(RtslUnitId unit, uint32_t *count);

// A class by its number.
//
// # Safety
// `class_info` is null or leads to a pointer.
RtslResult rtsl_unit_class(RtslUnitId unit, uint32_t index, const RtslClassInfo **class_info);

// The class of a name.
//
// # Safety
// `name` is null or a text; `class_info` is null or leads to a pointer.
RtslResult rtsl_unit_find_class(RtslUnitId unit, const char *name, const RtslClassInfo **class_info);

// Releases a unit. Instances of its classes stay.
RtslResult rtsl_unit_release(RtslUnitId unit);

// Makes an instance of a class. Its parameters have their defaults until they are set; it can be used when it is
// committed.
//
// # Safety
// `class_name` is null or a text; `instance` is null or leads to an id.
RtslResult rtsl_instance_new(RtslUnitId unit, const char *class_name, RtslInstanceId *instance);

// Sets a parameter that is made of floats: a number, a vector, a matrix (column by column), a colour (linear RGB, or one
// grey number), an array or a buffer of them. The path is its name, for a field of a struct "light.position"; for
// an array of structs the field of all elements, one after another. The numbers are copied. Whether they fit, the
// commit tells.
//
// # Safety
// `path` is null or a text; `values` is null or leads to so many numbers.
RtslResult rtsl_instance_set_floats(RtslInstanceId instance,
                                    const char *path,
                                    const float *values,
                                    size_t count);

// The same with ints, for parameters of ints and floats.
//
// # Safety
// `path` is null or a text; `values` is null or leads to so many numbers.
RtslResult rtsl_instance_set_ints(RtslInstanceId instance, const char *path, const int32_t *values, size_t count);

// The same with uints, for parameters of uints and floats.
//
// # Safety
// `path` is null or a text; `values` is null or leads to so many numbers.
RtslResult rtsl_instance_set_uints(RtslInstanceId instance, const char *path, const uint32_t *values, size_t count);

// The same for bools: bytes of 0 or another number.
//
// # Safety
// `path` is null or a text; `values` is null or leads to so many numbers.
RtslResult rtsl_instance_set_bools(RtslInstanceId instance, const char *path, const uint8_t *values, size_t count);

// Sets a parameter whose type is an enumeration, or an array of them, to choices by their names.
//
// # Safety
// `path` is null or a text; `names` is null or leads to so many texts or nulls.
RtslResult rtsl_instance_set_choices(RtslInstanceId instance, const char *path, const char *const *names, size_t count);

// Sets a reference, an array of references, or a `texture` parameter to what instances are now. Later commits of theirs
// do not change it.
//
// # Safety
// `path` is null or a text; `instances` is null or leads to so many ids.
RtslResult rtsl_instance_set_instances(RtslInstanceId instance,
                                       const char *path,
                                       const RtslInstanceId *instances,
                                       size_t count);

// Gives a parameter its default again.
//
// # Safety
// `path` is null or a text.
RtslResult rtsl_instance_unset(RtslInstanceId instance, const char *path);

// Makes what the parameters say now: checks them and runs the constructor. Nothing is compiled. Where it fails the instance stays
// what it was. Numbers outside of the ranges of their parameters are warnings among the diagnostics.
RtslResult rtsl_instance_commit(RtslInstanceId instance);

// Lets shapes pass attributes to materials and textures: those that `readers` or what they refer to read and that one of
// `shapes` gives. All are committed. `computeTextureCoordinates` of the shapes then sets `RTSL_STATE__Attributes`, and
// methods of the readers read it. Kernels for instances with other attributes than before are to be made anew. A commit
// takes an instance out again, with the defaults of the attributes that it reads.
//
// # Safety
// `readers` and `shapes` are null or lead to so many ids.
RtslResult rtsl_instances_share_attributes(const RtslInstanceId *readers,
                                           size_t reader_count,
                                           const RtslInstanceId *shapes,
                                           size_t shape_count);

// The data of an instance as a kernel reads it, for calls of its function. Good until the instance is committed
// again or released.
//
// # Safety
// `block` is null or leads to a pointer.
RtslResult rtsl_instance_block(RtslInstanceId instance, RtslKernelId kernel, const void **block);

// Releases an instance. What refers to it keeps what it was.
RtslResult rtsl_instance_release(RtslInstanceId instance);

// Makes an engine. Falling back on the interpreter is a warning among the diagnostics.
//
// # Safety
// `options` is null, for the defaults, or leads to so many bytes as its size says; `engine` is null or leads to an id.
RtslResult rtsl_engine_new(const RtslEngineOptions *options, RtslEngineId *engine);

// What an engine is.
//
// # Safety
// `info` is null or leads to an `RtslEngineInfo`.
RtslResult rtsl_engine_info(RtslEngineId engine, RtslEngineInfo *info);

// Releases an engine. Its kernels stay.
RtslResult rtsl_engine_release(RtslEngineId engine);

// Runs a method for many rays. Everything is checked but what arrays have room for, which is `lanes`. Where it fails nothing
// was run.
//
// # Safety
// `arguments` is null or leads to so many bytes as its size says; its pointers are null or lead to what their fields say, used by
// nobody else meanwhile; the host's functions do what `rtsl_kernel.h` says.
RtslResult rtsl_kernel_call(RtslKernelId kernel,
                            RtslArguments *arguments);

// A function for packets as the record describes them: `intersect`, and for rays with a hit what is wanted of `computeNormal`,
// `computeTextureCoordinates` and `computeDerivatives`, in one call on the rays where they lie. It serves all instances
// like this one: of its class, referring to instances of the same classes. It is compiled if none like it was; on the
// interpreter there is none.
//
// # Safety
// `record` is null or leads to so many bytes as its size says; its pointers lead to so many entries as it says; `callback` is null or leads to an
// id.
RtslResult rtsl_callback_new(RtslEngineId engine,
                             RtslInstanceId instance,
                             const RtslRecord *record,
                             RtslCallbackId *callback);

// The function, `void (*)(const void *)`. It checks nothing, and is good until the callback is released.
//
// # Safety
// `function` is null or leads to a pointer.
RtslResult rtsl_callback_function(RtslCallbackId callback, const void **function);

// Releases a callback. Its function must not be called any more.
RtslResult rtsl_callback_release(RtslCallbackId callback);

// A kernel of a method for instances like this one: of its class, referring to instances of the same classes. `shape` is an
// `RtslShape` for one object at a time. `width` is 1, 4, 8 or 16, or 0 for that of the engine; it never changes results. It is
// compiled if no kernel like it was.
//
// # Safety
// `method` is null or a text; `kernel` is null or leads to an id.
RtslResult rtsl_kernel_new(RtslEngineId engine,
                           RtslInstanceId instance,
                           const char *method,
                           uint32_t shape,
                           uint32_t width,
                           RtslKernelId *kernel);

// A kernel for objects: of the shape stream, which has one for each ray, or leaf, which has one ray for many.
//
// # Safety
// As for `rtsl_kernel_new`.
RtslResult rtsl_kernel_of_objects(RtslObjectsId objects,
                                  const char *method,
                                  uint32_t shape,
                                  uint32_t width,
                                  RtslKernelId *kernel);

// What a kernel is. All that it leads to is good until the kernel is released. Its function is that of libraries compiled
// ahead of time: it checks nothing.
//
// # Safety
// `info` is null or leads to an `RtslMethod`.
RtslResult rtsl_kernel_info(RtslKernelId kernel,
                            RtslMethod *info);

// How many scratch arrays the kernel's class has.
//
// # Safety
// `count` is null or leads to a number.
RtslResult rtsl_kernel_scratch_arrays(RtslKernelId kernel, uint32_t *count);

// How many words the data of an instance has, as the kernel reads it: hosts that call its function for many instances may
// copy their blocks to one array, where they lie close to each other. What was copied is good as long as the block.
//
// # Safety
// `count` is null or leads to a number.
RtslResult rtsl_kernel_block_words(RtslKernelId kernel,
                                   uint32_t *count);

// Releases a kernel. Its function must not be called any more.
RtslResult rtsl_kernel_release(RtslKernelId kernel);

// Objects of instances as they are now, which are all of one class and refer to instances of the same classes. Object `i` is
// instance `i`.
//
// # Safety
// `instances` is null or leads to so many ids; `objects` is null or leads to an id.
RtslResult rtsl_objects_new(RtslEngineId engine,
                            const RtslInstanceId *instances,
                            size_t count,
                            RtslObjectsId *objects);

// The elements of an instance whose class counts them, such as the triangles of a mesh: object `i` is element `i`.
//
// # Safety
// `objects` is null or leads to an id.
RtslResult rtsl_elements_new(RtslEngineId engine, RtslInstanceId instance, RtslObjectsId *objects);

// How many objects there are.
//
// # Safety
// `count` is null or leads to a number.
RtslResult rtsl_objects_count(RtslObjectsId objects, uint32_t *count);

// The blocks of objects and the block of what they share, for calls of kernels' functions. Good until the objects are
// released.
//
// # Safety
// `blocks` and `shared` are null or lead to pointers.
RtslResult rtsl_objects_blocks(RtslObjectsId objects, const void **blocks, const void **shared);

// Releases objects.
RtslResult rtsl_objects_release(RtslObjectsId objects);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* RTSL_H */
