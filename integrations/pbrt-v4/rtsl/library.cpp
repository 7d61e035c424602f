#include <pbrt/rtsl/library.h>

#include <pbrt/util/file.h>

#include <algorithm>
#include <map>
#include <mutex>

#include <dlfcn.h>

namespace pbrt::rtsl {

static const RtslLibrary &Load(const std::string &path, const FileLoc *loc) {
    // A name without a folder would be looked for among the system's libraries.
    bool hasFolder = path.find('/') != std::string::npos;
    void *handle = dlopen((hasFolder ? path : "./" + path).c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!handle)
        ErrorExit(loc, "RTSL library can't be loaded: %s", dlerror());
    auto library = static_cast<const RtslLibrary *>(dlsym(handle, "rtsl_library"));
    if (!library)
        ErrorExit(loc, "%s: no RTSL library: it has no symbol \"rtsl_library\".", path);
    if (library->abi != RTSL_ABI)
        ErrorExit(loc, "%s: made for version %d of the kernel interface; this pbrt has version %d. "
                  "Build the library with the rtsl that the adapter came with.",
                  path, int(library->abi), RTSL_ABI);
    return *library;
}

/// A library by its path; loaded once.
static const RtslLibrary &FindLibrary(const std::string &path, const FileLoc *loc) {
    static std::mutex mutex;
    static std::map<std::string, const RtslLibrary *> libraries;
    std::lock_guard<std::mutex> lock(mutex);
    const RtslLibrary *&library = libraries[path];
    if (!library)
        library = &Load(path, loc);
    return *library;
}

static std::string RoleNames(uint32_t roles) {
    static const char *names[] = {"camera", "primitive", "texture", "light", "material"};
    std::string text;
    for (int i = 0; i < 5; ++i)
        if (roles & (1u << i))
            text += (text.empty() ? "" : " and ") + std::string(names[i]);
    return text.empty() ? "nothing" : text;
}

static std::string ClassNames(const RtslLibrary &library) {
    std::string text;
    for (uint32_t i = 0; i < library.class_count; ++i)
        text += (i ? ", " : "") + std::string(library.classes[i]->name);
    return text;
}

static std::string RequireString(const ParameterDictionary &parameters, const char *name,
                                 const FileLoc *loc) {
    std::string text = parameters.GetOneString(name, "");
    if (text.empty())
        ErrorExit(loc, "\"rtsl\" needs the parameter \"string %s\".", name);
    return text;
}

const RtslClass &FindClass(const ParameterDictionary &parameters, RtslRole role,
                           const FileLoc *loc) {
    std::string path = ResolveFilename(RequireString(parameters, "library", loc));
    std::string name = RequireString(parameters, "class", loc);
    const RtslLibrary &library = FindLibrary(path, loc);
    const RtslClass *cls = rtsl_find_class(&library, name.c_str());
    if (!cls)
        ErrorExit(loc, "%s: no class \"%s\"; it has %s.", path, name, ClassNames(library));
    if (!(cls->roles & role))
        ErrorExit(loc, "%s: class %s is a %s, not a %s.", path, name, RoleNames(cls->roles),
                  RoleNames(role));
    if (cls->scratch_arrays > MaxScratchArrays)
        ErrorExit(loc, "%s: class %s has %d scratch arrays; pbrt's adapter has room for %d.", path,
                  name, int(cls->scratch_arrays), int(MaxScratchArrays));
    return *cls;
}

const RtslMethod *FindMethod(const RtslClass &cls, const char *name) {
    return rtsl_find_method(&cls, name, RTSL_SINGLE, 0);
}

const RtslMethod &RequireMethod(const RtslClass &cls, const char *name, const FileLoc *loc) {
    const RtslMethod *method = FindMethod(cls, name);
    if (!method)
        ErrorExit(loc, "Class %s can't be used here: its library has no %s() in the single shape.",
                  cls.name, name);
    return *method;
}

bool Writes(const RtslMethod &method, RtslState variable) {
    const uint32_t *end = method.writes + method.write_count;
    return std::find(method.writes, end, uint32_t(variable)) != end;
}

bool Reads(const RtslMethod *method, RtslState variable) {
    if (!method)
        return false;
    const uint32_t *end = method->reads + method->read_count;
    return std::find(method->reads, end, uint32_t(variable)) != end;
}

}  // namespace pbrt::rtsl
