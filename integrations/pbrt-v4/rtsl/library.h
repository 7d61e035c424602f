// Classes of RTSL libraries, by the names that a scene gives.

#ifndef PBRT_RTSL_LIBRARY_H
#define PBRT_RTSL_LIBRARY_H

#include <pbrt/pbrt.h>

#include <pbrt/paramdict.h>
#include <pbrt/util/error.h>

#include <pbrt/rtsl/rtsl_kernel.h>

namespace pbrt::rtsl {

/// Scratch arrays that a class may have.
constexpr uint32_t MaxScratchArrays = 256;

/// The class that the parameters "string library" and "string class" name. Libraries are loaded once, and stay loaded. Ends
/// with an error if either is missing, the library is of another version, or the class lacks the role.
const RtslClass &FindClass(const ParameterDictionary &parameters, RtslRole role,
                           const FileLoc *loc);

/// A class's method as plain scalar code, or null.
const RtslMethod *FindMethod(const RtslClass &cls, const char *name);

/// The same; ends with an error where the class lacks it.
const RtslMethod &RequireMethod(const RtslClass &cls, const char *name, const FileLoc *loc);

/// The code of a method, or null.
inline RtslKernel KernelOf(const RtslMethod *method) {
    return method ? method->kernel : nullptr;
}

/// Whether a method sets a state variable.
bool Writes(const RtslMethod &method, RtslState variable);

/// Whether a method reads a state variable.
bool Reads(const RtslMethod *method, RtslState variable);

}  // namespace pbrt::rtsl

#endif  // PBRT_RTSL_LIBRARY_H
